//! Messages that gather, and leave in one transfer.

use core::mem::transmute;
use core::sync::atomic::{Ordering, compiler_fence};

use embassy_stm32::dma::{Channel, Request, Transfer, TransferOptions};
use firmware::link::Full;

/// The two buffers of a line and the transfer that sends one of them.
pub struct Outgoing {
    pub channel: Channel<'static>,
    pub request: Request,
    pub data: *mut u8,
    pub gathers: &'static mut [u8],
    pub gathered: usize,
    pub leaves: &'static mut [u8],
    pub transfer: Option<Transfer<'static>>,
}

impl Outgoing {
    /// The whole message, or nothing of it.
    #[inline(never)] // many callers
    pub fn gather(&mut self, message: &[u8]) -> Result<(), Full> {
        let room = self.gathers.get_mut(self.gathered..);
        let room = room.and_then(|room| room.get_mut(..message.len()));
        copy(room.ok_or(Full)?, message);
        self.gathered += message.len();
        Ok(())
    }

    /// What has gathered begins to leave, unless there is something that still leaves.
    #[allow(unsafe_code, reason = "the driver's streams take addresses")]
    pub fn advance(&mut self) {
        if self.transfer.as_mut().is_some_and(Transfer::is_running) {
            return;
        }
        self.transfer = None;
        if self.gathered == 0 {
            return;
        }
        core::mem::swap(&mut self.gathers, &mut self.leaves);
        let bytes = self.leaves.get(..self.gathered).unwrap_or_default();
        self.gathered = 0;
        let options = TransferOptions::default();
        // SAFETY: the stream is this line's alone, and moves bytes to its data register. `leaves`
        // exists for ever, and is not written to before the transfer has ended.
        let transfer = unsafe { self.channel.write(self.request, bytes, self.data, options) };
        // SAFETY: a transfer knows its channel by number. The channel is used for another one only
        // when this one is dropped.
        self.transfer = Some(unsafe { transmute::<Transfer<'_>, Transfer<'static>>(transfer) });
    }
}

/// Copies by words, wherever they begin, which these cores can. The compiler's own `memcpy` takes
/// 190 to 216 instructions for a frame whose words begin elsewhere than its destination's. The
/// fence keeps the loop from becoming that again, and costs nothing.
fn copy(to: &mut [u8], from: &[u8]) {
    let (to, end) = to.as_chunks_mut::<4>();
    let (from, rest) = from.as_chunks::<4>();
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
        compiler_fence(Ordering::SeqCst);
    }
    for (to, from) in end.iter_mut().zip(rest) {
        *to = *from;
    }
}
