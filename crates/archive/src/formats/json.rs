//! What is wrong with a JSON file, in plain words.

/// The parser's complaint without its own names for things; the place, which is told before it, is left out.
pub(super) fn problem(e: &serde_json::Error) -> String {
    let text = e.to_string();
    let text = text.rsplit_once(" at line ").map_or(text.as_str(), |(text, _)| text);
    let wrong = ["invalid type: ", "invalid value: "].iter().find_map(|start| text.strip_prefix(start));
    if let Some((found, expected)) = wrong.and_then(|w| w.rsplit_once(", expected ")) {
        return format!("found {}, expected {}", found_words(found), expected_words(expected));
    }
    if let Some((found, expected)) =
        text.strip_prefix("invalid length ").and_then(|t| t.split_once(", expected "))
    {
        let found = if found == "1" { "1 value".into() } else { format!("{found} values") };
        return format!("found {found}, expected {}", expected_words(expected));
    }
    match text {
        "expected value" => "expected a value".into(),
        "EOF while parsing a value"
        | "EOF while parsing an object"
        | "EOF while parsing a list"
        | "EOF while parsing a string" => "the text ends too early; it is cut short".into(),
        text => text.replace('`', "'"),
    }
}

/// What serde says that it found.
fn found_words(found: &str) -> String {
    let (kind, value) = found.split_once(' ').unwrap_or((found, ""));
    match (kind, value) {
        ("integer" | "boolean", value) => value.trim_matches('`').into(),
        ("floating", value) => value.trim_start_matches("point ").trim_matches('`').into(),
        ("string", text) if text.chars().count() <= 40 => format!("the text {text}"),
        ("string", _) => "a text".into(),
        ("null", _) | ("unit", _) => "null".into(),
        ("sequence", _) => "a list".into(),
        ("map", _) => "an object".into(),
        _ => found.replace('`', "'"),
    }
}

/// What serde says that it would have taken.
fn expected_words(expected: &str) -> String {
    match expected {
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, 0 or more".into(),
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number".into(),
        "f32" | "f64" => "a number".into(),
        "a string" | "a borrowed string" | "string" => "a text".into(),
        "a sequence" => "a list".into(),
        "a map" => "an object".into(),
        "a boolean" => "true or false".into(),
        text if text.starts_with("struct ") => "an object".into(),
        text => match text.strip_prefix("an array of length ").or(text.strip_prefix("tuple of size ")) {
            Some(n) => format!("a list of {n}"),
            None => text.replace('`', "'"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[test]
    fn complaints_are_plain() {
        #[derive(Deserialize, Debug)]
        #[expect(dead_code, reason = "what is read well is not looked at")]
        struct Node {
            mesh: Option<usize>,
            matrix: Option<[f32; 4]>,
            name: Option<String>,
            #[serde(default)]
            children: Vec<u32>,
        }
        let said = |text: &str| problem(&serde_json::from_str::<Node>(text).unwrap_err());
        assert_eq!(said(r#"{"mesh": 0.5}"#), "found 0.5, expected a whole number, 0 or more");
        assert_eq!(said(r#"{"mesh": -1}"#), "found -1, expected a whole number, 0 or more");
        assert_eq!(said(r#"{"name": 3}"#), "found 3, expected a text");
        assert_eq!(said(r#"{"children": "x"}"#), "found the text \"x\", expected a list");
        assert_eq!(said(r#"{"children": {}}"#), "found an object, expected a list");
        assert_eq!(said(r#"{"children": null}"#), "found null, expected a list");
        assert_eq!(said(r#"{"matrix": [1, true]}"#), "found true, expected a number");
        assert_eq!(said("[]"), "found 0 values, expected an object");
        assert_eq!(said(r#"{"matrix": [1, 2, 3]}"#), "found 3 values, expected a list of 4");
        assert_eq!(said(r#"{"mesh": "#), "the text ends too early; it is cut short");
        assert_eq!(said(r#"{"mesh": 1,}"#), "trailing comma");
    }
}
