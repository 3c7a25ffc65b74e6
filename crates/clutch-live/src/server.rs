//! The pages' connections.

use crate::kept::Kept;
use crate::request::{Asked, Denied, Gate, LONGEST, asked};
use clutch_loop::live_gains::Refusal;
use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// The page; `NONCE` stands where the one of an answer goes.
const PAGE: &str = include_str!("page.html");
/// Pages that may look on at a time.
const PAGES: usize = 8;
/// Connections at a time, each with a thread.
const CONNECTIONS: usize = 32;
/// Stack of such a thread, bytes: a loop keeps all its memory in RAM.
const STACK: usize = 512 * 1024;
/// Time that a browser may take for a request, or to take what it gets.
const PATIENCE: Duration = Duration::from_secs(5);
/// Silence after which a stream says that it is still there, so that one whose page has gone ends.
const ALIVE: Duration = Duration::from_secs(2);

/// A server on this machine's loopback.
#[derive(Debug)]
pub(crate) struct Server {
    gate: Arc<Gate>,
    closing: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    pub(crate) fn start(port: u16, kept: Arc<Kept>, stop: Arc<AtomicBool>) -> io::Result<Server> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let gate = Arc::new(Gate { port: listener.local_addr()?.port(), token: random()? });
        let closing = Arc::new(AtomicBool::new(false));
        let (ours, flag) = (gate.clone(), closing.clone());
        let thread =
            std::thread::Builder::new().name("clutch-live".into()).stack_size(STACK).spawn(move || {
                let open = Arc::new(AtomicUsize::new(0));
                for stream in listener.incoming() {
                    if flag.load(Ordering::Relaxed) {
                        return;
                    }
                    // One that is over the limit is closed without a word, as what fails here is.
                    let Ok(stream) = stream else { continue };
                    if open.load(Ordering::Relaxed) >= CONNECTIONS {
                        continue;
                    }
                    let (gate, kept, stop) = (ours.clone(), kept.clone(), stop.clone());
                    let guard = Open::new(&open);
                    let _ = std::thread::Builder::new().name("clutch-page".into()).stack_size(STACK).spawn(
                        move || {
                            let _ = serve(stream, &gate, &kept, &stop);
                            drop(guard);
                        },
                    );
                }
            })?;
        Ok(Server { gate, closing, thread: Some(thread) })
    }

    /// The address, with its token.
    pub(crate) fn address(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.gate.port, self.gate.token)
    }
}

impl Drop for Server {
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
fn random() -> io::Result<String> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(|error| io::Error::other(format!("no random numbers: {error}")))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// A connection: one request, one answer.
fn serve(mut stream: TcpStream, gate: &Gate, kept: &Arc<Kept>, stop: &AtomicBool) -> io::Result<()> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    let mut head = [0; LONGEST];
    match read(&mut stream, &mut head, gate)? {
        Ok(Asked::Set { key, value }) => match change(kept, key, value) {
            Ok(verdict) => answer(&mut stream, "200 OK", "text/plain", "", &verdict),
            Err(refusal) => answer(&mut stream, "409 Conflict", "text/plain", "", &refusal.to_string()),
        },
        Ok(Asked::Page) => {
            let nonce = random()?;
            let rules = format!(
                "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; connect-src 'self'; \
                 img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
            );
            let headers = format!("Content-Security-Policy: {rules}\r\n");
            answer(&mut stream, "200 OK", "text/html", &headers, &PAGE.replace("NONCE", &nonce))
        }
        Ok(Asked::Stop) => {
            stop.store(true, Ordering::Relaxed);
            answer(&mut stream, "200 OK", "text/plain", "", "stopped")
        }
        Ok(Asked::Events) => match kept.reader(PAGES) {
            Some(reader) => events(&mut stream, reader),
            None => deny(&mut stream, Denied::Crowded),
        },
        Err(denied) => deny(&mut stream, denied),
    }
}

/// The request on a connection.
fn read<'a>(
    stream: &mut TcpStream,
    head: &'a mut [u8; LONGEST],
    gate: &Gate,
) -> io::Result<Result<Asked<'a>, Denied>> {
    let mut used = 0;
    loop {
        let Some(room) = head.get_mut(used..).filter(|room| !room.is_empty()) else {
            return Ok(Err(Denied::Malformed));
        };
        let count = stream.read(room)?;
        if count == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        used += count;
        match asked(&head[..used], gate) {
            Ok(None) => {}
            Ok(Some(_)) => break,
            Err(denied) => return Ok(Err(denied)),
        }
    }
    // Once more, as what is asked for borrows from the head.
    Ok(asked(&head[..used], gate).and_then(|asked| asked.ok_or(Denied::Malformed)))
}

/// Changes a gain of the run that goes on.
fn change(kept: &Kept, key: &str, value: &str) -> Result<String, Refusal> {
    let gains = kept.gains().ok_or_else(|| {
        Refusal("gains are not changed in this run: safety.live_gains = true allows it where `clutch loop` closes the loop".into())
    })?;
    let number = value.parse().map_err(|_| Refusal(format!("{key} = {value}: expected a number")))?;
    gains.change(key, number)
}

fn deny(stream: &mut TcpStream, denied: Denied) -> io::Result<()> {
    let words = format!("{}\n", denied.words());
    answer(stream, denied.status(), "text/plain", "", &words)
}

fn answer(stream: &mut TcpStream, status: &str, kind: &str, headers: &str, body: &str) -> io::Result<()> {
    let text = format!("{}{headers}Content-Length: {}\r\n\r\n{body}", head(status, kind), body.len());
    stream.write_all(text.as_bytes())
}

/// The lines that begin each answer.
fn head(status: &str, kind: &str) -> String {
    format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}; charset=utf-8\r\nCache-Control: no-store\r\n\
         Referrer-Policy: no-referrer\r\nX-Content-Type-Options: nosniff\r\nConnection: close\r\n"
    )
}

/// The stream of frames, until nothing more comes or the page goes.
fn events(stream: &mut TcpStream, mut reader: crate::kept::Reader) -> io::Result<()> {
    stream.write_all(format!("{}\r\n", head("200 OK", "text/event-stream")).as_bytes())?;
    while let Some(messages) = reader.next(ALIVE) {
        // A comment, where there is nothing to tell.
        let mut text = if messages.is_empty() { ": \n\n".to_owned() } else { String::new() };
        for message in messages {
            text += &format!("event: {}\ndata: {}\n\n", message.kind, message.json);
        }
        stream.write_all(text.as_bytes())?;
    }
    stream.write_all(b"event: end\ndata: {}\n\n")
}
