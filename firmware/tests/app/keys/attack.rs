//! Somebody who has no key: plain, changed, cut, repeated and old packets.

use super::*;

/// Without a seal nothing is changed, and everything can be read.
#[test]
fn what_changes_something_needs_the_key_and_reading_does_not() {
    let mut device = keyed(1);
    let before = state(&mut device);
    for request in changes() {
        assert!(request.changes(), "{request:?}");
        let mut buffer = [0; MAX_PACKET];
        let packet = encode(7, &request, &mut buffer).expect("a packet").to_vec();
        assert_eq!(
            refused(&mut device, &packet),
            Reason::KeyNeeded,
            "{request:?}"
        );
    }
    assert_eq!(state(&mut device), before);
    let (offset, length) = (0, 16);
    for request in [
        Request::GetVersion,
        Request::GetCounters,
        Request::GetEstimate,
        Request::GetReceiver,
        Request::GetMemory,
        Request::ReadImage { offset, length },
        Request::ReadConfiguration { offset, length },
    ] {
        assert!(!request.changes(), "{request:?}");
        device.ask(&request, |answer| {
            assert!(!matches!(answer, Response::Refused(_)), "{request:?}");
        });
    }
    // the right user does all of it, and knows by the seal that it was the device that did it
    let mut host = Host::at(&mut device, KEY);
    host.order(&mut device, &Request::SetMode(Mode::Frozen));
    assert_eq!(device.app.phase(), Phase::Run(Mode::Frozen));
    host.ask(
        &mut device,
        &Request::CommitImage { length: 3 },
        &Response::Refused(Reason::Range),
    );
    // the longest request and its seal fit
    for offset in (0..512).step_by(128) {
        let bytes = &[9; 128];
        host.order(&mut device, &Request::WriteImage { offset, bytes });
    }
    host.order(&mut device, &Request::SetMode(Mode::Bypass));
}

/// Every bit of a sealed packet, its CRC put right again, and every length.
#[test]
fn a_changed_or_cut_packet_is_refused_and_has_no_effect() {
    let mut device = keyed(2);
    let mut host = Host::at(&mut device, KEY);
    host.order(&mut device, &Request::SetMode(Mode::Frozen));
    let before = state(&mut device);
    let good = host.packet(&Request::SetMode(Mode::Shadow));
    let bits = 8 * (good.len() - 6); // without COBS, zero and CRC
    let mut reasons = Vec::new();
    for bit in 0..bits {
        let bad = forged(&good, |plain| plain[bit / 8] ^= 1 << (bit % 8));
        // some are no request at all any more
        let mut answer = raw(&mut device, &bad);
        if !answer.is_empty() {
            let opened: Opened<Response> = open(&mut answer).expect("an answer");
            match opened.message {
                Response::Refused(reason) => reasons.push(reason),
                other => panic!("bit {bit}: {other:?}"),
            }
        }
        assert_eq!(device.app.phase(), Phase::Run(Mode::Frozen), "bit {bit}");
    }
    for reason in [Reason::Session, Reason::Counter, Reason::Key] {
        assert!(reasons.contains(&reason), "{reason:?}");
    }
    for len in 0..good.len() - 6 {
        let bad = forged(&good, |plain| plain.truncate(len));
        let answer = raw(&mut device, &bad);
        let plain = len == 3; // nothing is left of the seal
        assert_eq!(!answer.is_empty(), plain, "length {len}");
        assert_eq!(device.app.phase(), Phase::Run(Mode::Frozen), "length {len}");
    }
    assert_eq!(state(&mut device), before);
    // and the right one still has its effect
    raw(&mut device, &good);
    assert_eq!(device.app.phase(), Phase::Run(Mode::Shadow));
}

/// A recorded session has no effect in itself, in another session, and after power-on.
#[test]
fn a_replayed_session_has_no_effect() {
    let mut device = keyed(3);
    let mut host = Host::at(&mut device, KEY);
    let session: Vec<Vec<u8>> = [
        Request::SetMode(Mode::Frozen),
        Request::StoreImage,
        Request::SetMode(Mode::Shadow),
        Request::SetMode(Mode::Bypass),
    ]
    .iter()
    .map(|request| host.packet(request))
    .collect();
    for packet in &session {
        assert!(!raw(&mut device, packet).is_empty());
    }
    let before = state(&mut device);
    let (last, older) = session.split_last().expect("some");
    for packet in older {
        assert_eq!(refused(&mut device, packet), Reason::Counter);
    }
    // the last one is answered, since it may be that its answer was lost
    assert!(open::<Response>(&mut raw(&mut device, last)).is_ok_and(|a| a.seal.is_some()));
    assert_eq!(state(&mut device), before);
    // in the next session
    let mut again = Host::at(&mut device, KEY);
    assert_ne!(again.challenge, host.challenge);
    again.order(&mut device, &Request::SetMode(Mode::Bypass));
    for packet in &session {
        assert_eq!(refused(&mut device, packet), Reason::Session);
    }
    assert_eq!(state(&mut device), before);
    // after power-on, with a challenge waiting
    let mut device = keyed(4);
    let fresh = challenge(&mut device);
    assert!(fresh != host.challenge && fresh != again.challenge);
    let before = state(&mut device);
    for packet in &session {
        assert_eq!(refused(&mut device, packet), Reason::Session);
    }
    assert_eq!(state(&mut device), before);
}

/// A request whose answer was lost: the same bytes again, the same answer, no second effect, also
/// when somebody has asked something else in between.
#[test]
fn a_lost_answer_is_given_again() {
    let mut device = keyed(5);
    let mut host = Host::at(&mut device, KEY);
    let mut renamed = configured(STIM);
    renamed.identity.name = "renamed".try_into().expect("short");
    renamed.correction.mode = Mode::Bypass;
    let record = firmware::configuration::record::encode(&renamed);
    for (n, bytes) in record.chunks(128).enumerate() {
        let offset = 128 * n as u32;
        host.order(&mut device, &Request::WriteConfiguration { offset, bytes });
    }
    let length = record.len() as u32;
    for request in [Request::CommitConfiguration { length }, Request::StoreImage] {
        let packet = host.packet(&request);
        let first = raw(&mut device, &packet);
        assert!(open::<Response>(&mut first.clone()).is_ok_and(|a| a.message == Response::Done));
        let stored = device.app.wants_to_store();
        device.app.store(|_, _| true);
        security(&mut device);
        assert_eq!(raw(&mut device, &packet), first);
        assert_eq!(stored, request == Request::StoreImage);
        assert!(!device.app.wants_to_store(), "a second effect");
        // the same counter with another message is not the same request
        let mut other = Host {
            counter: host.counter - 1,
            ..host.clone()
        };
        let other = other.packet(&Request::SetMode(Mode::Frozen));
        assert_eq!(refused(&mut device, &other), Reason::Counter);
    }
    // nor may one be left out
    host.counter += 1;
    let packet = host.packet(&Request::SetMode(Mode::Frozen));
    assert_eq!(refused(&mut device, &packet), Reason::Counter);
    assert_eq!(device.app.phase(), Phase::Run(Mode::Bypass));
}

/// Another key, a challenge that is too old, a session that was idle for too long.
#[test]
fn another_key_and_old_challenges_are_refused() {
    let frozen = Request::SetMode(Mode::Frozen);
    let mut device = keyed(6);
    let mut wrong = Host::at(&mut device, OTHER);
    for n in 1..=20 {
        wrong.counter = 0;
        let packet = wrong.packet(&frozen);
        assert_eq!(refused(&mut device, &packet), Reason::Key);
        assert_eq!(security(&mut device).forged, n);
    }
    // the device still offers the same challenge, and for 10 s
    let mut host = Host::at(&mut device, KEY);
    assert_eq!(host.challenge, wrong.challenge);
    device.wait_ms(10_000);
    let packet = host.packet(&frozen);
    assert_eq!(refused(&mut device, &packet), Reason::Session);
    let mut host = Host::at(&mut device, KEY);
    assert_ne!(host.challenge, wrong.challenge);
    host.order(&mut device, &frozen);
    device.wait_ms(59_000);
    host.order(&mut device, &Request::SetMode(Mode::Shadow));
    device.wait_ms(61_000);
    let packet = host.packet(&Request::SetMode(Mode::Bypass));
    assert_eq!(refused(&mut device, &packet), Reason::Session);
    assert_eq!(device.app.phase(), Phase::Run(Mode::Shadow));
    // an answer is no request, whatever its direction says
    let mut host = Host::at(&mut device, KEY);
    let sealer = Sealer {
        secret: &KEY,
        challenge: &host.challenge,
        counter: 1,
        direction: Direction::Answer,
    };
    let mut buffer = [0; MAX_PACKET];
    let packet = encode_sealed(1, &frozen, &mut buffer, Some(&sealer)).expect("a packet");
    let reflected = forged(packet, |plain| {
        let door = KEY.door(&host.challenge, 1);
        let at = plain.len() - 20;
        plain[at..at + 4].copy_from_slice(&door);
    });
    assert_eq!(refused(&mut device, &reflected), Reason::Key);
    host.order(&mut device, &frozen);
}

/// Challenges are never repeated: not in a run, not after power-on, not under another key.
#[test]
fn challenges_are_not_repeated() {
    let mut seen = std::collections::HashSet::new();
    for seed in 0..20 {
        let mut device = keyed(seed);
        assert!(security(&mut device).random);
        for _ in 0..20 {
            let given = challenge(&mut device);
            assert!(seen.insert(given.0), "seed {seed}");
            assert_eq!(challenge(&mut device), given, "until it is used or old");
            device.pass_us(10_000_001);
        }
    }
    // without random numbers the device says so
    let mut device = keyed(0);
    device.app = App::new(STIM.config());
    assert!(!security(&mut device).random);
    device.ask(&Request::GetChallenge, |answer| {
        assert_eq!(answer, Response::Refused(Reason::NoKey));
    });
    device.app.set_key(Key::Secret(OTHER));
    assert!(seen.insert(challenge(&mut device).0));
}
