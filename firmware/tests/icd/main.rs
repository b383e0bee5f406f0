//! The interface control document says what the code does: its tables, row by row.

use firmware::control::Reason;
use firmware::control::recording::Order;
use firmware::fix::Heading;
use firmware::model::IMAGES_LEN;
use firmware::wheels::WheelSpeed;
use firmware::wire::command::{
    MAX_CHUNK, MAX_PACKET, Provision, Request, Response, WIRE_VERSION, encode, fault,
};
use firmware::wire::{
    Change, Checked, Fields, ImuFormat, Settings, Simulated, cobs, epson, framer, hg4930, kvh,
    novatel, stim300,
};

mod body;
mod examples;

const ICD: &str = include_str!("../../../docs/ICD.md");

/// The cells of all table rows whose first cell is `first`.
fn rows(first: &str) -> Vec<Vec<&'static str>> {
    let cells = |line: &'static str| {
        line.trim_matches('|')
            .split('|')
            .map(str::trim)
            .collect::<Vec<_>>()
    };
    ICD.lines()
        .filter(|line| line.starts_with('|'))
        .map(cells)
        .filter(|row| row[0] == first)
        .collect()
}

fn number(text: &str) -> u32 {
    match text.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16).expect("a hexadecimal number"),
        None => text.parse().expect("a number"),
    }
}

fn numbers(text: &str) -> Vec<u32> {
    text.split_whitespace().map(number).collect()
}

#[test]
fn stim300_frames() {
    let mut listed = Vec::new();
    let rows = rows("STIM300")
        .into_iter()
        .filter(|row| row[1].starts_with("0x"));
    for row in rows {
        let (ids, lengths) = (numbers(row[1]), numbers(row[2]));
        assert_eq!(ids.len(), lengths.len());
        for (id, len) in ids.into_iter().zip(lengths) {
            let contents = stim300::Contents::from_id(id as u8).expect("an identifier");
            assert_eq!(contents.len() as u32, len, "{id:#x}");
            assert_eq!(contents.accel, row[3].contains("accelerometer"), "{id:#x}");
            listed.push(id);
        }
    }
    listed.sort_unstable();
    let known: Vec<u32> = (0..256)
        .filter(|&id| stim300::Contents::from_id(id as u8).is_some())
        .collect();
    assert_eq!(listed, known);
}

#[test]
fn kvh_novatel_hg4930_frames() {
    for (row, layout) in rows("KVH")
        .iter()
        .zip([kvh::Layout::A, kvh::Layout::B, kvh::Layout::C])
    {
        let mut buffer = [0; 40];
        let repr = kvh::Repr {
            layout,
            gyro: [0.0; 3],
            accel: [0.0; 3],
            extra: [0; 4],
            status: 0x77,
            sequence: 0,
            temperature: 0,
        };
        let len = repr.emit(&mut buffer).expect("room") as u32;
        let header = u32::from_be_bytes(buffer[..4].try_into().expect("four"));
        assert_eq!((number(row[1]), number(row[2])), (header, len));
    }
    use novatel::Log;
    let mut logs = Vec::new();
    for row in rows("NovAtel") {
        logs.extend(numbers(row[1]).into_iter().zip(numbers(row[2])));
    }
    let all = [Log::Rawimu, Log::Rawimux, Log::Rawimus, Log::Rawimusx];
    assert_eq!(
        logs,
        all.map(|log| (u32::from(log.id()), log.frame_len() as u32))
    );
    let frames: Vec<_> = rows("HG4930")
        .into_iter()
        .filter(|row| row[1].starts_with("0x"))
        .collect();
    let lengths: Vec<_> = frames
        .iter()
        .map(|row| (number(row[1]), number(row[2])))
        .collect();
    let made = [hg4930::Message::Inertial, hg4930::Message::SClass].map(|message| {
        let mut buffer = [0; 44];
        let repr = hg4930::Repr {
            message,
            rate: [0; 3],
            accel: [0; 3],
            status_1: 0,
            status_2: 0,
            angle: [0; 3],
            velocity: [0; 3],
        };
        let len = repr.emit(&mut buffer).expect("room") as u32;
        (u32::from(buffer[1]), len)
    });
    assert_eq!(lengths, made);
}

/// The registers of a row make bursts of the length of the row.
#[test]
fn epson_bursts() {
    let rows = rows("Epson").into_iter().filter(|row| row.len() == 6);
    let mut listed = 0;
    for row in rows {
        let registers: Vec<u16> = numbers(row[1]).into_iter().map(|n| n as u16).collect();
        let layout = epson::Layout::new(registers[0], registers[1]).expect("a checksum");
        assert_eq!(layout.bytes() as u32, number(row[2]));
        listed += 1;
    }
    assert_eq!(
        listed,
        ImuFormat::from_name("epson").expect("it").simulated().len()
    );
}

/// The rows of a format, in whatever case its name is written.
fn rows_of(format: ImuFormat) -> Vec<Vec<&'static str>> {
    let all = ICD.lines().filter(|line| line.starts_with('|'));
    let firsts = all.filter_map(|line| line.trim_matches('|').split('|').next());
    let mut firsts: Vec<&str> = firsts.map(str::trim).collect();
    firsts.dedup();
    let named = |first: &&str| first.to_lowercase().starts_with(format.name());
    firsts.into_iter().filter(named).flat_map(rows).collect()
}

fn simulated(sensor: &Simulated) -> Vec<u8> {
    let mut buffer = [0; framer::LONGEST];
    let len = (sensor.emit)(&Fields::default(), &mut buffer).expect("room");
    buffer[..len].to_vec()
}

/// Every frame that can be simulated is listed with its length.
#[test]
fn frames_of_every_format() {
    for format in ImuFormat::ALL {
        let rows = rows_of(format);
        let lengths = rows.iter().filter(|row| row.len() == 6);
        let lengths: Vec<u32> = lengths.flat_map(|row| numbers(row[2])).collect();
        for sensor in format.simulated() {
            let len = simulated(sensor).len() as u32;
            assert!(lengths.contains(&len), "{}: {lengths:?}", sensor.name);
        }
    }
}

/// The bit that a mark sets is the one in the table, or none where the table says so.
#[test]
fn own_fault_bits_of_every_format() {
    for format in ImuFormat::ALL {
        let rows = rows_of(format);
        let rows: Vec<_> = rows.iter().filter(|row| row.len() == 3).collect();
        assert!(!rows.is_empty(), "{format:?}");
        for sensor in format.simulated() {
            let mut frame = simulated(sensor);
            let before = frame.clone();
            let format = format.configured(&sensor.settings());
            let mut checked = Checked::new(format, &mut frame).expect("a frame");
            let sample = checked.read().expect("values").sample;
            let change = Change {
                sample: &sample,
                mark: true,
                settings: &Settings::DEFAULT,
            };
            checked.change(&change).expect("values of this kind");
            // all bytes but those that the checksum follows
            let mark = (0..frame.len()).find_map(|at| {
                let mut other = before.clone();
                other[at] = frame[at];
                format.seal(&mut other);
                (other == frame && frame[at] != before[at]).then_some(frame[at] ^ before[at])
            });
            let listed = rows.iter().any(|row| {
                let last = row[1].split_whitespace().last().expect("a bit");
                match mark {
                    None => last == "none",
                    Some(mark) => {
                        let mark = u32::from(mark);
                        last != "none" && [mark, mark << 8].contains(&number(last))
                    }
                }
            });
            assert!(listed, "{}: {mark:?}", sensor.name);
        }
    }
}

#[test]
fn own_fault_bits() {
    let bit = |format: &str| {
        let row = rows(format)
            .into_iter()
            .find(|row| row.len() == 3)
            .expect("a row");
        number(row[1].split_whitespace().last().expect("a bit"))
    };
    assert_eq!(bit("KVH"), u32::from(kvh::OWN_FAULT));
    assert_eq!(
        bit("NovAtel RAWIMUX, RAWIMUSX"),
        u32::from(novatel::OWN_FAULT)
    );
    assert_eq!(bit("HG4930"), u32::from(hg4930::OWN_FAULT));
}

#[test]
fn fault_flags() {
    let flags = [
        ("SILENT", fault::SILENT),
        ("UNKNOWN_FORMAT", fault::UNKNOWN_FORMAT),
        ("UNITS", fault::UNITS),
        ("NETWORK", fault::NETWORK),
        ("SATURATED", fault::SATURATED),
        ("OUTPUT_FULL", fault::OUTPUT_FULL),
        ("PASS_THROUGH", fault::PASS_THROUGH),
        ("SENSOR", fault::SENSOR),
        ("STORE", fault::STORE),
        ("NOT_CONFIGURED", fault::NOT_CONFIGURED),
        ("RATE", fault::RATE),
        ("GRAVITY", fault::GRAVITY),
        ("EARTH_RATE", fault::EARTH_RATE),
        ("AXES", fault::AXES),
        ("STUCK", fault::STUCK),
        ("WEIGHTS", fault::WEIGHTS),
    ];
    let of_the_board = [
        ("CLOCK", fault::CLOCK),
        ("BIT_RATE", fault::BIT_RATE),
        ("SAFE_START", fault::SAFE_START),
        ("SUPPLY", fault::SUPPLY),
        ("KEY", fault::KEY),
    ];
    let flags = flags.into_iter().enumerate();
    let of_the_board = (24..).zip(of_the_board);
    for (n, (name, bit)) in flags.chain(of_the_board) {
        assert_eq!(bit, 1 << n);
        let row = rows(&n.to_string());
        assert!(row.iter().any(|row| row[1] == name), "{name}");
    }
}

/// The numbers of the requests are postcard's.
#[test]
fn requests() {
    use firmware::control::{Alignment, Mode, Window};
    let window = Window {
        first: 0,
        last: 0,
        angle: [0.0; 3],
        velocity: [0.0; 3],
        angle_sigma: 1.0,
        velocity_sigma: 1.0,
    };
    let all = [
        Request::GetVersion,
        Request::GetHealth,
        Request::SetMode(Mode::Bypass),
        Request::WriteImage {
            offset: 0,
            bytes: &[],
        },
        Request::CommitImage { length: 0 },
        Request::ReadImage {
            offset: 0,
            length: 0,
        },
        Request::Reference(window),
        Request::Alignment(Alignment::Started),
        Request::GetCounters,
        Request::StoreImage,
        Request::GetEstimate,
        Request::ReadLearnt {
            offset: 0,
            length: 0,
        },
        Request::CommitLearnt,
        Request::WriteConfiguration {
            offset: 0,
            bytes: &[],
        },
        Request::CommitConfiguration { length: 0 },
        Request::ReadConfiguration {
            offset: 0,
            length: 0,
        },
        Request::GetBoard,
        Request::Heading(Heading {
            angle: 0.0,
            sigma: 0.1,
        }),
        Request::GetAntenna,
        Request::GetReceiver,
        Request::GetMemory,
        Request::GetStore,
        Request::GetRecording,
        Request::Record(Order::Hold),
        Request::ReadRecording {
            offset: 0,
            length: 0,
        },
        Request::GetSecurity,
        Request::GetChallenge,
        Request::Provision(Provision::OpenByChoice),
        Request::GetReset,
        Request::GetSolution,
        Request::GetTrials,
        Request::GetProgress,
        Request::WheelSpeed(WheelSpeed {
            speed: 0.0,
            age_ms: 0,
        }),
        Request::GetUpdate,
        Request::BeginUpdate {
            header: &[],
            older: false,
        },
        Request::WriteUpdate {
            offset: 0,
            bytes: &[],
        },
        Request::FinishUpdate,
        Request::Restart,
        Request::GetTimes,
    ];
    for (n, request) in all.iter().enumerate() {
        let name = format!("{request:?}");
        let name = name
            .split(|c: char| !c.is_alphanumeric())
            .next()
            .expect("a name");
        assert_eq!(rows(&format!("{n} {name}")).len(), 1, "{n} {name}");
        let mut buffer = [0; MAX_PACKET];
        let packet = encode(1, request, &mut buffer).expect("a packet");
        let len = packet.len() - 1;
        let len = cobs::decode_in_place(&mut packet[..len]).expect("our own packet");
        assert_eq!(usize::from(packet[..len][1]), n);
    }
}

/// The names of an enumeration's variants by their numbers: zeros behind a number are a value.
fn variants<'de, T: serde::Deserialize<'de> + core::fmt::Debug>(
    zeros: &'de [[u8; 512]],
) -> Vec<String> {
    let known = zeros
        .iter()
        .map_while(|bytes| postcard::from_bytes::<T>(bytes).ok());
    let names = known.map(|value| format!("{value:?}"));
    names
        .map(|name| {
            name.split(|c: char| !c.is_alphanumeric())
                .next()
                .unwrap_or_default()
                .to_owned()
        })
        .collect()
}

/// The numbers of the answers and of the reasons for a refusal are postcard's.
#[test]
fn answers_and_reasons() {
    let zeros: Vec<[u8; 512]> = (0..64)
        .map(|n| core::array::from_fn(|at| if at == 0 { n } else { 0 }))
        .collect();
    let answers = variants::<Response>(&zeros);
    let reasons = variants::<Reason>(&zeros);
    assert_eq!((answers.len(), reasons.len()), (21, 23));
    for (n, name) in answers.iter().enumerate() {
        assert_eq!(rows(&format!("{name}, {n}")).len(), 1, "{name}, {n}");
    }
    for (n, name) in reasons.iter().enumerate() {
        let stated = [format!("| {name}, {n}"), format!("; {name}, {n}")];
        assert!(
            stated.iter().any(|stated| ICD.contains(stated)),
            "{name}, {n}"
        );
    }
}

/// Places and lengths of the black box's parts.
#[test]
fn parts_of_a_recording() {
    use firmware::app::blackbox::read::{EVENT_LEN, EVENTS, HEAD_LEN, PAGE_LEN};
    use firmware::app::blackbox::{KEY_LEN, PAGES, VERSION};
    let events = EVENTS * EVENT_LEN;
    let parts = [
        (0, HEAD_LEN, "head: magic `LRBB`".to_owned()),
        (
            HEAD_LEN,
            events,
            format!("{EVENTS} events of {EVENT_LEN} bytes"),
        ),
        (
            HEAD_LEN + events,
            PAGES * PAGE_LEN,
            format!("{PAGES} pages of {PAGE_LEN} bytes"),
        ),
    ];
    for (at, length, content) in parts {
        let row = format!("| {at} | {length} | {content}");
        assert!(ICD.contains(&row), "{row}");
    }
    assert!(ICD.contains(&format!("layout version {VERSION} ")));
    assert!(ICD.contains(&format!("key ({KEY_LEN} bytes)")));
}

/// `12 (t: `name`)`: a number of the text and the code's.
#[test]
fn numbers_in_the_text() {
    let stated = |name: &str| {
        let mark = format!("(t: `{name}`)");
        let (before, _) = ICD.split_once(&mark).expect("a mark");
        let digits = |c: char| c.is_ascii_digit();
        let last = before
            .rsplit(|c: char| !digits(c))
            .find(|part| !part.is_empty());
        number(last.expect("a number")) as usize
    };
    assert_eq!(stated("packet"), MAX_PACKET);
    assert_eq!(stated("wire"), usize::from(WIRE_VERSION));
    assert_eq!(stated("images"), IMAGES_LEN);
    assert_eq!(stated("image"), lrnn_nostd::image::IMAGE_LEN);
    assert_eq!(stated("chunk"), MAX_CHUNK);
    assert_eq!(stated("header"), firmware::update::header::HEADER_LEN);
    assert_eq!(stated("recording"), firmware::app::blackbox::LEN);
    assert_eq!(stated("kinds"), firmware::compensator::OUTPUT_STREAMS);
    assert_eq!(
        stated("patience"),
        firmware::app::PATIENCE_US as usize / 1000
    );
    let config = firmware::app::Config::default();
    assert!(ICD.contains(&format!(
        "for {} ms (configurable)",
        config.silence_us / 1000
    )));
    let answer = config.sensor.stim300.answer_us.expect("answers by default") / 1000;
    assert!(ICD.contains(&format!("has not answered in {answer} ms (configurable)")));
    let failures = firmware::app::phase::FAILURES;
    assert!(ICD.contains(&format!("failed in {failures} blocks in a row")));
    let unknown = firmware::wire::framer::UNKNOWN_AFTER;
    assert!(ICD.contains(&format!("no frame in {unknown} bytes of garbage")));
}
