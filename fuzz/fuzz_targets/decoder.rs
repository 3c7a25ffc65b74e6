//! Any bytes into the decoder. It must not panic; the bytes that it accepts must be those that its
//! message encodes to; and after a delimiter the next good frame must be received.
//!
//! The first byte of the input chooses: the rest as it is, or as the content of a frame with a
//! right CRC (a fuzzer does not guess 32 bits).
#![no_main]

use clutch_wire::{Actuate, Decoder, MAX_FRAME, Message, encode};
use libfuzzer_sys::fuzz_target;

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

fn framed(content: &[u8]) -> Vec<u8> {
    let body = [content, &CRC.checksum(content).to_le_bytes()].concat();
    let mut out = vec![0];
    for block in body.split(|byte| *byte == 0) {
        out.push(u8::try_from(block.len() + 1).unwrap_or(0xFF));
        out.extend_from_slice(block);
    }
    out.push(0);
    out
}

fuzz_target!(|data: &[u8]| {
    let Some((mode, rest)) = data.split_first() else { return };
    let stream = if mode & 1 == 0 { rest.to_vec() } else { framed(rest) };

    let mut decoder = Decoder::new();
    // The bytes since the delimiter, this one included.
    let mut frame = Vec::new();
    let mut too_long = 0;
    for byte in stream {
        frame.push(byte);
        let heard = decoder.push(byte);
        match heard {
            Some(Ok(message)) => {
                assert_eq!(encode(&message).as_bytes(), frame, "accepted from other bytes: {message:?}");
            }
            // At a delimiter, or once where the frame gets too long.
            Some(Err(error)) if byte != 0 => {
                assert_eq!(error, clutch_wire::FrameError::TooLong);
                assert_eq!(frame.len(), MAX_FRAME);
                too_long += 1;
                assert_eq!(too_long, 1, "said twice");
            }
            // An error, or silence for an empty frame or a repeated error.
            _ => assert!(byte != 0 || heard.is_some() || frame.len() == 1 || too_long == 1),
        }
        if byte == 0 {
            frame.clear();
            too_long = 0;
        }
    }

    // After any bytes.
    let _ = decoder.push(0);
    let good = Message::Actuate(Actuate { run: 1, sequence: 0, code: 0x00FF, valid_us: 2000 });
    let mut last = None;
    for &byte in encode(&good).as_bytes() {
        last = decoder.push(byte);
    }
    assert_eq!(last, Some(Ok(good)));
});
