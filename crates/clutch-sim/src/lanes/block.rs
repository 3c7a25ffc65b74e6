//! A block of runs in lockstep: chunks of as many as a vector has lanes.

use super::candidate::{Candidate, Common};
use super::motion::Motions;
use super::servo::{FIXED, Sensors, Servos, Targets, beyond};
use super::shafts::Shafts;
use super::silence::Silences;
use crate::detected::STAIR;
use crate::lane::elementary::Powers;
use crate::lane::vector::InLanes;
use crate::lane::{Lane, MOST_LANES};
use crate::metrics::{Detected, Metrics, MetricsBuilder, Sampled, Sticks};
use crate::run::REPORT_EVERY;
use clutch_core::reference::Reference;
use clutch_core::{StickSlipParams, Target};

/// The paths of a chunk's runs.
enum Paths<'a> {
    /// One, but for where it begins.
    Same(Box<Reference<'a, f64>>),
    Each(Vec<Reference<'a, f64>>),
}

/// Runs in the lanes of one vector, but for the motion of their shafts.
struct Chunk<'a, V: Lane> {
    // Kept for the whole run.
    paths: Paths<'a>,
    /// Beginning of each path, in fixed point.
    start: V,
    sensors: Sensors<V>,
    // Changed by each tick.
    servos: Servos<'a, V>,
    radians_per_count: V,
    counts: V,
    // Results.
    sampled: Sampled<V>,
    /// Of stick-slip, and stairs.
    silences: Silences<V, 2>,
}

/// Figures of a run; none if it left what lanes can do.
pub(super) type Figures = Option<(Metrics, Detected)>;

/// A block, not yet in lanes.
pub(super) struct Block<'b, 'a> {
    pub(super) rows: &'b [&'a Candidate<'a>],
    pub(super) common: Common,
    /// True once it has to stop; asked now and then.
    pub(super) stop: &'b dyn Fn() -> bool,
}

impl InLanes for Block<'_, '_> {
    type Output = Option<Vec<Figures>>;

    #[inline(always)]
    fn run<V: Powers>(self) -> Self::Output {
        let Block { rows, common, stop } = self;
        let Some((mut motions, mut chunks)) = Chunk::<V>::all(rows, &common) else {
            return Some(rows.iter().map(|_| None).collect());
        };
        // Of one path there is one target, and not one for each vector.
        let first = rows.first().map(|row| &row.path);
        let shared = first.filter(|first| rows.iter().all(|row| row.path == **first));
        let asks = (REPORT_EVERY / rows.len() as u64).max(1);
        for k in 0..common.ticks {
            if k % asks == 0 {
                if stop() {
                    return None;
                }
                if motions.shafts.iter().all(|shafts| shafts.lost == !0) {
                    break;
                }
            }
            let time = k as f64 * common.motion.period;
            let target = shared.map(|path| path.at(k));
            for (n, chunk) in chunks.iter_mut().enumerate() {
                chunk.sample((k, time), target.as_ref(), &common, &mut motions.shafts[n]);
                motions.begin(n, time);
            }
            motions.end(time);
        }
        let of = |(i, _): (usize, &&Candidate<'_>)| {
            let (n, lane) = (i / V::WIDTH, i % V::WIDTH);
            chunks[n].figures(lane, &common, &motions.shafts[n])
        };
        Some(rows.iter().enumerate().map(of).collect())
    }
}

impl<'a, V: Lane> Chunk<'a, V> {
    /// All runs as they begin; none if they have no lanes together.
    fn all(rows: &[&'a Candidate<'a>], common: &Common) -> Option<(Motions<V>, Vec<Self>)> {
        let rigs: Vec<_> = rows.iter().map(|r| (&r.prepared.moving, r.prepared.volts)).collect();
        let sticks = Sticks::new(common.motion.period, common.settle);
        let motions = Motions::<V>::of(&rigs, &common.motion, &sticks)?;
        let chunks = rows.chunks(V::WIDTH).zip(&motions.shafts);
        let chunks = chunks.map(|(rows, shafts)| Chunk::of(rows, shafts, common)).collect::<Option<_>>()?;
        Some((motions, chunks))
    }

    /// The runs of one vector as they begin.
    fn of(rows: &[&'a Candidate<'a>], shafts: &Shafts<V>, common: &Common) -> Option<Self> {
        let row = |i: usize| rows[i.min(rows.len() - 1)];
        let all = || (0..V::WIDTH).map(row);
        let first = row(0);
        let paths = if rows.iter().all(|r| r.path == first.path) {
            Paths::Same(first.path.into())
        } else {
            Paths::Each(all().map(|r| r.path).collect())
        };
        let period = common.motion.period;
        let counts_per_radian = V::of(|i| row(i).steered.servo.encoder().counts_per_radian());
        let servos: Vec<_> = all().map(|r| &r.steered).collect();
        let mut chunk = Chunk {
            paths,
            start: V::of(|i| row(i).start.0 as f64),
            sensors: Sensors { counts_per_radian, whole_counts: common.whole_counts },
            servos: Servos::of(&servos, common.whole_counts, common.whole_codes)?,
            radians_per_count: V::of(|i| row(i).steered.servo.encoder().radians_per_count()),
            counts: V::ZERO,
            sampled: Sampled::new(period, common.settle),
            silences: Silences::new(
                [&StickSlipParams::default(), &STAIR],
                counts_per_radian * V::splat(period),
            ),
        };
        let targets = chunk.targets(0, None);
        let (_, seen) = chunk.sensors.read(shafts.position);
        chunk.servos.start(!V::none(), seen, &targets, shafts.arriving);
        Some(chunk)
    }

    /// The targets at a tick; `shared`: the one of the path that all runs of the block have.
    #[inline(always)]
    fn targets(&self, k: u64, shared: Option<&Target<f64>>) -> Targets<V> {
        let all = |target: &Target<f64>| Targets {
            position: V::splat(target.position.0 as f64) + self.start,
            velocity: V::splat(target.velocity),
            acceleration: V::splat(target.acceleration),
        };
        match (shared, &self.paths) {
            (Some(target), _) => all(target),
            (None, Paths::Same(path)) => all(&path.at(k)),
            (None, Paths::Each(paths)) => {
                let mut all = [Target::default(); MOST_LANES];
                for (target, path) in all.iter_mut().zip(paths) {
                    *target = path.at(k);
                }
                let targets = Targets::<V>::of(&all);
                Targets { position: targets.position + self.start, ..targets }
            }
        }
    }

    /// Tick `k` begins: sensor, law, converter, figures.
    #[inline(always)]
    fn sample(
        &mut self,
        (k, time): (u64, f64),
        shared: Option<&Target<f64>>,
        common: &Common,
        shafts: &mut Shafts<V>,
    ) {
        let targets = self.targets(k, shared);
        let (counts, seen) = self.sensors.read(shafts.position);
        shafts.lost |= beyond(seen, targets.position);
        let commanded = self.servos.sample(shafts.lost, seen, &targets);
        let target = targets.position * V::splat(1.0 / FIXED) * self.radians_per_count;
        self.sampled.sample(time, target - shafts.position, shafts.velocity, commanded);
        let rests = if k == 0 { V::none() } else { V::same(counts, self.counts) };
        self.counts = counts;
        let settled = time >= common.settle;
        self.silences.update(!rests, targets.velocity, settled);
        shafts.command(commanded);
    }

    /// Figures of a lane.
    fn figures(&self, i: usize, common: &Common, shafts: &Shafts<V>) -> Figures {
        if shafts.lost >> i & 1 == 1 {
            return None;
        }
        let sticks = shafts.sticks[i].clone();
        let metrics = MetricsBuilder::of(self.sampled.lane(i), sticks).finish();
        let time = metrics.measured_s.max(common.motion.period);
        let [(cycles, stuck_ticks), (stairs, _)] = self.silences.since_settled(i);
        let detected = Detected {
            stick_slip_cycles_per_s: cycles / time,
            stick_time_fraction: stuck_ticks * common.motion.period / time,
            stairs_per_s: stairs / time,
            ..Detected::default()
        };
        Some((metrics, detected))
    }
}
