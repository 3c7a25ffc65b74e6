//! Views of a running loop, on this machine alone: a page in a browser, Foxglove, a terminal.
//!
//! ```text
//!   control thread ──ring──► feed ─┬─ frames, 30 a second ──► kept: the last of them ──► one thread for each page
//!         ▲                        └─ records ──► backlog: the last of them ──► one thread for each client of Foxglove
//!         └───────────────────────────── the operator's stop, from a page or a terminal
//! ```
//!
//! | file | is |
//! |---|---|
//! | `feed` | from records to frames |
//! | `view` | the side of a view that the feed sees |
//! | `listener` | a port, its connections, its token |
//! | `request` | the things that a browser asks for, and whether it may |
//! | `kept`, `server`, `page.html` | the frames that a page gets, also one that comes late; its connection; the page, in one file |
//! | `backlog`, `foxglove` | the messages that Foxglove gets; its protocol. Feature `foxglove` |
//! | `figures`, `scope` | the figures as characters; the terminal's screen, and its keys. Feature `scope` |
//!
//! The thread that controls copies records into a ring and does nothing else. A view that is slow misses frames, or records.
//! Nobody gets anything without the token in the address that is printed, and no page of a foreign origin gets anything at
//! all.

#[cfg(feature = "foxglove")]
mod backlog;
mod feed;
#[cfg(feature = "scope")]
mod figures;
#[cfg(feature = "foxglove")]
pub mod foxglove;
mod kept;
mod listener;
mod request;
#[cfg(feature = "scope")]
mod scope;
mod server;
mod view;

use clutch_log::Header;
use clutch_loop::live_gains::LiveGains;
use clutch_loop::log_thread::Ring;
use clutch_loop::onlooker::{Onlooker, ring};
use clutch_sim::Scenario;
use kept::Kept;
use listener::Listener;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use view::View;

pub use request::{Asked, Denied, Gate, asked};

/// Time for which the end of a run waits for those who look on.
const FAREWELL: Duration = Duration::from_millis(500);
/// Time between two looks for a first one.
const NAP: Duration = Duration::from_millis(50);

/// Views that are served until they are dropped: none to begin with.
#[derive(Debug, Default)]
pub struct Live {
    views: Vec<Arc<dyn View>>,
    listeners: Vec<Listener>,
    feeds: Mutex<Vec<JoinHandle<()>>>,
}

impl Live {
    /// Serves a page on a port of this machine's loopback, 0 for a free one, and gives its address, with the token without
    /// which nobody gets anything. The page's button sets `stop`.
    ///
    /// # Errors
    /// The port is taken, or may not be used; the system has no random numbers.
    pub fn page(&mut self, port: u16, stop: Arc<AtomicBool>) -> io::Result<String> {
        let kept = Arc::new(Kept::default());
        let listener = server::start(port, kept.clone(), stop)?;
        Ok(self.add(kept, listener, "http"))
    }

    /// Serves the records by Foxglove's protocol, in the same way.
    ///
    /// # Errors
    /// As for [`page`](Live::page).
    #[cfg(feature = "foxglove")]
    pub fn foxglove(&mut self, port: u16) -> io::Result<String> {
        let backlog = Arc::new(backlog::Backlog::default());
        let listener = foxglove::start(port, backlog.clone())?;
        Ok(self.add(backlog, listener, "ws"))
    }

    /// Draws runs on the terminal of standard error; keys set `stop`.
    ///
    /// # Errors
    /// There is no terminal, or none that it can be drawn on.
    #[cfg(feature = "scope")]
    pub fn scope(&mut self, stop: Arc<AtomicBool>) -> io::Result<()> {
        self.views.push(Arc::new(scope::Scope::new(stop)?));
        Ok(())
    }

    fn add(&mut self, view: Arc<dyn View>, listener: Listener, scheme: &str) -> String {
        let address = listener.address(scheme);
        self.views.push(view);
        self.listeners.push(listener);
        address
    }

    /// Waits until somebody looks on; false if `stop` was set before one did.
    #[must_use]
    pub fn wait_for_reader(&self, stop: &AtomicBool) -> bool {
        while self.readers() == 0 {
            if stop.load(Ordering::Relaxed) {
                return false;
            }
            std::thread::sleep(NAP);
        }
        true
    }

    /// Those who look on: pages, and clients of Foxglove that take messages.
    #[must_use]
    pub fn readers(&self) -> usize {
        self.views.iter().map(|view| view.readers()).sum()
    }
}

impl Onlooker for Live {
    fn begin(&self, header: &Header, scenario: &Scenario, gains: Option<Arc<dyn LiveGains>>) -> Ring {
        let (producer, consumer) = ring();
        let mut feeds = self.feeds.lock().unwrap_or_else(PoisonError::into_inner);
        // One run after the other: the frames of the one before come first.
        feeds.drain(..).for_each(|feed| drop(feed.join()));
        feeds.extend(feed::start(header, scenario, gains, consumer, self.views.clone()));
        producer
    }
}

/// Those who look on get the last of it, and the news that there is no more.
impl Drop for Live {
    fn drop(&mut self) {
        let feeds = self.feeds.get_mut().unwrap_or_else(PoisonError::into_inner);
        feeds.drain(..).for_each(|feed| drop(feed.join()));
        self.views.iter().for_each(|view| view.close(FAREWELL));
    }
}
