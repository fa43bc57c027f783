//! What is known of a file: the same for people and for programs.

use crate::json::shortened;
use serde_json::{Map, Value};
use std::fmt::Write;

/// Names and what is said of them, in order.
#[derive(Default)]
pub struct Facts(Vec<(&'static str, Fact)>);

enum Fact {
    Value(Value),
    Facts(Facts),
    List(Vec<Facts>),
}

impl Facts {
    /// Adds a number, a text, a list of numbers; nothing where there is none.
    pub fn say(mut self, name: &'static str, value: impl Into<Value>) -> Self {
        match shortened(value.into()) {
            Value::Null => {}
            value => self.0.push((name, Fact::Value(value))),
        }
        self
    }

    /// Adds all of others.
    pub fn and(mut self, others: Self) -> Self {
        self.0.extend(others.0);
        self
    }

    /// Adds facts under a name, unless there are none.
    pub fn group(mut self, name: &'static str, facts: Self) -> Self {
        if !facts.0.is_empty() {
            self.0.push((name, Fact::Facts(facts)));
        }
        self
    }

    /// Adds one of each, unless there is none.
    pub fn list(mut self, name: &'static str, all: impl IntoIterator<Item = Self>) -> Self {
        let all: Vec<Self> = all.into_iter().collect();
        if !all.is_empty() {
            self.0.push((name, Fact::List(all)));
        }
        self
    }

    /// For programs.
    pub fn json(self) -> Value {
        let value = |fact| match fact {
            Fact::Value(v) => v,
            Fact::Facts(f) => f.json(),
            Fact::List(all) => all.into_iter().map(Facts::json).collect(),
        };
        Value::Object(self.0.into_iter().map(|(k, f)| (k.to_string(), value(f))).collect::<Map<_, _>>())
    }

    /// For people: a line a fact, the facts of one thing of a list in a line.
    pub fn text(&self) -> String {
        let mut out = String::new();
        self.lines(0, &mut out);
        out
    }

    fn lines(&self, indent: usize, out: &mut String) {
        let name = |name: &str| name.replace('_', " ");
        for (key, fact) in &self.0 {
            let _ = write!(out, "{:indent$}{}:", "", name(key));
            match fact {
                Fact::Value(v) => _ = writeln!(out, " {}", words(v)),
                Fact::Facts(facts) => {
                    out.push('\n');
                    facts.lines(indent + 2, out);
                }
                Fact::List(all) => {
                    let _ = writeln!(out, " {}", all.len());
                    for one in all.iter().take(MOST) {
                        let parts: Vec<String> = one.0.iter().map(|(k, f)| f.part(&name(k))).collect();
                        let _ = writeln!(out, "{:indent$}  {}", "", parts.join(", "));
                    }
                    if all.len() > MOST {
                        let _ =
                            writeln!(out, "{:indent$}  and {} more (--json lists all)", "", all.len() - MOST);
                    }
                }
            }
        }
    }
}

/// People read no more of a list.
const MOST: usize = 40;

impl Fact {
    fn part(&self, name: &str) -> String {
        match self {
            Self::Value(v) => format!("{name} {}", words(v)),
            Self::Facts(f) => {
                let parts: Vec<String> = f.0.iter().map(|(k, f)| f.part(&k.replace('_', " "))).collect();
                format!("{name} ({})", parts.join(", "))
            }
            Self::List(all) => format!("{name} {}", all.len()),
        }
    }
}

fn words(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Bool(true) => "yes".into(),
        Value::Bool(false) => "no".into(),
        Value::Array(all) => {
            let mut parts: Vec<String> = all.iter().take(MOST).map(words).collect();
            if all.len() > MOST {
                parts.push(format!("… ({} in all)", all.len()));
            }
            parts.join(" ")
        }
        other => other.to_string(),
    }
}
