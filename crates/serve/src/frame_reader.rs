//! Takes WebSocket frames apart byte by byte.
//!
//! ```text
//!   FIN RSV opcode | MASK length | extended length | mask key | payload ...      RFC 6455, section 5.2
//!   `------------------ FrameHeader ------------------------' `--- passed on as it arrives
//! ```
//!
//! Whether a frame is text, binary, the first or a later fragment makes no difference to its
//! payload: some senders begin a message with each realtime byte and never end it.

use std::fmt;
use std::io::Cursor;
use tungstenite::protocol::frame::coding::{self, OpCode};
use tungstenite::protocol::frame::FrameHeader;

/// The longest payload of a control frame, bytes (RFC 6455, section 5.5).
const CONTROL_PAYLOAD: u64 = 125;

/// A control frame.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum Control {
    /// A ping, to be answered with the same payload.
    Ping(Vec<u8>),
    /// A pong; the server never asks for one.
    Pong,
    /// The client wants to close the connection.
    Close,
}

/// A client's breach of the protocol; the connection is to be closed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum FrameError {
    /// An opcode or length that RFC 6455 does not know, or bits reserved for extensions.
    Header,
    /// A frame without a mask: clients have to mask all frames (section 5.1).
    Unmasked,
    /// A control frame that is too long or fragmented.
    Control,
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Header => "a frame header that cannot be",
            Self::Unmasked => "a frame that is not masked",
            Self::Control => "a control frame that is too long or in pieces",
        })
    }
}

impl std::error::Error for FrameError {}

/// The reader's place within a frame.
enum Place {
    /// In the header; holds the header's bytes so far.
    Header(Vec<u8>),
    /// In the payload.
    Payload {
        kind: Kind,
        left: u64,
        mask: [u8; 4],
        /// Bytes of payload read, modulo 4.
        turn: usize,
    },
}

/// The kind of frame that the payload belongs to.
enum Kind {
    Data,
    Ping(Vec<u8>),
    Pong,
    Close,
}

/// Reads frames that arrive in pieces of any size.
pub(super) struct FrameReader(Place);

impl FrameReader {
    /// Makes a reader that waits for the first frame.
    pub(super) fn new() -> Self {
        Self(Place::Header(Vec::new()))
    }

    /// Reads `bytes`. Appends the payload of data frames to `payload` and hands control frames to
    /// `control`.
    ///
    /// # Errors
    /// [`FrameError`] if the client breaks the protocol. Everything before the breach has been
    /// handed out.
    pub(super) fn read(
        &mut self,
        bytes: &[u8],
        payload: &mut Vec<u8>,
        mut control: impl FnMut(Control),
    ) -> Result<(), FrameError> {
        for byte in bytes {
            match &mut self.0 {
                Place::Header(header) => {
                    header.push(*byte);
                    if let Some(begun) = begin(header)? {
                        self.0 = begun;
                    }
                }
                Place::Payload {
                    kind,
                    left,
                    mask,
                    turn,
                } => {
                    kind.take(byte ^ mask[*turn], payload);
                    *turn = (*turn + 1) % 4;
                    *left -= 1;
                }
            }
            self.end_of_frame(&mut control);
        }
        Ok(())
    }

    fn end_of_frame(&mut self, control: &mut impl FnMut(Control)) {
        if !matches!(self.0, Place::Payload { left: 0, .. }) {
            return;
        }
        let ended = std::mem::replace(&mut self.0, Place::Header(Vec::new()));
        if let Place::Payload { kind, .. } = ended {
            match kind {
                Kind::Data => {}
                Kind::Ping(payload) => control(Control::Ping(payload)),
                Kind::Pong => control(Control::Pong),
                Kind::Close => control(Control::Close),
            }
        }
    }
}

impl Kind {
    fn take(&mut self, byte: u8, payload: &mut Vec<u8>) {
        match self {
            Self::Data => payload.push(byte),
            Self::Ping(ping) => ping.push(byte),
            Self::Pong | Self::Close => {}
        }
    }
}

/// The reader's place after a complete header; `None` while the header is incomplete.
fn begin(header: &[u8]) -> Result<Option<Place>, FrameError> {
    let parsed = FrameHeader::parse(&mut Cursor::new(header)).map_err(|_| FrameError::Header)?;
    let Some((header, left)) = parsed else {
        return Ok(None);
    };
    if header.rsv1 || header.rsv2 || header.rsv3 {
        return Err(FrameError::Header);
    }
    let kind = kind_of(header.opcode)?;
    if !matches!(kind, Kind::Data) && (left > CONTROL_PAYLOAD || !header.is_final) {
        return Err(FrameError::Control);
    }
    let mask = header.mask.ok_or(FrameError::Unmasked)?;
    Ok(Some(Place::Payload {
        kind,
        left,
        mask,
        turn: 0,
    }))
}

fn kind_of(opcode: OpCode) -> Result<Kind, FrameError> {
    match opcode {
        OpCode::Data(coding::Data::Continue | coding::Data::Text | coding::Data::Binary) => {
            Ok(Kind::Data)
        }
        OpCode::Control(coding::Control::Ping) => Ok(Kind::Ping(Vec::new())),
        OpCode::Control(coding::Control::Pong) => Ok(Kind::Pong),
        OpCode::Control(coding::Control::Close) => Ok(Kind::Close),
        OpCode::Data(coding::Data::Reserved(_)) | OpCode::Control(coding::Control::Reserved(_)) => {
            Err(FrameError::Header)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tungstenite::protocol::frame::coding::Data;

    /// A frame as a client sends it.
    fn frame(opcode: OpCode, is_final: bool, payload: &[u8]) -> Vec<u8> {
        let mask = [0x12, 0x34, 0x56, 0x78];
        let header = FrameHeader {
            is_final,
            opcode,
            mask: Some(mask),
            ..FrameHeader::default()
        };
        let mut bytes = Vec::new();
        header.format(payload.len() as u64, &mut bytes).unwrap();
        bytes.extend(
            payload
                .iter()
                .zip(mask.iter().cycle())
                .map(|(byte, key)| byte ^ key),
        );
        bytes
    }

    fn read(pieces: &[&[u8]]) -> (Vec<u8>, Vec<Control>, Result<(), FrameError>) {
        let mut reader = FrameReader::new();
        let (mut payload, mut controls) = (Vec::new(), Vec::new());
        for piece in pieces {
            let result = reader.read(piece, &mut payload, |control| controls.push(control));
            if result.is_err() {
                return (payload, controls, result);
            }
        }
        (payload, controls, Ok(()))
    }

    #[test]
    fn text_binary_and_fragments_without_end_are_all_payload() {
        let mut bytes = frame(OpCode::Data(Data::Text), true, b"G0X1\n");
        bytes.extend(frame(OpCode::Data(Data::Binary), false, b"?"));
        bytes.extend(frame(OpCode::Data(Data::Binary), false, &[0x85]));
        bytes.extend(frame(OpCode::Data(Data::Continue), true, b"!"));
        let (payload, controls, result) = read(&[&bytes]);
        assert_eq!(payload, b"G0X1\n?\x85!");
        assert_eq!((controls, result), (vec![], Ok(())));
    }

    #[test]
    fn bytes_are_passed_on_before_their_frame_has_ended() {
        let bytes = frame(OpCode::Data(Data::Text), true, b"?G4P1\n");
        let (payload, ..) = read(&[&bytes[..7]]);
        assert_eq!(payload, b"?");
    }

    #[test]
    fn cuts_anywhere_make_no_difference() {
        let mut bytes = frame(OpCode::Data(Data::Text), true, &[b'x'; 300]);
        bytes.extend(frame(OpCode::Control(coding::Control::Ping), true, b"hi"));
        bytes.extend(frame(OpCode::Data(Data::Binary), true, &vec![b'y'; 70_000]));
        bytes.extend(frame(OpCode::Data(Data::Text), true, b""));
        bytes.extend(frame(OpCode::Data(Data::Text), true, b"z"));
        let whole = read(&[&bytes]);
        assert_eq!(whole.0.len(), 70_301);
        assert_eq!(whole.1, [Control::Ping(b"hi".to_vec())]);
        let single: Vec<&[u8]> = bytes.chunks(1).collect();
        assert_eq!(read(&single), whole);
        for cut in 0..bytes.len().min(400) {
            assert_eq!(read(&[&bytes[..cut], &bytes[cut..]]), whole);
        }
    }

    #[test]
    fn a_ping_between_the_bytes_of_a_message_leaves_it_whole() {
        let mut bytes = frame(OpCode::Data(Data::Text), false, b"G0");
        bytes.extend(frame(OpCode::Control(coding::Control::Ping), true, b""));
        bytes.extend(frame(OpCode::Data(Data::Continue), true, b"X1\n"));
        let (payload, controls, _) = read(&[&bytes]);
        assert_eq!(
            (payload, controls),
            (b"G0X1\n".to_vec(), vec![Control::Ping(vec![])])
        );
    }

    #[test]
    fn what_no_client_may_send_is_an_error_after_what_came_before() {
        let bad: [(&[u8], FrameError); 5] = [
            (&[0x81, 0x01, b'x'], FrameError::Unmasked),
            (&[0xC1, 0x80, 0, 0, 0, 0], FrameError::Header),
            (&[0x83, 0x80, 0, 0, 0, 0], FrameError::Header),
            (&[0x09, 0x80, 0, 0, 0, 0], FrameError::Control),
            (&[0x89, 0xFE, 0, 126, 0, 0, 0, 0], FrameError::Control),
        ];
        for (bytes, error) in bad {
            let mut all = frame(OpCode::Data(Data::Text), true, b"$$\n");
            all.extend_from_slice(bytes);
            assert_eq!(read(&[&all]), (b"$$\n".to_vec(), vec![], Err(error)));
        }
    }
}
