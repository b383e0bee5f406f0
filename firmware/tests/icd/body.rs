//! The body of a configuration, read by the tables of the document and by nothing else.

mod expected;

use super::examples::all_bytes;
use super::{ICD, variants};
use expected::expected;
use firmware::compensator::Limit;
use firmware::configuration::record::{decode, encode};
use firmware::configuration::{
    Activation, Configuration, Correction, Identity, Parity, Receiver, ReceiverProtocol, Sensor,
    SerialLines, Triad, Vehicle, VehicleKind, Wheels,
};
use firmware::control::Mode;
use firmware::inputs::Source;
use firmware::sample::Quantity;
use firmware::wire::stim300::{Extra, Settings as Stim300};
use firmware::wire::vectornav::Values;
use firmware::wire::{FormatSettings, ImuFormat, Settings, adis, epson, mavlink, stim300};

/// The value of a field: numbers, of which an option that is not there has none, or text.
#[derive(Debug, Clone, PartialEq)]
enum Value {
    Numbers(Vec<f64>),
    Text(String),
}

type Fields = Vec<(String, Value)>;

/// Cells of the table whose heading has this mark.
fn table(mark: &str) -> Vec<Vec<&'static str>> {
    let (_, rest) = ICD.split_once(mark).expect("a mark");
    let rows = rest.lines().skip(2);
    let rows = rows.take_while(|line| line.starts_with('|'));
    rows.map(|row| row.trim_matches('|').split('|').map(str::trim).collect())
        .collect()
}

/// `0 this, 1 that (remark); more`: the names by their numbers.
fn listed(text: &str) -> Vec<String> {
    let text = text.split(';').next().expect("a list");
    let of = |(n, part): (usize, &str)| {
        let (number, name) = part.trim().split_once(' ').expect("a number and a name");
        assert_eq!(number, n.to_string(), "{text}");
        let name = name.split(" (").next().expect("a name");
        name.replace('-', "").to_lowercase()
    };
    text.split(',').enumerate().map(of).collect()
}

/// The models of an ADIS, and whether a digit follows.
fn adis_models() -> Vec<(String, bool)> {
    let (text, _) = ICD.split_once(" (t: `adis models`)").expect("a mark");
    let (_, text) = text.rsplit_once("a u8 with the digit: ").expect("a list");
    let models = listed(&text.replace('\n', " ")).into_iter();
    models
        .map(|model| match model.strip_suffix(" and digit") {
            Some(model) => (model.to_owned(), true),
            None => (model, false),
        })
        .collect()
}

/// Bytes still to be read.
struct Bytes<'b>(&'b [u8]);

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (bytes, rest) = self.0.split_first_chunk().expect("more bytes");
        self.0 = rest;
        *bytes
    }

    fn byte(&mut self) -> u8 {
        let [byte] = self.take();
        byte
    }

    /// Seven bits a byte, the least significant first, the top bit set on all but the last.
    fn varint(&mut self) -> f64 {
        let (mut value, mut shift) = (0u64, 0);
        loop {
            let byte = self.byte();
            value |= u64::from(byte & 0x7F) << shift;
            if byte < 0x80 {
                return value as f64;
            }
            shift += 7;
        }
    }

    fn flag(&mut self) -> bool {
        let byte = self.byte();
        assert!(byte < 2, "{byte} is neither 0 nor 1");
        byte == 1
    }

    /// The numbers of a value of this type.
    fn numbers(&mut self, of: &str) -> Vec<f64> {
        if let Some(of) = of.strip_prefix("opt ") {
            return match self.flag() {
                true => self.numbers(of),
                false => Vec::new(),
            };
        }
        if let Some((of, count)) = of.strip_suffix(']').and_then(|of| of.split_once('[')) {
            let count: usize = count.parse().expect("a number");
            return (0..count).flat_map(|_| self.numbers(of)).collect();
        }
        match of {
            "u8" => vec![self.byte().into()],
            "bool" | "opt" => vec![self.flag().into()],
            "u16" | "u32" | "enum" => vec![self.varint()],
            "f32" => vec![f32::from_le_bytes(self.take()).into()],
            "f64" => vec![f64::from_le_bytes(self.take())],
            "adis" => {
                let number = self.varint();
                let digit = adis_models()[number as usize].1.then(|| self.byte().into());
                [number].into_iter().chain(digit).collect()
            }
            other => panic!("{other} is no type"),
        }
    }

    fn text(&mut self) -> String {
        let length = self.varint() as usize;
        let text = (0..length).map(|_| char::from(self.byte()));
        text.collect()
    }

    /// What the second table says.
    fn sensor(&mut self) -> Fields {
        let rows = table("(t: `sensor`)").into_iter();
        let mut rows = rows.map(|row| (numbers(row[0]), row[2]));
        let found = rows.find(|(begins, _)| self.0.starts_with(begins));
        let (begins, settings) = found.expect("a format");
        self.0 = &self.0[begins.len()..];
        let begins = begins.into_iter().map(f64::from).collect();
        let mut fields = vec![("sensor".to_owned(), Value::Numbers(begins))];
        for setting in settings.split(';').filter(|setting| !setting.is_empty()) {
            let (name, rest) = setting.trim_start()[1..].split_once('`').expect("a name");
            let of = rest.split(':').next().expect("a type").trim();
            fields.push((name.to_owned(), Value::Numbers(self.numbers(of))));
        }
        fields
    }
}

fn numbers(text: &str) -> Vec<u8> {
    let words = text.split_whitespace();
    words.map(|word| word.parse().expect("a byte")).collect()
}

/// Every field of a record's body by the tables.
fn read(record: &[u8]) -> Fields {
    let (body, sum) = record.split_last_chunk().expect("a CRC");
    assert_eq!(u32::from_le_bytes(*sum), super::examples::crc32(body));
    let (head, body) = body.split_first_chunk::<8>().expect("a head");
    assert_eq!(
        (&head[..4], head[4..6].to_vec()),
        (&b"LRNC"[..], vec![6, 0])
    );
    assert_eq!(usize::from(head[6]) | usize::from(head[7]) << 8, body.len());
    let mut bytes = Bytes(body);
    let (mut fields, mut wheels) = (Fields::new(), true);
    for row in table("(t: `body`)") {
        let (name, of) = (row[0], row[1]);
        match of {
            _ if name.starts_with("wheels.") && !wheels => {}
            "sensor" => fields.extend(bytes.sensor()),
            "text" => fields.push((name.to_owned(), Value::Text(bytes.text()))),
            of => {
                let numbers = bytes.numbers(of);
                wheels = name != "wheels" || numbers == [1.0];
                fields.push((name.to_owned(), Value::Numbers(numbers)));
            }
        }
    }
    assert_eq!(bytes.0, [0; 0], "bytes behind the last field");
    fields
}

/// Every option is set, and no two fields of a type that follow each other are equal.
fn full() -> Configuration {
    let stim300 = Stim300 {
        config: stim300::config::Config::DEFAULT,
        ask: false,
        answer_us: Some(70_000),
        family: Some(Extra::Pps),
    };
    Configuration {
        identity: Identity {
            name: "a name of thirty-two characters!".try_into().expect("32"),
            serial: "N25581346021341234567890".try_into().expect("24"),
        },
        lines: SerialLines {
            sensor_baud: 1_843_200,
            parity: Parity::Odd,
            two_stop_bits: true,
            receiver_baud: 460_800,
            pins: 2,
            cut_through: true,
        },
        sensor: Some(Sensor::Stream(FormatSettings::Stim300(stim300))),
        rate: 500.0,
        mounting: [0.5, -0.5, 0.5, -0.5],
        gyro: triad([1e-5, 1e-6, 4e-5, 5e-4, 1e-3, 2e-6, 7.0]),
        accel: triad([0.01, 0.001, 1e-3, 4e-4, 2e-3, 3e-6, 98.0]),
        receiver: Receiver {
            protocol: ReceiverProtocol::Sbf,
            lever_arm: [1.0, -0.5, -1.5],
            lever_arm_sigma: 0.2,
            fix_delay: 0.125,
            fix_delay_sigma: 0.03,
            pulse: true,
            heading_offset: -1.5,
        },
        vehicle: Vehicle {
            kind: VehicleKind::Air,
            speed: 80.0,
        },
        correction: Correction {
            mode: Mode::Shadow,
            activation: Activation::FirstRest,
            limit: limit(1e-4, 0.05),
            slew: limit(1e-7, 5e-5),
            block: 2.0,
            align: 120.0,
            silence_us: 250_000,
            mark: true,
            check_rate: false,
        },
        inputs: [
            [
                Source::Temperature,
                Source::TemperatureRate,
                Source::Vibration,
            ],
            [Source::ForceX, Source::RateMagnitude, Source::ForceZ],
        ],
        wheels: Some(Wheels {
            lever_arm: [-1.5, 0.1, 0.5],
            ahead: 2.7,
            scale: 0.02,
            noise: 0.06,
            delay: 0.04,
        }),
    }
}

fn limit(gyro: f32, accel: f32) -> Limit {
    Limit { gyro, accel }
}

fn triad(values: [f32; 7]) -> Triad {
    let [
        bias_turn_on,
        bias_in_run,
        white_noise,
        scale,
        misalignment,
        g_sensitivity,
        range,
    ] = values;
    Triad {
        bias_turn_on,
        bias_in_run,
        white_noise,
        scale,
        misalignment,
        g_sensitivity,
        range,
    }
}

/// The record of [`full`], made in Python from the document's tables.
const FULL: &str = "
4c 52 4e 43 06 00 1d 01 20 61 20 6e 61 6d 65 20 6f 66 20 74 68 69 72 74 79 2d 74 77
6f 20 63 68 61 72 61 63 74 65 72 73 21 18 4e 32 35 35 38 31 33 34 36 30 32 31 33 34
31 32 33 34 35 36 37 38 39 30 80 c0 70 02 01 80 90 1c 02 01 00 00 bc 41 1f 62 20 71
44 40 71 44 40 70 44 40 00 00 00 00 00 00 00 00 56 01 60 9c 00 01 f0 a2 04 01 01 00
00 00 00 00 40 7f 40 00 00 00 3f 00 00 00 bf 00 00 00 3f 00 00 00 bf ac c5 27 37 bd
37 86 35 ac c5 27 38 6f 12 03 3a 6f 12 83 3a bd 37 06 36 00 00 e0 40 0a d7 23 3c 6f
12 83 3a 6f 12 83 3a 17 b7 d1 39 6f 12 03 3b 9c 53 49 36 00 00 c4 42 03 00 00 80 3f
00 00 00 bf 00 00 c0 bf cd cc 4c 3e 00 00 00 3e 8f c2 f5 3c 01 00 00 c0 bf 02 00 00
a0 42 02 04 17 b7 d1 38 cd cc 4c 3d 95 bf d6 33 17 b7 51 38 00 00 00 40 00 00 f0 42
90 a1 0f 01 00 06 07 08 03 09 05 01 01 00 00 c0 bf cd cc cc 3d 00 00 00 3f cd cc 2c
40 0a d7 a3 3c 8f c2 75 3d 0a d7 23 3d 28 4d d1 b5
";

/// Two records that were made apart from this code, by the tables and as the device encodes them.
#[test]
fn records_are_as_the_tables_say() {
    let words = FULL.split_whitespace();
    let full_bytes: Vec<u8> = words
        .map(|word| u8::from_str_radix(word, 16).expect("a byte"))
        .collect();
    let default = all_bytes("(t: `configuration record`):");
    for (golden, configuration) in [(default, Configuration::default()), (full_bytes, full())] {
        assert_eq!(read(&golden), expected(&configuration));
        assert_eq!(encode(&configuration)[..], golden);
        assert_eq!(decode(&golden), Ok(configuration));
    }
}

/// The settings of every format, and of an ADIS at the SPI.
#[test]
fn sensors_are_as_the_table_says() {
    let mut sensors: Vec<_> = ImuFormat::ALL
        .into_iter()
        .map(|format| Sensor::Stream(format.settings(&Settings::DEFAULT)))
        .collect();
    let model = adis::Model::Adis16470;
    sensors.push(Sensor::Spi(adis::Settings {
        form: model.form(),
        units: model.units(false).expect("its scales"),
        framed: true,
    }));
    // and where the defaults are equal to each other
    let imu = mavlink::Imu {
        system: 3,
        component: 4,
        id: 5,
    };
    let bursts = epson::Settings {
        layout: epson::Layout::new(0xF007, 0x1000).expect("a checksum"),
        model: epson::Model::G370Pdt0,
        high_range: true,
        angle_range: 7,
        velocity_range: 9,
        count_step: 300,
    };
    let others = [
        FormatSettings::AdisUart(adis::uart::Settings { model }),
        FormatSettings::Mavlink(mavlink::Settings { imu }),
        FormatSettings::Epson(bursts),
    ];
    sensors.extend(others.map(Sensor::Stream));
    assert_eq!(table("(t: `sensor`)").len(), ImuFormat::ALL.len() + 2);
    for sensor in sensors {
        let configuration = Configuration {
            sensor: Some(sensor),
            ..Configuration::default()
        };
        assert_eq!(read(&encode(&configuration)), expected(&configuration));
    }
}

/// The lists of numbers are the variants in their order.
#[test]
fn numbers_of_all_enumerations() {
    let zeros: Vec<[u8; 512]> = (0..64)
        .map(|n| core::array::from_fn(|at| if at == 0 { n } else { 0 }))
        .collect();
    let body = |name: &str| {
        let rows = table("(t: `body`)");
        let row = rows.iter().find(|row| row[0] == name).expect("a row");
        listed(row[2])
    };
    let setting = |format: &str, name: &str| {
        let rows = table("(t: `sensor`)");
        let row = rows.iter().find(|row| row[1].starts_with(format));
        let (_, text) = row.expect("a row")[2]
            .split_once(&format!("`{name}`"))
            .expect("a setting");
        let (_, list) = text.split_once(": ").expect("a list");
        listed(list.split(", none:").next().expect("a list"))
    };
    let names = |names: Vec<String>| -> Vec<String> {
        names.iter().map(|name| name.to_lowercase()).collect()
    };
    assert_eq!(body("parity"), names(variants::<Parity>(&zeros)));
    let protocols = names(variants::<ReceiverProtocol>(&zeros));
    assert_eq!(body("receiver.protocol"), protocols);
    assert_eq!(body("vehicle.kind"), names(variants::<VehicleKind>(&zeros)));
    assert_eq!(body("mode"), names(variants::<Mode>(&zeros)));
    assert_eq!(body("activation"), names(variants::<Activation>(&zeros)));
    let families = names(variants::<Extra>(&zeros));
    assert_eq!(families, ["none", "pps", "aux"]);
    assert_eq!(setting("stim300", "family"), ["plain", "pps", "aux"]);
    let models = epson::Model::ALL.map(|model| model.name().to_lowercase());
    assert_eq!(setting("epson", "model"), models);
    assert_eq!(variants::<epson::Model>(&zeros).len(), models.len());
    assert_eq!(
        setting("vectornav", "values"),
        names(variants::<Values>(&zeros))
    );
    assert_eq!(
        setting("ADIS", "form"),
        names(variants::<adis::Form>(&zeros))
    );
    let quantities = names(variants::<Quantity>(&zeros));
    assert_eq!(setting("ADIS", "gyro_quantity"), quantities);
    let sources = names(variants::<Source>(&zeros));
    let inputs = table("| number | input | meaning").into_iter();
    let inputs = inputs.flat_map(|row| row[1].split(", "));
    assert_eq!(
        inputs.map(|name| name.replace('-', "")).collect::<Vec<_>>(),
        sources
    );
    let models = adis_models().into_iter();
    let models: Vec<String> = models
        .map(|(name, digit)| if digit { format!("{name}(0)") } else { name })
        .collect();
    let known = zeros.iter().map_while(|bytes| {
        let model = postcard::from_bytes::<adis::Model>(bytes).ok()?;
        Some(format!("{model:?}").to_lowercase())
    });
    assert_eq!(models, known.collect::<Vec<_>>());
}
