//! The frames that a page gets: those of the last seconds, for one that comes late, and each new one as it is made.

use crate::view::View;
use crate::view::{Frame, Note, Opening};
use clutch_log::Header;
use clutch_loop::live_gains::LiveGains;
use serde::Serialize;
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Frames that are kept: 20 seconds of them.
const FRAMES: usize = 600;
/// Events that are kept of a run.
const EVENTS: usize = 200;

/// A message for pages: its kind, and its content as JSON.
#[derive(Clone, Debug)]
pub(crate) struct Message {
    /// Name of the event in the page.
    pub(crate) kind: &'static str,
    /// One line of JSON.
    pub(crate) json: Arc<str>,
}

#[derive(Debug, Default)]
struct State {
    /// The run that goes on.
    run: Option<Message>,
    /// Its gains, if they may be changed.
    gains: Option<Arc<dyn LiveGains>>,
    /// Notes of events in it.
    events: VecDeque<Message>,
    frames: VecDeque<Message>,
    /// Number of the first of the frames.
    first: u64,
    /// Number of runs and of events so far.
    runs: u64,
    told: u64,
    readers: usize,
    /// True if nothing more comes.
    closed: bool,
}

/// The frames that are kept, and who reads them.
#[derive(Debug, Default)]
pub(crate) struct Kept {
    state: Mutex<State>,
    changed: Condvar,
}

/// The place of a page in what is kept.
#[derive(Debug)]
pub(crate) struct Reader {
    kept: Arc<Kept>,
    runs: u64,
    told: u64,
    next: u64,
}

impl Kept {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The gains of the run that goes on, if they may be changed.
    pub(crate) fn gains(&self) -> Option<Arc<dyn LiveGains>> {
        self.state().gains.clone()
    }

    /// A run begins: the frames of the one before are of the past.
    fn begin(&self, json: String, gains: Option<Arc<dyn LiveGains>>) {
        let mut state = self.state();
        state.gains = gains;
        state.first += state.frames.len() as u64;
        state.frames.clear();
        state.events.clear();
        state.run = Some(Message { kind: "run", json: json.into() });
        state.runs += 1;
        self.changed.notify_all();
    }

    /// A new frame.
    fn frame(&self, json: String) {
        let mut state = self.state();
        state.frames.push_back(Message { kind: "frame", json: json.into() });
        while state.frames.len() > FRAMES {
            state.frames.pop_front();
            state.first += 1;
        }
        self.changed.notify_all();
    }

    /// Something has happened.
    fn event(&self, json: String) {
        let mut state = self.state();
        state.events.push_back(Message { kind: "note", json: json.into() });
        state.told += 1;
        if state.events.len() > EVENTS {
            state.events.pop_front();
        }
        self.changed.notify_all();
    }

    /// A reader, from the beginning of what is kept; none if there are `most` already.
    pub(crate) fn reader(self: &Arc<Self>, most: usize) -> Option<Reader> {
        let mut state = self.state();
        if state.readers >= most {
            return None;
        }
        state.readers += 1;
        self.changed.notify_all();
        Some(Reader { kept: self.clone(), runs: 0, told: 0, next: 0 })
    }
}

impl View for Kept {
    fn begin(&self, _: &Header, run: &Opening<'_>) {
        Kept::begin(self, json(run), run.live_gains.clone());
    }

    fn note(&self, note: &Note) {
        self.event(json(note));
    }

    fn frame(&self, frame: &Frame) {
        Kept::frame(self, json(frame));
    }

    fn readers(&self) -> usize {
        self.state().readers
    }

    fn close(&self, at_most: Duration) {
        let mut state = self.state();
        state.closed = true;
        self.changed.notify_all();
        let until = Instant::now() + at_most;
        while state.readers > 0 {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            state = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

fn json(value: &impl Serialize) -> String {
    // Numbers, texts and lists of them: there is nothing that JSON cannot say.
    serde_json::to_string(value).unwrap_or_default()
}

impl Reader {
    /// The messages since the last call, waited for; empty after a while without one; none once nothing more comes.
    pub(crate) fn next(&mut self, patience: Duration) -> Option<Vec<Message>> {
        let kept = self.kept.clone();
        let mut state = kept.state();
        let until = Instant::now() + patience;
        loop {
            let new = self.take(&state);
            if !new.is_empty() {
                return Some(new);
            }
            let left = until.saturating_duration_since(Instant::now());
            if state.closed {
                return None;
            }
            if left.is_zero() {
                return Some(new);
            }
            state = kept.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn take(&mut self, state: &State) -> Vec<Message> {
        let mut new = Vec::new();
        if self.runs != state.runs {
            self.runs = state.runs;
            self.told = state.told - state.events.len() as u64;
            new.extend(state.run.clone());
        }
        let skip = |next: u64, first: u64| usize::try_from(next.saturating_sub(first)).unwrap_or(usize::MAX);
        // A reader that was too slow goes on with the oldest that there is.
        new.extend(state.frames.iter().skip(skip(self.next, state.first)).cloned());
        self.next = state.first + state.frames.len() as u64;
        let first = state.told - state.events.len() as u64;
        new.extend(state.events.iter().skip(skip(self.told, first)).cloned());
        self.told = state.told;
        new
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        self.kept.state().readers -= 1;
        self.kept.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(reader: &mut Reader) -> Vec<String> {
        let messages = reader.next(Duration::ZERO).expect("not closed");
        messages.iter().map(|m| format!("{} {}", m.kind, m.json)).collect()
    }

    #[test]
    fn a_page_that_comes_late_gets_the_run_its_frames_and_its_events() {
        let kept = Arc::new(Kept::default());
        kept.begin("1".into(), None);
        kept.frame("a".into());
        kept.event("x".into());
        let mut late = kept.reader(1).unwrap();
        assert_eq!(texts(&mut late), ["run 1", "frame a", "note x"]);
        assert!(texts(&mut late).is_empty());
        kept.frame("b".into());
        assert_eq!(texts(&mut late), ["frame b"]);
        kept.begin("2".into(), None);
        kept.frame("c".into());
        assert_eq!(texts(&mut late), ["run 2", "frame c"], "nothing of the run before");
    }

    #[test]
    fn a_slow_page_misses_the_oldest_frames_and_memory_is_bounded() {
        let kept = Arc::new(Kept::default());
        kept.begin("1".into(), None);
        let mut slow = kept.reader(1).unwrap();
        let _ = texts(&mut slow);
        for i in 0..FRAMES + 5 {
            kept.frame(i.to_string());
            kept.event(i.to_string());
        }
        let got = texts(&mut slow);
        assert_eq!(got.len(), FRAMES + EVENTS);
        assert_eq!(got[0], "frame 5");
        assert_eq!(got[FRAMES], format!("note {}", FRAMES + 5 - EVENTS));
    }

    #[test]
    fn no_more_than_so_many_look_on_and_one_that_goes_makes_room() {
        let kept = Arc::new(Kept::default());
        let one = kept.reader(1).unwrap();
        assert!(kept.reader(1).is_none());
        drop(one);
        assert!(kept.reader(1).is_some());
    }

    #[test]
    fn an_end_is_told_after_the_last_frame() {
        let kept = Arc::new(Kept::default());
        let mut reader = kept.reader(1).unwrap();
        kept.frame("last".into());
        kept.close(Duration::ZERO);
        assert_eq!(texts(&mut reader), ["frame last"]);
        assert!(reader.next(Duration::from_secs(9)).is_none());
    }
}
