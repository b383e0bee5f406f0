//! Requests that are sealed with the device's key, and those who try to get round it.

mod attack;
mod flood;
mod golden;
mod provisioned;
mod wear;

use crate::device::Device;
use crate::frames::Kind;
use crate::health::START;
use crate::record::{HARDWARE, configured};
use firmware::app::{App, Config, Hardware, Phase};
use firmware::control::recording::Order;
use firmware::control::{Alignment, Mode, Reason, Window};
use firmware::fix::Heading;
use firmware::wire::cobs;
use firmware::wire::command::key::{Challenge, Direction, Key, Secret};
use firmware::wire::command::seal::{Opened, Sealer, encode_sealed, open};
use firmware::wire::command::{MAX_PACKET, Provision, Request, Reset, Response, Security, encode};

const STIM: Kind = Kind::STIM;
const KEY: Secret = secret(0x20);
const OTHER: Secret = secret(0x80);

/// 32 bytes that count from `first`.
const fn secret(first: u8) -> Secret {
    let mut bytes = [0; 32];
    let mut at = 0;
    while at < 32 {
        bytes[at] = first + at as u8;
        at += 1;
    }
    Secret(bytes)
}

/// The right user's end of the link, or somebody who has another key.
#[derive(Debug, Clone)]
struct Host {
    key: Secret,
    challenge: Challenge,
    counter: u32,
    number: u8,
}

impl Host {
    /// Asks for a challenge.
    fn at(device: &mut Device, key: Secret) -> Host {
        Host {
            key,
            challenge: challenge(device),
            counter: 0,
            number: 100,
        }
    }

    /// The next sealed packet.
    fn packet(&mut self, request: &Request) -> Vec<u8> {
        self.counter += 1;
        self.number = self.number.wrapping_add(1);
        let sealer = Sealer {
            secret: &self.key,
            challenge: &self.challenge,
            counter: self.counter,
            direction: Direction::Request,
        };
        let mut buffer = [0; MAX_PACKET];
        encode_sealed(self.number, request, &mut buffer, Some(&sealer))
            .expect("a packet")
            .to_vec()
    }

    /// Sends a request and expects this answer under a good seal.
    fn ask(&mut self, device: &mut Device, request: &Request, expected: &Response) {
        let packet = self.packet(request);
        let mut answer = raw(device, &packet);
        let opened: Opened<Response> = open(&mut answer).expect("an answer");
        assert_eq!((opened.number, &opened.message), (self.number, expected));
        let seal = opened.seal.expect("a sealed answer");
        assert_eq!(
            (seal.session, seal.counter),
            (self.challenge.session(), self.counter)
        );
        let (of, by) = (Direction::Answer, &self.challenge);
        assert_eq!(self.key.tag(of, by, self.counter, opened.coded), seal.tag);
    }

    fn order(&mut self, device: &mut Device, request: &Request) {
        self.ask(device, request, &Response::Done);
    }
}

/// Sends bytes on the command link and gives what comes back within 50 ms.
fn raw(device: &mut Device, bytes: &[u8]) -> Vec<u8> {
    device.lines.command.sent.clear();
    device.lines.command.input.extend(bytes);
    device.wait_ms(50);
    core::mem::take(&mut device.lines.command.sent).concat()
}

/// The plain refusal that comes back for a packet.
fn refused(device: &mut Device, packet: &[u8]) -> Reason {
    let mut answer = raw(device, packet);
    let opened: Opened<Response> = open(&mut answer).expect("an answer");
    assert!(opened.seal.is_none());
    match opened.message {
        Response::Refused(reason) => reason,
        other => panic!("{other:?}"),
    }
}

fn challenge(device: &mut Device) -> Challenge {
    device.ask(&Request::GetChallenge, |answer| match answer {
        Response::Challenge(challenge) => challenge,
        other => panic!("{other:?}"),
    })
}

fn security(device: &mut Device) -> Security {
    device.ask(&Request::GetSecurity, |answer| match answer {
        Response::Security(security) => security,
        other => panic!("{other:?}"),
    })
}

/// A device that is configured, stands in bypass, can store, and has a key.
fn keyed(seed: u8) -> Device {
    keyed_at(HARDWARE, seed)
}

fn keyed_at(hardware: Hardware, seed: u8) -> Device {
    let mut device = Device::new(Config::default());
    let mut unit = configured(STIM);
    unit.correction.mode = Mode::Bypass;
    device.app = App::new(Config {
        store: true,
        hardware,
        ..Config::of(&unit)
    });
    device.app.set_key(Key::Secret(KEY));
    device.app.seed([seed; 32]);
    device.feed(&STIM.stream(0, 10).concat());
    assert_eq!(device.app.phase(), Phase::Run(Mode::Bypass));
    device
}

/// A packet as it is between COBS and CRC, changed by `change`, with a right CRC.
fn forged(packet: &[u8], change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut plain = packet[..packet.len() - 1].to_vec();
    let len = cobs::decode_in_place(&mut plain).expect("our own packet");
    plain.truncate(len - 4);
    change(&mut plain);
    let crc = firmware::wire::checksum::crc32_zlib(&plain);
    plain.extend(crc.to_le_bytes());
    let mut out = vec![0; plain.len() + 8];
    let len = cobs::encode(&plain, &mut out).expect("room");
    out.truncate(len);
    out
}

/// One of each request that changes something.
fn changes() -> Vec<Request<'static>> {
    let window = Window {
        first: 0,
        last: 1,
        angle: [0.0; 3],
        velocity: [0.0; 3],
        angle_sigma: 1.0,
        velocity_sigma: 1.0,
    };
    let (angle, sigma) = (0.0, 0.1);
    vec![
        Request::SetMode(Mode::Frozen),
        Request::WriteImage {
            offset: 0,
            bytes: &[1; 128],
        },
        Request::CommitImage { length: 608 },
        Request::Reference(window),
        Request::Alignment(Alignment::Started),
        Request::StoreImage,
        Request::CommitLearnt,
        Request::WriteConfiguration {
            offset: 0,
            bytes: &[2],
        },
        Request::CommitConfiguration { length: 1 },
        Request::Heading(Heading { angle, sigma }),
        Request::Record(Order::Hold),
        Request::Record(Order::Release),
        Request::Provision(Provision::OpenByChoice),
        Request::Provision(Provision::Secret(OTHER)),
    ]
}

/// State that an attacker wants to change.
fn state(device: &mut Device) -> String {
    let mode = device.ask(&Request::GetHealth, |answer| match answer {
        Response::Health(health) => health.mode,
        other => panic!("{other:?}"),
    });
    let board = device.ask(&Request::GetBoard, |answer| format!("{answer:?}"));
    let protection = security(device).protection;
    let stores = device.app.wants_to_store();
    let key = *device.app.key() == Key::Secret(KEY);
    let none = device.app.nets().same_images(&firmware::model::Nets::NONE);
    format!("{mode:?} {board} {protection:?} {stores} {key} {none}")
}
