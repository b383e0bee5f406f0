//! A flood of requests.

use crate::device::Device;
use firmware::app::Config;
use firmware::wire::command::{MAX_PACKET, Packets, Request, encode};

/// However many requests have come, no pass carries out two.
#[test]
fn a_pass_carries_out_one_request() {
    let mut device = Device::new(Config::default());
    let mut buffer = [0; MAX_PACKET];
    for number in 0..50 {
        let packet = encode(number, &Request::GetHealth, &mut buffer).expect("a packet");
        device.lines.command.input.extend(&*packet);
    }
    let mut answers = 0;
    for _ in 0..1000 {
        device.app.poll(&mut device.lines, &device.time);
        let mut packets = Packets::new();
        let sent = std::mem::take(&mut device.lines.command.sent).concat();
        let n = sent
            .iter()
            .filter(|byte| packets.push(**byte).is_some())
            .count();
        assert!(n <= 1, "{n} in a pass");
        answers += n;
    }
    assert_eq!(answers, 50);
}
