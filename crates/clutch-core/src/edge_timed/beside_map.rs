//! Two edge-timed filters side by side: one that learns friction by itself, and one whose friction is that of a map.
//!
//! A map may be wrong: of another disc, or shifted, as the zero of an incremental encoder is another at each power-up. So
//! both filters run, and each edge says which of the two foresaw it better, by the logarithm of the ratio of their normal
//! densities, `½ (y₁²/S₁ − y₂²/S₂ + ln S₁/S₂)`. The sum over the edges is the evidence for the map. The first filter drives until that is
//! large, and again when none is left; once it speaks clearly against the map, the map is dropped for good. On an axis with a motor the
//! filter with the map first begins anew from the other, once: a start from rest leaves it an error that a disc without ripple has no
//! way to forget, and which is no fault of the map. Under a brake no right map was lost so, and a wrong one would be kept for longer.

use super::{EdgeTimed, EdgeTimedParams, EdgeTimedState, Surprise};
use crate::{Encoder, FixedCounts, Micros, ParamError, Place, Plant, Real};

/// Edges after which a map may drive.
const PROBATION: f64 = 8.0;
/// Evidence with which a map begins to drive; it drives while there is any.
const NEEDED: f64 = 4.0;
/// Most of the evidence that is kept for a map: one that becomes wrong is not believed for long.
const MOST: f64 = 8.0;
/// Evidence against a map with which a motor's filter begins anew, once, where the other one has got to: it may be its state that is wrong.
const ANEW: f64 = -5.0;
/// Edges of a map whose filter is to begin anew, and has done so.
const ASTRAY: f64 = PROBATION + 1.0;
const RENEWED: f64 = PROBATION + 2.0;
/// Evidence against a map that drops it for good.
const WRONG: f64 = -8.0;
/// Most that one edge says, for a map or against it.
const SAYS: f64 = 3.0;
/// Root mean square of what a map leaves of the ripple, as a share of friction.
const LEFT: f64 = 0.005;
/// Wander of the velocity beside a map, rad/s/√s, at least: what a map leaves is no white noise.
const WALK: f64 = 0.02;
/// Standard deviation by which the end of a count is blurred for a filter that is as sure of the position as with a map, counts.
const BLUR: f64 = 0.05;

/// Both filters, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BesideMap<T> {
    plain: EdgeTimed<T>,
    mapped: EdgeTimed<T>,
}

/// Memory of both filters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct BesideMapState<T> {
    plain: EdgeTimedState<T>,
    mapped: EdgeTimedState<T>,
    /// Friction around the shaft, by the map.
    place: Place<T>,
    /// Part of the map in the law: see [`BesideMapState::part`].
    part: T,
    /// Edges since the map is known, up to `PROBATION`; `ASTRAY` once its filter is to begin anew, `RENEWED` once it has.
    edges: T,
    /// Logarithm of the ratio in which the map has foreseen the edges better than the other filter.
    evidence: T,
}

/// Parts that a map may have.
const NONE: f64 = 0.0;
const TRIED: f64 = 1.0;
const DRIVES: f64 = 2.0;
const DROPPED: f64 = 3.0;

impl<T: Real> BesideMapState<T> {
    /// Part of the map: 0 there is none, 1 it is tried, 2 it drives, 3 it was wrong.
    pub(crate) fn part(&self) -> T {
        self.part
    }

    fn map_drives(&self) -> bool {
        self.part == T::splat(DRIVES)
    }

    /// `true` where the map is tried or drives.
    fn map_counts(&self) -> bool {
        self.part == T::splat(TRIED) || self.map_drives()
    }

    /// State of the filter that drives.
    pub(crate) fn driving(&self) -> &EdgeTimedState<T> {
        if self.map_drives() { &self.mapped } else { &self.plain }
    }
}

impl<T: Real> BesideMap<T> {
    /// As [`EdgeTimed::new`].
    pub(crate) fn new(
        p: &EdgeTimedParams<T>,
        plant: &Plant<T>,
        encoder: Encoder,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        let plain = EdgeTimed::new(p, plant, encoder, period)?;
        let known =
            EdgeTimedParams { ripple: p.ripple.min(T::splat(LEFT)), walk: p.walk.max(T::splat(WALK)), ..*p };
        let mut mapped = EdgeTimed::new(&known, plant, encoder, period)?;
        mapped.blur = T::splat(BLUR * BLUR);
        Ok(BesideMap { plain, mapped })
    }

    /// The filter that knows no map: what they have in common.
    pub(crate) fn plain(&self) -> &EdgeTimed<T> {
        &self.plain
    }

    /// The filter that drives, its state, and friction around the shaft as it takes it to be.
    pub(crate) fn driving<'s>(
        &self,
        state: &'s BesideMapState<T>,
    ) -> (&EdgeTimed<T>, &'s EdgeTimedState<T>, Option<&'s Place<T>>) {
        if state.map_drives() {
            (&self.mapped, &state.mapped, Some(&state.place))
        } else {
            (&self.plain, &state.plain, None)
        }
    }

    /// As [`EdgeTimed::start`].
    pub(crate) fn start(&self, position: FixedCounts, applied: T, target_velocity: T) -> BesideMapState<T> {
        let mut state = BesideMapState::default();
        self.start_in(&mut state, position, applied, target_velocity);
        state
    }

    /// As [`BesideMap::start`], in its place.
    #[inline(never)] // of a name, for a board's bound
    pub(crate) fn start_in(
        &self,
        state: &mut BesideMapState<T>,
        position: FixedCounts,
        applied: T,
        target_velocity: T,
    ) {
        self.plain.start_in(&mut state.plain, position, applied, target_velocity);
        // The fields of the map are written when that begins.
        (state.place, state.part) = (Place::default(), T::splat(NONE));
    }

    /// As [`EdgeTimed::let_go`], of both.
    pub(crate) fn let_go(&self, state: &mut BesideMapState<T>, target_velocity: T) {
        self.plain.let_go(&mut state.plain, target_velocity);
        if state.map_counts() {
            self.let_go_mapped(state, target_velocity);
        }
    }

    #[cold]
    #[inline(never)] // of a name, for a board has no map
    fn let_go_mapped(&self, state: &mut BesideMapState<T>, target_velocity: T) {
        self.mapped.let_go(&mut state.mapped, target_velocity);
    }

    /// As [`EdgeTimed::stand_aside`], of both.
    pub(crate) fn stand_aside(
        &self,
        state: &mut BesideMapState<T>,
        (position, place): (FixedCounts, &Place<T>),
        applied: T,
    ) -> T {
        let begins = Self::look(state, place);
        let moved = self.plain.stand_aside(&mut state.plain, position, applied);
        if begins {
            self.begin_mapped(state, place);
        } else if state.map_counts() {
            self.mapped.stand_aside(&mut state.mapped, position, applied);
        }
        moved
    }

    /// As [`EdgeTimed::take_over`], of both.
    pub(crate) fn take_over(&self, state: &mut BesideMapState<T>, position: T, friction: T) {
        self.plain.take_over(&mut state.plain, position, friction);
        if state.map_counts() {
            self.take_over_mapped(state, position, friction);
        }
    }

    #[cold]
    #[inline(never)] // likewise
    fn take_over_mapped(&self, state: &mut BesideMapState<T>, position: T, friction: T) {
        let mean = friction / state.place.friction(position);
        self.mapped.take_over(&mut state.mapped, position, mean);
    }

    /// As [`EdgeTimed::update_on`], of both; `place`: friction around the shaft, by the map; `path`: its velocity, and what
    /// the shaft was to gain on it.
    #[inline(never)] // of a name, for a board's bound
    pub(crate) fn update(
        &self,
        state: &mut BesideMapState<T>,
        (position, place): (FixedCounts, &Place<T>),
        applied: T,
        path: (T, T),
    ) {
        let begins = Self::look(state, place);
        self.plain.update_on(&mut state.plain, position, applied, path, None);
        if begins {
            self.begin_mapped(state, place);
        } else if state.map_counts() {
            self.update_mapped(state, position, applied, path);
        }
    }

    /// Looks up the map around the shaft, where it may have an end; `true` if its filter begins here, or begins anew.
    fn look(state: &mut BesideMapState<T>, place: &Place<T>) -> bool {
        if !place.is_known() {
            if state.map_counts() {
                state.part = T::splat(NONE);
            }
            return false;
        }
        state.place = *place;
        let begins = state.part == T::splat(NONE);
        if begins {
            state.part = T::splat(TRIED);
            (state.edges, state.evidence) = (T::ZERO, T::ZERO);
        } else if state.part == T::splat(TRIED) && state.edges == T::splat(ASTRAY) {
            state.edges = T::splat(RENEWED);
            return true;
        }
        begins
    }

    #[cold]
    #[inline(never)] // likewise
    fn begin_mapped(&self, state: &mut BesideMapState<T>, place: &Place<T>) {
        state.mapped = self.mapped.known_from(&state.plain, place);
    }

    #[inline(never)] // likewise
    fn update_mapped(&self, state: &mut BesideMapState<T>, position: FixedCounts, applied: T, path: (T, T)) {
        self.mapped.update_on(&mut state.mapped, position, applied, path, Some(&state.place));
        let (plain, mapped) = (state.plain.surprise(), state.mapped.surprise());
        if plain.variance > T::ZERO && mapped.variance > T::ZERO {
            let says =
                T::splat(0.5) * (relative(&plain, &mapped) + ratio_log(plain.variance, mapped.variance));
            let most = T::splat(SAYS);
            state.evidence = (state.evidence + says.limit(-most, most)).min(T::splat(MOST));
            if state.edges < T::splat(PROBATION) {
                state.edges += T::ONE;
            }
            let astray = state.evidence < T::splat(ANEW) && state.edges < T::splat(ASTRAY);
            if astray && self.mapped.actuator.kind().two_sided() {
                // In the next period, instead of an update: a board's longest period grows no longer.
                state.edges = T::splat(ASTRAY);
            }
            let needed = if state.map_drives() { T::ZERO } else { T::splat(NEEDED) };
            let drives = state.edges >= T::splat(PROBATION) && state.evidence > needed;
            let wrong = state.evidence < T::splat(WRONG);
            state.part = match (wrong, drives) {
                (true, _) => T::splat(DROPPED),
                (_, true) => T::splat(DRIVES),
                _ => T::splat(TRIED),
            };
        }
    }
}

/// Squares over their variances, of the one less of the other.
fn relative<T: Real>(one: &Surprise<T>, other: &Surprise<T>) -> T {
    one.square / one.variance - other.square / other.variance
}

/// The natural logarithm of `a/b`, to a tenth of it for ratios up to five.
fn ratio_log<T: Real>(a: T, b: T) -> T {
    let u = (a - b) / (a + b);
    (u + u) * (T::ONE + u * u * T::splat(1.0 / 3.0))
}

#[cfg(test)]
mod tests {
    use super::super::Phase;
    use super::*;
    use crate::{FrictionMap, MotorActuator, PlantParams};
    use std::vec::Vec;

    const PERIOD: Micros = Micros(1000);

    fn filters<T: Real>() -> BesideMap<T> {
        let plant = Plant::new(&PlantParams::default()).unwrap();
        BesideMap::new(&EdgeTimedParams::default(), &plant, Encoder::PAPER, PERIOD).unwrap()
    }

    /// Friction of the disc at a position, over its mean: 340 waves a turn.
    fn disc(counts: f64) -> f64 {
        1.0 + 0.15 * libm::sin(0.1068 * counts)
    }

    /// Points each 4 counts, up to count 400, of a disc that is turned on.
    fn points(turned: f64) -> Vec<u16> {
        (0..=100).map(|i| libm::rint(4096.0 * disc(f64::from(4 * i) + turned)) as u16).collect()
    }

    /// A shaft that goes at 2 °/s from count 10 on, under the voltage that keeps it there, with a map: the states of each period.
    fn ride<T: Real>(map: Option<&[u16]>, periods: i32) -> Vec<BesideMapState<T>> {
        let (f, rate) = (filters::<T>(), 2.0_f64.to_radians());
        let pace = rate * 1e-3 * Encoder::PAPER.counts_per_radian::<f64>();
        let volts = (0.047088 - 0.001 * rate) / (0.15 * 0.14);
        let rate = T::from_f64(rate);
        let mut state = f.start(FixedCounts::from_counts(10), T::from_f64(volts), rate);
        let mut states = Vec::new();
        for k in 1..=periods {
            let counts = 10.0 + pace * f64::from(k);
            let read = FixedCounts::from_counts(counts as i64);
            let place =
                map.map_or_else(Place::default, |points| FrictionMap::new(0, 4, points).unwrap().at(read));
            let applied = T::from_f64(volts / disc(counts - 0.5 * pace));
            f.update(&mut state, (read, &place), applied, (rate, T::ZERO));
            states.push(state);
        }
        states
    }

    /// Root mean square of the error of friction, over the second half of a ride.
    fn error<T: Real>(states: &[BesideMapState<T>]) -> f64 {
        let f = filters::<T>();
        let half = &states[states.len() / 2..];
        let squares = half.iter().map(|state| {
            let (filter, belief, place) = f.driving(state);
            let ahead = filter.ahead_on(belief, place);
            let counts = belief.counts as f64 + ahead.position.to_f64();
            let error = ahead.friction.to_f64() / disc(counts + 0.5 * ahead.velocity.to_f64()) - 1.0;
            error * error
        });
        libm::sqrt(squares.sum::<f64>() / half.len() as f64)
    }

    #[test]
    fn evidence_has_the_logarithm_of_a_ratio_to_a_tenth_up_to_five_and_better_where_it_is_near_one() {
        for (ratio, share) in [(1.1, 1e-4), (1.5, 1e-3), (2.0, 4e-3), (3.0, 0.02), (5.0, 0.1)] {
            let exact: f64 = libm::log(ratio);
            // Of 3 times the ratio to 3, and the other way round.
            let (over, under) = (ratio_log(3.0 * ratio, 3.0), ratio_log(3.0, 3.0 * ratio));
            assert!((over / exact - 1.0).abs() < share, "{ratio}: {over} for {exact}");
            assert!((under / -exact - 1.0).abs() < share, "1/{ratio}: {under} for {}", -exact);
        }
        assert_eq!(ratio_log(7.0, 7.0), 0.0);
    }

    #[test]
    fn an_edge_speaks_for_the_filter_that_has_foreseen_it_in_less_of_its_own_doubt() {
        let (one, other) = (Surprise { square: 6.0, variance: 2.0 }, Surprise { square: 1.0, variance: 4.0 });
        // Three variances against a quarter of one.
        assert_eq!((relative(&one, &other), relative(&other, &one)), (2.75, -2.75));
    }

    fn a_right_map_drives<T: Real>() {
        let states = ride::<T>(Some(&points(0.0)), 3000);
        let from = states.iter().position(BesideMapState::map_drives).expect("never drives");
        // A count takes nine periods.
        assert!((70..250).contains(&from), "drives after {from} ms");
        assert!(states[from..].iter().all(BesideMapState::map_drives), "and goes on");
        let (with, without) = (error(&states), error(&ride::<T>(None, 3000)));
        assert!(with < 0.004 && with < 0.2 * without, "{with} with the map, {without} without");
    }

    #[test]
    fn a_right_map_drives_after_some_edges_and_friction_is_then_known_better() {
        a_right_map_drives::<f64>();
        a_right_map_drives::<f32>();
    }

    /// A ride at 2 °/s with a right map whose filter, after 60 ms, is sure of a friction that is a quarter too high, as a kick may
    /// leave it: the periods in which it begins anew and in which the map drives, and the state at the end.
    fn astray(plant: &PlantParams<f64>, volts: fn(f64) -> f64) -> ([Option<i32>; 2], BesideMapState<f64>) {
        let plant = Plant::new(plant).unwrap();
        let f = BesideMap::<f64>::new(&EdgeTimedParams::default(), &plant, Encoder::PAPER, PERIOD).unwrap();
        let (points, rate) = (points(0.0), 2.0_f64.to_radians());
        let map = FrictionMap::new(0, 4, &points).unwrap();
        let pace = rate * 1e-3 * Encoder::PAPER.counts_per_radian::<f64>();
        let mut state = f.start(FixedCounts::from_counts(10), volts(10.0), rate);
        let (mut renewed, mut drives) = (None, None);
        for k in 1..=1500 {
            let counts = 10.0 + pace * f64::from(k);
            let read = FixedCounts::from_counts(counts as i64);
            f.update(&mut state, (read, &map.at(read)), volts(counts - 0.5 * pace), (rate, 0.0));
            if k == 60 {
                assert_eq!(state.part(), TRIED);
                state.mapped.belief.friction.mean *= 1.25;
                state.mapped.belief.friction.hh = 1e-6;
                state.evidence = -3.0;
            }
            if renewed.is_none() && state.edges == RENEWED {
                renewed = Some(k);
                assert_eq!(state.mapped.belief.motion, state.plain.belief.motion);
            }
            drives = drives.or(state.map_drives().then_some(k));
        }
        ([renewed, drives], state)
    }

    #[test]
    fn a_motors_filter_with_a_right_map_that_has_gone_astray_begins_anew_from_the_other_and_drives() {
        let motor = MotorActuator { gain: 0.05, preload: 0.25, load_share: 0.0 };
        let motor = PlantParams { actuator: motor.into(), drive_torque: 0.0, ..PlantParams::default() };
        let ([renewed, drives], state) = astray(&motor, |at| (0.15 * 0.25 * disc(at) + 3.5e-5) / 0.05);
        assert!(renewed.is_some_and(|k| k > 60 && k < 200) && drives > renewed, "{renewed:?}, {drives:?}");
        // It begins anew once.
        assert!(state.edges == RENEWED && state.part() != DROPPED);
        // A brake's never does.
        let ([renewed, _], state) =
            astray(&PlantParams::default(), |at| (0.047088 - 3.5e-5) / (0.15 * 0.14 * disc(at)));
        assert!(renewed.is_none() && state.edges <= PROBATION, "{renewed:?}");
    }

    #[test]
    fn a_map_of_another_place_never_drives_and_is_dropped() {
        let without = ride::<f64>(None, 1500);
        for turned in [10.0, 20.0, 30.0, 45.0] {
            let states = ride::<f64>(Some(&points(turned)), 1500);
            assert!(!states.iter().any(BesideMapState::map_drives), "turned by {turned} counts");
            let dropped = states.iter().position(|s| s.part() == DROPPED).expect("kept");
            assert!(dropped < 600, "turned by {turned} counts: dropped after {dropped} ms");
            let last = |states: &[BesideMapState<f64>]| *states.last().unwrap().driving();
            assert_eq!(last(&states), last(&without), "as if there were none");
        }
    }

    #[test]
    fn a_map_ends_and_may_begin_again() {
        // 400 counts take 3.6 s; it is known up to count 396.
        let states = ride::<f64>(Some(&points(0.0)), 3700);
        let part = |ms: usize| states[ms - 1].part();
        assert_eq!((part(3400), part(3600)), (DRIVES, NONE));
        let f = filters::<f64>();
        let mut state = states[3599];
        let points = points(0.0);
        let read = FixedCounts::from_counts(200);
        let place = FrictionMap::new(0, 4, &points).unwrap().at(read);
        f.update(&mut state, (read, &place), 2.0, (0.035, 0.0));
        assert_eq!(state.part(), TRIED);
    }

    #[test]
    fn a_count_back_that_is_none_is_no_other_place() {
        let (f, points) = (filters::<f64>(), points(0.0));
        let map = FrictionMap::new(0, 4, &points).unwrap();
        let state = ride::<f64>(Some(&points), 1500)[1499];
        let told = |counts: i64| {
            let (mut state, read) = (state, FixedCounts::from_counts(counts));
            f.update(&mut state, (read, &map.at(read)), 2.2, (0.035, 0.0));
            let (filter, belief, place) = f.driving(&state);
            filter.ahead_on(belief, place).friction
        };
        let counts = state.mapped.counts;
        let (still, back) = (told(counts), told(counts - 1));
        assert!((back / still - 1.0).abs() < 2e-4, "{still} and {back}");
    }

    #[test]
    fn a_rest_is_one_of_both_filters() {
        let (f, points) = (filters::<f64>(), points(0.0));
        let mut state = ride::<f64>(Some(&points), 1500)[1499];
        let read = FixedCounts::from_counts(state.plain.counts);
        let place = FrictionMap::new(0, 4, &points).unwrap().at(read);
        for _ in 0..60 {
            f.update(&mut state, (read, &place), 4.0, (0.035, 0.0));
        }
        assert!(state.plain.rests() && state.mapped.rests());
        f.let_go(&mut state, 0.035);
        assert!(state.plain.lets_go() && state.mapped.lets_go());
    }

    #[test]
    fn steps_hand_over_the_friction_of_their_place_and_a_filter_with_a_map_makes_it_the_mean_of_the_disc() {
        let (f, points) = (filters::<f64>(), points(0.0));
        let mut state = ride::<f64>(Some(&points), 1500)[1499];
        state.place = FrictionMap::new(0, 4, &points).unwrap().at(FixedCounts::from_counts(44));
        // So much in doubt that nothing but the word of the steps counts.
        (state.plain.belief.friction.hh, state.mapped.belief.friction.hh) = (1e12, 1e12);
        f.take_over(&mut state, 0.25, 1.3);
        let (plain, mapped) = (state.plain.belief.friction.mean, state.mapped.belief.friction.mean);
        assert!((plain - 1.3).abs() < 1e-9, "{plain}");
        assert!((mapped / (1.3 / disc(44.25)) - 1.0).abs() < 2e-3 && disc(44.25) < 0.86, "{mapped}");
        assert!(state.plain.rests() && state.mapped.rests());
    }

    #[test]
    fn an_edge_that_only_one_of_the_filters_has_foreseen_says_nothing() {
        let (f, points) = (filters::<f64>(), points(0.0));
        let mut before = ride::<f64>(Some(&points), 1500)[1499];
        before.evidence = 4.0;
        let read = FixedCounts::from_counts(before.plain.counts + 1);
        let place = FrictionMap::new(0, 4, &points).unwrap().at(read);
        let says = |plain: Phase, mapped: Phase| {
            let mut state = before;
            (state.plain.phase, state.mapped.phase) = (plain, mapped);
            f.update(&mut state, (read, &place), 2.2, (0.035, 0.0));
            (state.evidence != before.evidence, state.part())
        };
        assert_eq!(says(Phase::Sliding, Phase::Sliding), (true, DRIVES));
        assert_eq!(says(Phase::Resting, Phase::Sliding), (false, DRIVES));
        assert_eq!(says(Phase::Sliding, Phase::Resting), (false, DRIVES));
    }
}
