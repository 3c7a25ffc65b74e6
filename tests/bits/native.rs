//! The runs of the test of equal bits: scenarios, the counts that their simulations gave, and the
//! workload's results for these counts on this machine.

use clutch_bits::{FIELDS, Job, Kind, RECORD, Workload, hash, setting_to_bytes};
use clutch_core::law::LawParams;
use clutch_core::params::Choice;
use clutch_core::{Counts, FixedCounts, Micros};
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_settings::Settings;
use clutch_sim::run::{Keep, Trace, simulate_watched};
use clutch_sim::{Scenario, progress::UNWATCHED};
use std::fmt;
use std::path::Path;

/// Names and scenarios.
pub const RUNS: [(&str, &str); 24] = [
    ("pd_ramp", include_str!("runs/pd_ramp.toml")),
    ("pd_sine_bench", include_str!("runs/pd_sine_bench.toml")),
    ("pd_table_cubic", include_str!("runs/pd_table_cubic.toml")),
    ("ctc_ramp_bench", include_str!("runs/ctc_ramp_bench.toml")),
    ("ctc_jerk_limited_bench", include_str!("runs/ctc_jerk_limited_bench.toml")),
    ("ctc_chirp_bench", include_str!("runs/ctc_chirp_bench.toml")),
    ("smc_ramp", include_str!("runs/smc_ramp.toml")),
    ("smc_minimum_jerk", include_str!("runs/smc_minimum_jerk.toml")),
    ("smc_table_linear", include_str!("runs/smc_table_linear.toml")),
    ("sign_ramp_bench", include_str!("runs/sign_ramp_bench.toml")),
    ("sign_trapezoid", include_str!("runs/sign_trapezoid.toml")),
    ("pid_ramp_bench", include_str!("runs/pid_ramp_bench.toml")),
    ("pid_sine", include_str!("runs/pid_sine.toml")),
    ("motor_pid_sine", include_str!("runs/motor_pid_sine.toml")),
    ("twisting_ramp_bench", include_str!("runs/twisting_ramp_bench.toml")),
    ("integral_sine", include_str!("runs/integral_sine.toml")),
    ("motor_dob_sine", include_str!("runs/motor_dob_sine.toml")),
    ("glide_ramp_bench", include_str!("runs/glide_ramp_bench.toml")),
    ("glide_slow_bench", include_str!("runs/glide_slow_bench.toml")),
    ("motor_glide_sine", include_str!("runs/motor_glide_sine.toml")),
    ("motor_ctc_sine", include_str!("runs/motor_ctc_sine.toml")),
    ("motor_voltage", include_str!("runs/motor_voltage.toml")),
    ("both_hold", include_str!("runs/both_hold.toml")),
    ("both_ctc_chirp", include_str!("runs/both_ctc_chirp.toml")),
];

/// The reason of a failure.
pub type Wrong = Box<dyn std::error::Error + Send + Sync>;

/// A run with everything that a machine needs to repeat it, and its result here.
pub struct Run {
    /// Its name.
    pub name: &'static str,
    /// Its scenario as a file.
    pub toml: &'static str,
    /// The scenario's own name.
    pub title: String,
    /// The settings, as a board gets them.
    pub settings: Settings,
    /// The header for the emulated board.
    pub job: Job,
    /// The encoder's counts, one a tick.
    pub counts: Vec<i32>,
    /// The simulation that gave them.
    pub trace: Trace,
    /// The law.
    pub law: LawParams,
    /// The path's place among the kinds of paths.
    pub path: usize,
    /// Bytes of a record that the hash covers.
    pub hashed: usize,
    /// The records of this machine.
    pub records: Vec<u8>,
    /// Their hash.
    pub hash: u32,
}

impl Run {
    /// Simulates a scenario, and gives its counts to the workload.
    ///
    /// # Errors
    /// An invalid scenario, or one that is not for a board.
    pub fn new(name: &'static str, toml: &'static str) -> Result<Run, Wrong> {
        let scenario = Scenario::parse(name, toml, &[])?;
        let trace = simulate_watched::<f32>(&scenario.spec(), Keep::Trace, UNWATCHED)?.trace;
        let settings =
            from_scenario::settings(&scenario, &BuiltRun::new(&scenario, 0)?, Micros(0), scenario.ticks())?;
        let mut sent = 0;
        settings.each(|_, _| sent += 1);
        let first = trace.target_fixed.first().ok_or("a run without a tick")?.0;
        let job = Job {
            origin: FixedCounts::from_counts(first >> FixedCounts::FRACTION_BITS),
            volts: trace.start_voltage as f32,
            ticks: u32::try_from(trace.counts.len())?,
            settings: sent,
            dump: false,
            spoil: None,
        };
        let counts = trace.counts.clone();
        let (records, hash, hashed) = records(&settings, &job, &counts)?;
        let (law, path) = (scenario.spec().law, Choice::<f64>::chosen(&scenario.spec().reference));
        let title = scenario.name().to_owned();
        Ok(Run { name, toml, title, settings, job, counts, trace, law, path, hashed, records, hash })
    }

    /// All of them.
    ///
    /// # Errors
    /// As [`Run::new`].
    pub fn all() -> Result<Vec<Run>, Wrong> {
        std::thread::scope(|scope| {
            let runs = RUNS.map(|(name, toml)| scope.spawn(move || Run::new(name, toml)));
            runs.into_iter().map(|run| run.join().unwrap_or_else(|_| Err("a run panicked".into()))).collect()
        })
    }

    /// Stick-slip cycles, as the encoder shows them.
    #[must_use]
    pub fn cycles(&self) -> u64 {
        let last = self.records.chunks_exact(RECORD).last();
        last.and_then(|record| value(record, "cycles")).map_or(0, |cycles| cycles as u64)
    }

    /// The input of the image `mps2-bits`, with another header.
    #[must_use]
    pub fn input(&self, job: Job) -> Vec<u8> {
        let mut bytes = job.to_bytes().to_vec();
        self.settings.each(|key, value| bytes.extend(setting_to_bytes(key, value)));
        bytes.extend(self.counts.iter().flat_map(|counts| counts.to_le_bytes()));
        bytes
    }
}

fn records(settings: &Settings, job: &Job, counts: &[i32]) -> Result<(Vec<u8>, u32, usize), Wrong> {
    let first = Counts(*counts.first().ok_or("a run without a tick")?);
    let workload = Workload::new(settings, job.origin, first, job.volts);
    let mut workload = workload.map_err(|misfit| format!("{misfit:?}"))?;
    let hashed = workload.hashed();
    let (mut records, mut hash) = (Vec::with_capacity(counts.len() * RECORD), hash());
    for counts in counts {
        let record = workload.tick(Counts(*counts));
        hash.update(&record[..hashed]);
        records.extend(record);
    }
    Ok((records, hash.finalize(), hashed))
}

/// The fields of a record with their bytes.
pub fn fields(record: &[u8]) -> impl Iterator<Item = (&'static str, Kind, &[u8])> {
    let mut rest = record;
    FIELDS.iter().map(move |field| {
        let (bytes, after) = rest.split_at(field.kind.size());
        rest = after;
        (field.name, field.kind, bytes)
    })
}

/// A field of a record as a number: exact below 2⁵³.
#[must_use]
pub fn value(record: &[u8], name: &str) -> Option<f64> {
    fields(record).find(|(field, ..)| *field == name).map(|(_, kind, bytes)| number(kind, bytes))
}

fn number(kind: Kind, bytes: &[u8]) -> f64 {
    let wide = bytes.iter().rev().fold(0, |wide, byte| wide << 8 | u64::from(*byte));
    match kind {
        Kind::U8 | Kind::U16 | Kind::U32 => wide as f64,
        Kind::I64 => wide.cast_signed() as f64,
        Kind::F32 => f64::from(f32::from_bits(wide as u32)),
    }
}

/// The first tick and field of two machines' records that differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Tick.
    pub tick: usize,
    /// Field.
    pub field: &'static str,
    /// Its value here.
    pub ours: String,
    /// Its value there.
    pub theirs: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Difference { tick, field, ours, theirs } = self;
        write!(f, "tick {tick}, {field}: {ours} here, {theirs} there")
    }
}

/// Compares two machines' records of a run.
#[must_use]
pub fn first_difference(ours: &[u8], theirs: &[u8]) -> Option<Difference> {
    let pairs = ours.chunks_exact(RECORD).zip(theirs.chunks_exact(RECORD)).enumerate();
    let shown = |kind, bytes: &[u8]| {
        let hex: String = bytes.iter().rev().map(|b| format!("{b:02x}")).collect();
        format!("{:?} (0x{hex})", number(kind, bytes))
    };
    for (tick, (a, b)) in pairs {
        let differs = fields(a).zip(fields(b)).find(|(a, b)| a.2 != b.2);
        if let Some(((field, kind, a), (_, _, b))) = differs {
            return Some(Difference { tick, field, ours: shown(kind, a), theirs: shown(kind, b) });
        }
    }
    (ours.len() != theirs.len()).then(|| Difference {
        tick: ours.len().min(theirs.len()) / RECORD,
        field: "record",
        ours: format!("{} bytes in all", ours.len()),
        theirs: format!("{} bytes in all", theirs.len()),
    })
}

/// The table of `docs/bits.md`.
#[must_use]
pub fn table(runs: &[Run]) -> String {
    let mut text = "| run | what | ticks | stick-slip cycles | CRC-32 |\n|---|---|---|---|---|\n".to_owned();
    for run in runs {
        let Run { name, title, job, hash, .. } = run;
        text += &format!("| `{name}` | {title} | {} | {} | `{hash:08x}` |\n", job.ticks, run.cycles());
    }
    text
}

/// Writes the files that a machine other than the emulator needs to repeat the runs and to compare
/// itself: scenarios, counts, records, the fields of a record (name and NumPy's type), and a list
/// of the runs (name, ticks, hash).
///
/// # Errors
/// A file that cannot be written.
pub fn write(runs: &[Run], folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let mut list = String::new();
    for Run { name, toml, job, counts, records, hash, hashed, .. } in runs {
        let counts: Vec<u8> = counts.iter().flat_map(|counts| counts.to_le_bytes()).collect();
        std::fs::write(folder.join(format!("{name}.toml")), toml)?;
        std::fs::write(folder.join(format!("{name}.counts")), counts)?;
        std::fs::write(folder.join(format!("{name}.records")), records)?;
        list += &format!("{name} {} {hash:08x} {hashed}\n", job.ticks);
    }
    let fields: String = FIELDS.iter().map(|f| format!("{} {}\n", f.name, f.kind.numpy())).collect();
    std::fs::write(folder.join("fields.txt"), fields)?;
    std::fs::write(folder.join("runs.txt"), list)
}
