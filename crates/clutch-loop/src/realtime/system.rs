//! The kind of this machine, in words.

use super::line;
use std::path::Path;

/// One plain sentence for each thing that decides how late a control thread wakes here: kernel,
/// isolated cores, real-time throttling, governor, clock source, virtual machine.
#[must_use]
pub fn describe_system() -> Vec<String> {
    describe(Path::new("/"))
}

pub(super) fn describe(root: &Path) -> Vec<String> {
    let read = |path: &str| line(&root.join(path));
    let mut out = Vec::new();

    let version = read("proc/version").unwrap_or_default();
    let release = read("proc/sys/kernel/osrelease").unwrap_or_else(|| "of unknown version".to_owned());
    let realtime = read("sys/kernel/realtime").as_deref() == Some("1") || version.contains("PREEMPT_RT");
    let kind = if realtime {
        "PREEMPT_RT: a real-time kernel"
    } else if version.contains("PREEMPT_DYNAMIC") {
        "PREEMPT_DYNAMIC: not a real-time kernel, single cycles may be milliseconds late; install a PREEMPT_RT kernel \
         if that matters"
    } else if version.contains("PREEMPT") {
        "PREEMPT: not a real-time kernel, single cycles may be milliseconds late; install a PREEMPT_RT kernel if that \
         matters"
    } else {
        "no preemption: single cycles may be many milliseconds late; install a PREEMPT_RT kernel"
    };
    out.push(format!("kernel {release}, {kind}"));

    out.push(match read("sys/devices/system/cpu/isolated") {
        Some(cores) => format!("isolated cores: {cores} (choose one of them as cpu_affinity)"),
        None => {
            "isolated cores: none (kernel parameter isolcpus); other programs share the control thread's core"
                .to_owned()
        }
    });

    let number = |path| read(path).and_then(|text| text.parse::<i64>().ok());
    let period = number("proc/sys/kernel/sched_rt_period_us").unwrap_or(1_000_000);
    match number("proc/sys/kernel/sched_rt_runtime_us") {
        Some(runtime) if runtime < 0 || runtime >= period => {
            out.push("real-time throttling: off; a control thread that never sleeps blocks its core".to_owned());
        }
        Some(runtime) if period > 0 => out.push(format!(
            "real-time throttling: real-time threads may use {:.0} % of each {} ms, the kernel stops them beyond that",
            100.0 * runtime as f64 / period as f64,
            period / 1000
        )),
        _ => {}
    }

    out.push(match governors(root) {
        list if list.is_empty() => "frequency governor: none to be seen".to_owned(),
        list if list == ["performance"] => "frequency governor: performance".to_owned(),
        list => format!(
            "frequency governor: {}; waking is later until the clock is up: sudo cpupower frequency-set -g performance",
            list.join(", ")
        ),
    });

    match read("sys/devices/system/clocksource/clocksource0/current_clocksource") {
        Some(clock) if ["hpet", "acpi_pm", "jiffies", "refined-jiffies"].contains(&clock.as_str()) => {
            out.push(format!(
                "clock source: {clock}; reading it takes a system call of a microsecond or more"
            ));
        }
        Some(clock) => out.push(format!("clock source: {clock}")),
        None => {}
    }

    // x86 only: elsewhere the flag does not exist and nothing is said.
    let flags = std::fs::read_to_string(root.join("proc/cpuinfo")).unwrap_or_default();
    let virtual_machine = flags
        .lines()
        .filter(|line| line.starts_with("flags"))
        .any(|line| line.split_whitespace().any(|flag| flag == "hypervisor"));
    if virtual_machine {
        out.push(
            "virtual machine: its host may stop it for milliseconds at any time, and nothing here can prevent that"
                .to_owned(),
        );
    }
    out
}

/// The different governors of all cores, sorted.
fn governors(root: &Path) -> Vec<String> {
    let Ok(cores) = std::fs::read_dir(root.join("sys/devices/system/cpu")) else { return Vec::new() };
    let mut list: Vec<String> =
        cores.flatten().filter_map(|core| line(&core.path().join("cpufreq/scaling_governor"))).collect();
    list.sort();
    list.dedup();
    list
}
