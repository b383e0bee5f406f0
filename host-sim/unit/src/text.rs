//! Reads a text of TOML. A fault names its line, the key with its table, and what is expected.

use host_core::error::Error;
use serde::de::DeserializeOwned;
use std::path::Path;

/// The value that a text describes. `file` is named in errors; `remedy` gives the remedy for a key.
///
/// # Errors
/// [`Error::Scenario`].
pub fn parse<T: DeserializeOwned>(
    file: &Path,
    text: &str,
    remedy: impl Fn(&str) -> String,
) -> Result<T, Error> {
    let parsed = toml::Deserializer::parse(text)
        .map_err(|fault| (key_at(text, &fault), fault))
        .and_then(|document| {
            serde_path_to_error::deserialize(document).map_err(|fault| {
                let key = fault.path().to_string();
                (key, fault.into_inner())
            })
        });
    parsed.map_err(|(table, fault)| {
        let (key, problem) = explained(table, &fault.message().replace('\n', " "));
        Error::Scenario {
            file: file.to_path_buf(),
            line: fault.span().map(|span| line(text, span.start)),
            remedy: remedy(&key),
            key,
            problem,
        }
    })
}

/// The line of a byte, from 1.
fn line(text: &str, at: usize) -> usize {
    text[..at.min(text.len())].matches('\n').count() + 1
}

/// The key, with its table, on the line of a fault.
fn key_at(text: &str, fault: &toml::de::Error) -> String {
    let to = fault.span().map_or(1, |span| line(text, span.start));
    let lines: Vec<&str> = text.lines().take(to).map(str::trim).collect();
    let bare = |line: &str| line.trim_matches(['[', ']', ' ']).to_owned();
    let Some((on, before)) = lines.split_last() else {
        return ".".into();
    };
    let table = before.iter().rfind(|line| line.starts_with('['));
    match (on.split_once('='), table) {
        (Some((key, _)), Some(table)) => format!("{}.{}", bare(table), key.trim()),
        (Some((key, _)), None) => key.trim().into(),
        (None, _) => bare(on),
    }
}

/// Key and problem in plain words, of the path of a value and the message on it.
fn explained(path: String, message: &str) -> (String, String) {
    let inside = |name: &str| match &*path {
        "" | "." | "?" => name.to_owned(),
        path => format!("{path}.{name}"),
    };
    if let Some(name) = message.strip_prefix("missing field `") {
        return (inside(name.trim_end_matches('`')), "is missing".into());
    }
    let problem = match message.split_once(", expected ") {
        Some((found, known)) if found.starts_with("unknown field `") => {
            let name = found.trim_start_matches("unknown field `");
            let name = name.trim_end_matches('`');
            let key = match path.rsplit('.').next() == Some(name) {
                true => path.clone(),
                false => inside(name),
            };
            return (key, format!("is not known, expected {known}"));
        }
        Some((found, wanted)) if found.starts_with("invalid type: ") => {
            let found = found.trim_start_matches("invalid type: ");
            let wanted = match wanted {
                "f64" | "f32" => "a number",
                "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number",
                "a string" | "path string" => "a text in quotes",
                "a boolean" => "true or false",
                "a sequence" => "a list in brackets",
                other => other,
            };
            format!("is {found}, expected {wanted}")
        }
        _ if message.starts_with("duplicate key") => "is given twice".into(),
        _ => message.to_owned(),
    };
    let key = match &*path {
        "" | "." | "?" => "file".to_owned(),
        _ => path,
    };
    (key, problem)
}
