//! The JSON Schema of the unit file, written from its types, and the check of a file against it.
//!
//! Editors complete and check a file that begins with `#:schema unit.schema.json`. The same schema
//! checks a file here, so that all mistakes of a file are found at once and ranges are defined
//! once.

use super::Unit;
use super::finding::Finding;
use schemars::generate::SchemaSettings;
use serde_json::Value;

/// Name of the schema's file beside a unit file.
pub const FILE: &str = "unit.schema.json";

/// The JSON Schema, draft 7.
#[must_use]
pub fn schema() -> Value {
    let mut settings = SchemaSettings::draft07();
    settings.inline_subschemas = true;
    let schema = settings.into_generator().into_root_schema_for::<Unit>();
    let mut value = schema.to_value();
    without_null(&mut value);
    value
}

/// The JSON Schema as the text of its file.
#[must_use]
pub fn text() -> String {
    let text = serde_json::to_string_pretty(&schema()).unwrap_or_default();
    text + "\n"
}

/// A key that may be left out has no other type for that: TOML has no null. Formats of numbers say
/// nothing that the ranges do not.
fn without_null(schema: &mut Value) {
    if let Some(list) = schema.get_mut("anyOf").and_then(Value::as_array_mut) {
        list.retain(|one| one.get("type") != Some(&Value::from("null")));
        if let [only] = &mut list[..] {
            let only = only.take();
            if let (Some(into), Value::Object(only)) = (schema.as_object_mut(), only) {
                into.remove("anyOf");
                for (key, value) in only {
                    into.entry(key).or_insert(value);
                }
            }
        }
    }
    if let Some(map) = schema.as_object_mut() {
        if map.get("format").is_some_and(Value::is_string) {
            map.remove("format");
        }
        if map.get("default") == Some(&Value::Null) {
            map.remove("default");
        }
        let types = map.get("type").and_then(Value::as_array).cloned();
        if let Some([first, _]) = types.as_deref() {
            map.insert("type".into(), first.clone());
        }
        map.values_mut().for_each(without_null);
    } else if let Some(list) = schema.as_array_mut() {
        list.iter_mut().for_each(without_null);
    }
}

/// Checks a value against its schema; `key` is its key in the file.
pub(super) fn check(schema: &Value, value: &toml::Value, key: &str, found: &mut Vec<Finding>) {
    let kind = schema["type"].as_str().unwrap_or("string");
    match (kind, value) {
        ("object", toml::Value::Table(table)) => check_table(schema, table, key, found),
        ("array", toml::Value::Array(list)) => check_array(schema, list, key, found),
        ("number", toml::Value::Float(x)) => check_number(schema, *x, key, found),
        ("number" | "integer", toml::Value::Integer(x)) => {
            check_number(schema, *x as f64, key, found);
        }
        ("boolean", toml::Value::Boolean(_)) => {}
        ("string", toml::Value::String(text)) => check_text(schema, text, key, found),
        _ => {
            let is = match value {
                toml::Value::String(text) => format!("the text '{text}'"),
                toml::Value::Table(_) => "a table".into(),
                toml::Value::Array(_) => "a list".into(),
                other => other.to_string(),
            };
            let want = match kind {
                "object" => format!("write a table [{key}]"),
                "array" => "give a list of numbers".into(),
                "number" => "give a number without quotes".into(),
                "integer" => "give a whole number".into(),
                "boolean" => "give true or false".into(),
                _ => "give a text in quotes".into(),
            };
            found.push(Finding::wrong(key, format!("is {is}"), want));
        }
    }
}

fn check_table(schema: &Value, table: &toml::Table, key: &str, found: &mut Vec<Finding>) {
    let inside = |name: &str| match key {
        "" => name.to_owned(),
        key => format!("{key}.{name}"),
    };
    let empty = serde_json::Map::new();
    let properties = schema["properties"].as_object().unwrap_or(&empty);
    for (name, value) in table {
        match properties.get(name) {
            Some(property) => check(property, value, &inside(name), found),
            None => found.push(unknown(&inside(name), name, properties)),
        }
    }
    for name in schema["required"].as_array().into_iter().flatten() {
        let name = name.as_str().unwrap_or_default();
        if !table.contains_key(name) {
            let what = properties.get(name).map_or("", |field| {
                field["description"].as_str().unwrap_or_default()
            });
            let what = what.split(". ").next().unwrap_or_default();
            let what = what.replace('\n', " ");
            found.push(Finding::wrong(
                inside(name),
                "is missing",
                format!("give it: {what}"),
            ));
        }
    }
}

/// A key that is not in the schema, with the nearest one that is.
fn unknown(key: &str, name: &str, known: &serde_json::Map<String, Value>) -> Finding {
    let moved = [
        (
            "preset",
            "write unit = \"NAME\" in the scenario file instead",
        ),
        ("bias_dph", "use bias_turn_on_dph and bias_in_run_dph"),
        ("bias_ug", "use bias_turn_on_ug and bias_in_run_ug"),
        (
            "misalignment_arcsec",
            "use misalignment_mrad; 1 arcsec is 0.00485 mrad",
        ),
        (
            "misalignment_deg",
            "use misalignment_mrad; 1 deg is 17.5 mrad",
        ),
        ("scale_percent", "use scale_ppm; 1 % is 10000 ppm"),
        ("bias_turn_on_mg", "use bias_turn_on_ug; 1 mg is 1000 ug"),
    ];
    let nearest = || {
        let names: Vec<String> = known.keys().cloned().collect();
        match host_core::error::nearest_name(name, &names) {
            Some(close) => match other_unit(name, close) {
                Some([from, to]) => {
                    format!("write '{close}', and the value in {to}, not in {from}")
                }
                None => format!("write '{close}'"),
            },
            None if names.is_empty() => "leave it out, this table has no keys".into(),
            None => format!("use one of {}", names.join(", ")),
        }
    };
    let remedy = moved
        .iter()
        .find(|(old, _)| *old == name && !known.contains_key(name));
    let remedy = remedy.map_or_else(nearest, |(_, remedy)| (*remedy).to_owned());
    Finding::wrong(key, "is not a key of this table", remedy)
}

/// The units of two keys of the same quantity, which are their last words, where they differ.
fn other_unit<'n>(name: &'n str, close: &'n str) -> Option<[&'n str; 2]> {
    let (quantity, from) = name.rsplit_once('_')?;
    let (of, to) = close.rsplit_once('_')?;
    let is_unit = quantity == of && from != to && UNITS.contains(&to);
    is_unit.then_some([from, to])
}

/// Endings of keys that are units.
const UNITS: [&str; 17] = [
    "deg",
    "dph",
    "dphpg",
    "dphps",
    "dps",
    "dpsqrth",
    "g",
    "hz",
    "m",
    "mps",
    "mrad",
    "ms",
    "ppm",
    "s",
    "ug",
    "ugpg2",
    "ugpsqrthz",
];

fn check_array(schema: &Value, list: &[toml::Value], key: &str, found: &mut Vec<Finding>) {
    let length = |bound: &str| schema[bound].as_u64().map(|n| n as usize);
    let bounds = (length("minItems"), length("maxItems"));
    if let (Some(least), Some(most)) = bounds
        && !(least..=most).contains(&list.len())
    {
        let problem = format!("has {} values", list.len());
        found.push(Finding::wrong(key, problem, format!("give {least} values")));
    }
    for value in list {
        check(&schema["items"], value, key, found);
    }
}

fn check_number(schema: &Value, x: f64, key: &str, found: &mut Vec<Finding>) {
    let low = schema["minimum"].as_f64().unwrap_or(f64::NEG_INFINITY);
    let high = schema["maximum"].as_f64().unwrap_or(f64::INFINITY);
    if !(low..=high).contains(&x) || !x.is_finite() {
        let range = match (low.is_finite(), high.is_finite()) {
            (true, true) => format!("give a number from {low} to {high}"),
            (true, false) => format!("give a number of at least {low}"),
            _ => "give a finite number".into(),
        };
        found.push(Finding::wrong(key, format!("is {x}"), range));
    }
}

fn check_text(schema: &Value, text: &str, key: &str, found: &mut Vec<Finding>) {
    let words = words(schema);
    if !words.is_empty() && !words.iter().any(|word| word == text) {
        let close = host_core::error::nearest_name(text, &words);
        let close = close.map_or(String::new(), |close| format!(" (perhaps '{close}')"));
        let remedy = format!("use one of {}{close}", words.join(", "));
        found.push(Finding::wrong(key, format!("is '{text}'"), remedy));
    }
    let (least, most) = (schema["minLength"].as_u64(), schema["maxLength"].as_u64());
    let length = text.chars().count() as u64;
    if least.is_some_and(|least| length < least) || most.is_some_and(|most| length > most) {
        let (least, most) = (least.unwrap_or(0), most.unwrap_or(u64::MAX));
        let problem = format!("has {length} characters");
        found.push(Finding::wrong(
            key,
            problem,
            format!("give {least} to {most}"),
        ));
    }
}

/// The words that a text may be; empty if any text is allowed.
pub(super) fn words(schema: &Value) -> Vec<String> {
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let mut words: Vec<String> = list(&schema["enum"]).iter().filter_map(text).collect();
    for one in list(&schema["oneOf"]) {
        words.extend(text(&one["const"]));
        words.extend(list(&one["enum"]).iter().filter_map(text));
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `LRNN_UPDATE=1 cargo nextest run -p host-unit schema_in_the_repository` rewrites it.
    #[test]
    fn the_schema_in_the_repository_is_that_of_the_types() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/unit.schema.json");
        if std::env::var_os("LRNN_UPDATE").is_some() {
            std::fs::write(file, text()).unwrap();
        }
        let stored = std::fs::read_to_string(file).unwrap();
        assert!(
            stored == text(),
            "host-sim unit schema > host-sim/assets/unit.schema.json"
        );
    }

    #[test]
    fn every_field_is_described_with_its_default_or_is_required() {
        fn walk(schema: &Value, key: &str, count: &mut usize) {
            let required: Vec<&str> = schema["required"]
                .as_array()
                .map(|list| list.iter().filter_map(Value::as_str).collect())
                .unwrap_or_default();
            for (name, field) in schema["properties"].as_object().into_iter().flatten() {
                let key = format!("{key}.{name}");
                let says = field["description"].as_str().unwrap_or_default();
                assert!(says.len() > 3, "{key} is not described");
                // the simulation's own terms are off or have the default that they name
                if field["type"] == "object" || key.starts_with(".simulation") {
                    walk(field, &key, count);
                    continue;
                }
                *count += 1;
                let is_required = required.contains(&name.as_str());
                let word = if is_required { "Required" } else { "Default" };
                assert!(says.contains(word), "{key}: {says}");
                if field["type"] == "number" {
                    assert!(
                        field["minimum"].is_number() && field["maximum"].is_number(),
                        "{key}"
                    );
                }
            }
        }
        let mut count = 0;
        walk(&schema(), "", &mut count);
        assert!(count > 50, "{count}");
        assert!(!text().contains("null") && !text().contains("$ref"));
    }
}
