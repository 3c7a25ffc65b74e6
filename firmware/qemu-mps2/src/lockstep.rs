//! Lockstep over two files: each request brings the time and the bytes that have arrived, each
//! answer takes back the bytes to be sent.

use crate::files::HostFile;
use crate::last_word;
use clutch_node::controller_lockstep::{Exchange, LONGEST, answer};
use clutch_node::{BoardController, Lines};
use semihosting::process;

/// A request at this time comes from a test: the processor must fail.
const FAIL_AT: u64 = u64::MAX;

/// Both files.
pub struct Link {
    requests: HostFile,
    answers: HostFile,
}

impl Link {
    /// The files, if there are any.
    pub fn open() -> Option<Link> {
        Some(Link { requests: HostFile::open(c"to_fw")?, answers: HostFile::create(c"from_fw")? })
    }

    /// Writes an answer whole.
    fn answer(&self, answer: &Exchange<'_>) -> bool {
        let mut buffer = [0; LONGEST];
        let bytes = answer.write(&mut buffer).and_then(|n| buffer.get(..n));
        bytes.is_some_and(|bytes| self.answers.write(bytes))
    }
}

/// Answers until the files are closed.
pub fn run(link: Link, mut node: BoardController) -> ! {
    let mut buffer = [0; LONGEST];
    let mut used = 0;
    let mut lines = Lines::default();
    loop {
        // One read brings one request, as its writer writes it in one piece; but nothing guarantees
        // that.
        let whole = Exchange::length(buffer.get(..used).unwrap_or(&[]));
        if whole.is_none_or(|n| n > used) {
            let Some(room) = buffer.get_mut(used..).filter(|r| !r.is_empty()) else { process::exit(2) };
            match link.requests.read(room) {
                0 => process::exit(0),
                count => used = used.wrapping_add(count),
            }
            continue;
        }
        let Some(request) = buffer.get(..used).and_then(Exchange::read) else { process::exit(2) };
        if request.time_ns == FAIL_AT {
            cortex_m::asm::udf(); // an instruction that is none
        }
        if !link.answer(&answer(&mut node, &request, &mut lines)) {
            process::exit(3);
        }
        last_word::prepare(node.last_word());
        used = 0;
    }
}

/// The last frame of a processor that has failed.
pub fn last_word(frame: &[u8]) {
    if let Some(link) = Link::open() {
        let _ = link.answer(&Exchange { time_ns: u64::MAX, lateness_us: 0, host: &[], daq: frame });
    }
}
