//! Servos of shafts in lanes: sensor, filter (5), law, converter.

use crate::lane::{Lane, MOST_LANES, each};
use crate::run::RunSpec;
use clutch_core::law::{self, ControlLaw, Law, LawState, Seen, Tick};
use clutch_core::{
    Counts, DacCode, FixedCounts, FrictionMap, Place, Servo, ServoState, SmoothedDerivative, Target,
    VelocityParams,
};

/// Counts of an encoder beyond which a run goes alone: what wraps, wraps there.
const FARTHEST: f64 = (1 << 30) as f64;
/// A count in the fixed point of positions.
pub(super) const FIXED: f64 = (1 << FixedCounts::FRACTION_BITS) as f64;

macro_rules! laws {
    ($(lanes $law:ident;)+) => {
        /// A law of several runs, and its memory.
        #[derive(Clone)]
        enum LawInLanes<V: Lane> {
            $($law(law::$law<V>, <law::$law<V> as ControlLaw<V>>::State),)+
        }

        impl<V: Lane> LawInLanes<V> {
            /// The laws of the runs as one; none if they are not of one kind, or of a kind that has no lanes.
            fn of(laws: &[&Law<f64>]) -> Option<Self> {
                match laws.first()? {
                    $(Law::$law(_) => {
                        let own = |law: &&Law<f64>| if let Law::$law(law) = law { Some(*law) } else { None };
                        let own: Vec<law::$law<f64>> = laws.iter().map(own).collect::<Option<_>>()?;
                        let law: Option<law::$law<V>> =
                            law::$law::in_lanes(&|get| V::of(|i| get(&own[i]))).into();
                        Some(LawInLanes::$law(law?, Default::default()))
                    })+
                    _ => None,
                }
            }

            /// Begins at a tick in some lanes, with so many volts on the actuator.
            fn start(&mut self, which: V::Mask, tick: &Tick<V>, applied: V) {
                match self {
                    $(LawInLanes::$law(law, state) => {
                        let begun = law.start(tick, applied);
                        *state = <law::$law<V> as ControlLaw<V>>::State::select(which, &begun, state);
                    })+
                }
            }

            /// A period, with so many volts on the actuator since the last one.
            #[inline(always)]
            fn update(&mut self, tick: &Tick<V>, applied: impl FnOnce() -> V) -> V {
                match self {
                    $(LawInLanes::$law(law, state) => {
                        law.sees(state, || Seen { applied: applied(), ..Seen::default() });
                        law.update(state, tick).voltage
                    })+
                }
            }
        }

        /// The laws that run in lanes.
        fn has_lanes(law: &Law<f64>) -> bool {
            matches!(law, $(Law::$law(_))|+)
        }
    };
}
clutch_core::each_law_in_lanes!(laws);

/// A servo as lanes take it.
#[derive(Clone, Copy)]
pub(super) struct Steered<'a> {
    pub(super) servo: Servo<f64>,
    pub(super) by: Steering<'a>,
}

/// The way in which servos of one vector are computed.
#[derive(Clone, Copy)]
pub(super) enum Steering<'a> {
    /// In its lanes, with their filter (5).
    InLanes(SmoothedDerivative<f64>),
    /// One after the other, beside motion in lanes: with another filter, with a shell, or under a law that has no lanes.
    /// Some know a map of the disc.
    InTurn(Option<FrictionMap<'a>>),
}

impl<'a> Steered<'a> {
    /// The servo of a specification; none if it cannot be built.
    pub(super) fn of(spec: &RunSpec<'a>) -> Option<Self> {
        let servo = Servo::<f64>::new(&spec.servo().ok()?).ok()?;
        let by = match &spec.velocity {
            VelocityParams::SmoothedDerivative(filter)
                if spec.shell.boundary <= 0.0 && has_lanes(servo.law()) =>
            {
                Steering::InLanes(SmoothedDerivative::new(filter, servo.encoder(), spec.period).ok()?)
            }
            _ => Steering::InTurn(spec.friction_map),
        };
        Some(Steered { servo, by })
    }

    /// True if they are computed in lanes.
    pub(super) fn in_lanes(&self) -> bool {
        matches!(self.by, Steering::InLanes(_))
    }
}

/// The target of each lane; its position in fixed point.
pub(super) struct Targets<V> {
    pub(super) position: V,
    pub(super) velocity: V,
    pub(super) acceleration: V,
}

impl<V: Lane> Targets<V> {
    /// Of at most as many lanes as there are; those that are left over have the last.
    #[inline(always)]
    pub(super) fn of(each: &[Target<f64>]) -> Self {
        let at = |i: usize| &each[i.min(each.len() - 1)];
        Targets {
            position: V::of(|i| at(i).position.0 as f64),
            velocity: V::of(|i| at(i).velocity),
            acceleration: V::of(|i| at(i).acceleration),
        }
    }

    /// The target of a lane.
    fn lane(&self, i: usize) -> Target<f64> {
        Target {
            position: FixedCounts(self.position.lane(i) as i64),
            velocity: self.velocity.lane(i),
            acceleration: self.acceleration.lane(i),
        }
    }
}

/// Encoders of the shafts in the lanes of one vector.
#[derive(Clone, Copy)]
pub(super) struct Sensors<V> {
    pub(super) counts_per_radian: V,
    /// Else they are ideal.
    pub(super) whole_counts: bool,
}

impl<V: Lane> Sensors<V> {
    /// Counts of the encoder, and the position that the servo sees, in fixed point.
    #[inline(always)]
    pub(super) fn read(&self, position: V) -> (V, V) {
        let fine = position * self.counts_per_radian;
        let counts = fine.floor();
        let fixed = V::splat(FIXED);
        (counts, if self.whole_counts { counts * fixed } else { (fine * fixed).floor() })
    }
}

/// Lanes whose positions or whose targets, both in fixed point, are together beyond what lanes do, or no number.
#[inline(always)]
pub(super) fn beyond<V: Lane>(seen: V, target: V) -> u64 {
    let near = (seen.abs() + target.abs()).less(V::splat(FARTHEST * FIXED));
    if V::all(near) { 0 } else { V::bits(!near) }
}

/// Servos of the shafts in the lanes of one vector.
pub(super) enum Servos<'a, V: Lane> {
    InLanes(LaneServos<V>),
    InTurn(SingleServos<'a>),
}

impl<'a, V: Lane> Servos<'a, V> {
    /// Servos, one for each lane; none if they have no lanes together.
    pub(super) fn of(servos: &[&Steered<'a>], whole_counts: bool, whole_codes: bool) -> Option<Self> {
        if servos.iter().all(|steered| steered.in_lanes()) {
            return LaneServos::of(servos, whole_codes).map(Servos::InLanes);
        }
        Some(Servos::InTurn(SingleServos::of(servos, whole_counts, whole_codes)))
    }

    /// Begins in some lanes, at the position that is seen, with so many volts on the actuator.
    pub(super) fn start(&mut self, which: V::Mask, seen: V, targets: &Targets<V>, volts: V) {
        match self {
            Servos::InLanes(servos) => servos.start(which, seen, targets, volts),
            Servos::InTurn(servos) => servos.start(which, seen, targets, volts),
        }
    }

    /// A tick, with the position that is seen, in lanes that are not lost: the voltage that goes out, V.
    #[inline(always)]
    pub(super) fn sample(&mut self, lost: u64, seen: V, targets: &Targets<V>) -> V {
        match self {
            Servos::InLanes(servos) => servos.sample(seen, targets).1,
            Servos::InTurn(servos) => servos.sample(lost, seen, targets),
        }
    }
}

/// Servos that are computed in the lanes.
pub(super) struct LaneServos<V: Lane> {
    radians_per_count: V,
    /// Lowest voltage of the converter, its step, codes per volt, and its highest code.
    dac: [V; 4],
    /// Else the law's own voltage goes out.
    whole_codes: bool,
    filter: SmoothedDerivative<V>,
    law: LawInLanes<V>,
    /// Error of the last sample in fixed point, and its rate by (5).
    error: V,
    rate: V,
    /// Voltage since the last sample: the converter's, or the law's own.
    last: V,
}

impl<V: Lane> LaneServos<V> {
    /// Servos, one for each lane; none if one is not computed in lanes, or if their laws have none together.
    pub(super) fn of(all: &[&Steered<'_>], whole_codes: bool) -> Option<Self> {
        let filter = |one: &&Steered<'_>| match one.by {
            Steering::InLanes(filter) => Some(filter),
            Steering::InTurn(_) => None,
        };
        let filters = all.iter().map(filter).collect::<Option<Vec<_>>>()?;
        let of = |get: &dyn Fn(&Servo<f64>) -> f64| V::of(|i| get(&all[i].servo));
        Some(LaneServos {
            radians_per_count: of(&|s| s.encoder().radians_per_count()),
            dac: [
                of(&|s| s.dac().volts(DacCode(0))),
                of(&|s| s.dac().step()),
                of(&|s| s.dac().per_volt()),
                of(&|s| f64::from(s.dac().top().0)),
            ],
            whole_codes,
            filter: SmoothedDerivative::in_lanes(&|get| V::of(|i| get(&filters[i]))),
            law: LawInLanes::of(&all.iter().map(|one| one.servo.law()).collect::<Vec<_>>())?,
            error: V::ZERO,
            rate: V::ZERO,
            last: V::ZERO,
        })
    }

    /// Begins in some lanes, at the position that is seen, with so many volts on the actuator.
    pub(super) fn start(&mut self, which: V::Mask, seen: V, targets: &Targets<V>, volts: V) {
        self.error = V::select(which, targets.position - seen, self.error);
        self.rate = V::select(which, V::ZERO, self.rate);
        self.last = V::select(which, volts, self.last);
        let tick = self.tick(targets);
        self.law.start(which, &tick, volts);
    }

    #[inline(always)]
    fn tick(&self, targets: &Targets<V>) -> Tick<V> {
        Tick {
            error: self.error * V::splat(1.0 / FIXED) * self.radians_per_count,
            error_rate: self.rate,
            target_velocity: targets.velocity,
            target_acceleration: targets.acceleration,
        }
    }

    /// A tick, with the position that is seen: the law's input, and the voltage that goes out, V.
    #[inline(always)]
    pub(super) fn sample(&mut self, seen: V, targets: &Targets<V>) -> (Tick<V>, V) {
        let error = targets.position - seen;
        let difference = (error - self.error) * V::splat(1.0 / FIXED);
        self.error = error;
        self.rate = self.filter.smooth(self.rate, difference);
        let tick = self.tick(targets);
        // A law is told of the converter's voltage, though a rig's may round nothing.
        let (dac, last, rounded) = (&self.dac, self.last, self.whole_codes);
        let applied = || if rounded { last } else { converted(dac, last) };
        let demand = self.law.update(&tick, applied);
        self.last = if rounded { converted(dac, demand) } else { demand };
        (tick, self.last)
    }
}

/// The voltage of the nearest code.
#[inline(always)]
fn converted<V: Lane>([lowest, step, per_volt, top]: &[V; 4], demand: V) -> V {
    let code = ((demand - *lowest) * *per_volt + V::splat(0.5)).floor();
    let code = V::select(V::ZERO.less(code), code, V::ZERO);
    *lowest + *step * V::select(code.less(*top), code, *top)
}

/// Servos that are computed one after the other.
pub(super) struct SingleServos<'a> {
    lanes: Vec<Single<'a>>,
    whole_counts: bool,
    whole_codes: bool,
}

/// A servo with its memory.
struct Single<'a> {
    servo: Servo<f64>,
    state: ServoState<f64, LawState<f64>>,
    map: Option<FrictionMap<'a>>,
}

impl<'a> SingleServos<'a> {
    fn of(all: &[&Steered<'a>], whole_counts: bool, whole_codes: bool) -> Self {
        let single = |one: &&Steered<'a>| Single {
            servo: one.servo,
            state: ServoState::default(),
            map: match one.by {
                Steering::InLanes(_) => None,
                Steering::InTurn(map) => map,
            },
        };
        SingleServos { lanes: all.iter().map(single).collect(), whole_counts, whole_codes }
    }

    fn start<V: Lane>(&mut self, which: V::Mask, seen: V, targets: &Targets<V>, volts: V) {
        each(V::bits(which), |i| {
            let Single { servo, state, .. } = &mut self.lanes[i];
            let (position, target) = (FixedCounts(seen.lane(i) as i64), targets.lane(i));
            *state = if self.whole_counts {
                servo.start(whole(position), &target, volts.lane(i))
            } else {
                servo.start_at(position, &target, volts.lane(i))
            };
        });
    }

    // Once, by the instructions of a run alone: nothing of it is in lanes.
    #[inline(never)]
    fn sample<V: Lane>(&mut self, lost: u64, seen: V, targets: &Targets<V>) -> V {
        let mut volts = [0.0; MOST_LANES];
        for (i, Single { servo, state, map }) in self.lanes.iter_mut().enumerate() {
            if lost >> i & 1 == 1 {
                continue;
            }
            let (position, target) = (FixedCounts(seen.lane(i) as i64), targets.lane(i));
            let place = |position| map.map_or_else(Place::default, |map| map.at(position));
            let out = if self.whole_counts {
                servo.tick_on(state, whole(position), &target, place)
            } else {
                servo.tick_at(state, position, &target, place)
            };
            volts[i] = if self.whole_codes { servo.dac().volts(out.code) } else { out.command.voltage };
        }
        V::of(|i| volts[i])
    }
}

/// A whole position, which is near, as the encoder's word.
fn whole(position: FixedCounts) -> Counts {
    Counts((position.0 >> FixedCounts::FRACTION_BITS) as i32)
}
