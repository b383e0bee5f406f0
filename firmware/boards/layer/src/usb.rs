//! The command link over USB: a serial line (CDC ACM). Its bit rate means nothing.

use embassy_futures::join::join3;
use embassy_usb::class::cdc_acm::{CdcAcmClass, State};
use embassy_usb::driver::{Driver, EndpointError};
use embassy_usb::{Builder, Config};
use static_cell::StaticCell;

use crate::bytes;
use crate::through::{Through, ThroughLine};

/// Bytes of a packet at full speed.
const PACKET: u16 = 64;
/// pid.codes' number for tests: a product has one of its own.
const NUMBERS: (u16, u16) = (0x1209, 0x0001);

static LINE: Through = Through::new();

/// The line, and the task that serves it. Called once.
pub fn open<D: Driver<'static> + 'static>(driver: D) -> (ThroughLine, impl Future<Output = ()>) {
    (LINE.line(), serve(driver))
}

async fn serve<D: Driver<'static> + 'static>(driver: D) {
    static STATE: StaticCell<State> = StaticCell::new();
    let mut config = Config::new(NUMBERS.0, NUMBERS.1);
    config.product = Some("LRNN co-processor");
    config.max_packet_size_0 = 64;
    let mut builder = Builder::new(
        driver,
        config,
        bytes!(256),
        bytes!(256),
        bytes!(0),
        bytes!(64),
    );
    let class = CdcAcmClass::new(&mut builder, STATE.init(State::new()), PACKET);
    let (mut to_host, mut from_host) = class.split();
    let mut device = builder.build();
    let come = async {
        let mut packet = [0; PACKET as usize];
        loop {
            from_host.wait_connection().await;
            loop {
                match from_host.read_packet(&mut packet).await {
                    Ok(len) => {
                        let came = packet.iter().take(len);
                        came.for_each(|byte| LINE.came(*byte));
                    }
                    Err(EndpointError::BufferOverflow) => LINE.lost(),
                    Err(EndpointError::Disabled) => break,
                }
            }
        }
    };
    let leave = async {
        let mut packet = [0; PACKET as usize];
        loop {
            // less than a whole packet, so that none of length 0 must follow
            let len = LINE.next(&mut packet[..PACKET as usize - 1]).await;
            // without a host it is dropped, as on a line that nobody reads
            let _ = to_host.write_packet(&packet[..len]).await;
        }
    };
    join3(device.run(), come, leave).await;
}
