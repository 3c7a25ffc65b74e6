//! The errors of ports, and what to do about each.

use super::Address;
use rustix::io::Errno;
use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The program that has a port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Holder {
    /// Its process number.
    pub pid: u32,
    /// Its name, as far as the system gives it.
    pub name: Option<String>,
}

impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.name {
            Some(name) => write!(f, "{name}, process {}", self.pid),
            None => write!(f, "process {}", self.pid),
        }
    }
}

/// The reason why a port cannot be used. Each message says what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PortError {
    /// There is no such device file.
    #[error("{}: there is no such device; {}", path.display(), present_list(present))]
    NotFound {
        /// The device file asked for.
        path: PathBuf,
        /// The serial devices there are.
        present: Vec<PathBuf>,
    },
    /// The user may not open the device.
    #[error("{}: permission denied; {advice}", path.display())]
    PermissionDenied {
        /// The device file.
        path: PathBuf,
        /// Its owner, and the way to be let in.
        advice: String,
    },
    /// The file is no serial device.
    #[error("{}: not a serial device ({why}); expected one as /dev/ttyUSB0, /dev/ttyACM0 or the path that the simulated board prints", path.display())]
    NotASerialDevice {
        /// The file.
        path: PathBuf,
        /// The thing that it is instead, in words.
        why: String,
    },
    /// Another program has the port.
    #[error("{address}: in use by another program{}; end that program, or choose another port", holder_text(holder.as_ref()))]
    Busy {
        /// The port.
        address: Address,
        /// The other program, if it can be found out.
        holder: Option<Holder>,
    },
    /// Nobody listens at the TCP address.
    #[error("tcp://{to}: nobody listens there; start the board first, or check address and port")]
    ConnectionRefused {
        /// The address.
        to: SocketAddr,
    },
    /// The TCP address cannot be reached.
    #[error("tcp://{to}: no answer ({source}); check the address and the network")]
    Unreachable {
        /// The address.
        to: SocketAddr,
        /// The system's answer.
        source: io::Error,
    },
    /// The TCP address cannot be listened on.
    #[error(
        "tcp://{to}: cannot listen there ({source}); choose another address or port, or port 0 for any free one"
    )]
    CannotListen {
        /// The address.
        to: SocketAddr,
        /// The system's answer.
        source: io::Error,
    },
    /// The UNIX socket of a board cannot be opened.
    #[error("unix://{}: {source}; start the board first, or check the path", path.display())]
    Socket {
        /// Its file.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// A UNIX socket cannot be made there.
    #[error("unix://{}: {source}; name a file that does not exist, in a folder of yours", path.display())]
    CannotMakeSocket {
        /// Its file.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// The TCP address is open to other machines.
    #[error("tcp://{to}: other machines could reach this address, and whoever does moves the shaft; expected a loopback address, as tcp://127.0.0.1:{}", to.port())]
    NotLoopback {
        /// The address.
        to: SocketAddr,
    },
    /// The other side is gone.
    #[error(
        "{address}: unplugged, or the board's program has ended; check cable and power, start the board, then start again"
    )]
    Unplugged {
        /// The port.
        address: Address,
    },
    /// The frames do not fit the line rate.
    #[error("baud = {baud}: too slow for {bytes} bytes in each {:?}: 10 bits × {bytes} / {:?} = {needed} baud; expected {}", period, period, fits_text(*fits))]
    BaudTooSlow {
        /// The rate asked for, baud.
        baud: u32,
        /// Bytes of a cycle in the fuller direction.
        bytes: usize,
        /// The cycle's period.
        period: Duration,
        /// The rate that is just full, baud.
        needed: u64,
        /// The lowest standard rate with 25 % margin, baud; `None` if there is none.
        fits: Option<u32>,
    },
    /// The driver does not take the line rate.
    #[error(
        "{address}: baud = {baud} was not taken by the driver ({source}); choose a rate that the adapter's data sheet lists"
    )]
    BaudRefused {
        /// The port.
        address: Address,
        /// The rate asked for, baud.
        baud: u32,
        /// The system's answer.
        source: io::Error,
    },
    /// Anything else.
    #[error("{address}: {source}")]
    Io {
        /// The port.
        address: Address,
        /// The system's answer.
        source: io::Error,
    },
}

impl PortError {
    /// An error of opening or setting up a device file.
    pub(super) fn from_open(address: &Address, path: &Path, errno: Errno) -> Self {
        let path = path.to_owned();
        match errno {
            Errno::NOENT => PortError::NotFound { path, present: serial_devices(Path::new("/dev")) },
            Errno::ACCESS | Errno::PERM => {
                let advice = permission_advice(&path, Path::new("/etc/group"));
                PortError::PermissionDenied { path, advice }
            }
            // The exclusive mark of somebody who does not lock: the kernel does not say who.
            Errno::BUSY => PortError::Busy { address: address.clone(), holder: None },
            Errno::NOTTY | Errno::ISDIR | Errno::INVAL => {
                PortError::NotASerialDevice { path, why: "it takes no line settings".to_owned() }
            }
            Errno::IO | Errno::NXIO | Errno::NODEV => PortError::NotASerialDevice {
                path,
                why: "there is no hardware behind it, or its program has ended".to_owned(),
            },
            other => PortError::Io { address: address.clone(), source: other.into() },
        }
    }
}

fn holder_text(holder: Option<&Holder>) -> String {
    holder.map_or_else(String::new, |holder| format!(" ({holder})"))
}

fn present_list(present: &[PathBuf]) -> String {
    if present.is_empty() {
        return "no serial adapter is plugged in. Plug the board in, or start the simulated one".to_owned();
    }
    let list: Vec<String> = present.iter().map(|path| path.display().to_string()).collect();
    format!("present are {}", list.join(", "))
}

fn fits_text(fits: Option<u32>) -> String {
    match fits {
        Some(baud) => format!("at least {baud} baud, the lowest standard rate with 25 % margin"),
        None => "a longer period: no standard rate fits with 25 % margin. Or a board on USB, which has no line rate"
            .to_owned(),
    }
}

/// The serial devices in `dev`: stable names first.
pub(super) fn serial_devices(dev: &Path) -> Vec<PathBuf> {
    let list = |folder: PathBuf, take: &dyn Fn(&str) -> bool| {
        let mut found: Vec<PathBuf> = std::fs::read_dir(folder)
            .into_iter()
            .flatten()
            .flatten()
            .filter(|entry| take(&entry.file_name().to_string_lossy()))
            .map(|entry| entry.path())
            .collect();
        found.sort();
        found
    };
    let mut all = list(dev.join("serial/by-id"), &|_| true);
    // The boards' own serial ports have no stable names; the 8250's ttyS0… mostly lead nowhere.
    all.extend(list(dev.to_owned(), &|name| {
        ["ttyUSB", "ttyACM", "ttyAMA", "ttyTHS", "ttymxc", "ttySTM"]
            .iter()
            .any(|start| name.starts_with(start))
    }));
    all
}

/// The owner of the file, and the way to join its group.
pub(super) fn permission_advice(path: &Path, groups: &Path) -> String {
    let Ok(meta) = std::fs::metadata(path) else {
        return "one of its folders is closed to you; ask the administrator of this machine".to_owned();
    };
    let (gid, mode) = (meta.gid(), meta.mode() & 0o777);
    let text = std::fs::read_to_string(groups).unwrap_or_default();
    let name = text.lines().find_map(|line| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        (fields.nth(1)?.parse() == Ok(gid)).then(|| name.to_owned())
    });
    let shown = name.clone().unwrap_or_else(|| gid.to_string());
    let member =
        rustix::process::getgroups().is_ok_and(|list| list.iter().any(|group| group.as_raw() == gid));
    let owned = format!("it belongs to the group {shown} with mode {mode:04o}");
    match name {
        // Another user's pseudo-terminal, or a device whose group has no rights or is root's own.
        _ if mode & 0o060 != 0o060 || gid == 0 || member => format!(
            "{owned}, which lets only its owner in. Start as the user who owns it; a device can be opened to the \
             group dialout by a udev rule: SUBSYSTEM==\"tty\", KERNEL==\"{}\", GROUP=\"dialout\", MODE=\"0660\"",
            path.file_name().map_or_else(|| "ttyUSB*".into(), |name| name.to_string_lossy())
        ),
        Some(name) => format!("{owned}. Join it: sudo usermod -aG {name} $USER; then log out and in again"),
        None => format!("{owned}. Ask the administrator of this machine to let you in"),
    }
}

/// The program that holds the lock on the file.
pub(super) fn lock_holder(path: &Path) -> Option<Holder> {
    /// The list is read in pieces; a lock given up elsewhere between two of them shifts the rest,
    /// and a line is missed.
    const READINGS: usize = 10;
    let meta = std::fs::metadata(path).ok()?;
    let pid = (0..READINGS)
        .find_map(|_| holder_in(&std::fs::read_to_string("/proc/locks").ok()?, meta.dev(), meta.ino()))?;
    let name = crate::realtime::line(Path::new(&format!("/proc/{pid}/comm")));
    Some(Holder { pid, name })
}

/// The process in the text of `/proc/locks`: `1: FLOCK  ADVISORY  WRITE 708 00:15:3 0 EOF`.
pub(super) fn holder_in(locks: &str, device: u64, inode: u64) -> Option<u32> {
    let (major, minor) = (rustix::fs::major(device), rustix::fs::minor(device));
    let file = format!("{major:02x}:{minor:02x}:{inode}");
    locks.lines().find_map(|line| {
        let mut words = line.split_whitespace().skip(1);
        // A line with an arrow waits for the lock, it does not have it.
        let kind = words.next()?;
        let pid = words.nth(2)?;
        (kind == "FLOCK" && words.next()? == file).then(|| pid.parse().ok().filter(|&pid| pid > 0))?
    })
}
