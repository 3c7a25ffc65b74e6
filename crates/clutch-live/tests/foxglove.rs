//! Foxglove's protocol: its client gets what the log has, strangers get nothing, and a slow client costs nobody anything.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use clutch_live::Live;
use clutch_log::{CHANNELS, CommandRecord, Header, Record};
use clutch_loop::onlooker::{Looking, Onlooker};
use clutch_loop::to_log;
use clutch_sim::progress::UNWATCHED;
use clutch_sim::{Keep, Scenario};
use data_encoding::BASE64;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::net::TcpStream;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::{Error, Message, WebSocket};

const PROTOCOL: &str = "foxglove.websocket.v1";
/// Longest time of anything here.
const LONG: Duration = Duration::from_secs(20);

fn scenario() -> Scenario {
    let set = [("run.duration_s", "0.4"), ("run.settle_s", "0.1")];
    let set = set.map(|(key, value)| (key.to_owned(), value.to_owned()));
    Scenario::load("smc_2".as_ref(), &set).unwrap()
}

/// Opens a connection with these headers beside those of the protocol.
fn open(address: &str, headers: &[(&'static str, &str)]) -> Result<WebSocket<TcpStream>, Error> {
    let mut request = address.into_client_request()?;
    request.headers_mut().insert("Sec-WebSocket-Protocol", HeaderValue::from_static(PROTOCOL));
    for (name, value) in headers {
        request.headers_mut().insert(*name, HeaderValue::from_str(value).unwrap());
    }
    let host = request.uri().authority().unwrap().to_string();
    let stream = TcpStream::connect(host)?;
    stream.set_read_timeout(Some(LONG))?;
    match tungstenite::client(request, stream) {
        Ok((socket, response)) => {
            assert_eq!(response.headers()["Sec-WebSocket-Protocol"], PROTOCOL);
            Ok(socket)
        }
        Err(tungstenite::HandshakeError::Failure(error)) => Err(error),
        Err(interrupted) => panic!("{interrupted}"),
    }
}

/// A client that subscribes to each channel, one after the other, under its row + 100.
struct Client {
    socket: WebSocket<TcpStream>,
    channels: Vec<Value>,
}

/// A message as the protocol has it.
#[derive(Debug)]
enum Told {
    /// Row of the channel, time, data.
    Data(usize, u64, Vec<u8>),
    Time(u64),
    Text(Value),
    End,
}

impl Client {
    fn subscribe(address: &str) -> Client {
        let mut client = Client { socket: open(address, &[]).unwrap(), channels: Vec::new() };
        let Told::Text(info) = client.next() else { panic!("the server says first who it is") };
        assert_eq!((&info["op"], &info["capabilities"]), (&json!("serverInfo"), &json!(["time"])));
        let Told::Text(channels) = client.next() else { panic!("then what there is") };
        assert_eq!(channels["op"], "advertise");
        client.channels = channels["channels"].as_array().unwrap().clone();
        for channel in client.channels.clone() {
            let one = json!({ "id": client.row(&channel) + 100, "channelId": channel["id"] });
            client.say(&json!({ "op": "subscribe", "subscriptions": [one] }));
        }
        client
    }

    fn say(&mut self, json: &Value) {
        self.socket.send(Message::text(json.to_string())).unwrap();
    }

    fn row(&self, channel: &Value) -> usize {
        CHANNELS.iter().position(|c| c.topic == channel["topic"]).unwrap()
    }

    fn next(&mut self) -> Told {
        match self.socket.read() {
            Ok(Message::Text(text)) => Told::Text(serde_json::from_str(&text).unwrap()),
            Ok(Message::Binary(data)) if data[0] == 2 => Told::Time(number(&data[1..9])),
            Ok(Message::Binary(data)) => {
                assert_eq!(data[0], 1);
                let id = u32::from_le_bytes(data[1..5].try_into().unwrap());
                Told::Data(id as usize - 100, number(&data[5..13]), data[13..].to_vec())
            }
            Ok(_) | Err(Error::ConnectionClosed) => Told::End,
            Err(error) => panic!("{error}"),
        }
    }
}

fn number(bytes: &[u8]) -> u64 {
    u64::from_le_bytes(bytes.try_into().unwrap())
}

#[test]
fn a_client_gets_the_schemas_and_each_message_of_the_log_to_the_byte() {
    let scenario = scenario();
    let run = scenario.run(Keep::Trace, &|_| ControlFlow::Continue(())).unwrap();
    let file = std::env::temp_dir().join(format!("clutch-foxglove-{}.mcap", std::process::id()));
    to_log::save_simulation(&file, &scenario, &run, "test", None, UNWATCHED).unwrap();
    let log = std::fs::read(&file).unwrap();
    std::fs::remove_file(&file).unwrap();
    let log: Vec<mcap::Message<'_>> = mcap::MessageStream::new(&log).unwrap().map(Result::unwrap).collect();
    let started = log.iter().find(|m| m.channel.topic == "/parameters").unwrap().log_time;

    let mut live = Live::default();
    let address = live.foxglove(0).unwrap();
    let client = std::thread::spawn(move || {
        let mut client = Client::subscribe(&address);
        let (mut got, mut clock) = (BTreeMap::<usize, Vec<(u64, Vec<u8>)>>::new(), 0);
        loop {
            match client.next() {
                Told::Data(row, time, data) => {
                    assert!(time <= clock || CHANNELS[row].topic == "/parameters", "the time is told before");
                    got.entry(row).or_default().push((time, data));
                }
                Told::Time(time) => {
                    assert!(time > clock, "time goes forward");
                    clock = time;
                }
                Told::Text(text) => panic!("{text}"),
                Told::End => return (client.channels, got),
            }
        }
    });
    let live = Arc::new(live);
    let looking = Looking { onlooker: live.clone(), stop: Arc::default() };
    to_log::play_simulation(&looking, &scenario, &run, "test").unwrap();
    drop((looking, live));
    let (channels, got) = client.join().unwrap();

    for channel in &channels {
        assert_eq!(
            (&channel["encoding"], &channel["schemaEncoding"]),
            (&json!("protobuf"), &json!("protobuf"))
        );
        let of_log = log.iter().find(|m| m.channel.topic == channel["topic"]);
        // The log of a simulation has no messages of some channels, and then its stream has no schema.
        let Some(schema) = of_log.and_then(|m| m.channel.schema.clone()) else { continue };
        assert_eq!(channel["schemaName"], schema.name);
        assert_eq!(BASE64.decode(channel["schema"].as_str().unwrap().as_bytes()).unwrap(), *schema.data);
    }
    assert_eq!(channels.len(), CHANNELS.len());
    for (row, channel) in CHANNELS.iter().enumerate() {
        let of_log: Vec<_> = log
            .iter()
            .filter(|m| m.channel.topic == channel.topic)
            .map(|m| (m.log_time - started, m.data.to_vec()))
            .collect();
        let got = got.get(&row).map_or(&[][..], Vec::as_slice);
        let began = got.first().map_or(0, |first| first.0);
        let got: Vec<_> = got.iter().map(|(time, data)| (time - began, data.clone())).collect();
        assert_eq!(got.len(), of_log.len(), "{}", channel.topic);
        assert!(got == of_log, "{}", channel.topic);
    }
    assert_eq!(got.values().map(Vec::len).sum::<usize>(), log.len());
    assert!(log.len() > 1000, "{}", log.len());
}

#[test]
fn strangers_get_nothing() {
    let mut live = Live::default();
    let address = live.foxglove(0).unwrap();
    let refused = |address: &str, headers: &[(&'static str, &str)]| match open(address, headers) {
        Err(Error::Http(response)) => response.status().as_u16(),
        other => panic!("{address} {headers:?}: {other:?}"),
    };
    let (bare, token) = address.split_once("/?token=").unwrap();
    assert_eq!(refused(bare, &[]), 401);
    assert_eq!(refused(&format!("{bare}/?token="), &[]), 401);
    assert_eq!(refused(&format!("{bare}/?token={}", &token[1..]), &[]), 401);
    for origin in
        ["https://foreign.example", "null", "http://localhost", "https://app.foxglove.dev.foreign.example"]
    {
        assert_eq!(refused(&address, &[("Origin", origin)]), 403, "{origin}");
    }
    assert_eq!(refused(&address, &[("Host", "rebound.example")]), 421);
    assert_eq!(refused(&address, &[("Sec-WebSocket-Protocol", "chat")]), 400);
    // Its own pages, its desktop application, and what is no browser.
    let may = [vec![("Origin", "https://app.foxglove.dev")], vec![("Origin", "file://")], vec![]];
    let open: Vec<_> = may.iter().map(|headers| open(&address, headers).unwrap()).collect();
    assert_eq!(live.readers(), 0, "none has subscribed");
    drop(open);
}

#[test]
fn no_more_than_eight_clients_are_let_in() {
    let mut live = Live::default();
    let address = live.foxglove(0).unwrap();
    let all: Vec<_> = (0..8).map(|_| open(&address, &[]).unwrap()).collect();
    assert!(matches!(open(&address, &[]), Err(Error::Http(response)) if response.status() == 503));
    drop(all);
}

#[test]
fn a_client_that_does_not_read_stops_nobody_and_is_told_what_it_missed() {
    const ALL: u64 = 150_000;
    let mut live = Live::default();
    let address = live.foxglove(0).unwrap();
    let mut ring = live.begin(&Header::default(), &scenario(), None);
    let mut slow = Client::subscribe(&address);
    let mut quick = Client::subscribe(&address);
    let until = Instant::now() + LONG;
    while live.readers() < 2 {
        assert!(Instant::now() < until);
        std::thread::sleep(Duration::from_millis(5));
    }
    let end = std::thread::spawn(move || {
        loop {
            if let Told::Data(_, time, _) = quick.next()
                && time == ALL - 1
            {
                return;
            }
        }
    });
    let terms = [1.0; 8].into_iter().collect();
    for tick in 0..ALL {
        let record =
            Record::Command(CommandRecord { tick, time_ns: tick, terms, ..CommandRecord::default() });
        while ring.push(record).is_err() {
            assert!(Instant::now() < until, "the ring is not emptied");
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    end.join().unwrap();

    // Some were in the pipes already, and the last ones are kept.
    let (mut got, mut missed) = (0, 0);
    while got + missed < ALL {
        match slow.next() {
            Told::Data(..) => got += 1,
            Told::Text(text) => {
                assert_eq!((&text["op"], &text["level"]), (&json!("status"), &json!(1)));
                let words = text["message"].as_str().unwrap();
                missed += words.split(' ').next().unwrap().parse::<u64>().unwrap();
            }
            Told::Time(_) => {}
            Told::End => panic!("{got} messages, {missed} missed"),
        }
    }
    assert_eq!(got + missed, ALL);
    assert!(missed > 0, "a client that does not read misses some");
}

#[test]
fn what_a_client_gets_wrong_is_told_and_changes_nothing() {
    let mut live = Live::default();
    let address = live.foxglove(0).unwrap();
    let ring = live.begin(&Header::default(), &scenario(), None);
    let mut client = Client::subscribe(&address);
    let id = client.channels[0]["id"].clone();
    let subscribe = |id: u32, channel: &Value| json!({ "op": "subscribe", "subscriptions": [{ "id": id, "channelId": channel }] });
    for (said, level) in [
        (subscribe(7, &json!(9999)), 2),
        (subscribe(100, &id), 2),
        (subscribe(7, &id), 1),
        (json!({ "op": "setParameters", "parameters": [] }), 2),
        (json!("nothing"), 2),
    ] {
        client.say(&said);
        let Told::Text(status) = client.next() else { panic!("{said}") };
        assert_eq!((&status["op"], &status["level"]), (&json!("status"), &json!(level)), "{said}: {status}");
    }
    client.say(&json!({ "op": "unsubscribe", "subscriptionIds": [100, 12] }));
    client.say(&subscribe(100, &id));
    drop(ring);
    drop(live);
    assert!(matches!(client.next(), Told::End));
}

#[test]
fn a_new_run_has_new_channels_and_the_old_ones_go() {
    let mut live = Live::default();
    let address = live.foxglove(0).unwrap();
    let first = live.begin(&Header::default(), &scenario(), None);
    let mut client = Client::subscribe(&address);
    let ids =
        |channels: &Value| channels.as_array().unwrap().iter().map(|c| c["id"].clone()).collect::<Vec<_>>();
    let old = ids(&json!(client.channels));
    drop(first);
    let header = Header { term_names: vec!["other_v".to_owned()], ..Header::default() };
    let _second = live.begin(&header, &scenario(), None);
    let Told::Text(gone) = client.next() else { panic!("the old ones go") };
    assert_eq!((&gone["op"], &gone["channelIds"]), (&json!("unadvertise"), &json!(old)));
    let Told::Text(new) = client.next() else { panic!("new ones come") };
    assert_eq!(new["op"], "advertise");
    assert!(ids(&new["channels"]).iter().all(|id| !old.contains(id)));
}
