//! The pages' connections.

use crate::kept::Kept;
use crate::listener::{Listener, PATIENCE, random};
use crate::request::{Asked, Denied, Gate, LONGEST, asked};
use clutch_loop::live_gains::Refusal;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The page; `NONCE` stands where the one of an answer goes.
const PAGE: &str = include_str!("page.html");
/// Pages that may look on at a time.
/// A browser opens six connections to one place, and a stop needs one of them.
const PAGES: usize = 4;
/// Stack for the search of a certificate, bytes.
const SEARCH_STACK: usize = 8 << 20;
/// Silence after which a stream says that it is still there, so that one whose page has gone ends.
const ALIVE: Duration = Duration::from_secs(2);

/// Serves pages on a port; their button sets `stop`.
pub(crate) fn start(port: u16, kept: Arc<Kept>, stop: Arc<AtomicBool>) -> io::Result<Listener> {
    Listener::start(port, move |stream, gate| {
        let _ = serve(stream, gate, &kept, &stop);
    })
}

/// A connection: one request, one answer.
fn serve(mut stream: TcpStream, gate: &Gate, kept: &Arc<Kept>, stop: &AtomicBool) -> io::Result<()> {
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
    let (mut used, until) = (0, Instant::now() + PATIENCE);
    loop {
        // A request has so long as a whole: one that trickles in does not keep its connection.
        let left = until.saturating_duration_since(Instant::now());
        stream.set_read_timeout(Some(left.max(Duration::from_millis(1))))?;
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
    let key = key.to_owned();
    // A thread of its own: a search takes more stack than a connection.
    let certifying = std::thread::Builder::new().name("clutch-certify".into()).stack_size(SEARCH_STACK);
    let certifying = certifying.spawn(move || gains.change(&key, number));
    let done = certifying.map_err(|e| Refusal(format!("no thread for the certificate: {e}")))?.join();
    done.unwrap_or_else(|_| {
        Err(Refusal("the certificate's search came to a bad end; please report this as a defect".into()))
    })
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
        // A comment, where there is nothing to report.
        let mut text = if messages.is_empty() { ": \n\n".to_owned() } else { String::new() };
        for message in messages {
            text += &format!("event: {}\ndata: {}\n\n", message.kind, message.json);
        }
        stream.write_all(text.as_bytes())?;
    }
    stream.write_all(b"event: end\ndata: {}\n\n")
}
