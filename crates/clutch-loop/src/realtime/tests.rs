use super::*;
use std::fs;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::thread;
use std::time::Duration;

const MS: u64 = 1_000_000;

/// A deadline is never early, however the thread waits. Its lateness depends on the machine: only
/// the bench says.
#[test]
fn a_deadline_is_never_early_in_either_mode() {
    for mode in
        [WaitMode::Sleep, WaitMode::SleepSpin { spin_us: 300 }, WaitMode::SleepSpin { spin_us: u32::MAX }]
    {
        let start = monotonic_ns();
        for k in 1..=20 {
            let deadline = start + k * MS;
            sleep_until(deadline, mode);
            assert!(monotonic_ns() >= deadline, "{mode:?}");
        }
        assert!(monotonic_ns() - start >= 20 * MS);
    }
}

#[test]
fn a_deadline_in_the_past_returns_at_once() {
    let start = monotonic_ns();
    for _ in 0..1000 {
        sleep_until(start - MS, WaitMode::Sleep);
        sleep_until(0, WaitMode::SleepSpin { spin_us: 500 });
    }
    assert!(monotonic_ns() - start < 500 * MS);
}

#[test]
fn the_clock_is_that_of_the_kernel_and_does_not_run_backwards() {
    let uptime = fs::read_to_string("/proc/uptime").unwrap();
    let uptime: f64 = uptime.split_whitespace().next().unwrap().parse().unwrap();
    let now = monotonic_ns();
    // /proc/uptime counts suspended time too, so it may be ahead, never behind.
    assert!(now as f64 / 1e9 < uptime + 1.0, "{now} ns, uptime {uptime} s");
    let mut last = now;
    for _ in 0..10_000 {
        let next = monotonic_ns();
        assert!(next >= last);
        last = next;
    }
    thread::sleep(Duration::from_millis(20));
    let passed = monotonic_ns() - last;
    assert!((20 * MS..5_000 * MS).contains(&passed), "{passed} ns");
}

#[test]
fn waiting_ends_with_bytes_with_the_deadline_or_with_a_hang_up() {
    for mode in [WaitMode::Sleep, WaitMode::SleepSpin { spin_us: 2000 }] {
        let (near, far) = UnixStream::pair().unwrap();
        let until = monotonic_ns() + 5 * MS;
        assert_eq!(wait_readable(near.as_fd(), until, mode), Readiness::Timeout);
        assert!(monotonic_ns() >= until, "{mode:?}: the deadline was early");
        (&far).write_all(b"x").unwrap();
        // A deadline in the past still sees what is there.
        assert_eq!(wait_readable(near.as_fd(), 0, mode), Readiness::Readable);
        assert_eq!(wait_readable(near.as_fd(), monotonic_ns() + 5000 * MS, mode), Readiness::Readable);
    }
    // A pipe whose writer is gone reports a hang-up and nothing to read.
    let (reader, writer) = io::pipe().unwrap();
    (&writer).write_all(b"x").unwrap();
    drop(writer);
    assert_eq!(wait_readable(reader.as_fd(), 0, WaitMode::Sleep), Readiness::Readable);
    let mut byte = [0];
    io::Read::read_exact(&mut (&reader), &mut byte).unwrap();
    assert_eq!(wait_readable(reader.as_fd(), u64::MAX, WaitMode::Sleep), Readiness::HungUp);
}

#[test]
fn bytes_that_come_while_waiting_end_it_before_the_deadline() {
    for mode in [WaitMode::Sleep, WaitMode::SleepSpin { spin_us: 10_000_000 }] {
        let (near, far) = UnixStream::pair().unwrap();
        let writer = thread::spawn(move || {
            thread::sleep(Duration::from_millis(20));
            (&far).write_all(b"x").unwrap();
            far
        });
        let until = monotonic_ns() + 10_000 * MS;
        assert_eq!(wait_readable(near.as_fd(), until, mode), Readiness::Readable);
        assert!(monotonic_ns() < until);
        drop(writer.join().unwrap());
    }
}

extern "C" fn ignore(_signal: libc::c_int) {}

#[test]
fn a_signal_neither_shortens_nor_ends_a_wait() {
    // SAFETY: the handler does nothing, which is allowed in a signal handler; SIGUSR1 is used by
    // nothing else here.
    unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        action.sa_sigaction = ignore as extern "C" fn(libc::c_int) as usize;
        // No SA_RESTART: waits are to be interrupted.
        assert_eq!(libc::sigaction(libc::SIGUSR1, &action, std::ptr::null_mut()), 0);
    }
    let (near, _far) = UnixStream::pair().unwrap();
    let waiter = thread::spawn(move || {
        let until = monotonic_ns() + 100 * MS;
        sleep_until(until, WaitMode::Sleep);
        let slept = monotonic_ns();
        let until_poll = slept + 100 * MS;
        let seen = wait_readable(near.as_fd(), until_poll, WaitMode::Sleep);
        (until, slept, until_poll, seen, monotonic_ns())
    });
    use std::os::unix::thread::JoinHandleExt;
    let mut sent = 0;
    while !waiter.is_finished() && sent < 15 {
        thread::sleep(Duration::from_millis(10));
        // SAFETY: the thread has not been joined, so its handle is valid.
        unsafe { libc::pthread_kill(waiter.as_pthread_t(), libc::SIGUSR1) };
        sent += 1;
    }
    // On a loaded machine they may be few.
    assert!(sent > 0);
    let (until, slept, until_poll, seen, polled) = waiter.join().unwrap();
    assert!(slept >= until);
    assert_eq!(seen, Readiness::Timeout);
    assert!(polled >= until_poll);
}

#[test]
fn what_the_system_refuses_is_said_with_its_remedy_and_nothing_fails() {
    // On its own thread: it drops its rights, and gets a priority where it may.
    let notes = thread::spawn(|| {
        use rustix::process::{Gid, Uid, geteuid};
        if geteuid().is_root() {
            let nobody = Uid::from_raw(65534);
            rustix::thread::set_thread_groups(&[]).unwrap();
            rustix::thread::set_thread_res_gid(
                Gid::from_raw(65534),
                Gid::from_raw(65534),
                Gid::from_raw(65534),
            )
            .unwrap();
            rustix::thread::set_thread_res_uid(nobody, nobody, nobody).unwrap();
        }
        let limit = getrlimit(Resource::Rtprio).current.unwrap_or(99);
        let notes = enter(&RealtimeOptions {
            thread_priority: 99,
            lock_memory: false, // would hold for the whole test process
            cpu_affinity: Some(CpuSet::MAX_CPU + 5),
            wait: WaitMode::Sleep,
        });
        (notes, limit)
    })
    .join()
    .unwrap();
    let (notes, limit) = notes;
    let all = notes.join("\n");
    assert!(all.contains(&format!("cpu_affinity = {}: refused", CpuSet::MAX_CPU + 5)), "{all}");
    assert!(all.contains("this process may use 0"), "{all}");
    if limit < 99 {
        assert!(all.contains("thread_priority = 99: refused"), "{all}");
        assert!(all.contains("rtprio") && all.contains("CAP_SYS_NICE"), "{all}");
    }
    let out_of_range = thread::spawn(|| {
        enter(&RealtimeOptions { thread_priority: 100, lock_memory: false, ..Default::default() })
    })
    .join()
    .unwrap()
    .join("\n");
    assert!(out_of_range.contains("thread_priority = 100: refused"), "{out_of_range}");
    assert!(out_of_range.contains("expected 1 to 99"), "{out_of_range}");
}

#[test]
fn what_is_granted_is_in_force() {
    let (core, policy, slack, granted) = thread::spawn(|| {
        let core = (0..CpuSet::MAX_CPU).rfind(|&core| sched_getaffinity(None).unwrap().is_set(core)).unwrap();
        let notes = enter(&RealtimeOptions {
            thread_priority: 3,
            lock_memory: false,
            cpu_affinity: Some(core),
            wait: WaitMode::Sleep,
        });
        let granted = !notes.iter().any(|note| note.starts_with("thread_priority"));
        // SAFETY: asks for the policy of the calling thread.
        let policy = unsafe { libc::sched_getscheduler(0) };
        let now = sched_getaffinity(None).unwrap();
        assert_eq!(now.count(), 1);
        assert!(now.is_set(core));
        // A thread started from here must not inherit the priority.
        // SAFETY: asks for the policy of the calling thread.
        let child = thread::spawn(|| unsafe { libc::sched_getscheduler(0) }).join().unwrap();
        assert_eq!(child, libc::SCHED_OTHER);
        (core, policy, rustix::thread::current_timer_slack().unwrap(), granted)
    })
    .join()
    .unwrap();
    if granted {
        assert_eq!(policy & !libc::SCHED_RESET_ON_FORK, libc::SCHED_FIFO, "core {core}");
    } else {
        println!("SCHED_FIFO is refused here: only the rest was tested");
    }
    assert!(slack <= 1, "slack {slack} ns"); // a real-time thread has none: 0
}

#[test]
fn locked_memory_is_locked() {
    // In a process of its own, as locking holds for the whole process. The child is this test.
    if std::env::var_os("CLUTCH_LOCK_CHILD").is_some() {
        let notes = enter(&RealtimeOptions {
            thread_priority: 0,
            lock_memory: true,
            cpu_affinity: None,
            wait: WaitMode::Sleep,
        });
        let status = fs::read_to_string("/proc/self/status").unwrap();
        let locked = status.lines().find(|line| line.starts_with("VmLck:")).unwrap();
        let kib: u64 = locked.split_whitespace().nth(1).unwrap().parse().unwrap();
        assert!(
            kib > 0 || notes.iter().any(|note| note.starts_with("lock_memory: refused")),
            "{locked} {notes:?}"
        );
        println!("locked {kib} KiB, notes {notes:?}");
        return;
    }
    let run = |uid: Option<u32>| {
        let mut command = std::process::Command::new(std::env::current_exe().unwrap());
        command
            .args(["locked_memory_is_locked", "--nocapture", "--test-threads=1"])
            .env("CLUTCH_LOCK_CHILD", "1");
        if let Some(uid) = uid {
            std::os::unix::process::CommandExt::uid(&mut command, uid);
        }
        command.output().map(|output| {
            let text = String::from_utf8_lossy(&output.stdout).into_owned()
                + &String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{text}");
            text
        })
    };
    let text = run(None).unwrap();
    assert!(text.contains("locked "), "{text}");
    if rustix::process::geteuid().is_root() && getrlimit(Resource::Memlock).current.is_some() {
        match run(Some(65534)) {
            // All of it or what is in use now, as far as the limit goes: either is said.
            Ok(text) => assert!(
                (text.contains("only the memory in use now is locked")
                    || text.contains("lock_memory: refused"))
                    && text.contains("memlock unlimited"),
                "{text}"
            ),
            Err(error) => println!("not run as another user: {error}"),
        }
    }
}

#[test]
fn ranges_of_cores_are_short() {
    assert_eq!(ranges(&[0, 1, 2, 3, 6]), "0-3, 6");
    assert_eq!(ranges(&[5]), "5");
    assert_eq!(ranges(&[]), "");
}

#[test]
fn percentiles_are_within_a_thousandth_and_the_longest_is_exact() {
    let mut stats = CycleStats::new();
    assert_eq!(stats.summary(), CycleSummary::default());
    assert_eq!(stats.summary().to_string(), "no cycles");
    // 1 µs … 10 ms evenly, then one outlier.
    let mut all: Vec<u64> = (1..=10_000).map(|k| k * 1000 + 7).collect();
    all.push(123_456_789);
    for &ns in &all {
        stats.record(ns);
    }
    for percent in [1.0, 50.0, 90.0, 99.0, 99.9, 99.99] {
        let rank = ((percent / 100.0 * all.len() as f64).ceil() as usize).max(1);
        let exact = all[rank - 1] as f64;
        let got = stats.percentile_ns(percent) as f64;
        assert!((got - exact).abs() <= 16.0 + 1e-3 * exact, "{percent} %: {got}, exactly {exact}");
    }
    let summary = stats.summary();
    assert_eq!((summary.count, summary.max_ns), (10_001, 123_456_789));
    assert_eq!(stats.percentile_ns(100.0), 123_456_789);
    assert_eq!(stats.percentile_ns(f64::NAN), 0);
    assert!(summary.to_string().ends_with("max 123.5ms  (10001 cycles)"), "{summary}");
}

#[test]
fn times_out_of_range_are_counted_and_nothing_grows() {
    let mut stats = CycleStats::new();
    let size = stats.size();
    for ns in [0, 1, 15, 10_000_000_000, 10_000_000_001, u64::MAX] {
        stats.record(ns);
    }
    assert_eq!(stats.size(), size);
    assert_eq!((stats.count(), stats.beyond(), stats.max_ns()), (6, 2, u64::MAX));
    assert!(stats.percentile_ns(60.0) >= 9_990_000_000);
    let mut sum = CycleStats::new();
    sum.record(5_000);
    sum.add(&stats);
    assert_eq!((sum.count(), sum.beyond(), sum.max_ns()), (7, 2, u64::MAX));
    sum.clear();
    assert_eq!((sum.count(), sum.beyond(), sum.max_ns(), sum.size()), (0, 0, 0, size));
}

/// A folder that looks like the root of a machine.
fn machine(name: &str, files: &[(&str, &str)]) -> std::path::PathBuf {
    let root = std::env::temp_dir().join(format!("clutch-machine-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&root);
    for (path, text) in files {
        let path = root.join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    root
}

#[test]
fn a_machine_is_described_by_what_its_kernel_shows() {
    let rt = machine(
        "rt",
        &[
            ("proc/version", "Linux version 6.12.0 #1 SMP PREEMPT_RT\n"),
            ("proc/sys/kernel/osrelease", "6.12.0-rt\n"),
            ("sys/kernel/realtime", "1\n"),
            ("sys/devices/system/cpu/isolated", "2-3\n"),
            ("proc/sys/kernel/sched_rt_runtime_us", "-1\n"),
            ("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n"),
            ("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "performance\n"),
        ],
    );
    let text = system::describe(&rt).join("\n");
    assert!(text.contains("kernel 6.12.0-rt, PREEMPT_RT: a real-time kernel"), "{text}");
    assert!(text.contains("isolated cores: 2-3"), "{text}");
    assert!(text.contains("throttling: off"), "{text}");
    assert!(text.ends_with("frequency governor: performance"), "{text}");
    fs::remove_dir_all(rt).unwrap();

    let desktop = machine(
        "desktop",
        &[
            ("proc/version", "Linux version 6.1.0 #1 SMP PREEMPT_DYNAMIC\n"),
            ("proc/sys/kernel/sched_rt_runtime_us", "950000\n"),
            ("proc/sys/kernel/sched_rt_period_us", "1000000\n"),
            ("sys/devices/system/cpu/isolated", "\n"),
            ("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n"),
            ("sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet\n"),
            ("proc/cpuinfo", "processor : 0\nflags : fpu hypervisor sse\n"),
        ],
    );
    let text = system::describe(&desktop).join("\n");
    for part in [
        "kernel of unknown version, PREEMPT_DYNAMIC: not a real-time kernel",
        "isolated cores: none",
        "95 % of each 1000 ms",
        "powersave; waking is later",
        "hpet; reading it takes a system call",
        "virtual machine",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    fs::remove_dir_all(desktop).unwrap();
    assert!(describe_system().len() >= 3);
}
