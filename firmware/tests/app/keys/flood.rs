//! A line full of forgeries: the stream goes on and the right user gets in.

use super::*;
use firmware::wire::command::seal::Seal;

/// Bytes that the command link carries in a millisecond at 921 600 bit/s.
const LINE: usize = 92;

/// Packets of an attacker, one by one.
type Flood<'f> = &'f mut dyn FnMut(u32) -> Vec<u8>;

/// Frames at 1000 Hz, from a number on, through a device whose command link is full. Gives its
/// answers.
fn under(device: &mut Device, from: u32, milliseconds: u32, flood: Flood) -> Vec<Vec<u8>> {
    let mut line = Vec::new();
    let mut made = 0;
    for ms in 0..milliseconds {
        while line.len() < LINE {
            line.extend(flood(made));
            made += 1;
        }
        device.lines.command.input.extend(line.drain(..LINE));
        let frame = STIM.stream(from + ms, from + ms + 1).concat();
        device.lines.sensor.input.extend(frame);
        device.wait_ms(1);
    }
    let answers = core::mem::take(&mut device.lines.command.sent);
    // the packet that was cut off
    raw(device, &[0]);
    answers
}

/// A sealed packet with any seal.
fn with(seal: Seal, n: u32) -> Vec<u8> {
    let mut buffer = [0; MAX_PACKET];
    let packet = encode(n as u8, &Request::SetMode(Mode::Frozen), &mut buffer).expect("a packet");
    forged(packet, |plain| {
        plain.extend(seal.session);
        plain.extend(seal.counter.to_le_bytes());
        plain.extend(seal.door);
        plain.extend(seal.tag);
    })
}

/// Packets of an attacker who hears everything and has no key.
fn forgery(session: [u8; 4], counter: u32, door: Option<[u8; 4]>) -> impl FnMut(u32) -> Vec<u8> {
    move |n| {
        let mut tag = [0x55; 16];
        tag[..4].copy_from_slice(&n.to_le_bytes());
        let seal = Seal {
            session,
            counter,
            door: door.unwrap_or(n.wrapping_mul(2_654_435_761).to_le_bytes()),
            tag,
        };
        with(seal, n)
    }
}

#[test]
fn the_stream_goes_on_and_the_right_user_gets_in_at_once() {
    let frozen = Request::SetMode(Mode::Frozen);
    let plain = |request: &Request| {
        let mut buffer = [0; MAX_PACKET];
        encode(1, request, &mut buffer).expect("a packet").to_vec()
    };
    let order = plain(&frozen);
    let ask = plain(&Request::GetChallenge);
    let mut device = keyed(10);
    let mut from = 10;
    for kind in 0..4 {
        let next = challenge(&mut device).session();
        let flood: Flood = match kind {
            0 => &mut |_| order.clone(),
            1 => &mut |_| ask.clone(),
            2 => &mut forgery(next, 1, None),
            _ => &mut forgery([1, 2, 3, 4], 1, None),
        };
        device.lines.navigation.sent.clear();
        under(&mut device, from, 3000, flood);
        let passed = &device.lines.navigation.sent;
        assert!(*passed == STIM.stream(from, from + 3000), "the stream");
        from += 3000;
        assert_eq!(device.app.phase(), Phase::Run(Mode::Bypass));
        // the challenge, and the first sealed request
        let mut host = Host::at(&mut device, KEY);
        host.order(&mut device, &Request::SetMode(Mode::Bypass));
    }
    assert!(security(&mut device).forged > 1000);
}

/// An attacker who intercepted a request that never arrived has a valid door, and uses up the tries
/// of the session. A new session is not affected.
#[test]
fn who_has_heard_a_door_ends_a_session_at_most() {
    let mut device = keyed(11);
    let mut host = Host::at(&mut device, KEY);
    host.order(&mut device, &Request::SetMode(Mode::Bypass));
    let lost = host.packet(&Request::SetMode(Mode::Shadow));
    let door = KEY.door(&host.challenge, host.counter);
    let mut flood = forgery(host.challenge.session(), host.counter, Some(door));
    let answers = under(&mut device, 10, 2000, &mut flood);
    let mut tried = 0;
    let mut waits = 0;
    for mut answer in answers {
        match open::<Response>(&mut answer).expect("an answer").message {
            Response::Refused(Reason::Key) => tried += 1,
            Response::Refused(Reason::Wait(ms)) => {
                assert!((1..=250).contains(&ms));
                waits += 1;
            }
            other => panic!("{other:?}"),
        }
    }
    // 8 at once, then four a second
    assert!(
        (15..=17).contains(&tried) && waits > 1000,
        "{tried} {waits}"
    );
    assert_eq!(device.app.phase(), Phase::Run(Mode::Bypass));
    // the right user is asked to wait, begins another session, and gets in
    let Reason::Wait(_) = refused(&mut device, &lost) else {
        panic!("there were tries left");
    };
    let mut host = Host::at(&mut device, KEY);
    host.order(&mut device, &Request::SetMode(Mode::Frozen));
    assert_eq!(device.app.phase(), Phase::Run(Mode::Frozen));
}

/// While forgeries come without pause, between two of them.
#[test]
fn the_right_user_gets_in_between_two_forgeries() {
    let mut device = keyed(12);
    let session = challenge(&mut device).session();
    let mut flood = forgery(session, 1, None);
    under(&mut device, 10, 1000, &mut flood);
    let mut host = Host {
        key: KEY,
        challenge: challenge(&mut device),
        counter: 0,
        number: 0,
    };
    let packet = host.packet(&Request::SetMode(Mode::Frozen));
    let before: Vec<u8> = (0..20).flat_map(&mut flood).collect();
    let after: Vec<u8> = (0..20).flat_map(&mut flood).collect();
    raw(&mut device, &[before, packet, after].concat());
    assert_eq!(device.app.phase(), Phase::Run(Mode::Frozen));
}
