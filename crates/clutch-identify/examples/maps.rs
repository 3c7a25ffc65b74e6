//! Glide with a map of the disc: the tables `maps` of docs/smooth.md and, with the word `motor`, `motor_maps`.
//!
//! Each disc of `bench`, or of the motor axis, is ridden once without a map, which makes one. A second ride begins half a degree
//! farther and has no map, that one, or the one of the disc before.

use clutch_identify::{Recorded, Recording, map_as_believed, map_file, ride::Place};
use clutch_sim::Scenario;
use clutch_sim::engine::EventKind;
use clutch_sim::progress::UNWATCHED;
use clutch_sim::rig::Rig;
use clutch_sim::run::{Keep, Run, simulate_watched};
use std::error::Error;
use std::f64::consts::TAU;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Discs on which no number of the law, the filters or the map was chosen.
const DISCS: std::ops::Range<u64> = 4001..4041;

/// A machine whose discs are ridden.
struct Machine {
    motor: bool,
    /// Rig and model of a scenario.
    rig: &'static str,
    /// Rates of the second ride, °/s.
    rates: &'static [f64],
    /// Rates of the ride that makes the map, °/s, and the way of it, °.
    learnt_at: &'static [(f64, f64)],
}

/// The brake; the last ride that makes a map is that of `clutch identify`.
const BRAKE: Machine = Machine {
    motor: false,
    rig: "[rig]\nbase = \"bench\"\n",
    rates: &[2.0, 1.5, 1.0, 0.7],
    learnt_at: &[(2.0, 16.0), (4.0, 16.0), (4.0, 32.0), (5.0, 40.0)],
};

/// The motor axis of the table `motor`, with a Stribeck velocity of 0.003 rad/s.
const MOTOR: Machine = Machine {
    motor: true,
    rig: include_str!("../../clutch-sim/examples/smooth/motor_axis.toml"),
    rates: &[1.0, 2.0, 4.0],
    learnt_at: &[(2.0, 16.0), (4.0, 16.0)],
};

impl Machine {
    fn scenario(&self, seed: u64, rate: f64, rest: &str, run: &str) -> Outcome<Scenario> {
        let text = format!(
            "name = \"maps\"\n\n{}\n[law.glide.filter]\ndelay_ticks = 1\n\n[reference.ramp]\n\
             rate_deg_s = {rate:?}\n\n[run]\nseed = {seed}\n{run}\n\n{rest}",
            self.rig
        );
        Ok(Scenario::parse("maps", &text, &[])?)
    }

    /// The map of a disc that a ride makes.
    fn learnt(&self, seed: u64, (rate, way): (f64, f64)) -> Outcome<Vec<Place>> {
        let scenario = self.scenario(seed, rate, "", &format!("duration_s = {:?}", way / rate))?;
        let trace = ridden(&scenario)?.trace;
        let ticks = trace.counts.iter().zip(&trace.voltage);
        let recording = Recording {
            motor: self.motor,
            name: "ride".to_owned(),
            period: scenario.spec().period.seconds(),
            counts_per_rev: scenario.spec().rig.encoder.sensor.counts_per_rev,
            step_volts: 20.0 / 4096.0,
            volts_before: trace.start_voltage,
            glides_at: None,
            first_tick: 0,
            ticks: ticks.map(|(&counts, &volts)| Recorded { counts: counts.into(), volts }).collect(),
        };
        Ok(map_as_believed(&[recording], &scenario))
    }

    /// The disc's own friction, a point each 5000th of a turn, from before the beginning of both rides to behind their end.
    fn exact(&self, seed: u64) -> Outcome<Vec<Place>> {
        let rig = Rig::new(&self.scenario(seed, 2.0, "", "")?.spec().rig, seed)?;
        let ripple = rig.model.ripple.as_ref().ok_or("an even disc")?;
        let step = TAU / 5000.0;
        let angles = (-70..300).map(|i| f64::from(i) * step);
        Ok(angles.map(|angle| Place { angle, factor: ripple.factor(angle) }).collect())
    }

    /// Root mean square of a map's error, as a share of friction, its mean apart.
    fn error_of(&self, map: &[Place], seed: u64) -> Outcome<f64> {
        let rig = Rig::new(&self.scenario(seed, 2.0, "", "")?.spec().rig, seed)?;
        let ripple = rig.model.ripple.as_ref().ok_or("an even disc")?;
        let ratios: Vec<f64> = map.iter().map(|place| place.factor / ripple.factor(place.angle)).collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        let square = ratios.iter().map(|r| (r / mean - 1.0) * (r / mean - 1.0)).sum::<f64>();
        Ok((square / ratios.len() as f64).sqrt())
    }

    /// A row: a second ride on each disc, with the maps given.
    fn print_row(&self, title: &str, rate: f64, maps: &[Option<&[Place]>]) -> Outcome<()> {
        let (mut cycles, mut discs, mut error, mut square, mut travel, mut first) =
            (0.0, 0, 0.0_f64, 0.0, 0.0, 0);
        let (mut dropped, mut drove, mut kept) = (Vec::new(), 0.0, 0);
        for (seed, map) in DISCS.zip(maps) {
            let file = map.map_or_else(String::new, |map| map_file(map, "bench"));
            let scenario = self.scenario(seed, rate, &file, "duration_s = 5.0\nstart_counts = 28.37")?;
            let run = ridden(&scenario)?;
            let m = &run.metrics;
            cycles += m.stick_slip_cycles_per_s;
            discs += usize::from(m.stick_slip_cycles_per_s > 0.0);
            error = error.max(m.max_error_rad.to_degrees());
            square += m.rms_error_rad.powi(2);
            travel += m.control_variation_v_s;
            first += run.events.iter().filter(|e| e.time < 1.0 && e.kind == EventKind::Stick).count();
            let (_, part) = run.trace.terms.iter().find(|(name, _)| *name == "map").ok_or("no term map")?;
            drove += part.iter().filter(|&&part| part == 2.0).count() as f64 / part.len() as f64;
            match part.iter().position(|&part| part == 3.0) {
                Some(at) => dropped.push(at as f64 * 1e-3),
                None => kept += 1,
            }
        }
        let n = maps.len() as f64;
        dropped.sort_unstable_by(f64::total_cmp);
        let gone = match (maps.iter().all(Option::is_none), dropped.last()) {
            (true, _) => "–".to_owned(),
            (false, None) => "0".to_owned(),
            (false, Some(last)) => {
                format!("{}: {:.2} s, {last:.2} s", dropped.len(), dropped[dropped.len() / 2])
            }
        };
        let drives = if kept == maps.len() && drove == 0.0 {
            "–".to_owned()
        } else {
            format!("{:.0} %", 100.0 * drove / n)
        };
        println!(
            "| {title} | {:.3} | {discs} | {error:.4}° | {:.4}° | {:.0} | {:.2} | {drives} | {gone} |",
            cycles / n,
            (square / n).sqrt().to_degrees(),
            travel / n,
            first as f64 / n
        );
        Ok(())
    }
}

fn ridden(scenario: &Scenario) -> Outcome<Run> {
    Ok(simulate_watched::<f64>(&scenario.spec(), Keep::Trace, UNWATCHED)?)
}

fn main() -> Outcome<()> {
    let of = match std::env::args().nth(1).as_deref() {
        None => BRAKE,
        Some("motor") => MOTOR,
        Some(word) => return Err(format!("{word}: expected nothing, or motor").into()),
    };
    println!(
        "| second ride, map | cycles/s | discs of {} | largest error | RMS | V/s | sticks in the first second | map drives | dropped: after, median and last |",
        DISCS.count()
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut errors = Vec::new();
    let mut learnt_at = Vec::new();
    for &rate in of.learnt_at {
        let maps = DISCS.map(|seed| of.learnt(seed, rate)).collect::<Outcome<Vec<_>>>()?;
        let off = DISCS.zip(&maps).map(|(seed, map)| of.error_of(map, seed)).collect::<Outcome<Vec<_>>>()?;
        errors.push((rate, off));
        learnt_at.push((rate, maps));
    }
    for &rate in of.rates {
        of.print_row(&format!("{rate} °/s, none"), rate, &vec![None; DISCS.count()])?;
        for ((at, way), maps) in &learnt_at {
            let learnt: Vec<_> = maps.iter().map(|map| Some(&map[..])).collect();
            of.print_row(&format!("{rate} °/s, of a ride at {at} °/s over {way}°"), rate, &learnt)?;
        }
        let own = DISCS.map(|seed| of.exact(seed)).collect::<Outcome<Vec<_>>>()?;
        let own: Vec<_> = own.iter().map(|map| Some(&map[..])).collect();
        of.print_row(&format!("{rate} °/s, the disc's own friction, exactly"), rate, &own)?;
        let (_, maps) = &learnt_at[0];
        let others: Vec<_> = (0..maps.len()).map(|i| Some(&maps[(i + 1) % maps.len()][..])).collect();
        of.print_row(&format!("{rate} °/s, of another disc"), rate, &others)?;
    }
    for ((at, way), off) in &errors {
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        let worst = off.iter().copied().fold(0.0, f64::max);
        println!(
            "\nMaps of rides at {at} °/s over {way}° err by {:.2} % RMS in the mean, {:.2} % on the worst disc.",
            100.0 * mean,
            100.0 * worst
        );
    }
    Ok(())
}
