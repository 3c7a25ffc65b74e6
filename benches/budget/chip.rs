//! Counts of instructions of the images that are flashed, in runs on the model of their chip.

use crate::emulator::Counts;
use anyhow::{Context, Result};
use clutch_loop::chip_board::{AloneSession, ChipEnd, ChipOptions, ChipRole, ChipSession, Counted};
use clutch_loop::lockstep_session::LockstepOptions;
use clutch_sim::Scenario;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A run of 0.4 s on the chip.
struct Run {
    image: &'static str,
    law: &'static str,
    set: Pairs,
    /// True if it is counted to its end; else while it goes on.
    ends: bool,
    /// Rows of firmware/budget.toml that it measures, by `measured`, and what of it.
    rows: Pairs,
}

const CONTROLLER: &str = "nucleo-controller";
const DURATION_S: f64 = 0.4;
/// The rig that the images are made for.
const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/nucleo_smc_2.toml");
const TABLE: &[(&str, &str)] = &[(
    "reference",
    "{ table = { interpolation = \"cubic\", points_s_deg = [[0.0, 0.0], [0.1, 0.2], [0.2, 0.45], [0.4, 0.8]] } }",
)];
const ANY_EXPONENT: &[(&str, &str)] = &[("model.friction.stribeck.stribeck_exponent", "1.5")];

const CODE: &str = "sample_to_converter";
const PERIOD: &str = "period";
const SERVO: &str = "servo";
const LAWS: &[(&str, &str)] = &[("code", CODE), ("goes_on", PERIOD), ("servo", SERVO)];

type Pairs = &'static [(&'static str, &'static str)];

/// A run of the controller that is counted while it goes on.
const fn goes_on(law: &'static str, set: Pairs, rows: Pairs) -> Run {
    Run { image: CONTROLLER, law, set, ends: false, rows }
}

/// One that is counted to its end.
const fn ends(law: &'static str, set: Pairs, rows: Pairs) -> Run {
    Run { ends: true, ..goes_on(law, set, rows) }
}

const RUNS: [Run; 15] = [
    goes_on("pd", &[], LAWS),
    goes_on("ctc", &[], LAWS),
    goes_on("smc", &[], LAWS),
    goes_on("pid", &[], LAWS),
    goes_on("super_twisting", &[], LAWS),
    goes_on("ctc", ANY_EXPONENT, &[("code_power", CODE), ("servo", SERVO)]),
    goes_on("glide", &[], &[("code_glide", CODE), ("goes_on_glide", PERIOD), ("servo", SERVO)]),
    goes_on("smc", TABLE, &[("goes_on_table", PERIOD)]),
    ends("smc", &[], &[("any", PERIOD)]),
    ends("smc", TABLE, &[("any_table", PERIOD)]),
    ends("glide", &[], &[("any_glide", PERIOD)]),
    Run {
        image: "nucleo-controller-read-back",
        ..goes_on("smc", &[], &[("code_read_back", CODE), ("goes_on_read_back", PERIOD)])
    },
    Run {
        image: "nucleo-daq-read-back",
        ..ends("smc", &[], &[("daq_code_read_back", CODE), ("daq_any_read_back", PERIOD)])
    },
    // It has its run compiled in, of which this is the begin.
    Run {
        image: "nucleo-alone",
        ..goes_on("smc", &[], &[("alone_code", CODE), ("alone_goes_on", PERIOD), ("alone_servo", SERVO)])
    },
    Run { image: "nucleo-daq", ..ends("smc", &[], &[("daq_code", CODE), ("daq_any", PERIOD)]) },
];

/// Counts by the names of rows.
pub(crate) type OnChip = BTreeMap<&'static str, Counts>;

/// Makes the runs with the images of a folder.
pub(crate) fn measure(images: &Path) -> Result<OnChip> {
    let (next, counted) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        while let Some(run) = RUNS.get(next.fetch_add(1, Ordering::Relaxed)) {
            let of = run.count(images).with_context(|| format!("{} under {}", run.image, run.law));
            counted.lock().unwrap_or_else(|e| e.into_inner()).push((run, of));
        }
    };
    std::thread::scope(|scope| (0..2).for_each(|_| drop(scope.spawn(work))));
    let mut measured = OnChip::new();
    for (run, of) in counted.into_inner().unwrap_or_else(|e| e.into_inner()) {
        let of = of?;
        for (row, what) in run.rows {
            let counts = counts(&of[*what]).with_context(|| format!("{}: no counts of {what}", run.image))?;
            measured.entry(row).and_modify(|all| *all = all.and(&counts)).or_insert(counts);
        }
    }
    Ok(measured)
}

impl Run {
    fn count(&self, images: &Path) -> Result<Counted> {
        let of_run = [
            ("law", format!("{{ {} = {{}} }}", self.law)),
            ("run.duration_s", DURATION_S.to_string()),
            ("run.settle_s", "0.1".to_owned()),
            ("safety.limits.following_error_deg", "5.0".to_owned()),
        ];
        let more = self.set.iter().map(|(key, value)| (*key, (*value).to_owned()));
        let set = of_run.into_iter().chain(more).map(|(key, value)| (key.to_owned(), value));
        let scenario = Scenario::load(Path::new(SCENARIO), &set.collect::<Vec<_>>())?;
        let file = std::env::temp_dir().join(format!("clutch-budget-{}-{self:p}.json", std::process::id()));
        let chip = ChipOptions {
            count: Some(file.clone()),
            until: (!self.ends).then_some(DURATION_S - 0.05),
            ..ChipOptions::default()
        };
        let image = images.join(self.image);
        let end = if AloneSession::is_for(&image) {
            AloneSession::new(scenario, true, chip.faults, chip.count)?.run(&image)?.chip
        } else {
            self.with_host(scenario, chip, &image)?
        };
        std::fs::remove_file(&file)?;
        end.counted.context("nothing was counted")
    }

    fn with_host(&self, scenario: Scenario, chip: ChipOptions, image: &Path) -> Result<ChipEnd> {
        let options = LockstepOptions { uncertified: true, seed: 1, ..LockstepOptions::default() };
        Ok(ChipSession::new(scenario, options, chip, ChipRole::of(image))?.run(image)?.chip)
    }
}

fn counts(of: &Counted) -> Option<Counts> {
    let number = |key: &str| of["instructions"][key].as_f64();
    Some(Counts {
        calls: of["count"].as_u64()? as usize,
        least: number("lowest")? as u64,
        mean: number("mean")?.round() as u64,
        most: number("highest")? as u64,
    })
}
