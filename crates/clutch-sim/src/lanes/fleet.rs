//! Shafts of a fleet in lanes: motion, and laws where they can.

use super::alike::Alike;
use super::motion::Motions;
use super::servo::{FIXED, LaneServos, Sensors, Steered, Targets, beyond};
use crate::engine::EngineKind;
use crate::fleet::{Begun, Quantity, Told};
use crate::lane::Lane;
use crate::lane::elementary::Powers;
use crate::lane::vector::{InLanes, at};
use crate::metrics::Sticks;
use crate::run::RunSpec;
use crate::scenario::ScalarKind;
use clutch_core::Target;
use fearless_simd::Level;

/// Shafts in the lanes of vectors, by whatever instructions.
pub(crate) trait Together: Send + Sync {
    /// A shaft begins, with its first target.
    fn begin(&mut self, shaft: usize, begun: &Begun, target: &Target<f64>);
    /// A period passes, under voltages that the converters give, V.
    fn advance(&mut self, volts: &[f64]);
    /// A sample, with the targets of the shafts: the motion is told, and what laws in lanes see and answer.
    fn look(&mut self, targets: &[Target<f64>], told: &mut Told);
    /// A shaft that left what lanes can do.
    fn lost(&self, shaft: usize) -> bool;
    /// Sticks of a shaft since it began.
    fn sticks(&self, shaft: usize) -> u64;
}

/// Shafts of one scenario, not yet in lanes.
pub(crate) struct Gathered<'a> {
    begun: &'a [Begun],
    alike: Alike,
    whole_counts: bool,
    whole_codes: bool,
    /// The servo, if it runs in lanes.
    servo: Option<Steered<'a>>,
}

impl<'a> Gathered<'a> {
    /// Shafts of a specification that an engine moves; none if that has to be alone.
    pub(crate) fn of(
        spec: &RunSpec<'a>,
        scalar: ScalarKind,
        engine: EngineKind,
        begun: &'a [Begun],
    ) -> Option<Self> {
        // One by one they are no faster here than alone.
        let servo = Steered::of(spec).filter(|servo| scalar == ScalarKind::F64 && servo.in_lanes());
        Some(Gathered {
            begun,
            alike: Alike::of(begun.first()?.moving.rig(), engine, spec.period.seconds())?,
            whole_counts: spec.rig.encoder.quantised,
            whole_codes: spec.rig.dac.quantised,
            servo,
        })
    }

    /// The shafts in lanes, by the instructions of a level, and whether their laws are; none where there are no lanes.
    pub(crate) fn at(self, level: Level) -> Option<(Box<dyn Together>, bool)> {
        let laws = self.servo.is_some();
        Some((at(level, self)??, laws))
    }
}

impl InLanes for Gathered<'_> {
    type Output = Option<Box<dyn Together>>;

    #[inline(always)]
    fn run<V: Powers>(self) -> Self::Output {
        let Gathered { begun, alike, whole_counts, whole_codes, servo } = self;
        let rigs: Vec<_> = begun.iter().map(|begun| (&begun.moving, begun.volts)).collect();
        // Times of events are those within a period: sticks are counted, and nothing more.
        let sticks = Sticks::new(alike.period, 0.0);
        let motions = Motions::<V>::of(&rigs, &alike, &sticks)?;
        let laws = match servo {
            None => None,
            Some(servo) => {
                let each = vec![&servo; V::WIDTH];
                let laws = motions.shafts.iter().map(|_| LaneServos::of(&each, whole_codes));
                Some(laws.collect::<Option<Vec<_>>>()?)
            }
        };
        let counts_per_radian = V::splat(begun.first()?.moving.rig().encoder.counts_per_radian());
        let sensors = Sensors { counts_per_radian, whole_counts };
        Some(Box::new(Group { motions, sensors, laws, sticks }))
    }
}

/// Shafts in the lanes of vectors.
struct Group<V: Lane> {
    motions: Motions<V>,
    sensors: Sensors<V>,
    /// Vector by vector.
    laws: Option<Vec<LaneServos<V>>>,
    /// None so far.
    sticks: Sticks,
}

/// The shafts of a vector, from this one on, have these numbers.
#[inline(always)]
fn tell<V: Lane>(told: &mut Told, first: usize, of: Quantity, numbers: V) {
    for (i, to) in told.row(of)[first..].iter_mut().take(V::WIDTH).enumerate() {
        *to = numbers.lane(i);
    }
}

impl<V: Lane> Together for Group<V> {
    fn begin(&mut self, shaft: usize, begun: &Begun, target: &Target<f64>) {
        let (n, lane) = (shaft / V::WIDTH, shaft % V::WIDTH);
        self.motions.begin_anew(n, lane, (&begun.moving, begun.volts), &self.sticks);
        if let Some(laws) = &mut self.laws {
            let which = V::ZERO.less(V::of(|i| f64::from(u8::from(i == lane))));
            let (_, seen) = self.sensors.read(self.motions.shafts[n].position);
            laws[n].start(which, seen, &Targets::of(&[*target]), V::splat(begun.volts));
        }
    }

    fn advance(&mut self, volts: &[f64]) {
        let motions = &mut self.motions;
        V::apart(
            #[inline(always)]
            || {
                for (n, some) in volts.chunks(V::WIDTH).enumerate() {
                    motions.shafts[n].command(V::of(|i| some[i.min(some.len() - 1)]));
                    motions.begin(n, 0.0);
                }
                motions.end(0.0);
            },
        );
    }

    fn look(&mut self, targets: &[Target<f64>], told: &mut Told) {
        let Group { motions, sensors, laws, .. } = self;
        V::apart(
            #[inline(always)]
            || {
                for (n, some) in targets.chunks(V::WIDTH).enumerate() {
                    let (shafts, targets) = (&mut motions.shafts[n], Targets::of(some));
                    let first = n * V::WIDTH;
                    let (_, seen) = sensors.read(shafts.position);
                    shafts.lost |= beyond(seen, targets.position);
                    tell(told, first, Quantity::Position, shafts.position);
                    tell(told, first, Quantity::Velocity, shafts.velocity);
                    // A count of −0 is 0.
                    tell(told, first, Quantity::Counts, seen * V::splat(1.0 / FIXED) + V::ZERO);
                    let moves = shafts.sign.less(V::ZERO) | V::ZERO.less(shafts.sign);
                    tell(told, first, Quantity::Stuck, V::select(moves, V::ZERO, V::ONE));
                    if let Some(laws) = laws {
                        let (tick, volts) = laws[n].sample(seen, &targets);
                        tell(told, first, Quantity::MeasuredError, tick.error);
                        tell(told, first, Quantity::ErrorRate, tick.error_rate);
                        tell(told, first, Quantity::LawVoltage, volts);
                    }
                }
            },
        );
    }

    fn lost(&self, shaft: usize) -> bool {
        self.motions.shafts[shaft / V::WIDTH].lost >> (shaft % V::WIDTH) & 1 == 1
    }

    fn sticks(&self, shaft: usize) -> u64 {
        self.motions.shafts[shaft / V::WIDTH].sticks[shaft % V::WIDTH].count()
    }
}
