//! The remains after a crash and after a full disk. The tests that end themselves run in processes
//! of their own: this binary again, with one ignored test.
#![cfg(unix)]

mod common;

use clutch_log::{Limits, LogError, LogWriter, Record, SampleRecord, read, recover};
use common::{Folder, Numbers, header};
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Names the file to the child.
const PATH: &str = "CLUTCH_LOG_TEST_FILE";

fn path_from_parent() -> PathBuf {
    std::env::var_os(PATH).expect("started by another test").into()
}

fn sample(tick: u64) -> SampleRecord {
    SampleRecord { tick, time_ns: tick * 1_000_000, counts: (tick * 7) as i32, ..SampleRecord::default() }
}

#[test]
#[ignore = "the child of kill_9_costs_at_most_100_ms"]
fn child_writes_at_1_khz_until_it_is_killed() {
    let mut log = LogWriter::create(path_from_parent(), &header()).unwrap();
    let start = Instant::now();
    for tick in 0..60_000 {
        std::thread::sleep((start + Duration::from_millis(tick)).saturating_duration_since(Instant::now()));
        log.write(&Record::Sample(sample(tick))).unwrap();
        println!("tick {tick}");
    }
}

#[test]
fn kill_9_costs_at_most_100_ms() {
    let folder = Folder::new("kill");
    let seed = u64::from(std::process::id());
    let mut n = Numbers(seed);
    let mut worst = 0;
    for kill in 0..20 {
        let path = folder.file(&format!("{kill}.mcap"));
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "child_writes_at_1_khz_until_it_is_killed", "--ignored", "--nocapture"])
            .env(PATH, &path)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let delay = Duration::from_micros(150_000 + n.next() % 400_000);
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let (mut deadline, mut last) = (None, 0_u64);
        for line in lines.map_while(Result::ok) {
            let Some(tick) = line.split("tick ").nth(1) else { continue };
            last = tick.parse().unwrap();
            if Instant::now() >= *deadline.get_or_insert(Instant::now() + delay) {
                child.kill().unwrap(); // SIGKILL; the loop ends with what is left in the pipe
            }
        }
        child.wait().unwrap();
        let log = read(&path, &Limits::default()).unwrap();
        assert!(!log.complete);
        assert_eq!(log.header, header());
        for (tick, s) in (0..).zip(&log.samples) {
            assert_eq!(*s, sample(tick), "seed {seed}, kill {kill}");
        }
        let lost = (last + 1).saturating_sub(log.samples.len() as u64);
        worst = worst.max(lost);
        assert!(lost <= 100, "seed {seed}, kill {kill}: {lost} of {} ms lost", last + 1);
        assert!(last > 100, "seed {seed}, kill {kill}: killed after {last} ms");
        let recovered = recover(&path, folder.file("recovered.mcap"), &Limits::default()).unwrap();
        assert_eq!(recovered.records, log.samples.len() as u64);
        let whole = read(folder.file("recovered.mcap"), &Limits::default()).unwrap();
        assert!(whole.complete && whole.samples == log.samples);
    }
    println!("worst loss in 20 kills: {worst} ms");
}

/// Writes until there is no space left; checks the report and the remains.
#[test]
#[ignore = "the child of the tests on full disks"]
fn child_writes_until_the_disk_is_full() {
    let path = path_from_parent();
    let mut log = LogWriter::create(&path, &header()).unwrap();
    let mut n = Numbers(11);
    let mut tick = 0;
    let e = loop {
        // Noise does not compress.
        let record = Record::Sample(SampleRecord {
            board_time_us: n.next() as u32,
            age_us: n.next() as u32,
            ..sample(tick)
        });
        match log.write(&record) {
            Ok(()) => tick += 1,
            Err(e) => break e,
        }
        assert!(tick < 1_000_000, "the disk never fills");
    };
    let LogError::Full { written, .. } = &e else { panic!("{e}") };
    let written = *written;
    assert!(e.to_string().contains(&format!("{written} records")), "{e}");
    assert!(written > 1000 && written <= tick && tick - written <= 101, "{written} of {tick}");
    // Reported once; dead after it, even when there is space again.
    for _ in 0..3 {
        let e = log.write(&Record::Sample(sample(tick))).unwrap_err();
        assert!(matches!(e, LogError::Closed { written: w, .. } if w == written), "{e}");
    }
    assert!(matches!(log.flush(), Err(LogError::Closed { .. })));
    let size = std::fs::metadata(&path).unwrap().len();
    assert!(matches!(log.finish(), Err(LogError::Closed { .. })));
    assert_eq!(std::fs::metadata(&path).unwrap().len(), size, "a dead writer writes nothing");
    let back = read(&path, &Limits::default()).unwrap();
    assert!(!back.complete);
    // The last chunk may be whole without its index.
    let read = back.samples.len() as u64;
    assert!(read >= written && read <= tick, "{written} reported, {read} read, {tick} accepted");
    assert!(back.samples.iter().zip(0..).all(|(s, tick)| s.tick == tick));
    println!("full: {e}; {read} read back");
}

/// Runs the child from a shell: `script` prepares, then starts `"$@"`.
fn until_full(script: &str, file: &Path) -> Output {
    Command::new("unshare")
        .args(["-m", "sh", "-c", script, "sh"])
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", "child_writes_until_the_disk_is_full", "--ignored", "--nocapture"])
        .env(PATH, file)
        .env("FOLDER", file.parent().unwrap())
        .output()
        .unwrap()
}

fn passed(done: &Output) {
    let (out, err) = (String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success() && out.contains("full: "), "{}\n{out}\n{err}", done.status);
    println!("{out}");
}

#[test]
fn a_full_disk_is_told_once_with_the_records_that_are_safe() {
    let folder = Folder::new("full");
    let mount = "mount -t tmpfs -o size=128k none \"$FOLDER\" || exit 77; exec \"$@\"";
    let may_mount = Command::new("unshare").args(["-m", "true"]).output().is_ok_and(|o| o.status.success());
    if !may_mount {
        eprintln!("skipped: mounting a small disk takes root");
        return;
    }
    let done = until_full(mount, &folder.file("run.mcap"));
    if done.status.code() == Some(77) {
        eprintln!("skipped: no tmpfs may be mounted here");
        return;
    }
    passed(&done);
}

#[test]
fn a_file_that_may_not_grow_is_told_like_a_full_disk() {
    let folder = Folder::new("limit");
    // 256 blocks of 512 bytes. The signal that comes with the limit is ignored, as the loop does.
    let done = Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 256; exec \"$@\"", "sh"])
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", "child_writes_until_the_disk_is_full", "--ignored", "--nocapture"])
        .env(PATH, folder.file("run.mcap"))
        .output()
        .unwrap();
    passed(&done);
}
