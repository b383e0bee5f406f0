//! An attacker at the command link who knows its format: packets with a right checksum and any
//! content, images and records with a valid frame around any content. The stream goes on all the
//! time. Each answer is a good packet, no request gets two, and bytes pass unchanged while the
//! device reports bypass.

use arbitrary::Arbitrary;
use firmware::app::{App, Config, Lines, Phase};
use firmware::control::Mode;
use firmware::learn::{CombinedLearner, FixLearner, FixMemory, Settings, WindowLearner};
use firmware::wire::command::{Packets, Response, decode};
use firmware::wire::{Fields, ImuFormat, cobs, framer};
use host_device::hil::{MemoryLine, SetClock};

/// Longest message that fits into a packet, bytes.
const ROOM: usize = 150;

#[derive(Arbitrary, Debug)]
enum Act<'i> {
    /// A message of this kind with this content.
    Message(u8, &'i [u8]),
    /// A piece of an upload: offset and content.
    Piece(bool, u16, &'i [u8]),
    /// A whole weight image with a valid frame, then its commit.
    Image([u8; 24]),
    /// A whole configuration record with a valid frame, then its commit.
    Record(u8, &'i [u8]),
    /// Bytes.
    Bytes(&'i [u8]),
}

#[derive(Arbitrary, Debug)]
struct Input<'i> {
    mode: u8,
    acts: Vec<(Act<'i>, u8)>,
}

struct Device<'m> {
    app: App<'m>,
    lines: Lines<MemoryLine, MemoryLine, MemoryLine, MemoryLine>,
    clock: SetClock,
    number: u8,
    asked: usize,
    index: u32,
    packets: Packets,
    answers: usize,
}

fn varint(mut value: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value > 0x7F {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

impl Device<'_> {
    /// A packet of any content.
    fn packet(&mut self, message: &[u8]) {
        self.number = self.number.wrapping_add(1);
        let mut plain = vec![self.number];
        plain.extend(&message[..message.len().min(ROOM)]);
        plain.extend(crate::crc32(&plain).to_le_bytes());
        let mut packet = [0; 256];
        let len = cobs::encode(&plain, &mut packet).expect("room");
        self.bytes(&packet[..len]);
    }

    fn bytes(&mut self, bytes: &[u8]) {
        self.asked += bytes.iter().filter(|&&byte| byte == 0).count();
        self.lines.command.received.extend(bytes);
        self.settle();
    }

    /// Pieces of an image (3) or a record (13), and the commit (4, 14).
    fn upload(&mut self, kinds: [u8; 2], bytes: &[u8]) {
        for (at, piece) in (0u32..).step_by(128).zip(bytes.chunks(128)) {
            let mut message = vec![kinds[0]];
            message.extend(varint(at));
            message.extend(varint(piece.len() as u32));
            message.extend(piece);
            self.packet(&message);
        }
        let mut message = vec![kinds[1]];
        message.extend(varint(bytes.len() as u32));
        self.packet(&message);
    }

    fn settle(&mut self) {
        let mut passes = 0;
        while self.app.poll(&mut self.lines, &self.clock) {
            passes += 1;
            assert!(passes < 2000, "it never rests");
        }
        if self.app.wants_to_store() {
            self.app.store(|_, _| true);
        }
        let _ = self.app.to_open();
        for byte in std::mem::take(&mut self.lines.command.sent) {
            if let Some(packet) = self.packets.push(byte) {
                decode::<Response>(packet).expect("our own packet");
                self.answers += 1;
            }
        }
        assert!(self.answers <= self.asked, "more answers than requests");
    }

    /// A frame of the sensor.
    fn frame(&mut self) {
        let sensor = &ImuFormat::Stim300.simulated()[0];
        let noise = (self.index.wrapping_mul(2_654_435_761) >> 20) as i32;
        let fields = Fields {
            index: self.index,
            time: f64::from(self.index) * 1e-3,
            gyro: [noise - 2048, 100, 7],
            accel: [5, -noise, 41_000],
            rest: sensor.rest,
        };
        let mut buffer = [0; framer::LONGEST];
        let len = (sensor.emit)(&fields, &mut buffer).expect("room");
        self.index += 1;
        self.clock.0 += 1000;
        self.lines.sensor.received.extend(&buffer[..len]);
        let bypass = self.bypasses();
        self.settle();
        let sent = std::mem::take(&mut self.lines.navigation.sent);
        if bypass && self.bypasses() {
            assert_eq!(sent, buffer[..len], "bypass changes bytes");
        }
    }

    fn bypasses(&self) -> bool {
        self.app.phase() == Phase::Run(Mode::Bypass)
    }
}

/// Whether a request was answered.
pub fn run(bytes: &[u8]) -> bool {
    let Some(input) = crate::structured::<Input>(bytes) else {
        return false;
    };
    let mut windows = WindowLearner::new();
    let mut memory = Box::new(FixMemory::ZEROED);
    let mut learner = CombinedLearner {
        references: &mut windows,
        fixes: FixLearner::new(&mut memory, Settings::MEDIUM),
    };
    let config = Config {
        format: Some(ImuFormat::Stim300),
        mode: [Mode::Bypass, Mode::Frozen, Mode::Shadow, Mode::Learn][usize::from(input.mode % 4)],
        block: 0.01,
        store: true,
        ..Config::default()
    };
    let mut device = Device {
        app: App::with_learner(config, Some(&mut learner)),
        lines: Lines::default(),
        clock: SetClock(0),
        number: 0,
        asked: 0,
        index: 0,
        packets: Packets::new(),
        answers: 0,
    };
    for (act, frames) in input.acts.iter().take(64) {
        match act {
            Act::Message(kind, content) => {
                let kind = kind % 48; // those that there are, and some more
                device.packet(&[&[kind], *content].concat());
            }
            Act::Piece(record, offset, content) => {
                let mut message = vec![if *record { 13 } else { 3 }];
                message.extend(varint(u32::from(*offset)));
                message.extend(varint(content.len() as u32));
                message.extend(*content);
                device.packet(&message);
            }
            Act::Image(values) => {
                let mut images = Vec::new();
                for half in values.chunks(12) {
                    let mut image = b"LRNN\x01\x02\x00\x00".to_vec();
                    image.extend(304u32.to_le_bytes());
                    for k in 0..72 {
                        let value = f32::from(half[k % 12] as i8) / 64.0;
                        image.extend(value.to_le_bytes());
                    }
                    image.extend(crate::crc32(&image).to_le_bytes());
                    images.extend(image);
                }
                device.upload([3, 4], &images);
            }
            Act::Record(schema, body) => {
                let body = &body[..body.len().min(500)];
                let mut record = b"LRNC".to_vec();
                record.extend([schema % 6, 0]);
                record.extend((body.len() as u16).to_le_bytes());
                record.extend(body);
                record.extend(crate::crc32(&record).to_le_bytes());
                device.upload([13, 14], &record);
            }
            Act::Bytes(bytes) => device.bytes(bytes),
        }
        for _ in 0..*frames {
            device.frame();
        }
    }
    device.answers > 0
}
