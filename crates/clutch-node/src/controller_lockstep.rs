//! Lockstep: an emulated controller gets its time and its bytes in one piece, and answers in one.
//!
//! ```text
//! request = now_ns u64 · lateness_us u32 · host u16 · daq u16 · bytes of both
//! answer  = poll_at_ns u64 (all ones: none) · 0 u32 · host u16 · daq u16 · bytes of both
//! ```
//!
//! All little-endian. The sender of a request decides the time until the next, so that a run is
//! the same however fast the machine is.

use crate::board_controller::BoardController;
use crate::outbox::Outbox;
use clutch_core::Micros;
use clutch_wire::Decoder;

/// Bytes before those that are carried.
pub const HEAD: usize = 16;
/// The longest request or answer.
pub const LONGEST: usize = HEAD + 2 * 1024;

/// A request or an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exchange<'a> {
    /// In a request: current time, ns. In an answer: latest time for the next request, ns.
    pub time_ns: u64,
    /// In a request: time that the answer before took until it was on its way, µs.
    pub lateness_us: u32,
    /// From or to the host.
    pub host: &'a [u8],
    /// From or to encoder and converter.
    pub daq: &'a [u8],
}

impl<'a> Exchange<'a> {
    /// Writes it; its length, or nothing if it is longer than the buffer.
    pub fn write(&self, buffer: &mut [u8]) -> Option<usize> {
        let (host, daq) = (u16::try_from(self.host.len()).ok()?, u16::try_from(self.daq.len()).ok()?);
        let length = HEAD.checked_add(self.host.len())?.checked_add(self.daq.len())?;
        let head = self.time_ns.to_le_bytes().into_iter().chain(self.lateness_us.to_le_bytes());
        let head = head.chain(host.to_le_bytes()).chain(daq.to_le_bytes());
        let bytes = head.chain(self.host.iter().copied()).chain(self.daq.iter().copied());
        buffer.get_mut(..length)?.iter_mut().zip(bytes).for_each(|(to, from)| *to = from);
        Some(length)
    }

    /// The length of the one that begins so; nothing before its head is there.
    #[must_use]
    pub fn length(buffer: &[u8]) -> Option<usize> {
        let (host, daq) = Self::lengths(buffer)?;
        HEAD.checked_add(host)?.checked_add(daq)
    }

    fn lengths(buffer: &[u8]) -> Option<(usize, usize)> {
        let (_, lengths) = buffer.first_chunk::<HEAD>()?.split_last_chunk::<4>()?;
        let [a, b, c, d] = *lengths;
        Some((u16::from_le_bytes([a, b]).into(), u16::from_le_bytes([c, d]).into()))
    }

    /// Reads one; nothing before it is whole.
    #[must_use]
    pub fn read(buffer: &'a [u8]) -> Option<Exchange<'a>> {
        let (host, daq) = Self::lengths(buffer)?;
        let (time, rest) = buffer.split_first_chunk::<8>()?;
        let (lateness, _) = rest.split_first_chunk::<4>()?;
        let carried = buffer.get(HEAD..)?;
        let (host, rest) = carried.split_at_checked(host)?;
        Some(Exchange {
            time_ns: u64::from_le_bytes(*time),
            lateness_us: u32::from_le_bytes(*lateness),
            host,
            daq: rest.get(..daq)?,
        })
    }
}

/// The lines of a controller that has two.
#[derive(Clone, Debug, Default)]
pub struct Lines {
    /// Frames on their way to the host.
    pub host: Outbox,
    /// Frames on their way to encoder and converter.
    pub daq: Outbox,
    /// Reads the frames of encoder and converter.
    pub from_daq: Decoder,
}

/// A controller's answer: what has arrived goes in, what is due comes out.
pub fn answer<'p>(node: &mut BoardController, request: &Exchange<'_>, lines: &'p mut Lines) -> Exchange<'p> {
    let Lines { host, daq, from_daq } = lines;
    host.clear();
    daq.clear();
    if request.lateness_us > 0 {
        node.answered(Micros(request.lateness_us));
    }
    node.host(request.time_ns, request.host, host, daq);
    if !request.daq.is_empty() {
        node.daq(request.time_ns, from_daq, request.daq, host, daq);
    }
    node.poll(request.time_ns, host, daq);
    Exchange {
        time_ns: node.poll_at().unwrap_or(u64::MAX),
        lateness_us: 0,
        host: host.as_bytes(),
        daq: daq.as_bytes(),
    }
}
