//! The address of a board, as the user writes it.

use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::str::FromStr;

/// Line rate unless told otherwise, baud: the cycle's frames at 1 kHz do not fit below 460 800.
pub const DEFAULT_BAUD: u32 = 921_600;

/// The address of a board: `/dev/ttyUSB0`, `tcp://127.0.0.1:5000` or `unix:///run/user/1000/board`.
///
/// ```
/// use clutch_loop::port::{Address, DEFAULT_BAUD};
/// let serial: Address = "/dev/ttyUSB0".parse()?;
/// assert_eq!(serial, Address::Serial { path: "/dev/ttyUSB0".into(), baud: DEFAULT_BAUD });
/// let tcp: Address = "tcp://127.0.0.1:5000".parse()?;
/// assert_eq!(tcp.to_string(), "tcp://127.0.0.1:5000");
/// let error = "ttyUSB0".parse::<Address>().unwrap_err();
/// assert_eq!(
///     error.to_string(),
///     "port = \"ttyUSB0\": expected a device as /dev/ttyUSB0 or an address as tcp://127.0.0.1:5000; \
///      did you mean /dev/ttyUSB0?"
/// );
/// # Ok::<(), clutch_loop::port::AddressError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Address {
    /// A serial device or the slave of a pseudo-terminal.
    Serial {
        /// The device file.
        path: PathBuf,
        /// Line rate, baud. Without effect on a pseudo-terminal or a USB board.
        baud: u32,
    },
    /// A board that listens on TCP.
    Tcp(SocketAddr),
    /// A board that listens on a UNIX socket: the file that it made.
    Unix(PathBuf),
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Address::Serial { path, .. } => write!(f, "{}", path.display()),
            Address::Tcp(to) => write!(f, "tcp://{to}"),
            Address::Unix(path) => write!(f, "unix://{}", path.display()),
        }
    }
}

/// A text that is no [`Address`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AddressError {
    /// The text.
    pub value: String,
    /// The address that it could have meant.
    pub suggestion: Option<String>,
}

impl fmt::Display for AddressError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "port = {:?}: expected a device as /dev/ttyUSB0 or an address as tcp://127.0.0.1:5000",
            self.value
        )?;
        match &self.suggestion {
            Some(suggestion) => write!(f, "; did you mean {suggestion}?"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for AddressError {}

/// `127.0.0.1:5000`, `[::1]:5000` or `localhost:5000`. No other names: looking one up may take
/// seconds and may lead elsewhere.
fn socket(text: &str) -> Option<SocketAddr> {
    if let Some(port) = text.strip_prefix("localhost:") {
        return Some(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port.parse().ok()?));
    }
    text.parse().ok()
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let fail = |suggestion: Option<String>| Err(AddressError { value: text.to_owned(), suggestion });
        if let Some(rest) = text.strip_prefix("tcp://") {
            let rest = rest.strip_suffix('/').unwrap_or(rest);
            return match socket(rest) {
                Some(to) => Ok(Address::Tcp(to)),
                None if rest.parse::<IpAddr>().is_ok() || rest == "localhost" => {
                    fail(Some(format!("tcp://{rest}:5000")))
                }
                None => fail(None),
            };
        }
        if let Some(path) = text.strip_prefix("unix://")
            && path.len() > 1
            && path.starts_with('/')
            && !path.contains('\0')
        {
            return Ok(Address::Unix(PathBuf::from(path)));
        }
        if text.contains("://") || text.contains('\0') {
            return fail(None);
        }
        if text.starts_with('/') || text.starts_with("./") || text.starts_with("../") {
            return Ok(Address::Serial { path: PathBuf::from(text), baud: DEFAULT_BAUD });
        }
        if let Some(to) = socket(text) {
            return fail(Some(Address::Tcp(to).to_string()));
        }
        let bare = text.strip_prefix("dev/").unwrap_or(text);
        if bare.starts_with("tty") || bare.starts_with("pts/") || bare.starts_with("serial/") {
            return fail(Some(format!("/dev/{bare}")));
        }
        fail(None)
    }
}
