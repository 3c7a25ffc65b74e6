//! Waiting for the disk, on a thread of its own: what a disk takes for a sync is no time that records wait.

use std::fs::File;
use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::time::{Duration, Instant};

/// Least time between two syncs beside the writing.
const SYNC_EVERY: Duration = Duration::from_secs(1);

/// Syncs a file once a second, beside its writer.
#[derive(Debug)]
pub(crate) struct Syncer {
    asks: Sender<()>,
    answers: Receiver<io::Result<()>>,
    /// One is under way.
    pending: bool,
    asked: Instant,
}

impl Syncer {
    /// For a file. Its thread ends with the syncer, or when the sync under way then has ended.
    ///
    /// # Errors
    /// The system starts no thread.
    pub(crate) fn start(file: Arc<File>) -> io::Result<Syncer> {
        Syncer::with(move || file.sync_data())
    }

    fn with(mut sync: impl FnMut() -> io::Result<()> + Send + 'static) -> io::Result<Syncer> {
        let (asks, asked) = channel();
        let (answer, answers) = channel();
        let run = move || {
            // Ends when nobody asks or listens any more.
            while asked.recv().is_ok() && answer.send(sync()).is_ok() {}
        };
        let _ = std::thread::Builder::new().name("clutch-log-sync".to_owned()).spawn(run)?;
        Ok(Syncer { asks, answers, pending: false, asked: Instant::now() })
    }

    /// Asks for a sync if the last one has ended and a second has passed since it was asked for. Never waits.
    ///
    /// # Errors
    /// The error of the last sync.
    pub(crate) fn nudge(&mut self) -> io::Result<()> {
        if self.pending {
            match self.answers.try_recv() {
                Ok(answer) => {
                    self.pending = false;
                    answer?;
                }
                Err(TryRecvError::Empty) => return Ok(()),
                Err(TryRecvError::Disconnected) => {
                    return Err(io::Error::other("the thread that syncs has ended"));
                }
            }
        }
        if self.asked.elapsed() >= SYNC_EVERY {
            self.ask();
        }
        Ok(())
    }

    /// Waits until everything that was written before this call is on the disk.
    ///
    /// # Errors
    /// The error of a sync.
    pub(crate) fn wait(&mut self) -> io::Result<()> {
        if self.pending {
            // It may have begun before the last write.
            self.answer()?;
        }
        self.ask();
        self.answer()
    }

    fn ask(&mut self) {
        self.asked = Instant::now();
        self.pending = self.asks.send(()).is_ok();
    }

    fn answer(&mut self) -> io::Result<()> {
        self.pending = false;
        self.answers.recv().unwrap_or_else(|_| Err(io::Error::other("the thread that syncs has ended")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU32, Ordering};

    #[test]
    fn a_slow_sync_holds_nothing_up_but_the_end() {
        const SLOW: Duration = Duration::from_millis(1500);
        let done = Arc::new(AtomicU32::new(0));
        let count = done.clone();
        let mut syncer = Syncer::with(move || {
            std::thread::sleep(SLOW);
            count.fetch_add(1, Ordering::Relaxed);
            Ok(())
        })
        .unwrap();
        let (begin, mut longest) = (Instant::now(), Duration::ZERO);
        while begin.elapsed() < 3 * SYNC_EVERY {
            let before = Instant::now();
            syncer.nudge().unwrap();
            longest = longest.max(before.elapsed());
            std::thread::sleep(Duration::from_millis(5));
        }
        assert!(longest < SLOW / 10, "{longest:?}");
        // The first after 1 s, done at 2.5 s, and the next from then on.
        assert_eq!(done.load(Ordering::Relaxed), 1);
        syncer.wait().unwrap();
        assert_eq!(done.load(Ordering::Relaxed), 3, "one that began after the last write");
    }

    #[test]
    fn an_error_comes_with_the_next_question() {
        let mut syncer = Syncer::with(|| Err(io::Error::other("the disk is gone"))).unwrap();
        syncer.ask();
        let begin = Instant::now();
        let error = loop {
            match syncer.nudge() {
                Err(error) => break error,
                Ok(()) if begin.elapsed() < Duration::from_secs(30) => {
                    std::thread::sleep(Duration::from_millis(5))
                }
                Ok(()) => panic!("no error came"),
            }
        };
        assert_eq!(error.to_string(), "the disk is gone");
        assert_eq!(syncer.wait().unwrap_err().to_string(), "the disk is gone");
    }
}
