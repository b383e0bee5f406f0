//! Streams of zstd: any number of frames, some of which are to be skipped (RFC 8878, section 3).

use ruzstd::decoding::errors::{FrameDecoderError, ReadFrameHeaderError};
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};
use std::io::{self, BufRead, BufReader, Read};

/// Whether a file begins with a frame, or with one to be skipped.
pub(super) fn is_zstd(start: &[u8]) -> bool {
    matches!(
        start,
        [0x28, 0xB5, 0x2F, 0xFD, ..] | [0x50..=0x5F, 0x2A, 0x4D, 0x18, ..]
    )
}

/// The content of all frames of a stream, one after another.
pub(super) struct Frames<R> {
    bytes: BufReader<R>,
    /// Of the present frame; finished before the first one.
    decoder: FrameDecoder,
}

impl<R: Read> Frames<R> {
    pub(super) fn new(bytes: R) -> Self {
        Self {
            bytes: BufReader::new(bytes),
            decoder: FrameDecoder::new(),
        }
    }

    /// Begins the next frame. `false`: the stream has ended.
    fn next(&mut self) -> io::Result<bool> {
        let sums = (
            self.decoder.get_checksum_from_data(),
            self.decoder.get_calculated_checksum(),
        );
        if let (Some(stored), Some(computed)) = sums
            && stored != computed
        {
            return Err(io::Error::other("the checksum of a frame is wrong"));
        }
        if self.bytes.fill_buf()?.is_empty() {
            return Ok(false);
        }
        match self.decoder.init(&mut self.bytes) {
            Ok(()) => {}
            Err(FrameDecoderError::ReadFrameHeaderError(ReadFrameHeaderError::SkipFrame {
                length,
                ..
            })) => {
                let mut skipped = Read::by_ref(&mut self.bytes).take(length.into());
                io::copy(&mut skipped, &mut io::sink())?;
            }
            Err(fault) => return Err(io::Error::other(fault)),
        }
        Ok(true)
    }
}

impl<R: Read> Read for Frames<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.decoder.can_collect() == 0 && !buffer.is_empty() {
            if self.decoder.is_finished() {
                if !self.next()? {
                    return Ok(0);
                }
            } else {
                let one = BlockDecodingStrategy::UptoBlocks(1);
                let decoded = self.decoder.decode_blocks(&mut self.bytes, one);
                decoded.map_err(io::Error::other)?;
            }
        }
        self.decoder.read(buffer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ruzstd::encoding::{CompressionLevel, compress_to_vec};

    fn read(bytes: &[u8]) -> io::Result<Vec<u8>> {
        let mut out = Vec::new();
        Frames::new(bytes).read_to_end(&mut out).map(|_| out)
    }

    /// As `cat a.zst b.zst`, or from a recorder that writes a frame now and then.
    #[test]
    fn all_frames_are_read_and_those_to_be_skipped_are_not() {
        let frame = |text: &[u8]| compress_to_vec(text, CompressionLevel::Fastest);
        let long: Vec<u8> = (0..400_000u32)
            .map(|k| (k.wrapping_mul(k) >> 7) as u8)
            .collect();
        let skipped = [&[0x53, 0x2A, 0x4D, 0x18, 3, 0, 0, 0][..], b"abc"].concat();
        let two = [frame(b"t,x\n1,2\n"), frame(&long)].concat();
        let whole = [b"t,x\n1,2\n", &long[..]].concat();
        assert_eq!(read(&two).unwrap(), whole);
        let all = [&skipped[..], &two, &skipped].concat();
        assert!(is_zstd(&all) && is_zstd(&two));
        assert_eq!(read(&all).unwrap(), whole);
        assert_eq!(read(&[]).unwrap(), b"");
        for cut in [5, two.len() / 2, two.len() - 1] {
            assert!(read(&two[..cut]).is_err(), "{cut}");
        }
        let mut damaged = two.clone();
        let half = damaged.len() / 2;
        damaged[half] ^= 0x10;
        assert!(read(&damaged).map_or(true, |out| out != whole));
        assert!(read(&[&two[..], b"rest"].concat()).is_err());
    }
}
