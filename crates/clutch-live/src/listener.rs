//! A port of this machine's loopback, and its connections.

use crate::request::Gate;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

/// Connections at a time, each with a thread.
const CONNECTIONS: usize = 32;
/// Stack of such a thread, bytes: a loop keeps all its memory in RAM.
const STACK: usize = 512 * 1024;
/// Time that a client may take for a request, or to take what it gets.
pub(crate) const PATIENCE: Duration = Duration::from_secs(5);

/// A port that is served until it is dropped.
#[derive(Debug)]
pub(crate) struct Listener {
    gate: Arc<Gate>,
    closing: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Listener {
    /// Serves each connection to a port, 0 for a free one, in a thread of its own.
    pub(crate) fn start(
        port: u16,
        serve: impl Fn(TcpStream, &Gate) + Send + Sync + 'static,
    ) -> io::Result<Listener> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let gate = Arc::new(Gate { port: listener.local_addr()?.port(), token: random()? });
        let closing = Arc::new(AtomicBool::new(false));
        let (ours, flag, serve) = (gate.clone(), closing.clone(), Arc::new(serve));
        let thread = Builder::new().name("clutch-live".into()).stack_size(STACK).spawn(move || {
            let open = Arc::new(AtomicUsize::new(0));
            for stream in listener.incoming() {
                if flag.load(Ordering::Relaxed) {
                    return;
                }
                // One that is over the limit is closed without a word, as what fails here is.
                let Ok(stream) = stream else {
                    // None to be had, perhaps for long: no reason to spin beside a loop.
                    std::thread::sleep(Duration::from_millis(50));
                    continue;
                };
                if open.load(Ordering::Relaxed) >= CONNECTIONS {
                    continue;
                }
                let (gate, serve) = (ours.clone(), serve.clone());
                let guard = Open::new(&open);
                let _ = Builder::new().name("clutch-page".into()).stack_size(STACK).spawn(move || {
                    serve(stream, &gate);
                    drop(guard);
                });
            }
        })?;
        Ok(Listener { gate, closing, thread: Some(thread) })
    }

    /// The address, with its token.
    pub(crate) fn address(&self, scheme: &str) -> String {
        format!("{scheme}://127.0.0.1:{}/?token={}", self.gate.port, self.gate.token)
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.closing.store(true, Ordering::Relaxed);
        // The listener waits for a connection: here is one.
        let here = SocketAddr::from((Ipv4Addr::LOCALHOST, self.gate.port));
        if TcpStream::connect_timeout(&here, PATIENCE).is_ok()
            && let Some(thread) = self.thread.take()
        {
            let _ = thread.join();
        }
    }
}

/// An open connection, counted.
struct Open(Arc<AtomicUsize>);

impl Open {
    fn new(count: &Arc<AtomicUsize>) -> Open {
        count.fetch_add(1, Ordering::Relaxed);
        Open(count.clone())
    }
}

impl Drop for Open {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// 128 random bits, in hex.
pub(crate) fn random() -> io::Result<String> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(|error| io::Error::other(format!("no random numbers: {error}")))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}
