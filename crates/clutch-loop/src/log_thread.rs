//! The thread that writes a log beside the loop, and the ring that leads to it.

use crate::watch::Watch;
use clutch_log::{Header, LogError, LogWriter, Record};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// The way of records to their thread.
pub type Ring = rtrb::Producer<Record>;

/// Records of a log that wait for their thread.
const RING: usize = 1 << 15;
/// Interval at which a chunk of the log goes to the file. With the ring's 20 ms this leaves a busy machine
/// 20 ms of the 100 ms that a crash may cost.
const LOG_FLUSH: Duration = Duration::from_millis(60);
/// A log that is written beside the loop.
pub struct LogThread {
    path: std::path::PathBuf,
    thread: std::thread::JoinHandle<Result<clutch_log::Summary, LogError>>,
}

impl LogThread {
    /// Starts a thread that writes what comes through the ring.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn start(path: &Path, header: &Header, watch: Arc<Watch>) -> Result<(LogThread, Ring), LogError> {
        let mut writer = LogWriter::create(path, header)?;
        let (producer, mut consumer) = rtrb::RingBuffer::<Record>::new(RING);
        let thread = std::thread::Builder::new().name("clutch-log".to_owned());
        let thread = thread.spawn(move || {
            let mut failed = None;
            let mut flushed = Instant::now();
            loop {
                // Asked before the ring is emptied: what was pushed before the end is seen.
                let last = consumer.is_abandoned();
                while let Ok(record) = consumer.pop() {
                    if failed.is_none()
                        && let Err(error) = writer.write(&record)
                    {
                        watch.log_ended.store(true, Ordering::Relaxed);
                        failed = Some(error);
                    }
                }
                if last {
                    break;
                }
                // Sooner than the writer would: what waits in the ring is lost with the chunk.
                if failed.is_none() && flushed.elapsed() >= LOG_FLUSH {
                    flushed = Instant::now();
                    if let Err(error) = writer.flush() {
                        watch.log_ended.store(true, Ordering::Relaxed);
                        failed = Some(error);
                    }
                }
                std::thread::sleep(Duration::from_millis(20));
            }
            match failed {
                Some(error) => Err(error),
                None => writer.finish(),
            }
        });
        let thread = thread.map_err(|source| LogError::Io {
            path: path.into(),
            action: "cannot start its thread",
            source,
        })?;
        Ok((LogThread { path: path.to_owned(), thread }, producer))
    }

    /// Ends the log of a run that never began, and removes its file; the ring has to be gone.
    pub fn discard(self) {
        let path = self.path.clone();
        // Nobody needs its own word on its end any more.
        let _ = self.finish();
        let _ = std::fs::remove_file(path);
    }

    /// Waits until everything is in the file.
    ///
    /// # Errors
    /// The file could not be written to its end.
    pub fn finish(self) -> Result<clutch_log::Summary, LogError> {
        let LogThread { path, thread } = self;
        thread.join().unwrap_or(Err(LogError::Closed { path, written: 0 }))
    }
}
