//! A browser's request, and whether it may have what it asks for.
//!
//! A page of another origin can send requests to this machine, and a name that it owns can point here. So a request has to
//! name this address as its host, must not come from another origin, and has to know the token.

use httparse::{EMPTY_HEADER, Request, Status};

/// Bytes of the longest request.
pub(crate) const LONGEST: usize = 8192;
/// Header lines of a request, at most.
const HEADERS: usize = 64;

/// The thing that is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked<'a> {
    /// The page.
    Page,
    /// The stream of frames.
    Events,
    /// The operator's stop.
    Stop,
    /// Another value of a gain.
    Set {
        /// Its key in a scenario.
        key: &'a str,
        /// The value, as it was written.
        value: &'a str,
    },
}

/// The reason why it is not given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Denied {
    /// No request, or one that is too long.
    Malformed,
    /// Another host is meant: a foreign name that points here.
    Host,
    /// A page of another origin asks.
    Origin,
    /// The token is missing, or another.
    Token,
    /// There is no such thing.
    Unknown,
    /// It is there, but not by this method.
    Method,
    /// Too many look on already.
    Crowded,
}

impl Denied {
    /// Status line of the answer.
    #[must_use]
    pub fn status(self) -> &'static str {
        match self {
            Denied::Malformed => "400 Bad Request",
            Denied::Host => "421 Misdirected Request",
            Denied::Origin => "403 Forbidden",
            Denied::Token => "401 Unauthorized",
            Denied::Unknown => "404 Not Found",
            Denied::Method => "405 Method Not Allowed",
            Denied::Crowded => "503 Service Unavailable",
        }
    }

    /// A sentence for the person who reads it.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Denied::Malformed => "This is no request that a browser sends.",
            Denied::Host => "This address is served as 127.0.0.1 and localhost only.",
            Denied::Origin => "A page of another origin gets nothing from here.",
            Denied::Token => "The address needs its token: open the one that clutch has printed, to its end.",
            Denied::Unknown => "There is no such page here.",
            Denied::Method => "This is asked for in another way: the page by GET, a stop by POST.",
            Denied::Crowded => "Too many pages look on already: close one.",
        }
    }
}

/// The way in: a port and a token.
#[derive(Clone, Debug)]
pub struct Gate {
    /// The port.
    pub port: u16,
    /// The token.
    pub token: String,
}

impl Gate {
    /// True if a value names this machine's loopback at the port, as a host, or behind a scheme as an origin.
    pub(crate) fn is_ours(&self, value: &[u8], scheme: &str) -> bool {
        ["127.0.0.1", "localhost"]
            .iter()
            .any(|host| value == format!("{scheme}{host}:{}", self.port).as_bytes())
    }

    /// True if a query has the token.
    pub(crate) fn is_known(&self, query: &str) -> bool {
        field(query, "token").is_some_and(|token| same(token, &self.token))
    }
}

/// The value of a field in a query, as it is written there.
fn field<'a>(query: &'a str, name: &str) -> Option<&'a str> {
    query.split('&').find_map(|pair| pair.split_once('=').filter(|(n, _)| *n == name).map(|(_, value)| value))
}

/// The thing that a browser asks for, in the head of its request; none if the head has not ended yet.
///
/// # Errors
/// The reason why it is not given.
pub fn asked<'a>(head: &'a [u8], gate: &Gate) -> Result<Option<Asked<'a>>, Denied> {
    let mut headers = [EMPTY_HEADER; HEADERS];
    let mut request = Request::new(&mut headers);
    match request.parse(head) {
        Ok(Status::Complete(_)) => {}
        Ok(Status::Partial) if head.len() < LONGEST => return Ok(None),
        Ok(Status::Partial) | Err(_) => return Err(Denied::Malformed),
    }
    let (Some(method), Some(target)) = (request.method, request.path) else { return Err(Denied::Malformed) };
    let named = |name: &str| {
        let mut values =
            request.headers.iter().filter(|h| h.name.eq_ignore_ascii_case(name)).map(|h| h.value);
        (values.next(), values.next().is_some())
    };
    if !matches!(named("host"), (Some(host), false) if gate.is_ours(host, "")) {
        return Err(Denied::Host);
    }
    // A browser sends none with a page that a person has opened.
    match named("origin") {
        (None, _) => {}
        (Some(origin), false) if gate.is_ours(origin, "http://") => {}
        _ => return Err(Denied::Origin),
    }
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    if !gate.is_known(query) {
        return Err(Denied::Token);
    }
    let (asked, by) = match path {
        "/" => (Asked::Page, "GET"),
        "/events" => (Asked::Events, "GET"),
        "/stop" => (Asked::Stop, "POST"),
        "/set" => match (field(query, "key"), field(query, "value")) {
            (Some(key), Some(value)) => (Asked::Set { key, value }, "POST"),
            _ => return Err(Denied::Malformed),
        },
        _ => return Err(Denied::Unknown),
    };
    if method == by { Ok(Some(asked)) } else { Err(Denied::Method) }
}

/// Compares in a time that does not show where two differ.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |differs, (a, b)| differs | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(first: &str, headers: &[&str]) -> Result<Option<Asked<'static>>, Denied> {
        let gate = Gate { port: 4242, token: "secret".into() };
        let head = format!("{first} HTTP/1.1\r\n{}\r\n\r\n", headers.join("\r\n"));
        asked(head.leak().as_bytes(), &gate)
    }

    const HOST: &str = "Host: 127.0.0.1:4242";

    #[test]
    fn the_page_its_stream_and_the_stop_are_there_for_who_has_the_token() {
        assert_eq!(ask("GET /?token=secret", &[HOST]), Ok(Some(Asked::Page)));
        assert_eq!(ask("GET /?x=1&token=secret", &["host: localhost:4242"]), Ok(Some(Asked::Page)));
        let origin = "Origin: http://127.0.0.1:4242";
        assert_eq!(ask("GET /events?token=secret", &[HOST, origin]), Ok(Some(Asked::Events)));
        assert_eq!(ask("POST /stop?token=secret", &[HOST, origin]), Ok(Some(Asked::Stop)));
        let set = Asked::Set { key: "law.pd.kp_v_rad", value: "4e1" };
        assert_eq!(
            ask("POST /set?token=secret&key=law.pd.kp_v_rad&value=4e1", &[HOST, origin]),
            Ok(Some(set))
        );
        assert_eq!(
            ask("POST /set?token=secret&key=law.pd.kp_v_rad", &[HOST, origin]),
            Err(Denied::Malformed)
        );
    }

    #[test]
    fn a_foreign_name_a_foreign_page_and_a_wrong_token_get_nothing() {
        for (headers, denied) in [
            (vec!["Host: rebound.example:4242"], Denied::Host),
            (vec!["Host: 127.0.0.1"], Denied::Host),
            (vec![HOST, "Host: rebound.example"], Denied::Host),
            (vec!["Accept: */*"], Denied::Host),
            (vec![HOST, "Origin: http://foreign.example"], Denied::Origin),
            (vec![HOST, "Origin: null"], Denied::Origin),
            (vec![HOST, "Origin: https://127.0.0.1:4242"], Denied::Origin),
        ] {
            assert_eq!(ask("POST /stop?token=secret", &headers), Err(denied), "{headers:?}");
        }
        for target in ["/", "/?token=", "/?token=secre", "/?token=secretx", "/?token=Secret", "/stop"] {
            assert_eq!(ask(&format!("GET {target}"), &[HOST]), Err(Denied::Token), "{target}");
        }
        assert_eq!(ask("GET /etc/passwd?token=secret", &[HOST]), Err(Denied::Unknown));
        assert_eq!(ask("GET /stop?token=secret", &[HOST]), Err(Denied::Method), "a link must not stop a run");
    }

    #[test]
    fn a_head_that_goes_on_is_waited_for_and_an_endless_one_is_not() {
        let gate = Gate { port: 1, token: "t".into() };
        assert_eq!(asked(b"GET /?tok", &gate), Ok(None));
        let mut endless = b"GET / HTTP/1.1\r\nX: ".to_vec();
        endless.resize(LONGEST, b'x');
        assert_eq!(asked(&endless, &gate), Err(Denied::Malformed));
        assert_eq!(asked(b"\x16\x03\x01\x02", &gate), Err(Denied::Malformed));
    }
}
