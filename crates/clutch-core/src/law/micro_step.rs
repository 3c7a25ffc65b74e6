//! Micro-steps: the motion below the slowest rate at which a shaft slides.
//!
//! ```text
//! a step:  m periods let go (a motor pushes), n periods held;   way m² k,   k = a/2 (1 + a/b),   n ≥ m a/b
//! ```
//!
//! `a` is the acceleration of the shaft that is let go, `b` the one that stops it again. A step is taken when the path
//! is half a step ahead of where the steps before have brought the shaft, so that the error is half a step and what is
//! not known of `k`. `k` is learnt: the steps from edge to edge make a count. A fall from rest needs no knowledge of
//! friction, and the way to its end hardly any; where steps that should have made two counts made none, an actuator
//! that lags lets go for longer and a motor, which has to break its friction first, pushes harder.

use crate::Real;

/// Share of the fastest succession of steps that the path takes: the rest makes up for steps that fall short.
const SHARE: f64 = 0.8;
/// Multiple of the believed friction at rest with which a motor pushes: at first, at least, at most.
const PUSHED: f64 = 1.65;
const PUSHES: (f64, f64) = (0.7, 5.0);
/// Way that a motor catches up with in one step at most, counts: of fine ones a step is several, and no better for being longer.
const FARTHEST: f64 = 2.0;
/// Most periods of a step, whatever the path.
const LONGEST: f64 = 64.0;
/// Twice the way of the longest fall of a shaft of which no edge comes, counts: one, and half of it for a weaker drive.
const FALL: f64 = 3.0;
/// Share of a new measurement in the way of a step.
const LEARNT: f64 = 0.3;
/// Limits of the way of a step, as a multiple of the model's.
const WAYS: (f64, f64) = (0.05, 5.0);
/// Way of the shortest step above which a motor pushes less, counts.
const COARSE: f64 = 0.6;

/// The steps, checked. Lengths are in counts, times in periods.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct MicroStep<T> {
    /// The path's velocity below which steps are taken; 0 takes none.
    below: T,
    /// `k` of the model.
    way: T,
    /// `a/b` of the model.
    ratio: T,
    /// The way in which a shaft that is let go sets off; 0 for a motor, which breaks friction either way.
    only: T,
    /// From a voltage to its effect.
    delay: T,
    /// Most for which a shaft is let go where no edge comes.
    longest: T,
}

/// Memory of the steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct MicroStepState<T> {
    /// 1 while steps are being taken, else 0: a board copies a state without a byte of its own by words.
    active: T,
    /// Position above the lower edge of the last count, when all steps have ended.
    position: T,
    /// `k` as a multiple of the model's; 0 before the first step.
    scale: T,
    /// A motor's push.
    push: T,
    /// Least periods of a step.
    least: T,
    /// Steps since the last edge, each with the square of its periods.
    since_edge: T,
    /// 1 if they began at an edge, else 0.
    from_edge: T,
    /// Counts of this step.
    counts: T,
    /// Periods of this step: all that let go, those still to let go, those still to hold.
    periods: T,
    go: T,
    hold: T,
    /// Its way: 1 or −1.
    sign: T,
}

/// Demand of a period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stepping<T> {
    /// Lets go; a motor pushes with this multiple of the friction at rest, whose sign is the way.
    Go(T),
    /// Holds.
    Hold,
}

impl<T: Real> Stepping<T> {
    /// The first push, `way` 1 or −1.
    pub(super) fn first(way: T) -> Self {
        Stepping::Go(T::splat(PUSHED) * way)
    }
}

impl<T: Real> MicroStepState<T> {
    /// `true` while steps are taken.
    pub(super) fn active(&self) -> bool {
        self.active > T::ZERO
    }

    /// Position at the end of the step, counts above the last edge.
    pub(super) fn position(&self) -> T {
        self.position
    }

    /// Begins at a position, counts above the last edge. The learnt numbers stay.
    pub(super) fn begin(&mut self, position: T, delay: T) {
        let known = self.scale > T::ZERO;
        *self = MicroStepState {
            active: T::ONE,
            position: position.limit(T::ZERO, T::ONE),
            scale: if known { self.scale } else { T::ONE },
            push: if known { self.push } else { T::splat(PUSHED) },
            least: self.least.max(T::ONE),
            // The voltages on their way have to arrive, and the shaft has to stop.
            hold: T::ONE + delay,
            ..MicroStepState::default()
        };
    }

    /// Ends, at [`MicroStepState::position`].
    pub(super) fn end(&mut self) {
        self.active = T::ZERO;
    }
}

impl<T: Real> MicroStep<T> {
    /// Steps for paths slower than `below`, counts per period. `go` and `stop` are the accelerations of a shaft that
    /// is let go and of one that is held, counts per period²; `only` is the way that one goes that is let go, 0 for a
    /// motor, which goes either way; `delay` and `lag` are periods from a voltage to its effect.
    pub(super) fn new(below: T, (go, stop): (T, T), only: T, (delay, lag): (T, T)) -> Self {
        let least = T::splat(1e-9);
        let (go, stop) = (go.max(least), stop.max(least));
        MicroStep {
            below,
            way: T::splat(0.5) * go * (T::ONE + go / stop),
            ratio: go / stop,
            only,
            delay,
            // A brake of which 10 V hold twice the load lets go 1.6 lags later.
            longest: (T::splat(FALL) / go).sqrt() + T::ONE + lag + lag,
        }
    }

    /// `true` if a path at `pace`, counts per period, is followed in steps. One that rests is where it was.
    pub(super) fn takes(&self, state: &MicroStepState<T>, pace: T) -> bool {
        let fast = pace.abs();
        fast < self.below && (fast > T::ZERO || state.active())
    }

    /// Friction of a brake, as a multiple of the model's, by the way in which steps have stopped; the model's before any
    /// was learnt.
    pub(super) fn friction(&self, state: &MicroStepState<T>) -> T {
        let ratio = state.scale * (T::ONE + self.ratio) - T::ONE;
        if self.only == T::ZERO || state.scale == T::ONE || ratio <= T::ZERO {
            return T::ONE;
        }
        // 1/r + 1 is the load of the pad over the drive.
        ((T::ONE + ratio) * self.ratio / (ratio * (T::ONE + self.ratio))).limit(T::splat(0.3), T::splat(3.0))
    }

    /// Demand of a period in which the shaft has gone `moved` counts since the last sample, for a path at `pace`,
    /// counts per period, whose target when the voltage takes effect is `target` counts above the last edge.
    pub(super) fn demand(&self, state: &mut MicroStepState<T>, moved: T, target: T, pace: T) -> Stepping<T> {
        state.counts += moved;
        if state.go <= T::ZERO && state.hold <= T::ZERO {
            self.judge(state);
            self.decide(state, target - state.position, pace);
        }
        if state.go > T::ZERO {
            state.go -= T::ONE;
            return Stepping::Go(state.push * state.sign);
        }
        state.hold = (state.hold - T::ONE).max(T::ZERO);
        Stepping::Hold
    }

    /// A step has ended: the place and the way that it came.
    fn judge(&self, state: &mut MicroStepState<T>) {
        let square = state.periods * state.periods;
        let came = self.way * state.scale * square;
        state.since_edge += square;
        state.periods = T::ZERO;
        if state.counts == T::ZERO {
            state.position = (state.position + state.sign * came).limit(T::ZERO, T::ONE);
            self.insist(state);
            return;
        }
        if state.from_edge > T::ZERO && state.since_edge > T::ZERO && state.counts * state.sign > T::ZERO {
            let seen = state.counts.abs() / (state.since_edge * self.way);
            let scale = state.scale + T::splat(LEARNT) * (seen - state.scale);
            state.scale = scale.limit(T::splat(WAYS.0), T::splat(WAYS.1));
            if self.only == T::ZERO && state.scale * self.way > T::splat(COARSE) {
                state.push = (state.push * T::splat(0.95)).max(T::splat(PUSHES.0));
            }
        }
        let beyond = T::splat(0.5) * came.min(T::ONE);
        state.position = if state.counts > T::ZERO { beyond } else { T::ONE - beyond };
        state.counts = T::ZERO;
        state.from_edge = T::ONE;
        state.since_edge = T::ZERO;
    }

    /// Steps that should have made two counts and made none have not moved the shaft.
    fn insist(&self, state: &mut MicroStepState<T>) {
        if state.since_edge * self.way * state.scale > T::splat(2.0) {
            if self.only == T::ZERO {
                state.push = (state.push * T::splat(1.15)).min(T::splat(PUSHES.1));
            } else {
                state.least = (state.least + T::ONE).min(self.longest.floor());
            }
            state.since_edge = T::ZERO;
            state.from_edge = T::ZERO;
        }
    }

    /// Decides whether a step begins, with the path `error` counts ahead.
    fn decide(&self, state: &mut MicroStepState<T>, error: T, pace: T) {
        let way = if error < T::ZERO { -T::ONE } else { T::ONE };
        // The way of a step shows how long it takes to stop; a place with less friction has a whole period.
        let ratio = (state.scale * (T::ONE + self.ratio) - T::ONE).max(T::ONE).max(self.ratio);
        let k = self.way * state.scale;
        // The least m for which m² k in m (1 + ratio) periods and the delay is as fast as the path.
        let half = T::splat(0.5) * pace.abs() * (T::ONE + ratio) / (T::splat(SHARE) * k);
        let needed = half + (half * half + pace.abs() * self.delay / (T::splat(SHARE) * k)).sqrt();
        // A motor whose steps fall short where friction is high catches up in one, by some counts at most.
        let far = (way * error).min(T::splat(FARTHEST));
        let behind = if self.only == T::ZERO { (far / k).sqrt().floor() } else { T::ZERO };
        let periods = (-(-needed).floor()).max(state.least).max(behind).min(T::splat(LONGEST));
        // A path that goes one way is not gone back on, nor can a brake.
        let along = way * pace >= T::ZERO && way * self.only >= T::ZERO;
        if along && way * error > T::splat(0.5) * k * periods * periods {
            state.go = periods;
            state.periods = periods;
            state.hold = -(-(periods * ratio)).floor() + self.delay;
            if way != state.sign {
                state.from_edge = T::ZERO;
            }
            state.sign = way;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A shaft in counts and periods: let go it gains `go` a period, held it loses `stop`.
    struct Shaft {
        go: f64,
        stop: f64,
        position: f64,
        velocity: f64,
    }

    impl Shaft {
        fn period(&mut self, acceleration: f64) {
            let next = (self.velocity + acceleration).max(0.0);
            let time =
                if acceleration < 0.0 { ((self.velocity - next) / -acceleration).min(1.0) } else { 1.0 };
            self.position += 0.5 * (self.velocity + next) * time;
            self.velocity = next;
        }
    }

    /// Largest error behind the tenth count, and what was learnt.
    fn errors(steps: &MicroStep<f64>, shaft: &mut Shaft, pace: f64) -> (f64, MicroStepState<f64>) {
        let mut state = begun();
        let (mut most, mut counts) = (0.0_f64, 0.0);
        for k in 0..200_000 {
            let path = 0.5 + pace * f64::from(k);
            let moved = shaft.position.floor() - counts;
            counts += moved;
            let demand = steps.demand(&mut state, moved, path - counts, pace);
            if path > 10.0 {
                most = most.max((path - shaft.position).abs());
            }
            shaft.period(if demand == Stepping::Hold { -shaft.stop } else { shaft.go });
        }
        (most, state)
    }

    /// Steps that begin in the middle of a count.
    fn begun() -> MicroStepState<f64> {
        let mut state = MicroStepState::default();
        state.begin(0.5, 0.0);
        state
    }

    fn shaft(go: f64, stop: f64) -> Shaft {
        Shaft { go, stop, position: 0.5, velocity: 0.0 }
    }

    #[test]
    fn a_shaft_as_believed_is_never_farther_from_its_path_than_a_step_and_a_half() {
        let (go, stop) = (0.09, 0.17);
        let steps = MicroStep::new(1.0, (go, stop), 1.0, (0.0, 0.0));
        let step = 0.5 * go * (1.0 + go / stop);
        for pace in [0.0005, 0.003, 0.01, 0.02] {
            let (most, _) = errors(&steps, &mut shaft(go, stop), pace);
            // Half a step, what an edge leaves open, and what the path goes on while a step is taken.
            let bound = 1.5 * step + 3.0 * pace;
            assert!(most < bound, "{pace}: {most}, {bound}");
        }
    }

    #[test]
    fn the_way_of_a_step_is_learnt_from_the_edges() {
        for (go, stop) in [(0.06, 0.2), (0.09, 0.1), (0.13, 0.13)] {
            let steps = MicroStep::new(1.0, (0.09, 0.17), 1.0, (0.0, 0.0));
            let (most, state) = errors(&steps, &mut shaft(go, stop), 0.005);
            let (learnt, true_way) = (state.scale * steps.way, 0.5 * go * (1.0 + go / stop));
            assert!((learnt / true_way - 1.0).abs() < 0.2, "{go}, {stop}: {learnt} for {true_way}");
            assert!(most < 0.3, "{go}, {stop}: {most}");
        }
    }

    #[test]
    fn fast_paths_take_steps_of_more_periods_and_are_kept() {
        let steps = MicroStep::new(1.0, (0.09, 0.17), 1.0, (0.0, 0.0));
        let (most, state) = errors(&steps, &mut shaft(0.09, 0.17), 0.06);
        assert!(most < 1.0, "{most}");
        assert!(state.periods + state.go > 1.0 || state.hold > 1.0);
    }

    #[test]
    fn a_brake_never_steps_back_and_waits_for_a_path_that_is_behind() {
        let steps = MicroStep::new(1.0, (0.09, 0.17), 1.0, (0.0, 0.0));
        let mut state = begun();
        for _ in 0..100 {
            assert_eq!(steps.demand(&mut state, 0.0, -3.0, 0.001), Stepping::Hold);
        }
        let motor = MicroStep::new(1.0, (0.09, 0.17), 0.0, (0.0, 0.0));
        let mut back = None;
        for _ in 0..10 {
            if let Stepping::Go(push) = motor.demand(&mut state, 0.0, -3.0, 0.0) {
                back = Some(push);
            }
        }
        assert!(back.is_some_and(|push| push < 0.0), "{back:?}");
    }

    #[test]
    fn where_no_edge_comes_a_motor_pushes_harder_and_a_brake_lets_go_for_longer() {
        for (only, what) in [(0.0, "motor"), (1.0, "brake")] {
            let steps = MicroStep::new(1.0, (0.09, 0.17), only, (0.0, 0.0));
            let mut state = begun();
            for k in 0..2000 {
                steps.demand(&mut state, 0.0, 0.5 + 0.01 * f64::from(k), 0.01);
            }
            // A fall of a count and a half takes 5.8 periods.
            assert!(state.push <= 5.0 && state.least <= 6.0, "{what}");
            let harder = if only == 0.0 { state.push / 1.65 } else { state.least };
            assert!(harder > 1.1, "{what}: {harder}");
        }
    }

    #[test]
    fn a_motor_whose_steps_are_most_of_a_count_pushes_less() {
        let motor = MicroStep::new(1.0, (0.6, 0.6), 0.0, (0.0, 0.0));
        let (_, state) = errors(&motor, &mut shaft(0.6, 0.6), 0.005);
        assert_eq!(state.push, PUSHES.0);
        let fine = MicroStep::new(1.0, (0.09, 0.17), 0.0, (0.0, 0.0));
        let (_, state) = errors(&fine, &mut shaft(0.09, 0.17), 0.005);
        assert_eq!(state.push, PUSHED);
    }

    #[test]
    fn a_motor_that_has_fallen_behind_takes_a_step_as_long_as_its_way_and_a_brake_none() {
        let (go, stop) = (0.09, 0.17);
        let k = 0.5 * go * (1.0 + go / stop);
        for (only, error, periods) in [(0.0, 1.2, 4.0), (0.0, -1.2, 4.0), (0.0, 0.1, 1.0), (1.0, 1.2, 1.0)] {
            let steps = MicroStep::new(1.0, (go, stop), only, (0.0, 0.0));
            let mut state = begun();
            // From the middle of a count.
            steps.demand(&mut state, 0.0, 0.5 + error, 0.001);
            steps.demand(&mut state, 0.0, 0.5 + error, 0.001 * error.signum());
            assert_eq!(state.periods, periods, "{only}, {error}");
            assert!(k * periods * periods <= error.abs().max(2.0 * k), "no farther than the path");
        }
    }

    #[test]
    fn edges_without_a_step_between_them_teach_nothing_of_its_way() {
        let steps = MicroStep::new(1.0, (0.09, 0.17), 1.0, (0.0, 0.0));
        let mut state = begun();
        for _ in 0..100 {
            // The shaft creeps on ahead of a path that it has to wait for.
            assert_eq!(steps.demand(&mut state, 1.0, -3.0, 0.001), Stepping::Hold);
            assert_eq!(state.scale, 1.0);
        }
    }

    #[test]
    fn an_edge_against_the_step_teaches_nothing_of_its_way() {
        let steps = MicroStep::new(1.0, (0.09, 0.17), 0.0, (0.0, 0.0));
        let mut state = begun();
        let mut back = 0;
        // Each tenth period the shaft is a count further back, however it is pushed.
        for k in 1..1000 {
            let moved = if k % 10 == 0 { -1.0 } else { 0.0 };
            let demand = steps.demand(&mut state, moved, 5.0, 0.01);
            back += i32::from(demand == Stepping::Go(state.push));
            assert_eq!(state.scale, 1.0);
        }
        assert!(back > 50, "{back} periods of a push forwards");
    }

    #[test]
    fn friction_is_told_by_how_much_shorter_or_longer_steps_are_than_believed() {
        let (go, stop) = (0.09, 0.17);
        let steps = MicroStep::new(1.0, (go, stop), 1.0, (0.0, 0.0));
        let told = |scale: f64| steps.friction(&MicroStepState { scale, ..MicroStepState::default() });
        // Held, a shaft loses what the pad has more than the drive: k = go (1 + go/stop)/2.
        for friction in [0.7, 0.9, 1.2, 2.0] {
            let stops = friction * (stop + go) - go;
            let scale = (1.0 + go / stops) / (1.0 + go / stop);
            assert!((told(scale) - friction).abs() < 1e-12, "{friction}: {}", told(scale));
        }
        assert_eq!((told(1.0), told(0.3)), (1.0, 1.0), "nothing learnt; less than no time to stop");
        assert_eq!((told(0.66), told(4.9)), (3.0, (0.3_f64).max(told(4.9))));
        let motor = MicroStep::new(1.0, (go, stop), 0.0, (0.0, 0.0));
        assert_eq!(motor.friction(&MicroStepState { scale: 2.0, ..MicroStepState::default() }), 1.0);
    }

    #[test]
    fn nothing_that_is_no_number_is_remembered() {
        let steps = MicroStep::new(1.0, (0.09, 0.17), 1.0, (1.0, 0.0));
        let mut state = MicroStepState::default();
        state.begin(f64::NAN, 1.0);
        for target in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1.0] {
            for _ in 0..10 {
                steps.demand(&mut state, 0.0, target, 0.001);
            }
            let sum = state.position + state.scale + state.push + state.hold + state.go + state.since_edge;
            assert!(sum.is_finite(), "{target}: {state:?}");
        }
    }

    /// The step that follows a rest, on a path that goes at `pace` and is `error` counts ahead: periods of letting go and of
    /// holding; none if none is taken.
    fn first_step(steps: &MicroStep<f64>, scale: f64, pace: f64, error: f64) -> Option<(f64, f64)> {
        let mut state = MicroStepState { scale, ..begun() };
        steps.decide(&mut state, error, pace);
        assert_eq!(state.go, state.periods);
        (state.go > 0.0).then_some((state.go, state.hold))
    }

    #[test]
    fn a_step_is_held_until_the_shaft_that_its_way_tells_of_has_stopped() {
        // Let go it gains 0.1 a period, and is believed to lose 0.25 held.
        let steps = MicroStep::new(1.0, (0.1, 0.25), 1.0, (2.0, 0.0));
        let believed = 0.5 * 0.1 * (1.0 + 0.1 / 0.25);
        for (stop, go, hold) in [(0.25, 4.0, 4.0), (0.12, 3.0, 3.0), (0.04237, 3.0, 8.0), (0.0237, 3.0, 13.0)]
        {
            // The way of a step of one period, with what stops it in truth.
            let way = 0.5 * 0.1 * (1.0 + 0.1 / stop);
            let step = first_step(&steps, way / believed, 0.08, 30.0);
            // A place with less friction than believed has a whole period for each that let go; then comes the delay.
            assert!(
                (go * 0.1 / stop).max(go) <= hold && hold < (go * 0.1 / stop).max(go) + 1.0,
                "{stop}: no test"
            );
            assert_eq!(step, Some((go, hold + 2.0)), "{stop}");
        }
        // One that is believed to stop slower than it sets off is held for as long whatever the way tells.
        let slow = MicroStep::new(1.0, (0.1, 0.04), 1.0, (0.0, 0.0));
        assert_eq!(first_step(&slow, 0.5, 0.01, 30.0), Some((1.0, 3.0)));
    }

    #[test]
    fn a_step_is_the_shortest_whose_succession_is_a_quarter_faster_than_the_path() {
        for (delay, scale) in [(0.0, 1.0), (0.0, 2.1), (1.0, 1.0), (3.0, 1.4)] {
            let steps = MicroStep::new(1.0, (0.09, 0.17), 0.0, (delay, 0.0));
            let k = 0.5 * 0.09 * (1.0 + 0.09 / 0.17) * scale;
            let ratio = f64::max(2.0 * k / 0.09 - 1.0, 1.0);
            for pace in [0.003, 0.013, 0.04, 0.09, 0.3, -0.013, -0.3] {
                let fast = |m: f64| m * m * k / (m * (1.0 + ratio) + delay) >= 1.25 * f64::abs(pace);
                let shortest = (1..).map(f64::from).find(|m| fast(*m)).unwrap();
                // It is taken as soon as the path is half a step ahead.
                let half = 0.5 * shortest * shortest * k;
                let taken =
                    |error: f64| first_step(&steps, scale, pace, error * pace.signum()).map(|(go, _)| go);
                assert_eq!(
                    (taken(1.001 * half), taken(0.999 * half)),
                    (Some(shortest), None),
                    "{delay}, {pace}"
                );
                assert_eq!(taken(-1.001 * half), None, "back on a path that goes on");
            }
        }
        let steps = MicroStep::new(1.0, (0.09, 0.17), 1.0, (0.0, 0.0));
        assert_eq!(first_step(&steps, 1.0, 10.0, 1e6).map(|(go, _)| go), Some(64.0), "whatever the path");
    }

    #[test]
    fn a_path_below_the_rate_is_followed_in_steps_either_way_and_one_that_rests_if_it_was_before() {
        let steps = MicroStep::new(0.0625, (0.09, 0.17), 1.0, (0.0, 0.0));
        let ended = MicroStepState::default();
        for (pace, taken) in [(0.06, true), (-0.06, true), (0.0625, false), (0.07, false), (-0.07, false)] {
            assert_eq!((steps.takes(&begun(), pace), steps.takes(&ended, pace)), (taken, taken), "{pace}");
        }
        assert!(steps.takes(&begun(), 0.0) && !steps.takes(&ended, 0.0));
    }

    #[test]
    fn steps_begin_after_the_voltages_on_their_way_and_remember_what_was_learnt() {
        let mut state = MicroStepState { scale: 0.0, push: 0.0, ..MicroStepState::default() };
        state.begin(0.25, 2.0);
        assert_eq!((state.hold, state.scale, state.push, state.least), (3.0, 1.0, PUSHED, 1.0));
        state = MicroStepState { scale: 1.5, push: 2.0, least: 3.0, since_edge: 9.0, ..state };
        state.begin(7.0, 0.0);
        assert_eq!((state.hold, state.scale, state.push, state.least), (1.0, 1.5, 2.0, 3.0));
        assert_eq!((state.position, state.since_edge), (1.0, 0.0), "in its count");
    }

    #[test]
    fn steps_without_an_edge_for_two_counts_are_pushed_by_a_seventh_more_or_let_go_for_a_period_more() {
        // A step of one period makes a count: 1/2 (1 + 1).
        let with = |only: f64, lag: f64| MicroStep::new(1.0, (1.0, 1.0), only, (0.0, lag));
        let after = |steps: &MicroStep<f64>, since_edge: f64, push: f64, least: f64| {
            let mut state = MicroStepState { since_edge, push, least, from_edge: 1.0, ..begun() };
            steps.insist(&mut state);
            assert_eq!(state.from_edge == 0.0, since_edge > 2.0);
            (state.push, state.least, state.since_edge)
        };
        let (motor, brake) = (with(0.0, 0.0), with(1.0, 0.0));
        assert_eq!(after(&motor, 2.0, 2.0, 1.0), (2.0, 1.0, 2.0), "two counts are not more than two");
        let (push, least, since) = after(&motor, 3.0, 2.0, 1.0);
        assert!((push - 2.3).abs() < 1e-12 && least == 1.0 && since == 0.0, "{push}");
        assert_eq!(after(&motor, 3.0, 4.9, 1.0), (5.0, 1.0, 0.0), "at most");
        // A fall of a count and a half takes 1.73 periods; one more, and two lags.
        assert_eq!(after(&brake, 3.0, 2.0, 1.0), (2.0, 2.0, 0.0));
        assert_eq!(after(&brake, 3.0, 2.0, 2.0), (2.0, 2.0, 0.0));
        assert_eq!(after(&with(1.0, 1.5), 3.0, 2.0, 5.0), (2.0, 5.0, 0.0));
        assert!((with(1.0, 1.5).longest - 5.732_05).abs() < 1e-5);
    }

    #[test]
    fn only_steps_from_edge_to_edge_and_their_own_way_teach_it() {
        let steps = MicroStep::new(1.0, (0.5, 0.5), 0.0, (0.0, 0.0));
        // Two steps of two periods with half a count of a period: four counts were to come.
        let learns = |from_edge: f64, before: f64, periods: f64, counts: f64, sign: f64| {
            let mut state =
                MicroStepState { from_edge, since_edge: before, periods, counts, sign, ..begun() };
            steps.judge(&mut state);
            assert_eq!((state.counts, state.since_edge, state.from_edge), (0.0, 0.0, 1.0));
            (state.scale, state.position)
        };
        // Three tenths of what they came short by; the place is half the way of a step from the edge, half a count at most.
        assert_eq!(learns(1.0, 4.0, 2.0, 2.0, 1.0), (0.85, 0.5));
        assert_eq!(learns(1.0, 4.0, 2.0, -2.0, -1.0), (0.85, 0.5));
        assert_eq!(learns(1.0, 3.0, 1.0, -1.0, -1.0), (0.85, 0.75));
        assert_eq!(learns(1.0, 3.0, 1.0, 1.0, 1.0), (0.85, 0.25));
        for (from_edge, before, periods, counts, sign) in [
            // From the middle of a count; without a step; and back.
            (0.0, 4.0, 2.0, 2.0, 1.0),
            (1.0, 0.0, 0.0, 2.0, 1.0),
            (1.0, 4.0, 2.0, 2.0, -1.0),
            (1.0, 4.0, 2.0, -2.0, 1.0),
        ] {
            assert_eq!(
                learns(from_edge, before, periods, counts, sign).0,
                1.0,
                "{from_edge}, {before}, {counts}, {sign}"
            );
        }
    }
}
