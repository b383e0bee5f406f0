//! Asks the user for the keys of a unit file, and writes the file.

use super::sensor::FormatName;
use super::{Sources, Unit, schema};
use std::io::{self, BufRead, Write};

/// A question: its key in the file, and its text.
struct Question {
    table: &'static str,
    key: &'static str,
    what: &'static str,
}

impl Question {
    /// The key with its table, as in `sensor.format`.
    fn path(&self) -> String {
        match self.table {
            "" => self.key.to_owned(),
            table => format!("{table}.{}", self.key),
        }
    }
}

/// Keys whose words are explained before the question.
const EXPLAINED: [&str; 2] = ["mode", "activation"];

const fn ask(table: &'static str, key: &'static str, what: &'static str) -> Question {
    Question { table, key, what }
}

/// The questions in the order of the file. Ranges and words are those of the schema.
const QUESTIONS: [Question; 26] = [
    ask("", "name", "Name of the unit"),
    ask("", "serial", "Serial number of the sensor (may be empty)"),
    ask("sensor", "format", "Format of the sensor's frames"),
    ask("sensor", "rate_hz", "Samples a second, Hz"),
    ask("sensor", "baud", "Bit rate of the sensor's line, bit/s"),
    ask(
        "mounting",
        "axes",
        "Forward, right, down in axes of the sensor, as in y x -z",
    ),
    ask("gyro", "bias_turn_on_dph", "Gyro bias at power-on, deg/h"),
    ask("gyro", "bias_in_run_dph", "Gyro bias in run, deg/h"),
    ask(
        "gyro",
        "angle_random_walk_dpsqrth",
        "Angle random walk, deg/sqrt(h)",
    ),
    ask("gyro", "scale_ppm", "Gyro scale factor error, ppm"),
    ask("gyro", "misalignment_mrad", "Gyro misalignment, mrad"),
    ask("gyro", "g_sensitivity_dphpg", "Gyro g-sensitivity, deg/h/g"),
    ask("gyro", "range_dps", "Gyro range, deg/s"),
    ask(
        "accel",
        "bias_turn_on_ug",
        "Accelerometer bias at power-on, ug",
    ),
    ask("accel", "bias_in_run_ug", "Accelerometer bias in run, ug"),
    ask(
        "accel",
        "velocity_random_walk_ugpsqrthz",
        "Velocity random walk, ug/sqrt(Hz)",
    ),
    ask(
        "accel",
        "scale_ppm",
        "Accelerometer scale factor error, ppm",
    ),
    ask(
        "accel",
        "misalignment_mrad",
        "Accelerometer misalignment, mrad",
    ),
    ask("accel", "range_g", "Accelerometer range, g"),
    ask("receiver", "protocol", "What the receiver speaks"),
    ask(
        "receiver",
        "lever_arm_m",
        "From the IMU to the antenna: forward right down, m; nothing if not measured",
    ),
    ask(
        "receiver",
        "fix_delay_ms",
        "Least age of a fix when it arrives, ms",
    ),
    ask("vehicle", "kind", "How the vehicle moves"),
    ask(
        "vehicle",
        "largest_speed_mps",
        "Largest speed over ground, m/s",
    ),
    ask("correction", "mode", "Mode at power-on"),
    ask(
        "correction",
        "activation",
        "When what was learnt comes into force",
    ),
];

/// Asks line by line, with the values of `from` as defaults, and gives the text of the file, in
/// which values that are kept keep their comments (`sources`). The answer `?` explains a question.
/// An answer that is refused is asked again. `None`: the input ended before all required answers.
///
/// # Errors
/// Input or output that fails.
pub fn interview(
    from: Option<&Unit>,
    sources: &Sources,
    input: &mut impl BufRead,
    output: &mut impl Write,
) -> io::Result<Option<String>> {
    let mut table = match from {
        Some(unit) => toml::Table::try_from(unit).unwrap_or_default(),
        None => toml::Table::new(),
    };
    // the simulation's terms describe another sensor than the answers
    table.remove("simulation");
    let schema = schema::schema();
    for question in &QUESTIONS {
        if answer(question, &schema, &mut table, input, output)?.is_none() {
            return Ok(None);
        }
        if question.key == "format" {
            let extra = variants(&table);
            for question in &extra {
                if answer(question, &schema, &mut table, input, output)?.is_none() {
                    return Ok(None);
                }
            }
        }
    }
    Ok(Some(file(&table, &schema, sources)))
}

/// Questions for the chosen format only.
fn variants(table: &toml::Table) -> Vec<Question> {
    let format = table.get("sensor").and_then(|sensor| sensor.get("format"));
    let format = format.cloned().and_then(|name| name.try_into().ok());
    match format {
        Some(FormatName::Stim300) => vec![
            ask("sensor.stim300", "datagram", "Datagram, as in 0x91"),
            ask("sensor.stim300", "gyro_output", "Gyro values are"),
            ask("sensor.stim300", "accel_output", "Accelerometer values are"),
            ask(
                "sensor.stim300",
                "accel_range_g",
                "Accelerometer range, g: 5, 10, 30, 80",
            ),
        ],
        Some(FormatName::Kvh) => vec![
            ask("sensor.kvh", "rotation", "Gyro values are (=ROTFMT)"),
            ask("sensor.kvh", "angle", "Unit of angles (=ROTUNITS)"),
        ],
        Some(FormatName::Novatel) => vec![ask("sensor.novatel", "imu_type", "IMU type number")],
        Some(FormatName::Epson) => vec![ask("sensor.epson", "model", "Model, as in G366PDG0")],
        Some(FormatName::AdisSpi) => vec![ask("sensor.adis", "model", "Model, as in ADIS16495-2")],
        _ => Vec::new(),
    }
}

/// Asks until the answer fits. An empty answer takes the default, if there is one.
fn answer(
    question: &Question,
    schema: &serde_json::Value,
    table: &mut toml::Table,
    input: &mut impl BufRead,
    output: &mut impl Write,
) -> io::Result<Option<()>> {
    let field = field(schema, question);
    let usual = current(table, question).or_else(|| usual(field));
    let required = usual.is_none() && is_required(schema, question);
    let words = schema::words(field);
    if EXPLAINED.contains(&question.key) {
        explain(question, field, output)?;
    }
    loop {
        write!(output, "{}", question.what)?;
        if !words.is_empty() {
            write!(output, " ({})", words.join(", "))?;
        }
        if let Some(usual) = &usual {
            write!(output, " [{}]", shown(usual))?;
        }
        write!(output, ": ")?;
        output.flush()?;
        let mut line = String::new();
        let ended = input.read_line(&mut line)? == 0;
        let text = line.trim();
        if text.is_empty() {
            match (&usual, required) {
                (Some(usual), _) => {
                    put(table, question, usual.clone());
                    return Ok(Some(()));
                }
                (None, false) => return Ok(Some(())),
                (None, true) if ended => return Ok(None),
                (None, true) => writeln!(output, "  {}: an answer is needed", question.path())?,
            }
            continue;
        }
        if text == "?" {
            explain(question, field, output)?;
            continue;
        }
        let value = read(field, text);
        let mut found = Vec::new();
        schema::check(field, &value, question.key, &mut found);
        match found.first() {
            None => {
                put(table, question, value);
                return Ok(Some(()));
            }
            Some(fault) => {
                let (path, problem, remedy) = (question.path(), &fault.problem, &fault.remedy);
                writeln!(output, "  {path} {problem}; {remedy} (? explains it)")?;
            }
        }
        if ended {
            return Ok(None);
        }
    }
}

/// Explains a question by the schema: the key, and each of its words.
fn explain(
    question: &Question,
    field: &serde_json::Value,
    output: &mut impl Write,
) -> io::Result<()> {
    let says = |of: &serde_json::Value| {
        let says = of["description"].as_str().unwrap_or_default();
        says.replace('\n', " ")
    };
    writeln!(output, "  {}: {}", question.path(), says(field))?;
    for one in field["oneOf"].as_array().into_iter().flatten() {
        if let Some(word) = one["const"].as_str() {
            writeln!(output, "    {word}: {}", says(one))?;
        }
    }
    Ok(())
}

/// The schema of a question's key.
fn field<'s>(schema: &'s serde_json::Value, question: &Question) -> &'s serde_json::Value {
    &table_schema(schema, question)["properties"][question.key]
}

fn table_schema<'s>(schema: &'s serde_json::Value, question: &Question) -> &'s serde_json::Value {
    let names = question.table.split('.').filter(|name| !name.is_empty());
    names.fold(schema, |schema, name| &schema["properties"][name])
}

fn is_required(schema: &serde_json::Value, question: &Question) -> bool {
    let required = table_schema(schema, question)["required"].as_array();
    required.is_some_and(|names| names.iter().any(|name| name == question.key))
}

/// The default in the schema. Numbers are converted one by one: serde would make a table of a JSON
/// number that keeps its digits (feature `arbitrary_precision`, which other crates may switch on).
fn usual(field: &serde_json::Value) -> Option<toml::Value> {
    use serde_json::Value;
    match field.get("default")? {
        Value::Bool(value) => Some(toml::Value::Boolean(*value)),
        Value::String(text) => Some(toml::Value::String(text.clone())),
        Value::Number(number) => number
            .as_i64()
            .map(toml::Value::Integer)
            .or_else(|| number.as_f64().map(toml::Value::Float)),
        Value::Null | Value::Array(_) | Value::Object(_) => None,
    }
}

/// The value in the table.
fn current(table: &toml::Table, question: &Question) -> Option<toml::Value> {
    let names = question.table.split('.').filter(|name| !name.is_empty());
    let mut inside = table;
    for name in names {
        inside = inside.get(name)?.as_table()?;
    }
    inside.get(question.key).cloned()
}

fn put(table: &mut toml::Table, question: &Question, value: toml::Value) {
    let mut inside = table;
    for name in question.table.split('.').filter(|name| !name.is_empty()) {
        let entry = inside
            .entry(name)
            .or_insert_with(|| toml::Table::new().into());
        let toml::Value::Table(next) = entry else {
            return;
        };
        inside = next;
    }
    inside.insert(question.key.into(), value);
}

/// The answer as a value of the field's type; a text if it is none.
fn read(field: &serde_json::Value, text: &str) -> toml::Value {
    let number = |text: &str| match text.parse::<i64>() {
        Ok(whole) => Some(toml::Value::Integer(whole)),
        Err(_) => text.parse::<f64>().ok().map(toml::Value::Float),
    };
    let value = match field["type"].as_str() {
        Some("number" | "integer") => number(text),
        Some("array") => {
            let list = text.trim_matches(['[', ']']).split([',', ' ']);
            let values = list.filter(|value| !value.is_empty()).map(number);
            values.collect::<Option<Vec<_>>>().map(toml::Value::Array)
        }
        Some("boolean") => text.parse().ok().map(toml::Value::Boolean),
        _ => None,
    };
    value.unwrap_or_else(|| toml::Value::String(text.into()))
}

fn shown(value: &toml::Value) -> String {
    match value {
        toml::Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// The text of a file with these tables, and with comments `about` it in its first lines. The
/// comment above each line is the first sentence of the field's description.
#[must_use]
pub fn text(table: &toml::Table, sources: &Sources, about: &[String]) -> String {
    let text = file(table, &schema::schema(), sources);
    let (first, rest) = text.split_once('\n').unwrap_or_default();
    let about: String = about.iter().map(|line| format!("# {line}\n")).collect();
    format!("{first}\n{about}{rest}")
}

/// The text of the file. The comment of each line is the first sentence of the field's description.
fn file(table: &toml::Table, schema: &serde_json::Value, sources: &Sources) -> String {
    let mut text = format!("#:schema {}\n", schema::FILE);
    write_table(table, schema, sources, "", &mut text);
    text
}

fn write_table(
    table: &toml::Table,
    schema: &serde_json::Value,
    sources: &Sources,
    path: &str,
    text: &mut String,
) {
    let is_table = |value: &&toml::Value| value.is_table();
    if !path.is_empty() && table.values().any(|value| !value.is_table()) {
        *text += &format!("\n[{path}]\n");
    }
    let known = schema["properties"].as_object();
    let names = known.into_iter().flatten().map(|(name, _)| name.as_str());
    for name in names.clone() {
        let Some(value) = table.get(name).filter(|value| !value.is_table()) else {
            continue;
        };
        let says = schema["properties"][name]["description"].as_str();
        let says = says.unwrap_or_default().replace('\n', " ");
        let says = says.split(". ").next().unwrap_or_default();
        let key = match path {
            "" => name.to_owned(),
            path => format!("{path}.{name}"),
        };
        let source = sources.comment(&key, value);
        let source = source.map_or(String::new(), |source| format!(" # {source}"));
        *text += &format!("# {says}\n{name} = {value}{source}\n");
    }
    for name in names {
        if let Some(toml::Value::Table(inner)) = table.get(name).filter(is_table) {
            let path = match path {
                "" => name.to_owned(),
                path => format!("{path}.{name}"),
            };
            write_table(inner, &schema["properties"][name], sources, &path, text);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::examine;
    use super::*;

    fn ask_all(from: Option<&Unit>, answers: &str) -> (Option<String>, String) {
        let mut said = Vec::new();
        let text = interview(
            from,
            &Sources::default(),
            &mut answers.as_bytes(),
            &mut said,
        )
        .unwrap();
        (text, String::from_utf8(said).unwrap())
    }

    #[test]
    fn answers_become_a_file_and_wrong_ones_are_asked_again() {
        let answers = "my unit\nN1\nstim30\nstim300\n0x93\n\n\n30\n500\n\ny x -z\n10\n-1\n0.5\n0.15\n\
                       \n\n1\n\n2000\n50\n60\n\n\n\nsbf\n1\n1 0.2,-2\n\nair\n80\nlearn\nfaded\n";
        let (text, said) = ask_all(None, answers);
        let text = text.unwrap();
        assert!(
            said.contains("sensor.format is 'stim30'; use one of stim300"),
            "{said}"
        );
        assert!(said.contains("is -1; give a number from 0"), "{said}");
        assert!(
            said.contains("Bit rate of the sensor's line, bit/s [921600]: "),
            "{said}"
        );
        let (unit, found) = examine(&text);
        assert!(found.is_empty(), "{text}\n{found:?}");
        let unit = unit.unwrap();
        assert_eq!((unit.name.as_str(), unit.sensor.rate()), ("my unit", 500.0));
        assert_eq!(unit.sensor.stim300.as_ref().unwrap().datagram, "0x93");
        assert_eq!(unit.mounting.axes.as_deref(), Some("y x -z"));
        assert_eq!(
            (unit.gyro.bias_in_run_dph, unit.accel.bias_in_run_ug),
            (0.5, 50.0)
        );
        assert_eq!(unit.vehicle.largest_speed_mps, 80.0);
        assert!(said.contains("has 1 values; give 3 values"), "{said}");
        assert!(
            said.contains("(ubx, nmea, novatel, sbf, detect) [ubx]: "),
            "{said}"
        );
        assert_eq!(unit.receiver.lever_arm_m, [1.0, 0.2, -2.0]);
        assert_eq!(unit.receiver.lever_arm_sigma(), 0.5);
        assert!(text.starts_with("#:schema unit.schema.json\n"));
        assert!(text.contains("# Bias in run: random walk of the bias in an hour, deg/h"));
    }

    #[test]
    fn empty_answers_take_the_preset() {
        for name in super::super::presets::names() {
            let mut unit = Unit::preset(name).unwrap();
            let (text, _) = ask_all(Some(&unit), "");
            let (made, found) = examine(&text.unwrap());
            assert!(found.is_empty(), "{name}: {found:?}");
            let made = made.unwrap().configuration();
            unit.simulation = None;
            assert_eq!(made, unit.configuration(), "{name}");
        }
    }

    #[test]
    fn a_question_is_explained_and_kept_values_keep_their_sources() {
        let preset = super::super::presets::text("tactical").unwrap();
        let unit = Unit::preset("tactical").unwrap();
        let mut said = Vec::new();
        let answers = "\n\n\n\n\n\n?\n2\n";
        let sources = Sources::of(&preset);
        let text = interview(Some(&unit), &sources, &mut answers.as_bytes(), &mut said);
        let text = text.unwrap().unwrap();
        let said = String::from_utf8(said).unwrap();
        assert!(said.contains("  mounting.axes: "), "{said}");
        assert!(
            said.contains("  correction.mode: ") && said.contains("    bypass: "),
            "{said}"
        );
        assert!(text.contains("velocity_random_walk_ugpsqrthz = 34.0 # source: [simulation]\n"));
        let rate = "rate_hz = 100.0 # source: NovAtel OEM7 documentation: HG1700 logs at 100 Hz\n";
        assert!(text.contains(rate), "{text}");
        let (asked, _) = ask_all(Some(&unit), "x\n");
        assert!(
            !asked.unwrap().contains("# source"),
            "no sources were given"
        );
        let other = Sources::of("name = \"a\" # mine\n[gyro]\nscale_ppm = 2 # sheet\n");
        let two = toml::Value::Float(2.0);
        assert_eq!(other.comment("gyro.scale_ppm", &two), Some("sheet"));
        assert_eq!(other.comment("name", &two), None);
    }

    #[test]
    fn answers_that_end_too_early_give_no_file() {
        let (text, said) = ask_all(None, "my unit\n");
        assert_eq!(text, None);
        assert!(said.ends_with(", adis-spi, detect): "), "{said}");
    }
}
