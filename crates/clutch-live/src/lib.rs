//! A view of a running loop in a browser, served on this machine alone.
//!
//! ```text
//!   control thread ──ring──► feed: frames, 30 a second ──► kept: the last of them ──► one thread for each page
//!         ▲                                                                              │
//!         └───────────────────────────── the operator's stop ◄──────────────────────────┘
//! ```
//!
//! | file | is |
//! |---|---|
//! | `feed` | from records to frames |
//! | `kept` | the frames that a page gets, also one that comes late |
//! | `server`, `request` | the pages' connections; what a browser asks for, and whether it may |
//! | `page.html` | the page, in one file |
//!
//! The thread that controls copies records into a ring and does nothing else. A page that is slow misses frames. Nobody
//! gets anything without the token in the address that is printed, and no page of another origin gets anything at all.

mod feed;
mod kept;
mod request;
mod server;

use clutch_log::Header;
use clutch_loop::live_gains::LiveGains;
use clutch_loop::log_thread::Ring;
use clutch_loop::onlooker::{Onlooker, ring};
use clutch_sim::Scenario;
use kept::Kept;
use server::Server;
use std::io;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

pub use request::{Asked, Denied, Gate, asked};

/// Time for which the end of a run waits for its pages.
const FAREWELL: Duration = Duration::from_millis(500);

/// A view that is served until it is dropped.
#[derive(Debug)]
pub struct Live {
    server: Server,
    kept: Arc<Kept>,
    feeds: Mutex<Vec<JoinHandle<()>>>,
}

impl Live {
    /// Serves a view on a port of this machine's loopback; 0 takes a free one. The button of a page sets `stop`.
    ///
    /// # Errors
    /// The port is taken, or may not be used; the system has no random numbers.
    pub fn start(port: u16, stop: Arc<AtomicBool>) -> io::Result<Live> {
        let kept = Arc::new(Kept::default());
        let server = Server::start(port, kept.clone(), stop)?;
        Ok(Live { server, kept, feeds: Mutex::default() })
    }

    /// The address of the page, with the token without which nobody gets anything.
    #[must_use]
    pub fn address(&self) -> String {
        self.server.address()
    }

    /// Waits until a page looks on; false if `stop` was set before one did.
    #[must_use]
    pub fn wait_for_page(&self, stop: &AtomicBool) -> bool {
        self.kept.wait_for_reader(stop)
    }

    /// Pages that look on.
    #[must_use]
    pub fn pages(&self) -> usize {
        self.kept.readers()
    }
}

impl Onlooker for Live {
    fn begin(&self, header: &Header, scenario: &Scenario, gains: Option<Arc<dyn LiveGains>>) -> Ring {
        let (producer, consumer) = ring();
        let mut feeds = self.feeds.lock().unwrap_or_else(PoisonError::into_inner);
        // One run after the other: the frames of the one before come first.
        feeds.drain(..).for_each(|feed| drop(feed.join()));
        feeds.extend(feed::start(header, scenario, gains, consumer, self.kept.clone()));
        producer
    }
}

/// Its pages get the last frames, and the news that there are no more.
impl Drop for Live {
    fn drop(&mut self) {
        let feeds = self.feeds.get_mut().unwrap_or_else(PoisonError::into_inner);
        feeds.drain(..).for_each(|feed| drop(feed.join()));
        self.kept.close(FAREWELL);
    }
}
