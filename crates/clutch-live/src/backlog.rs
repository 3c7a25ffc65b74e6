//! The messages that Foxglove's clients get: one ring for all of them, in which each has its place.

use crate::view::Opening;
use crate::view::View;
use clutch_log::{Header, Record, channel_of, encode, parameters};
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Messages that are kept: some seconds of them at 1 kHz. A slow client costs no more in memory.
const MESSAGES: usize = 1 << 14;
/// Bytes that a client takes at a time, and a message more.
pub(crate) const BATCH: usize = 1 << 18;

/// A message, as in the log.
#[derive(Debug)]
pub(crate) struct Message {
    /// Row of its channel in [`CHANNELS`](clutch_log::CHANNELS).
    pub(crate) row: usize,
    /// Log time, ns since 1970-01-01 UTC.
    pub(crate) time_ns: u64,
    pub(crate) data: Vec<u8>,
}

/// A run that is reported.
#[derive(Debug)]
pub(crate) struct Run {
    /// Its number, from 1.
    pub(crate) number: u32,
    pub(crate) started_unix_ns: u64,
    /// Names of the terms of its law.
    pub(crate) terms: Vec<String>,
    /// Messages of `/parameters`.
    pub(crate) parameters: Vec<Vec<u8>>,
}

#[derive(Debug, Default)]
struct State {
    run: Option<Arc<Run>>,
    messages: VecDeque<Arc<Message>>,
    /// Number of the first of them.
    first: u64,
    runs: u32,
    /// Clients that are connected, and those of them that take messages.
    clients: usize,
    takers: usize,
    closed: bool,
}

/// The ring.
#[derive(Debug, Default)]
pub(crate) struct Backlog {
    state: Mutex<State>,
    changed: Condvar,
}

/// The place of a client.
#[derive(Debug)]
pub(crate) struct Place {
    backlog: Arc<Backlog>,
    run: u32,
    /// Number of the next message; none before it takes any.
    next: Option<u64>,
}

/// The news for a client.
#[derive(Debug, Default)]
pub(crate) struct News {
    /// A run has begun.
    pub(crate) run: Option<Arc<Run>>,
    pub(crate) messages: Vec<Arc<Message>>,
    /// Messages that were gone before the client could take them.
    pub(crate) missed: u64,
    /// True if nothing more comes after these.
    pub(crate) closed: bool,
}

impl Backlog {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A place for a client; none if there are `most` already.
    pub(crate) fn place(self: &Arc<Self>, most: usize) -> Option<Place> {
        let mut state = self.state();
        if state.clients >= most {
            return None;
        }
        state.clients += 1;
        Some(Place { backlog: self.clone(), run: 0, next: None })
    }

    /// True if nothing more comes.
    pub(crate) fn closed(&self) -> bool {
        self.state().closed
    }
}

impl View for Backlog {
    fn begin(&self, header: &Header, _: &Opening<'_>) {
        let mut state = self.state();
        state.runs += 1;
        state.run = Some(Arc::new(Run {
            number: state.runs,
            started_unix_ns: header.started_unix_ns,
            terms: header.term_names.clone(),
            parameters: parameters(header).collect(),
        }));
        state.first += state.messages.len() as u64;
        state.messages.clear();
    }

    fn record(&self, record: &Record) {
        let mut data = Vec::new();
        encode(record, &mut data);
        data.shrink_to_fit();
        let mut state = self.state();
        let started = state.run.as_ref().map_or(0, |run| run.started_unix_ns);
        // The time that the log has.
        let time_ns = started.wrapping_add(record.time_ns());
        state.messages.push_back(Arc::new(Message { row: channel_of(record), time_ns, data }));
        if state.messages.len() > MESSAGES {
            state.messages.pop_front();
            state.first += 1;
        }
    }

    /// A client looks on once it takes messages.
    fn readers(&self) -> usize {
        self.state().takers
    }

    fn close(&self, at_most: Duration) {
        let mut state = self.state();
        state.closed = true;
        let until = Instant::now() + at_most;
        while state.clients > 0 {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            state = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Place {
    /// Takes messages from now on, those first that are kept of this run.
    pub(crate) fn begin(&mut self) {
        let mut state = self.backlog.state();
        if self.next.is_none() {
            self.next = Some(state.first);
            state.takers += 1;
        }
    }

    /// The messages since the last call, up to some bytes of them.
    pub(crate) fn news(&mut self) -> News {
        let state = self.backlog.state();
        let mut news = News::default();
        if self.run != state.runs {
            self.run = state.runs;
            news.run.clone_from(&state.run);
        }
        let Some(next) = &mut self.next else { return News { closed: state.closed, ..news } };
        news.missed = state.first.saturating_sub(*next);
        *next = state.first.max(*next);
        let mut bytes = 0;
        let from = usize::try_from(*next - state.first).unwrap_or(usize::MAX);
        for message in state.messages.iter().skip(from) {
            if bytes >= BATCH {
                break;
            }
            bytes += message.data.len();
            news.messages.push(message.clone());
            *next += 1;
        }
        news.closed = state.closed && *next == state.first + state.messages.len() as u64;
        news
    }

    /// True if nothing more comes.
    pub(crate) fn closed(&self) -> bool {
        self.backlog.closed()
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut state = self.backlog.state();
        state.clients -= 1;
        state.takers -= usize::from(self.next.is_some());
        self.backlog.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clutch_log::LinkRecord;

    fn push(backlog: &Backlog, ticks: std::ops::Range<u64>) {
        ticks.for_each(|tick| backlog.record(&Record::Link(LinkRecord { tick, ..LinkRecord::default() })));
    }

    #[test]
    fn a_client_that_comes_late_gets_what_is_kept_and_then_each_message_once() {
        let backlog = Arc::new(Backlog::default());
        push(&backlog, 0..3);
        let mut place = backlog.place(1).unwrap();
        assert!(backlog.place(1).is_none(), "one more than may be");
        assert!(place.news().messages.is_empty(), "it has not subscribed");
        assert_eq!(backlog.readers(), 0);
        place.begin();
        assert_eq!(backlog.readers(), 1);
        assert_eq!(place.news().messages.len(), 3);
        push(&backlog, 3..4);
        let news = place.news();
        assert_eq!((news.messages.len(), news.missed, news.closed), (1, 0, false));
        backlog.close(Duration::ZERO);
        assert!(place.news().closed);
        drop(place);
        assert_eq!(backlog.readers(), 0);
    }

    #[test]
    fn memory_is_bounded_and_what_a_slow_client_misses_is_counted() {
        let backlog = Arc::new(Backlog::default());
        let mut slow = backlog.place(1).unwrap();
        slow.begin();
        let all = 3 * MESSAGES as u64;
        push(&backlog, 0..all);
        assert_eq!(backlog.state().messages.len(), MESSAGES);
        let (mut got, mut missed) = (0, 0);
        loop {
            let news = slow.news();
            assert!(news.messages.iter().map(|m| m.data.len()).sum::<usize>() < BATCH + 1024);
            (got, missed) = (got + news.messages.len() as u64, missed + news.missed);
            if news.messages.is_empty() {
                break;
            }
        }
        assert_eq!((got, missed), (MESSAGES as u64, all - MESSAGES as u64));
    }
}
