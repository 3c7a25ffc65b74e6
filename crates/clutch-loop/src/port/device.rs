//! The device behind a device file, and the capacity of its line.

use super::{Address, PortError};
use crate::realtime::line;
use rustix::fd::AsFd;
use rustix::io::Errno;
use std::io;
use std::os::fd::AsRawFd;
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The rates that serial adapters offer, baud, ascending.
pub const STANDARD_BAUDS: [u32; 18] = [
    9_600, 19_200, 38_400, 57_600, 115_200, 230_400, 460_800, 500_000, 576_000, 921_600, 1_000_000,
    1_152_000, 1_500_000, 2_000_000, 2_500_000, 3_000_000, 3_500_000, 4_000_000,
];

/// Bits on the line for a byte: start bit, 8 data bits, stop bit.
const BITS_PER_BYTE: u128 = 10;

/// The kind of device that a port leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceKind {
    /// A program on this machine.
    PseudoTerminal,
    /// A board that is itself a USB device (CDC-ACM).
    UsbCdc,
    /// A USB adapter to a serial line.
    UsbSerial,
    /// A serial line of this machine.
    Uart,
    /// A TCP connection.
    Tcp,
    /// A UNIX socket.
    Unix,
}

impl DeviceKind {
    /// There is a line on which bits take time, so the baud rate counts.
    #[must_use]
    pub fn has_line_rate(self) -> bool {
        matches!(self, DeviceKind::UsbSerial | DeviceKind::Uart)
    }

    /// True for a connection, false for a device file.
    #[must_use]
    pub fn is_socket(self) -> bool {
        matches!(self, DeviceKind::Tcp | DeviceKind::Unix)
    }

    /// In words, with an article.
    #[must_use]
    pub fn describe(self) -> &'static str {
        match self {
            DeviceKind::PseudoTerminal => "a pseudo-terminal",
            DeviceKind::UsbCdc => "a USB device without a serial line",
            DeviceKind::UsbSerial => "a USB serial adapter",
            DeviceKind::Uart => "a serial line",
            DeviceKind::Tcp => "a TCP connection",
            DeviceKind::Unix => "a UNIX socket",
        }
    }
}

/// Bytes of the fuller direction, and the rate that is just full, baud.
fn needed(bytes: (usize, usize), period: Duration) -> (usize, u128) {
    let most = bytes.0.max(bytes.1);
    let period_ns = period.as_nanos().max(1);
    (most, (most as u128 * BITS_PER_BYTE * 1_000_000_000).div_ceil(period_ns))
}

/// Refuses a line rate on which a cycle's bytes, (to the board, to the host), take longer than the
/// period. The two directions do not share the line: the fuller one counts.
///
/// ```
/// use clutch_loop::port::check_baud;
/// use std::time::Duration;
/// let period = Duration::from_millis(1);
/// assert!(check_baud(921_600, (18, 20), period).is_ok());
/// assert_eq!(
///     check_baud(115_200, (18, 20), period).unwrap_err().to_string(),
///     "baud = 115200: too slow for 20 bytes in each 1ms: 10 bits × 20 / 1ms = 200000 baud; \
///      expected at least 460800 baud, the lowest standard rate with 25 % margin"
/// );
/// ```
///
/// # Errors
/// [`PortError::BaudTooSlow`], with the arithmetic and the lowest standard rate that fits with
/// 25 % margin.
pub fn check_baud(baud: u32, bytes: (usize, usize), period: Duration) -> Result<(), PortError> {
    let (most, needed) = needed(bytes, period);
    if u128::from(baud) >= needed {
        return Ok(());
    }
    let fits = STANDARD_BAUDS.into_iter().find(|&rate| u128::from(rate) * 4 >= needed * 5);
    let needed = u64::try_from(needed).unwrap_or(u64::MAX);
    Err(PortError::BaudTooSlow { baud, bytes: most, period, needed, fits })
}

/// Says that a line which is fast enough has less than 25 % margin.
pub(super) fn tight_line(baud: u32, bytes: (usize, usize), period: Duration) -> Option<String> {
    let (most, needed) = needed(bytes, period);
    (u128::from(baud) * 4 < needed * 5).then(|| {
        format!(
            "baud = {baud}: {most} bytes in each {period:?} take {:.0} % of the line; after a delay it hardly \
             catches up. Choose a higher rate",
            100.0 * needed as f64 / f64::from(baud)
        )
    })
}

/// The facts that `/sys` gives of a device file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Found {
    pub(super) kind: DeviceKind,
    /// The driver's name, if there is one.
    pub(super) driver: Option<String>,
    /// The device's folder in `/sys`.
    folder: PathBuf,
}

/// The reason why a file is not taken for a serial device.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum NotSerial {
    /// The system did not let us look.
    Errno(Errno),
    /// It is something else.
    Is(String),
}

impl NotSerial {
    pub(super) fn into_error(self, address: &Address, path: &Path) -> PortError {
        match self {
            NotSerial::Errno(errno) => PortError::from_open(address, path, errno),
            NotSerial::Is(why) => PortError::NotASerialDevice { path: path.to_owned(), why },
        }
    }
}

/// Looks at a file without opening it.
pub(super) fn classify_path(sys: &Path, path: &Path) -> Result<Found, NotSerial> {
    let meta = std::fs::metadata(path)
        .map_err(|error| NotSerial::Errno(Errno::from_io_error(&error).unwrap_or(Errno::IO)))?;
    let kind = meta.file_type();
    let what = if kind.is_dir() {
        "a folder"
    } else if kind.is_file() {
        "an ordinary file"
    } else if kind.is_socket() {
        "a socket; for TCP write tcp://ADDRESS:PORT"
    } else if kind.is_fifo() {
        "a named pipe"
    } else if kind.is_block_device() {
        "a disk"
    } else {
        return classify(sys, rustix::fs::major(meta.rdev()), rustix::fs::minor(meta.rdev()));
    };
    Err(NotSerial::Is(format!("it is {what}")))
}

/// The kind of the character device of these numbers.
pub(super) fn classify(sys: &Path, major: u32, minor: u32) -> Result<Found, NotSerial> {
    let folder = sys.join(format!("dev/char/{major}:{minor}"));
    let found = |kind, driver| Ok(Found { kind, driver, folder: folder.clone() });
    match (major, minor) {
        // Numbers fixed by the kernel (Documentation/admin-guide/devices.txt).
        (136..=143, _) => return found(DeviceKind::PseudoTerminal, None),
        (4, 0..=63) => return Err(NotSerial::Is("it is a text console".to_owned())),
        (5, 0) => return Err(NotSerial::Is("it is the terminal this program runs in".to_owned())),
        (5, 1) => return Err(NotSerial::Is("it is the system's console".to_owned())),
        (5, 2) => return Err(NotSerial::Is("it makes pseudo-terminals".to_owned())),
        _ => {}
    }
    let link = |name: &str| {
        let target = std::fs::read_link(folder.join(name)).ok()?;
        Some(target.file_name()?.to_string_lossy().into_owned())
    };
    match link("subsystem") {
        Some(class) if class == "tty" => {}
        Some(class) => return Err(NotSerial::Is(format!("it is a device of the class {class}"))),
        // Without /sys, opening has to show it.
        None => {}
    }
    let driver = link("device/driver");
    let kind = match (driver.as_deref(), link("device/subsystem").as_deref()) {
        (Some("cdc_acm"), _) => DeviceKind::UsbCdc,
        (_, Some("usb-serial")) => DeviceKind::UsbSerial,
        _ => DeviceKind::Uart,
    };
    found(kind, driver)
}

impl Found {
    /// Time for which the adapter holds received bytes, ms, where its driver reports it (FTDI).
    pub(super) fn latency_timer_ms(&self) -> Option<u32> {
        line(&self.folder.join("device/latency_timer"))?.parse().ok()
    }

    /// The result of low-latency mode, if there is something to say.
    pub(super) fn latency_note(
        &self,
        port: &str,
        refused: Option<&io::Error>,
        timer_ms: Option<u32>,
    ) -> Option<String> {
        if !self.kind.has_line_rate() {
            return None;
        }
        let name = port.rsplit('/').next().unwrap_or(port);
        let answer = match refused {
            Some(error) => format!("low-latency mode was refused ({error})"),
            None => "low-latency mode was accepted without effect".to_owned(),
        };
        match (timer_ms, refused) {
            (Some(0 | 1), _) | (None, None) => None,
            (Some(ms), _) => Some(format!(
                "{port}: the adapter holds received bytes for up to {ms} ms, and {answer}: too late for a loop at \
                 1 kHz. Set it by hand: echo 1 | sudo tee /sys/bus/usb-serial/devices/{name}/latency_timer"
            )),
            (None, Some(_)) if self.kind == DeviceKind::UsbSerial => Some(format!(
                "{port}: {answer}, and the driver ({}) does not say how long the adapter holds received bytes: an \
                 FTDI adapter does for 16 ms. Look for /sys/bus/usb-serial/devices/{name}/latency_timer, and measure \
                 the round trip",
                self.driver.as_deref().unwrap_or("unknown")
            )),
            (None, Some(_)) => {
                Some(format!("{port}: {answer}; received bytes may come late in small groups"))
            }
        }
    }
}

/// The kernel's `struct serial_struct` (include/uapi/linux/serial.h).
#[repr(C)]
struct SerialStruct {
    kind: libc::c_int,
    line: libc::c_int,
    port: libc::c_uint,
    irq: libc::c_int,
    flags: libc::c_int,
    xmit_fifo_size: libc::c_int,
    custom_divisor: libc::c_int,
    baud_base: libc::c_int,
    close_delay: libc::c_ushort,
    io_type: libc::c_char,
    reserved_char: [libc::c_char; 1],
    hub6: libc::c_int,
    closing_wait: libc::c_ushort,
    closing_wait2: libc::c_ushort,
    iomem_base: *mut libc::c_uchar,
    iomem_reg_shift: libc::c_ushort,
    port_high: libc::c_uint,
    iomap_base: libc::c_ulong,
}

/// `ASYNC_LOW_LATENCY` (include/uapi/linux/tty_flags.h).
const LOW_LATENCY: libc::c_int = 1 << 13;

/// Asks the driver to hand received bytes over at once.
pub(super) fn set_low_latency(fd: impl AsFd) -> io::Result<()> {
    let fd = fd.as_fd().as_raw_fd();
    let check = |result: libc::c_int| if result < 0 { Err(io::Error::last_os_error()) } else { Ok(()) };
    // SAFETY: all fields are numbers or a pointer nobody follows here; zero is a value of each.
    let mut serial: SerialStruct = unsafe { std::mem::zeroed() };
    // SAFETY: `serial` has the layout the kernel writes, and lives through the call; `fd` is open.
    check(unsafe { libc::ioctl(fd, libc::TIOCGSERIAL as _, &mut serial as *mut SerialStruct) })?;
    if serial.flags & LOW_LATENCY != 0 {
        return Ok(());
    }
    serial.flags |= LOW_LATENCY;
    // SAFETY: as above; the kernel only reads.
    check(unsafe { libc::ioctl(fd, libc::TIOCSSERIAL as _, &serial as *const SerialStruct) })
}

/// The terminal in which the user typed the command: its settings are not ours to change.
///
/// The kernel names the session of a terminal only to a process that terminal controls. The number itself is not
/// looked at: where the session began outside of a container it is zero.
pub(super) fn is_own_terminal(fd: impl AsFd) -> bool {
    let mut session: libc::pid_t = 0;
    // SAFETY: the kernel writes one process identifier to `session`, which lives through the call; `fd` is open.
    unsafe { libc::ioctl(fd.as_fd().as_raw_fd(), libc::TIOCGSID as _, &mut session as *mut libc::pid_t) == 0 }
}
