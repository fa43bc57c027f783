//! Reports for programs.

use serde_json::{Number, Value};

/// To standard output, as a line: numbers as they were typed or computed, 0.01 and not 0.009999999776482582.
pub fn print(report: Value) {
    println!("{}", shortened(report));
}

/// For a file that people may look into as well.
pub fn text(report: Value) -> String {
    format!("{:#}", shortened(report))
}

/// Numbers that are 32-bit floats get the fewest digits that tell them from their neighbours.
pub fn shortened(value: Value) -> Value {
    match value {
        Value::Number(n) => Value::Number(short(&n).unwrap_or(n)),
        Value::Array(all) => all.into_iter().map(shortened).collect(),
        Value::Object(all) => all.into_iter().map(|(k, v)| (k, shortened(v))).collect(),
        other => other,
    }
}

/// Beyond this, whole numbers that happen to be 32-bit floats would lose digits.
const WHOLE: f64 = 16_777_216.0;

fn short(n: &Number) -> Option<Number> {
    let v = n.as_f64().filter(|v| n.is_f64() && v.abs() < WHOLE)?;
    let narrow = v as f32;
    if f64::from(narrow) != v {
        return None;
    }
    Number::from_f64(narrow.to_string().parse().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn numbers_have_the_digits_that_were_typed() {
        let report = json!({ "a": 0.01f32, "b": [0.1f32, 1.0f32, 3], "c": { "d": 1e-9f32 }, "e": 0.1f64, "f": 1.0f64 / 3.0,
            "g": f32::NAN, "h": 67_108_864.0f64, "i": -1e6f32, "j": 12_345_678_901u64 });
        let text = shortened(report).to_string();
        assert_eq!(
            text,
            r#"{"a":0.01,"b":[0.1,1.0,3],"c":{"d":1e-9},"e":0.1,"f":0.3333333333333333,"g":null,"h":67108864.0,"i":-1000000.0,"j":12345678901}"#
        );
        // What was computed with 64 bits and what 32 bits cannot tell apart stay themselves.
        for v in [0.1f32, 1.0 / 3.0, f32::MIN_POSITIVE, 16_777_215.0, 1.17549e-38] {
            let back: f64 = shortened(json!(v)).as_f64().unwrap();
            assert_eq!(back as f32, v);
        }
    }
}
