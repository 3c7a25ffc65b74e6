//! The records of a run by Foxglove's WebSocket protocol, as the log has them.
//!
//! The protocol: <https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>, of which a client gets channels, their
//! messages and their time. A client's messages change nothing but its own share.

#![allow(clippy::result_large_err, reason = "the type of tungstenite's callback")]

use crate::backlog::{BATCH, Backlog, Message, Place, Run};
use crate::listener::{Listener, PATIENCE};
use crate::request::{Denied, Gate};
use clutch_log::{CHANNELS, PARAMETER_CHANNEL, schema};
use data_encoding::BASE64;
use serde::Deserialize;
use serde_json::json;
use std::io::{self, ErrorKind};
use std::net::TcpStream;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};
use tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tungstenite::http::{HeaderValue, header};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, WebSocket};

/// The port that the protocol's clients expect.
pub const PORT: u16 = 8765;
/// Names of the protocol, the one that is preferred first. They differ in nothing that is said here.
const PROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
/// Origins of the pages that may look on: Foxglove's own (its links to a server on localhost begin with this,
/// <https://github.com/foxglove/ws-protocol/tree/main/typescript/ws-protocol-examples>), and a page from a disk, as the
/// desktop applications are (`rendererEntry` of <https://github.com/foxglove/studio>). Both need the token.
const ORIGINS: [&str; 2] = ["https://app.foxglove.dev", "file://"];
/// Clients at a time.
const CLIENTS: usize = 8;
/// Bytes of the longest message that a client sends.
const LONGEST: usize = 1 << 16;
/// Time from a client's first subscription to its first message: it subscribes channel by channel, and what is kept of the
/// run goes to all of them.
const SETTLE: Duration = Duration::from_millis(200);
/// Time for which a client is listened to before it is told what is new.
const NAP: Duration = Duration::from_millis(15);
/// Time that a client has to hear that nothing more comes.
const FAREWELL: Duration = Duration::from_millis(200);
/// Time between two complaints about a slow client.
const PAUSE: Duration = Duration::from_secs(1);

/// Serves what is kept on a port.
pub(crate) fn start(port: u16, backlog: Arc<Backlog>) -> io::Result<Listener> {
    let since_1970 = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    let session = since_1970.as_millis().to_string();
    Listener::start(port, move |stream, gate| {
        // A client that goes needs no reason.
        let _ = serve(stream, gate, &backlog, &session);
    })
}

fn serve(stream: TcpStream, gate: &Gate, backlog: &Arc<Backlog>, session: &str) -> Result<(), Error> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    let config = WebSocketConfig::default()
        .read_buffer_size(4096)
        .write_buffer_size(4 * BATCH) // so that nothing is sent but by a flush
        .max_message_size(Some(LONGEST))
        .max_frame_size(Some(LONGEST));
    let mut place = None;
    let admit = |request: &Request, response: Response| {
        let protocol = admitted(request, gate).map_err(|denied| refusal(denied.status(), denied.words()))?;
        place = backlog.place(CLIENTS);
        if place.is_none() {
            return Err(refusal(Denied::Crowded.status(), Denied::Crowded.words()));
        }
        agreed(response, protocol)
    };
    let Ok(socket) = tungstenite::accept_hdr_with_config(stream, admit, Some(config)) else { return Ok(()) };
    let Some(place) = place else { return Ok(()) };
    // From here on nothing waits for the client: it is asked again.
    socket.get_ref().set_read_timeout(Some(NAP))?;
    socket.get_ref().set_write_timeout(Some(NAP))?;
    Client::new(socket, place).serve(session)
}

/// The name of the protocol that both speak, none if there is none.
fn admitted(request: &Request, gate: &Gate) -> Result<Option<&'static str>, Denied> {
    let mut hosts = request.headers().get_all(header::HOST).iter();
    if !matches!((hosts.next(), hosts.next()), (Some(host), None) if gate.is_ours(host.as_bytes(), "")) {
        return Err(Denied::Host);
    }
    let mut origins = request.headers().get_all(header::ORIGIN).iter();
    match (origins.next(), origins.next()) {
        (None, _) => {}
        (Some(origin), None) if ORIGINS.iter().any(|ours| origin == ours) => {}
        _ => return Err(Denied::Origin),
    }
    if !gate.is_known(request.uri().query().unwrap_or("")) {
        return Err(Denied::Token);
    }
    let offered = request.headers().get_all(header::SEC_WEBSOCKET_PROTOCOL).iter();
    let offered: Vec<&str> = offered
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','))
        .map(str::trim)
        .collect();
    Ok(PROTOCOLS.into_iter().find(|protocol| offered.contains(protocol)))
}

fn agreed(mut response: Response, protocol: Option<&'static str>) -> Result<Response, ErrorResponse> {
    let words = format!("Here {} are spoken.", PROTOCOLS.join(" and "));
    let protocol = protocol.ok_or_else(|| refusal("400 Bad Request", &words))?;
    response.headers_mut().insert(header::SEC_WEBSOCKET_PROTOCOL, HeaderValue::from_static(protocol));
    Ok(response)
}

/// A refusal, with a status line.
fn refusal(status: &str, words: &str) -> ErrorResponse {
    let mut response = ErrorResponse::new(Some(format!("{words}\n")));
    let code = status.split(' ').next().and_then(|code| code.parse().ok());
    *response.status_mut() = code.unwrap_or_default();
    response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
    response
}

/// The texts that a client sends and that mean anything here.
#[derive(Deserialize)]
#[serde(tag = "op", rename_all = "camelCase")]
enum Said {
    Subscribe {
        subscriptions: Vec<Subscription>,
    },
    #[serde(rename_all = "camelCase")]
    Unsubscribe {
        subscription_ids: Vec<u32>,
    },
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Subscription {
    id: u32,
    channel_id: u32,
}

/// Rank of a status message.
#[derive(Clone, Copy)]
enum Level {
    Warning = 1,
    Error = 2,
}

/// Number of a channel: a new run has new ones, for its law may have other terms.
fn channel_id(run: u32, row: usize) -> u32 {
    run.wrapping_mul(CHANNELS.len() as u32).wrapping_add(row as u32)
}

/// A connection, from its handshake on.
struct Client {
    socket: WebSocket<TcpStream>,
    place: Place,
    run: Option<Arc<Run>>,
    /// The time from which it takes messages.
    begins: Option<Instant>,
    /// The client's number of its subscription to each channel.
    subscriptions: [Option<u32>; CHANNELS.len()],
    /// The last time that it was told, ns.
    clock: u64,
    /// Messages that it missed and has not been told of.
    missed: u64,
    complained: Option<Instant>,
    /// True if it has not taken what it was sent.
    full: bool,
}

impl Client {
    fn new(socket: WebSocket<TcpStream>, place: Place) -> Client {
        let subscriptions = [None; CHANNELS.len()];
        Client {
            socket,
            place,
            run: None,
            begins: None,
            subscriptions,
            clock: 0,
            missed: 0,
            complained: None,
            full: false,
        }
    }

    fn serve(mut self, session: &str) -> Result<(), Error> {
        let info = json!({
            "op": "serverInfo",
            "name": concat!("clutch ", env!("CARGO_PKG_VERSION")),
            "capabilities": ["time"],
            "supportedEncodings": [],
            "metadata": {},
            "sessionId": session,
        });
        self.text(&info)?;
        loop {
            self.flush()?;
            if self.full {
                // A viewer that takes no more gets no more, and is not heard.
                if self.place.closed() {
                    return Ok(());
                }
                continue;
            }
            self.hear()?;
            if self.tell()? {
                break;
            }
        }
        self.part()
    }

    /// Says good-bye, and waits until it is heard, but not for long.
    fn part(mut self) -> Result<(), Error> {
        self.socket.close(None)?;
        let until = Instant::now() + FAREWELL;
        while Instant::now() < until {
            self.flush()?;
            // It ends by an error, also where all is well.
            self.hear()?;
        }
        Ok(())
    }

    /// Hears one message, if there is one.
    fn hear(&mut self) -> Result<(), Error> {
        match self.socket.read() {
            Ok(tungstenite::Message::Text(text)) => match serde_json::from_str(&text) {
                Ok(Said::Subscribe { subscriptions }) => {
                    subscriptions.iter().try_for_each(|subscription| self.subscribe(subscription))
                }
                Ok(Said::Unsubscribe { subscription_ids }) => {
                    let gone = |id: &Option<u32>| id.is_some_and(|id| subscription_ids.contains(&id));
                    self.subscriptions.iter_mut().filter(|id| gone(id)).for_each(|id| *id = None);
                    Ok(())
                }
                Err(error) => self.status(Level::Error, &format!("not understood: {error}")),
            },
            Ok(tungstenite::Message::Binary(_)) => self.status(Level::Error, "nothing is taken from clients"),
            Ok(_) => Ok(()),
            Err(error) if is_early(&error) => Ok(()),
            Err(error) => Err(error),
        }
    }

    fn subscribe(&mut self, &Subscription { id, channel_id: channel }: &Subscription) -> Result<(), Error> {
        let rows = 0..CHANNELS.len();
        let run = self.run.clone();
        let asked = run
            .and_then(|run| Some((rows.clone().find(|row| channel_id(run.number, *row) == channel)?, run)));
        let Some((row, run)) = asked else {
            return self.status(Level::Error, &format!("channel {channel} is not there"));
        };
        if self.subscriptions.contains(&Some(id)) {
            return self.status(Level::Error, &format!("subscription {id} is there already"));
        }
        if self.subscriptions[row].is_some() {
            let topic = CHANNELS[row].topic;
            return self.status(Level::Warning, &format!("{topic} has a subscription already"));
        }
        self.subscriptions[row] = Some(id);
        self.begins.get_or_insert_with(|| Instant::now() + SETTLE);
        if row == PARAMETER_CHANNEL {
            for data in &run.parameters {
                self.data(id, run.started_unix_ns, data)?;
            }
        }
        Ok(())
    }

    /// Reports what is new; true if there is nothing more to come.
    fn tell(&mut self) -> Result<bool, Error> {
        if self.begins.is_some_and(|at| at <= Instant::now()) || self.place.closed() {
            self.place.begin();
        }
        let news = self.place.news();
        if let Some(run) = news.run {
            self.begin(run)?;
        }
        self.missed += news.missed;
        for message in news.messages {
            self.message(&message)?;
        }
        if self.missed > 0 && self.complained.is_none_or(|at| at.elapsed() >= PAUSE) {
            let words = format!("{} messages were left out: this client is too slow for them", self.missed);
            (self.missed, self.complained) = (0, Some(Instant::now()));
            self.status(Level::Warning, &words)?;
        }
        Ok(news.closed)
    }

    fn begin(&mut self, run: Arc<Run>) -> Result<(), Error> {
        let ids =
            |run: &Run| -> Vec<u32> { (0..CHANNELS.len()).map(|row| channel_id(run.number, row)).collect() };
        if let Some(last) = &self.run {
            let gone = json!({ "op": "unadvertise", "channelIds": ids(last) });
            self.text(&gone)?;
        }
        let channels = CHANNELS.iter().zip(ids(&run)).map(|(channel, id)| {
            json!({
                "id": id,
                "topic": channel.topic,
                "encoding": "protobuf",
                "schemaName": channel.message,
                "schemaEncoding": "protobuf",
                "schema": BASE64.encode(&schema(channel, &run.terms)),
            })
        });
        self.text(&json!({ "op": "advertise", "channels": channels.collect::<Vec<_>>() }))?;
        self.subscriptions = [None; CHANNELS.len()];
        self.run = Some(run);
        Ok(())
    }

    fn message(&mut self, message: &Message) -> Result<(), Error> {
        let Some(id) = self.subscriptions[message.row] else { return Ok(()) };
        // A client that asks for the time takes it for that of the messages that follow.
        if message.time_ns > self.clock {
            self.clock = message.time_ns;
            let mut time = vec![2];
            time.extend(message.time_ns.to_le_bytes());
            self.write(tungstenite::Message::binary(time))?;
        }
        self.data(id, message.time_ns, &message.data)
    }

    /// A message of a subscription.
    fn data(&mut self, id: u32, time_ns: u64, data: &[u8]) -> Result<(), Error> {
        let mut bytes = Vec::with_capacity(13 + data.len());
        bytes.push(1);
        bytes.extend(id.to_le_bytes());
        bytes.extend(time_ns.to_le_bytes());
        bytes.extend(data);
        self.write(tungstenite::Message::binary(bytes))
    }

    fn status(&mut self, level: Level, words: &str) -> Result<(), Error> {
        self.text(&json!({ "op": "status", "level": level as u8, "message": words }))
    }

    fn text(&mut self, json: &serde_json::Value) -> Result<(), Error> {
        self.write(tungstenite::Message::text(json.to_string()))
    }

    /// Puts a message where the next flush takes it from.
    fn write(&mut self, message: tungstenite::Message) -> Result<(), Error> {
        self.socket.write(message).or_else(|error| self.early(error))
    }

    fn flush(&mut self) -> Result<(), Error> {
        self.full = false;
        self.socket.flush().or_else(|error| self.early(error))
    }

    /// The unsent rest stays with the socket, for the next time.
    fn early(&mut self, error: Error) -> Result<(), Error> {
        self.full = true;
        if is_early(&error) { Ok(()) } else { Err(error) }
    }
}

/// True if there was nothing to read, or no room to write.
fn is_early(error: &Error) -> bool {
    matches!(error, Error::Io(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut))
}
