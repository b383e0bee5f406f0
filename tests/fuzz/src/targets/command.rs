//! Any bytes on the command link: what decodes as a request encodes to a packet that decodes to the
//! same request.

use firmware::wire::command::{MAX_PACKET, Packets, Request, Response, decode, encode};
use firmware::wire::stim300::request::Requests;
use firmware::wire::{checksum, cobs};

/// Whether a message could be decoded.
pub fn run(input: &[u8]) -> bool {
    let mut packets = Packets::new();
    let mut requests = Requests::default();
    for &byte in input {
        requests.push(byte);
        if let Some(packet) = packets.push(byte) {
            let _ = decode::<Response>(&mut packet.to_vec());
            let _ = decode::<Request>(packet);
        }
    }
    // with a right CRC, which a fuzzer does not find
    let mut plain = input.to_vec();
    plain.extend(checksum::crc32_zlib(input).to_le_bytes());
    let mut packet = vec![0; plain.len() + plain.len() / 254 + 2];
    let len = cobs::encode(&plain, &mut packet).expect("room");
    let mut copy = packet[..len].to_vec();
    let decoded = decode::<Request>(&mut copy);
    if let Ok((number, request)) = &decoded {
        let mut again = [0; MAX_PACKET];
        let Ok(again) = encode(*number, request, &mut again) else {
            assert!(input.len() > MAX_PACKET - 6); // a chunk longer than we would ever send
            return true;
        };
        let (n, same) = decode::<Request>(again).expect("our own packet");
        assert_eq!(n, *number);
        assert_eq!(format!("{same:?}"), format!("{request:?}")); // NaN is not equal to itself
    }
    decode::<Response>(&mut packet[..len]).is_ok() | decoded.is_ok()
}
