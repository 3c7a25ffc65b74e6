use super::device::{NotSerial, classify, classify_path, set_low_latency, tight_line};
use super::error::{holder_in, permission_advice, serial_devices};
use super::*;
use crate::realtime::{Readiness, WaitMode, monotonic_ns, wait_readable};
use rustix::process::{Gid, Uid, geteuid};
use std::fs;
use std::io::Read;
use std::os::unix::fs::{OpenOptionsExt, PermissionsExt, symlink};
use std::path::PathBuf;
use std::process::{Child, Command};
use std::thread;

const MS: u64 = 1_000_000;
const SLEEP: WaitMode = WaitMode::Sleep;

fn serial(path: &Path) -> Address {
    Address::Serial { path: path.to_owned(), baud: DEFAULT_BAUD }
}

fn try_open(path: &Path) -> Result<Opened, PortError> {
    Port::open(&serial(path), &SerialOptions::default())
}

fn tcp(listener: &Listener) -> Port {
    Port::open(&listener.address(), &SerialOptions::default()).unwrap().port
}

/// Reads `count` bytes within 5 s.
fn read_port(port: &mut Port, count: usize) -> Vec<u8> {
    let (mut got, mut buf, until) = (Vec::new(), [0; 512], monotonic_ns() + 5000 * MS);
    while got.len() < count && monotonic_ns() < until {
        let _ = wait_readable(port.as_fd(), until, SLEEP);
        let n = port.read(&mut buf).unwrap();
        got.extend_from_slice(&buf[..n]);
    }
    got
}

fn read_board(board: &mut dyn Endpoint, count: usize) -> Vec<u8> {
    let (mut got, mut buf, until) = (Vec::new(), [0; 512], monotonic_ns() + 5000 * MS);
    while got.len() < count && monotonic_ns() < until {
        let _ = board.wait(until, SLEEP);
        let n = board.read(&mut buf).unwrap();
        got.extend_from_slice(&buf[..n]);
    }
    got
}

/// The next event, within 5 s.
fn event(board: &mut dyn Endpoint) -> Option<ClientEvent> {
    for _ in 0..5000 {
        if let Some(event) = board.service().unwrap() {
            return Some(event);
        }
        thread::sleep(Duration::from_millis(1));
    }
    None
}

/// The error of a read or write, within 5 s.
fn failure(mut act: impl FnMut() -> io::Result<usize>) -> io::Error {
    for _ in 0..5000 {
        match act() {
            Ok(_) => thread::sleep(Duration::from_millis(1)),
            Err(error) => return error,
        }
    }
    panic!("no error in 5 s");
}

/// On a thread without root's rights. Linux has them per thread.
fn without_rights<T: Send + 'static>(act: impl FnOnce() -> T + Send + 'static) -> T {
    thread::spawn(|| {
        if geteuid().is_root() {
            let (user, group) = (Uid::from_raw(65534), Gid::from_raw(65534));
            rustix::thread::set_thread_groups(&[]).unwrap();
            rustix::thread::set_thread_res_gid(group, group, group).unwrap();
            rustix::thread::set_thread_res_uid(user, user, user).unwrap();
        }
        act()
    })
    .join()
    .unwrap()
}

fn set_mode(path: &Path, mode: u32) {
    fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
}

fn temporary(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("clutch-port-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

// ---- bytes ----

#[test]
fn every_byte_passes_unchanged_both_ways() {
    let (mut board, path) = PseudoTerminal::open().unwrap();
    let mut port = try_open(&path).unwrap().port;
    assert_eq!(event(&mut board), Some(ClientEvent::Connected));
    // Those that a terminal would act on first, then all.
    let mut bytes = vec![0x00, 0x03, 0x04, 0x0a, 0x0d, 0x11, 0x13, 0x1a, 0x1c, 0x7f, 0xff, 0xff, 0x00, 0x00];
    bytes.extend(0..=255);
    assert_eq!(port.write(&bytes).unwrap(), bytes.len());
    assert_eq!(read_board(&mut board, bytes.len()), bytes);
    assert_eq!(board.write(&bytes).unwrap(), bytes.len());
    assert_eq!(read_port(&mut port, bytes.len()), bytes);
    // No echo came with them.
    thread::sleep(Duration::from_millis(20));
    assert_eq!(board.read(&mut [0; 16]).unwrap(), 0);
    assert_eq!(port.read(&mut [0; 16]).unwrap(), 0);
}

#[test]
fn bytes_pass_unchanged_over_tcp_and_leave_at_once() {
    let mut board = Listener::bind("127.0.0.1:0".parse().unwrap()).unwrap();
    let mut port = tcp(&board);
    assert_eq!(event(&mut board), Some(ClientEvent::Connected));
    assert!(board.client_present());
    assert_eq!(port.kind(), DeviceKind::Tcp);
    let bytes: Vec<u8> = (0..=255).collect();
    assert_eq!(port.write(&bytes).unwrap(), 256);
    assert_eq!(read_board(&mut board, 256), bytes);
    assert_eq!(board.write(&bytes).unwrap(), 256);
    assert_eq!(read_port(&mut port, 256), bytes);
    assert!(rustix::net::sockopt::tcp_nodelay(&port.fd).unwrap());
    port.discard().unwrap();
}

#[test]
fn a_line_without_bytes_is_not_a_line_without_a_board() {
    let (_board, path) = PseudoTerminal::open().unwrap();
    let mut port = try_open(&path).unwrap().port;
    for _ in 0..3 {
        assert_eq!(port.read(&mut [0; 64]).unwrap(), 0);
    }
    assert_eq!(port.read(&mut []).unwrap(), 0);
    assert_eq!(port.write(&[]).unwrap(), 0);
    let until = monotonic_ns() + 5 * MS;
    assert_eq!(wait_readable(port.as_fd(), until, SLEEP), Readiness::Timeout);
}

#[test]
fn a_full_line_takes_a_part_then_nothing_and_never_waits() {
    let (mut board, path) = PseudoTerminal::open().unwrap();
    let mut port = try_open(&path).unwrap().port;
    assert_eq!(event(&mut board), Some(ClientEvent::Connected));
    let sent: Vec<u8> = (0..200_000_u32).map(|k| (k % 251) as u8).collect();
    let mut count = 0;
    let mut refused = false;
    for chunk in sent.chunks(1000) {
        let n = port.write(chunk).unwrap();
        count += n;
        if n < chunk.len() {
            refused = true;
            break;
        }
    }
    assert!(refused, "200 kB went into a line nobody reads");
    while port.write(b"x").unwrap() == 1 {
        count += 1;
    }
    // As many bytes arrive as were counted as taken, no byte more.
    let got = read_board(&mut board, count);
    assert_eq!(got.len(), count);
    thread::sleep(Duration::from_millis(20));
    assert_eq!(board.read(&mut [0; 16]).unwrap(), 0);
    assert_eq!(port.write(b"again").unwrap(), 5);
    // The other way round, too.
    while board.write(&[7; 1000]).unwrap() == 1000 {}
    for _ in 0..100 {
        let _ = board.write(&[7; 1000]).unwrap(); // the last gaps fill up
    }
    assert_eq!(board.write(&[7; 1000]).unwrap(), 0);
}

// ---- one program per port ----

#[test]
fn a_second_opening_is_refused_also_for_root_and_names_the_first() {
    let (mut board, path) = PseudoTerminal::open().unwrap();
    let mut first = try_open(&path).unwrap().port;
    assert_eq!(event(&mut board), Some(ClientEvent::Connected));
    for _ in 0..100 {
        let error = try_open(&path).unwrap_err();
        let PortError::Busy { holder, .. } = &error else { panic!("{error:?}") };
        let text = error.to_string();
        assert!(text.contains("in use by another program"), "{text}");
        let holder = holder.as_ref().expect("/proc/locks names the holder");
        assert_eq!(holder.pid, std::process::id());
        assert!(text.contains(&format!("process {}", holder.pid)), "{text}");
    }
    // The first does not notice: neither bytes nor its client's presence are lost.
    board.write(b"before").unwrap();
    assert!(try_open(&path).is_err());
    assert_eq!(read_port(&mut first, 6), b"before");
    assert_eq!(board.service().unwrap(), None);
    drop(first);
    try_open(&path).unwrap();
}

#[test]
fn a_port_marked_exclusive_by_a_program_that_does_not_lock_is_busy() {
    let (_board, path) = PseudoTerminal::open().unwrap();
    set_mode(&path, 0o666);
    let theirs = fs::File::options().read(true).write(true).custom_flags(libc::O_NOCTTY).open(&path).unwrap();
    ioctl_tiocexcl(&theirs).unwrap();
    let error = without_rights(move || try_open(&path).map(|_| ())).unwrap_err();
    assert!(matches!(error, PortError::Busy { holder: None, .. }), "{error:?}");
}

/// Runs this test binary again as a client that holds the port until it is killed.
fn client(path: &Path) -> Child {
    Command::new(std::env::current_exe().unwrap())
        .args(["port::tests::a_client_that_holds_the_port", "--exact", "--ignored", "--nocapture"])
        .env("CLUTCH_PORT", path)
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap()
}

#[test]
#[ignore = "started by other tests as a program of its own"]
fn a_client_that_holds_the_port() {
    let Some(path) = std::env::var_os("CLUTCH_PORT") else { return };
    let mut port = try_open(Path::new(&path)).unwrap().port;
    port.write(b"here").unwrap();
    thread::sleep(Duration::from_secs(30));
}

#[test]
fn a_pseudo_terminal_can_be_opened_again_after_its_client_was_killed() {
    let (mut board, path) = PseudoTerminal::open().unwrap();
    set_mode(&path, 0o666);
    for _ in 0..3 {
        let mut child = client(&path);
        assert_eq!(event(&mut board), Some(ClientEvent::Connected));
        assert_eq!(read_board(&mut board, 4), b"here");
        let busy = try_open(&path).unwrap_err();
        let PortError::Busy { holder: Some(holder), .. } = &busy else { panic!("{busy:?}") };
        assert_eq!(holder.pid, child.id());
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(event(&mut board), Some(ClientEvent::Left));
        let path = path.clone();
        without_rights(move || try_open(&path).map(|_| ()))
            .expect("the port is free again, also for non-root");
        // The client was there too short to be certain to be seen, and a program that another test
        // starts may have a copy of its descriptor for a moment.
        while board.service().unwrap().is_some() || board.client_present() {}
    }
}

// ---- clients that come and go ----

#[test]
fn a_hang_up_is_an_error_in_reading_and_writing_and_is_explained() {
    let (board, path) = PseudoTerminal::open().unwrap();
    let mut port = try_open(&path).unwrap().port;
    assert_eq!(port.read(&mut [0; 8]).unwrap(), 0);
    drop(board);
    assert_ne!(wait_readable(port.as_fd(), monotonic_ns() + 1000 * MS, SLEEP), Readiness::Timeout);
    let error = failure(|| port.read(&mut [0; 8]));
    assert_eq!(error.kind(), io::ErrorKind::BrokenPipe);
    assert_eq!(failure(|| port.write(b"x")).kind(), io::ErrorKind::BrokenPipe);
    assert_eq!(port.read(&mut [0; 8]).unwrap_err().kind(), io::ErrorKind::BrokenPipe, "it stays so");
    let text = port.explain(&error).to_string();
    assert!(text.starts_with(&path.display().to_string()), "{text}");
    assert!(text.contains("unplugged") && text.contains("check cable"), "{text}");
    // A path whose board is gone is said to be so. The system gives its number to the next terminal, which another test
    // may have opened by now, for itself.
    drop(port);
    if let Err(error) = try_open(&path) {
        let gone = matches!(error, PortError::NotFound { .. } | PortError::NotASerialDevice { .. });
        assert!(gone || matches!(error, PortError::Busy { .. }), "{error:?}");
    }
}

#[test]
fn a_board_sees_each_client_come_and_go_and_leaves_nothing_to_the_next() {
    let (mut board, path) = PseudoTerminal::open().unwrap();
    assert_eq!(board.service().unwrap(), None);
    assert!(!board.client_present());
    // To nobody: gone, as on an open cable.
    assert_eq!(board.write(b"early").unwrap(), 5);
    for round in 0..20 {
        let mut port = try_open(&path).unwrap().port;
        assert_eq!(event(&mut board), Some(ClientEvent::Connected), "round {round}");
        assert!(board.client_present());
        assert_eq!(board.service().unwrap(), None);
        assert_eq!(port.read(&mut [0; 64]).unwrap(), 0, "round {round}: something was left over");
        assert_eq!(board.write(b"stale sample").unwrap(), 12);
        assert_eq!(port.write(b"last command").unwrap(), 12);
        drop(port);
        // Its last words arrive, as on a cable; only then it has left.
        assert_eq!(board.service().unwrap(), None, "round {round}");
        let mut buf = [0; 64];
        assert_eq!(board.read(&mut buf).unwrap(), 12, "round {round}");
        assert_eq!(&buf[..12], b"last command");
        assert_eq!(event(&mut board), Some(ClientEvent::Left), "round {round}");
        assert_eq!(board.read(&mut buf).unwrap(), 0, "round {round}");
    }
}

#[test]
fn settings_that_a_client_left_behind_are_undone() {
    let (mut board, path) = PseudoTerminal::open().unwrap();
    {
        let theirs =
            fs::File::options().read(true).write(true).custom_flags(libc::O_NOCTTY).open(&path).unwrap();
        assert_eq!(event(&mut board), Some(ClientEvent::Connected));
        let mut modes = tcgetattr(&theirs).unwrap();
        modes.local_modes |= rustix::termios::LocalModes::ECHO | rustix::termios::LocalModes::ICANON;
        tcsetattr(&theirs, OptionalActions::Now, &modes).unwrap();
    }
    assert_eq!(event(&mut board), Some(ClientEvent::Left));
    // A program that sets nothing: the line is raw already.
    let plain = fs::File::options().read(true).write(true).custom_flags(libc::O_NOCTTY).open(&path).unwrap();
    assert_eq!(event(&mut board), Some(ClientEvent::Connected));
    board.write(&[0x03, 0x0d, 0x41]).unwrap();
    let mut buf = [0; 3];
    (&plain).read_exact(&mut buf).unwrap();
    assert_eq!(buf, [0x03, 0x0d, 0x41]);
    assert_eq!(board.read(&mut [0; 8]).unwrap(), 0, "an echo");
}

#[test]
fn waiting_with_nobody_there_lasts_to_the_deadline_and_takes_no_processor_time() {
    let cpu_ns = || {
        let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
    };
    let (terminal, _) = PseudoTerminal::open().unwrap();
    let listener = Listener::bind("127.0.0.1:0".parse().unwrap()).unwrap();
    let boards: [&dyn Endpoint; 2] = [&terminal, &listener];
    for board in boards {
        let (before, until) = (cpu_ns(), monotonic_ns() + 200 * MS);
        assert_eq!(board.wait(until, SLEEP), Readiness::Timeout);
        assert!(monotonic_ns() >= until);
        assert!(cpu_ns() - before < 50 * MS, "{} ns of processor time", cpu_ns() - before);
    }
}

#[test]
fn a_second_tcp_client_is_told_busy_even_if_it_speaks_first() {
    let mut board = Listener::bind("127.0.0.1:0".parse().unwrap()).unwrap();
    let mut first = tcp(&board);
    assert_eq!(event(&mut board), Some(ClientEvent::Connected));
    for _ in 0..10 {
        let mut second = tcp(&board);
        assert_eq!(second.write(&[0x55; 40]).unwrap(), 40);
        assert_eq!(board.service().unwrap(), None, "the first client stays");
        let error = failure(|| second.read(&mut [0; 256]));
        assert_eq!(error.kind(), io::ErrorKind::ResourceBusy);
        assert!(matches!(second.explain(&error), PortError::Busy { .. }));
        drop(second);
        assert_eq!(board.service().unwrap(), None);
    }
    // The first goes on unharmed, and nothing of the others came through.
    assert_eq!(first.write(b"still here").unwrap(), 10);
    assert_eq!(read_board(&mut board, 10), b"still here");
    drop(first);
    assert_eq!(event(&mut board), Some(ClientEvent::Left));
    let mut next = tcp(&board);
    assert_eq!(event(&mut board), Some(ClientEvent::Connected));
    assert_eq!(next.write(b"x").unwrap(), 1);
    assert_eq!(read_board(&mut board, 1), b"x");
}

#[test]
fn a_tcp_client_that_left_is_seen_by_reading_and_by_writing() {
    let mut board = Listener::bind("127.0.0.1:0".parse().unwrap()).unwrap();
    for by_reading in [true, false] {
        let mut port = tcp(&board);
        assert_eq!(event(&mut board), Some(ClientEvent::Connected));
        port.write(b"last words").unwrap();
        assert_eq!(read_board(&mut board, 10), b"last words");
        drop(port);
        for _ in 0..50 {
            thread::sleep(Duration::from_millis(1));
            if by_reading {
                assert_eq!(board.read(&mut [0; 8]).unwrap(), 0);
            } else {
                assert_eq!(board.write(b"anyone?").unwrap(), 7);
            }
        }
        // Its end must not make waiting return at once for ever.
        assert_eq!(board.wait(monotonic_ns() + MS, SLEEP), Readiness::Timeout);
        assert_eq!(event(&mut board), Some(ClientEvent::Left));
    }
    // And the board that left, by its client.
    let mut port = tcp(&board);
    assert_eq!(event(&mut board), Some(ClientEvent::Connected));
    drop(board);
    assert_eq!(failure(|| port.read(&mut [0; 8])).kind(), io::ErrorKind::BrokenPipe);
    let error = failure(|| port.write(b"x"));
    assert_eq!(error.kind(), io::ErrorKind::BrokenPipe);
    assert!(matches!(port.explain(&error), PortError::Unplugged { .. }));
}

#[test]
fn only_loopback_is_listened_on_unless_asked() {
    for address in ["0.0.0.0:0", "[::]:0", "192.0.2.1:5000"] {
        let error = Listener::bind(address.parse().unwrap()).unwrap_err();
        assert!(matches!(error, PortError::NotLoopback { .. }), "{error:?}");
        assert!(error.to_string().contains("tcp://127.0.0.1:"), "{error}");
    }
    Listener::bind_remote("0.0.0.0:0".parse().unwrap()).unwrap();
    let taken = Listener::bind("127.0.0.1:0".parse().unwrap()).unwrap();
    let Address::Tcp(address) = taken.address() else { panic!() };
    let error = Listener::bind(address).unwrap_err();
    assert!(matches!(error, PortError::CannotListen { .. }), "{error:?}");
    drop(taken);
    let error = Port::open(&Address::Tcp(address), &SerialOptions::default()).unwrap_err();
    assert!(matches!(error, PortError::ConnectionRefused { .. }), "{error:?}");
    assert!(error.to_string().contains("nobody listens there; start the board first"), "{error}");
}

#[test]
fn a_socket_in_a_file_tells_the_board_and_the_loop_what_each_can_do() {
    let folder = temporary("sockets");
    let file = folder.join("board");
    let error = Port::open(&Address::Unix(file.clone()), &SerialOptions::default()).unwrap_err();
    assert!(matches!(error, PortError::Socket { .. }), "{error:?}");
    assert!(error.to_string().ends_with("; start the board first, or check the path"), "{error}");
    let board = Listener::bind_unix(&file).unwrap();
    let error = Listener::bind_unix(&file).err().unwrap();
    assert!(matches!(error, PortError::CannotMakeSocket { .. }), "{error:?}");
    assert!(error.to_string().contains("; name a file that does not exist"), "{error}");
    drop(board);
    fs::remove_dir_all(folder).unwrap();
}

// ---- what is refused ----

#[test]
fn what_is_not_a_serial_device_is_refused_before_it_is_opened() {
    let folder = temporary("kinds");
    let file = folder.join("file");
    fs::write(&file, "").unwrap();
    let socket = folder.join("socket");
    let _socket = std::os::unix::net::UnixListener::bind(&socket).unwrap();
    let fifo = folder.join("fifo");
    assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    for (path, why) in [
        (Path::new("/dev/null"), "class mem"),
        (Path::new("/dev/ptmx"), "makes pseudo-terminals"),
        (Path::new("/dev/tty"), "terminal this program runs in"),
        (&folder, "a folder"),
        (&file, "an ordinary file"),
        (&socket, "tcp://ADDRESS:PORT"),
        (&fifo, "a named pipe"),
    ] {
        let error = try_open(path).unwrap_err();
        assert!(matches!(error, PortError::NotASerialDevice { .. }), "{error:?}");
        let text = error.to_string();
        assert!(text.contains(why) && text.contains("expected one as /dev/ttyUSB0"), "{text}");
    }
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_device_that_is_not_there_is_answered_with_those_that_are() {
    let error = try_open(Path::new("/dev/ttyUSB-none")).unwrap_err();
    assert!(matches!(error, PortError::NotFound { .. }), "{error:?}");
    assert!(error.to_string().starts_with("/dev/ttyUSB-none: there is no such device; "), "{error}");

    let dev = temporary("dev");
    fs::create_dir_all(dev.join("serial/by-id")).unwrap();
    for name in ["ttyUSB1", "ttyUSB0", "ttyACM0", "ttyS0", "null", "serial/by-id/usb-FTDI_A1-if00-port0"] {
        fs::write(dev.join(name), "").unwrap();
    }
    let names: Vec<String> = serial_devices(&dev)
        .iter()
        .map(|path| path.strip_prefix(&dev).unwrap().display().to_string())
        .collect();
    assert_eq!(names, ["serial/by-id/usb-FTDI_A1-if00-port0", "ttyACM0", "ttyUSB0", "ttyUSB1"]);
    let text = PortError::NotFound { path: "/dev/x".into(), present: vec!["/dev/a".into(), "/dev/b".into()] }
        .to_string();
    assert_eq!(text, "/dev/x: there is no such device; present are /dev/a, /dev/b");
    fs::remove_dir_all(dev).unwrap();
}

#[test]
fn a_closed_device_says_whose_it_is_and_how_to_be_let_in() {
    let (_board, path) = PseudoTerminal::open().unwrap();
    set_mode(&path, 0o000);
    let error = without_rights(move || try_open(&path).map(|_| ())).unwrap_err();
    assert!(matches!(error, PortError::PermissionDenied { .. }), "{error:?}");
    assert!(error.to_string().contains("permission denied; it belongs to the group"), "{error}");

    // The usual case, with a group file of our own. A group we are not in, or root's, is needed.
    let folder = temporary("groups");
    let (device, groups) = (folder.join("ttyUSB0"), folder.join("group"));
    fs::write(&device, "").unwrap();
    if geteuid().is_root() {
        std::os::unix::fs::chown(&device, None, Some(54_321)).unwrap();
        set_mode(&device, 0o660);
        fs::write(&groups, "root:x:0:\ndialout:x:54321:someone\n").unwrap();
        let advice = permission_advice(&device, &groups);
        assert!(advice.starts_with("it belongs to the group dialout with mode 0660. Join it: "), "{advice}");
        assert!(advice.contains("sudo usermod -aG dialout $USER; then log out and in again"), "{advice}");
        fs::write(&groups, "").unwrap();
        let advice = permission_advice(&device, &groups);
        assert!(advice.contains("group 54321") && advice.contains("administrator"), "{advice}");
    } else {
        println!("the group's case needs root to be made");
    }
    set_mode(&device, 0o600);
    let advice = permission_advice(&device, &groups);
    assert!(advice.contains("KERNEL==\"ttyUSB0\"") && advice.contains("GROUP=\"dialout\""), "{advice}");
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn the_holder_of_a_lock_is_read_from_the_kernels_list() {
    let locks = "1: POSIX  ADVISORY  WRITE 11 00:15:3 0 EOF\n\
                 2: FLOCK  ADVISORY  WRITE 22 00:15:3 0 EOF\n\
                 2: -> FLOCK  ADVISORY  WRITE 33 00:15:3 0 EOF\n\
                 3: FLOCK  ADVISORY  WRITE 44 fd:1a:7 0 EOF\n\
                 4: FLOCK  ADVISORY  WRITE -1 00:15:9 0 EOF\n\
                 torn line";
    let device = rustix::fs::makedev(0, 0x15);
    assert_eq!(holder_in(locks, device, 3), Some(22));
    assert_eq!(holder_in(locks, device, 4), None);
    assert_eq!(holder_in(locks, device, 9), None, "in another PID namespace");
    assert_eq!(holder_in(locks, rustix::fs::makedev(0xfd, 0x1a), 7), Some(44));
    assert_eq!(holder_in("", device, 3), None);
}

// ---- kinds, rates, latency ----

/// A `/sys` with one device of these numbers.
fn sys(name: &str, class: &str, bus: &str, driver: &str, timer: Option<&str>) -> PathBuf {
    let root = temporary(&format!("sys-{name}"));
    let device = root.join("devices/device");
    for folder in [
        "dev/char/188:0",
        &format!("class/{class}"),
        &format!("bus/{bus}/drivers/{driver}"),
        "devices/device",
    ] {
        fs::create_dir_all(root.join(folder)).unwrap();
    }
    symlink(root.join(format!("class/{class}")), root.join("dev/char/188:0/subsystem")).unwrap();
    symlink(&device, root.join("dev/char/188:0/device")).unwrap();
    symlink(root.join(format!("bus/{bus}")), device.join("subsystem")).unwrap();
    symlink(root.join(format!("bus/{bus}/drivers/{driver}")), device.join("driver")).unwrap();
    if let Some(timer) = timer {
        fs::write(device.join("latency_timer"), timer).unwrap();
    }
    root
}

#[test]
fn devices_are_told_apart_without_opening_them() {
    for (name, bus, driver, kind, rate) in [
        ("ftdi", "usb-serial", "ftdi_sio", DeviceKind::UsbSerial, true),
        ("cp210x", "usb-serial", "cp210x", DeviceKind::UsbSerial, true),
        ("acm", "usb", "cdc_acm", DeviceKind::UsbCdc, false),
        ("uart", "serial-base", "port", DeviceKind::Uart, true),
    ] {
        let root = sys(name, "tty", bus, driver, None);
        let found = classify(&root, 188, 0).unwrap();
        assert_eq!((found.kind, found.driver.as_deref()), (kind, Some(driver)));
        assert_eq!(found.kind.has_line_rate(), rate);
        fs::remove_dir_all(root).unwrap();
    }
    let root = sys("watchdog", "watchdog", "platform", "iTCO_wdt", None);
    assert_eq!(classify(&root, 188, 0), Err(NotSerial::Is("it is a device of the class watchdog".into())));
    fs::remove_dir_all(root).unwrap();
    let nowhere = Path::new("/nowhere");
    assert!(matches!(classify(nowhere, 4, 1), Err(NotSerial::Is(_))), "a text console");
    assert_eq!(classify(nowhere, 4, 64).unwrap().kind, DeviceKind::Uart, "ttyS0");
    let (_board, path) = PseudoTerminal::open().unwrap();
    assert_eq!(classify_path(Path::new("/sys"), &path).unwrap().kind, DeviceKind::PseudoTerminal);
}

#[test]
fn an_adapter_that_holds_bytes_back_is_reported_with_its_time_and_remedy() {
    let refused = io::Error::from_raw_os_error(libc::EPERM);
    let port = "/dev/ttyUSB3";

    let root = sys("slow", "tty", "usb-serial", "ftdi_sio", Some("16\n"));
    let ftdi = classify(&root, 188, 0).unwrap();
    assert_eq!(ftdi.latency_timer_ms(), Some(16));
    let note = ftdi.latency_note(port, Some(&refused), Some(16)).unwrap();
    for part in ["up to 16 ms", "low-latency mode was refused", "usb-serial/devices/ttyUSB3/latency_timer"] {
        assert!(note.contains(part), "{part}: {note}");
    }
    assert!(ftdi.latency_note(port, None, Some(16)).unwrap().contains("accepted without effect"));
    assert_eq!(ftdi.latency_note(port, None, Some(1)), None);
    assert_eq!(ftdi.latency_note(port, Some(&refused), Some(1)), None, "set by hand");
    fs::remove_dir_all(root).unwrap();

    let root = sys("other", "tty", "usb-serial", "cp210x", None);
    let other = classify(&root, 188, 0).unwrap();
    assert_eq!(other.latency_timer_ms(), None);
    assert_eq!(other.latency_note(port, None, None), None);
    let note = other.latency_note(port, Some(&refused), None).unwrap();
    assert!(note.contains("cp210x") && note.contains("16 ms") && note.contains("measure"), "{note}");
    fs::remove_dir_all(root).unwrap();

    let root = sys("cdc", "tty", "usb", "cdc_acm", None);
    assert_eq!(classify(&root, 188, 0).unwrap().latency_note(port, Some(&refused), None), None);
    fs::remove_dir_all(root).unwrap();

    // A pseudo-terminal has no such mode; opening one gives no note.
    let (_board, path) = PseudoTerminal::open().unwrap();
    let opened = try_open(&path).unwrap();
    assert_eq!(opened.notes, Vec::<String>::new());
    assert!(set_low_latency(&opened.port).is_err());
}

#[test]
fn a_line_too_slow_for_the_cycle_is_refused_with_the_arithmetic() {
    let ms = Duration::from_millis(1);
    // 16 bytes at 1 kHz: 160 000 baud just fill the line.
    assert!(check_baud(160_000, (16, 12), ms).is_ok());
    let error = check_baud(159_999, (16, 12), ms).unwrap_err();
    let PortError::BaudTooSlow { bytes: 16, needed: 160_000, fits: Some(230_400), .. } = error else {
        panic!("{error:?}")
    };
    // The fuller direction counts, whichever it is.
    assert!(check_baud(115_200, (8, 16), ms).is_err());
    assert!(check_baud(115_200, (11, 11), ms).is_ok());
    assert!(check_baud(115_200, (12, 0), ms).is_err());
    // 25 %: 20 bytes need 200 000, so 250 000 leaves it.
    assert!(tight_line(249_999, (20, 20), ms).unwrap().contains("80 %"));
    assert_eq!(tight_line(250_000, (20, 20), ms), None);
    // A slower loop needs less; one of no standard rate says so.
    assert!(check_baud(9_600, (20, 20), Duration::from_millis(50)).is_ok());
    let error = check_baud(4_000_000, (500, 20), ms).unwrap_err();
    assert!(matches!(error, PortError::BaudTooSlow { fits: None, needed: 5_000_000, .. }), "{error:?}");
    assert!(error.to_string().contains("a longer period"), "{error}");
    // Nothing overflows.
    assert!(check_baud(u32::MAX, (usize::MAX, 1), Duration::ZERO).is_err());
    assert!(check_baud(0, (0, 0), Duration::MAX).is_ok());

    let (_board, path) = PseudoTerminal::open().unwrap();
    let port =
        Port::open(&serial(&path), &SerialOptions { baud: Some(9_600), low_latency: true }).unwrap().port;
    assert_eq!(port.baud(), 9_600);
    let note = port.check_baud((20, 20), ms).unwrap().unwrap();
    assert!(note.contains("a pseudo-terminal; a baud rate has no effect"), "{note}");
}

#[test]
fn addresses_are_read_as_they_are_written_and_mistakes_get_a_suggestion() {
    for (text, shown) in [
        ("/dev/ttyUSB0", "/dev/ttyUSB0"),
        (
            "/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0",
            "/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0",
        ),
        ("./pty", "./pty"),
        ("tcp://127.0.0.1:5000", "tcp://127.0.0.1:5000"),
        ("tcp://localhost:5000/", "tcp://127.0.0.1:5000"),
        ("tcp://[::1]:80", "tcp://[::1]:80"),
    ] {
        let address: Address = text.parse().unwrap();
        assert_eq!(address.to_string(), shown);
        assert_eq!(address.to_string().parse::<Address>().unwrap(), address);
    }
    for (text, suggestion) in [
        ("ttyACM0", Some("/dev/ttyACM0")),
        ("dev/ttyACM0", Some("/dev/ttyACM0")),
        ("127.0.0.1:5000", Some("tcp://127.0.0.1:5000")),
        ("localhost:5000", Some("tcp://127.0.0.1:5000")),
        ("tcp://127.0.0.1", Some("tcp://127.0.0.1:5000")),
        ("tcp://127.0.0.1:70000", None),
        ("tcp://example.org:5000", None),
        ("udp://127.0.0.1:5000", None),
        ("COM3", None),
        ("", None),
        ("/dev/tty\0USB0", None),
    ] {
        let error = text.parse::<Address>().unwrap_err();
        assert_eq!(error.suggestion.as_deref(), suggestion, "{text}");
        assert!(error.to_string().contains("expected a device as /dev/ttyUSB0"), "{error}");
    }
}

#[test]
fn a_terminal_in_which_somebody_works_is_not_taken() {
    // `script` gives the child a terminal of its own, which it then tries to open as a port.
    if let Some(path) = std::env::var_os("CLUTCH_OWN_TERMINAL") {
        let path = fs::read_link("/proc/self/fd/0").unwrap_or_else(|_| path.into());
        let error = try_open(&path).unwrap_err();
        assert!(error.to_string().contains("the terminal this program runs in"), "{error}");
        return;
    }
    let own = std::env::current_exe().unwrap();
    let command =
        format!("{} port::tests::a_terminal_in_which_somebody_works_is_not_taken --exact", own.display());
    let Ok(output) =
        Command::new("script").args(["-qec", &command, "/dev/null"]).env("CLUTCH_OWN_TERMINAL", "/").output()
    else {
        println!("not tested: `script` (package bsdutils) is not installed");
        return;
    };
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && text.contains("1 passed"), "{text}");
}

#[test]
fn a_port_is_free_at_once_even_while_another_program_is_being_started() {
    let (_board, path) = PseudoTerminal::open().unwrap();
    for _ in 0..20 {
        let port = try_open(&path).unwrap().port;
        // It has a copy of the descriptor until its own code is loaded.
        let mut child = Command::new("sleep").arg("30").spawn().unwrap();
        drop(port);
        let opened = try_open(&path);
        child.kill().unwrap();
        child.wait().unwrap();
        opened.unwrap();
    }
}

#[test]
fn a_program_that_is_started_does_not_inherit_the_port() {
    let (_board, path) = PseudoTerminal::open().unwrap();
    let _port = try_open(&path).unwrap().port;
    let mut child = Command::new("sleep").arg("30").stdin(std::process::Stdio::null()).spawn().unwrap();
    let folder = PathBuf::from(format!("/proc/{}", child.id()));
    for _ in 0..1000 {
        if fs::read_to_string(folder.join("comm")).unwrap().trim() == "sleep" {
            break;
        }
        thread::sleep(Duration::from_millis(1));
    }
    thread::sleep(Duration::from_millis(20)); // its name comes just before the descriptors go
    let files: Vec<PathBuf> = fs::read_dir(folder.join("fd"))
        .unwrap()
        .flatten()
        .filter_map(|entry| fs::read_link(entry.path()).ok())
        .collect();
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!files.is_empty());
    assert!(!files.contains(&path) && !files.contains(&PathBuf::from("/dev/ptmx")), "{files:?}");
}
