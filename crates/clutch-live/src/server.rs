//! The pages' connections.

use crate::kept::Kept;
use crate::listener::{Listener, PATIENCE, random};
use crate::request::{Asked, Denied, Gate, LONGEST, asked};
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The page; `NONCE` stands where the one of an answer goes.
const PAGE: &str = include_str!("page.html");
/// Pages that may look on at a time.
const PAGES: usize = 8;
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
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    match read(&mut stream, gate)? {
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
fn read(stream: &mut TcpStream, gate: &Gate) -> io::Result<Result<Asked, Denied>> {
    let mut head = [0; LONGEST];
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
            Ok(Some(asked)) => return Ok(Ok(asked)),
            Err(denied) => return Ok(Err(denied)),
        }
    }
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
