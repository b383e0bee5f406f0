//! The comments of a unit file that name the source of each value.

use std::collections::BTreeMap;

/// Value and comment of each key that has a comment behind it.
#[derive(Debug, Default)]
pub struct Sources(BTreeMap<String, (toml::Value, String)>);

impl Sources {
    /// The comments of a file.
    #[must_use]
    pub fn of(text: &str) -> Self {
        let (mut path, mut found) = (String::new(), BTreeMap::new());
        for line in text.lines().map(str::trim) {
            if let Some(table) = line.strip_prefix('[').and_then(|t| t.split(']').next()) {
                path = format!("{table}.");
            }
            let Some((set, comment)) = line.split_once(" #") else {
                continue;
            };
            let set = set.parse::<toml::Table>().unwrap_or_default();
            for (key, value) in set {
                found.insert(format!("{path}{key}"), (value, comment.trim().to_owned()));
            }
        }
        Self(found)
    }

    /// Sets the comment of a key that has this value.
    pub fn put(&mut self, key: &str, value: toml::Value, comment: String) {
        self.0.insert(key.to_owned(), (value, comment));
    }

    /// The comment of a key (`gyro.scale_ppm`), if it has the value that the comment is about.
    pub(super) fn comment(&self, key: &str, value: &toml::Value) -> Option<&str> {
        let number = |of: &toml::Value| of.as_float().or(of.as_integer().map(|n| n as f64));
        let (of, comment) = self.0.get(key)?;
        let same = of == value || number(of).is_some() && number(of) == number(value);
        same.then_some(comment)
    }
}
