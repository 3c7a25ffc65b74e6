//! Means and covariance of what the filter believes, in counts and periods.
//!
//! Positions are in counts above the lower edge of the count that was read last, velocities in counts per period,
//! friction in multiples of the model's sliding friction. One period of the shaft under the pull `D` of drive and
//! motor and the load `w` of the pad (both in counts per period²):
//!
//! ```text
//! a = D − w (h + r) sgn ω − c ω,    ω' = ω + a,    Δ = ω + a/2
//! s' = s − Δ (k² r + 2 ζ k s),      r' = r + Δ s'                    ripple: a damped wave along the way
//! ```

use crate::Real;

/// Numbers that stay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shaft<T> {
    /// `c`: damping, per period.
    pub(super) damping: T,
    /// `k²`, per count².
    pub(super) stiffness: T,
    /// `2 ζ k`, per count.
    pub(super) decay: T,
    /// Variance that the velocity gains in a period.
    pub(super) walk: T,
    /// Share of an acceleration that may be wrong.
    pub(super) gain_doubt: T,
    /// Variance that the ripple's slope gains per count, with friction as the model has it.
    pub(super) roughness: T,
}

/// A measured position that is not the one foreseen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Surprise<T> {
    /// Square of the distance, counts².
    pub(crate) square: T,
    /// The variance that it was foreseen with, counts²; 0 where nothing was measured.
    pub(crate) variance: T,
}

/// Means of position and velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Motion<T> {
    pub(super) position: T,
    pub(super) velocity: T,
}

/// Mean friction `h`, ripple `r` and its slope `s`: means and covariance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Friction<T> {
    pub(super) mean: T,
    pub(super) ripple: T,
    pub(super) slope: T,
    pub(super) hh: T,
    pub(super) hr: T,
    pub(super) hs: T,
    pub(super) rr: T,
    pub(super) rs: T,
    pub(super) ss: T,
}

/// Means and covariance of position `t`, velocity `w`, and friction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Belief<T> {
    pub(super) motion: Motion<T>,
    pub(super) friction: Friction<T>,
    pub(super) tt: T,
    pub(super) tw: T,
    pub(super) th: T,
    pub(super) tr: T,
    pub(super) ts: T,
    pub(super) ww: T,
    pub(super) wh: T,
    pub(super) wr: T,
    pub(super) ws: T,
}

impl<T: Real> Motion<T> {
    /// One period without covariances, with a friction at the pad: the way, counts, the acceleration, and the velocity that
    /// the shaft lacks to have gone on, 0 if it goes on.
    #[inline(always)] // in two places, which have the sign, and go on with the way
    pub(super) fn glide(&mut self, shaft: &Shaft<T>, pull: T, load: T, friction: T) -> (T, T, T) {
        let half = T::splat(0.5);
        let sign = self.direction(pull);
        let acceleration = pull - shaft.damping * self.velocity - sign * load * friction;
        let next = self.velocity + acceleration;
        let lacks = (-(next * sign)).max(T::ZERO);
        let way = if lacks > T::ZERO {
            // It comes to rest; what may push it the other way is seen in the next period.
            let slowing = acceleration.abs();
            self.velocity = T::ZERO;
            half * (next - acceleration) * (next - acceleration).abs() / slowing
        } else {
            self.velocity = next;
            next - half * acceleration
        };
        self.position += way;
        (way, acceleration, lacks)
    }

    /// The way that it goes, or would go.
    fn direction(&self, pull: T) -> T {
        if self.velocity == T::ZERO { pull.sgn() } else { self.velocity.sgn() }
    }
}

/// Friction at the pad, `h + r`, never so small that a voltage for a torque is without bounds.
#[inline]
pub(super) fn at_pad<T: Real>(mean: T, ripple: T) -> T {
    (mean + ripple).max(T::splat(0.05))
}

impl<T: Real> Friction<T> {
    /// Friction at the pad.
    #[inline]
    pub(super) fn level(&self) -> T {
        at_pad(self.mean, self.ripple)
    }

    /// Its variance.
    #[inline]
    pub(super) fn variance(&self) -> T {
        (self.hh + (self.hr + self.hr) + self.rr).max(T::ZERO)
    }

    /// Friction here is `level`, with a standard deviation; the mean stays.
    pub(super) fn know(&mut self, level: T, deviation: T) {
        self.ripple = level - self.mean;
        self.slope = T::ZERO;
        (self.hr, self.rs) = (T::ZERO, T::ZERO);
        self.rr = deviation * deviation;
    }
}

impl<T: Real> Belief<T> {
    /// One period: the way, counts. `fall`: what the load loses per count per period, with friction as the model has
    /// it. `moves`: the shaft is known to move.
    #[inline(never)]
    pub(super) fn advance(&mut self, shaft: &Shaft<T>, pull: T, (load, fall): (T, T), moves: bool) -> T {
        let sign = self.motion.direction(pull);
        let friction = self.friction.level();
        let (way, acceleration, lacks) = self.motion.glide(shaft, pull, load, friction);
        let fall = fall * friction;
        self.spread(shaft, -(sign * load), acceleration, fall);
        if moves && lacks > T::ZERO {
            self.keep_moving(sign, lacks);
        }
        self.turn(shaft, way);
        way
    }

    /// The shaft goes on: friction is not as high as to stop it. `lacks`: the velocity
    /// below 0 that was believed.
    fn keep_moving(&mut self, sign: T, lacks: T) {
        let deviation = self.ww.sqrt();
        if deviation > T::ZERO {
            let (lambda, _) = cut_off(-lacks / deviation);
            self.motion.velocity = -(sign * lacks);
            let column = [self.tw, self.ww, self.wh, self.wr, self.ws];
            // This cuts the means alone: a period in which it went on is no measurement, and a thousand of them are not a
            // thousand.
            self.take(column, self.ww, sign * deviation * lambda, T::ZERO);
        }
    }

    /// Covariance of a period in which friction acted on the velocity with the factor `b`, and fell with it by `fall`.
    fn spread(&mut self, shaft: &Shaft<T>, b: T, acceleration: T, fall: T) {
        let half_b = T::splat(0.5) * b;
        let keep = T::ONE - shaft.damping + fall;
        // Covariances with the friction h + r.
        let (nt, nw) = (self.th + self.tr, self.wh + self.wr);
        let f = &self.friction;
        let (nh, nr, ns) = (f.hh + f.hr, f.hr + f.rr, f.hs + f.rs);
        let nf = nh + nr;
        let off = shaft.gain_doubt * acceleration;
        let tt = self.tt + (self.tw + self.tw) + self.ww + b * (nt + nw) + half_b * half_b * nf;
        let tw = keep * (self.tw + self.ww + half_b * nw) + b * (nt + nw + half_b * nf);
        let ww = keep * keep * self.ww + (keep + keep) * b * nw + b * b * nf;
        self.tt = tt;
        self.tw = tw;
        self.th = self.th + self.wh + half_b * nh;
        self.tr = self.tr + self.wr + half_b * nr;
        self.ts = self.ts + self.ws + half_b * ns;
        self.ww = ww + shaft.walk + off * off;
        self.wh = keep * self.wh + b * nh;
        self.wr = keep * self.wr + b * nr;
        self.ws = keep * self.ws + b * ns;
    }

    /// The disc has turned by a way, counts: another place of it is at the pad.
    fn turn(&mut self, shaft: &Shaft<T>, way: T) {
        let far = way.abs();
        let b = -(way * shaft.stiffness);
        let d = T::ONE - far * shaft.decay;
        self.ts = b * self.tr + d * self.ts;
        self.tr += way * self.ts;
        self.ws = b * self.wr + d * self.ws;
        self.wr += way * self.ws;
        let f = &mut self.friction;
        f.slope = b * f.ripple + d * f.slope;
        f.ripple += way * f.slope;
        f.hs = b * f.hr + d * f.hs;
        f.hr += way * f.hs;
        let (sr, s) = (b * f.rr + d * f.rs, b * f.rs + d * f.ss);
        let ss = b * sr + d * s;
        let rs = sr + way * ss;
        f.rr += way * (sr + rs);
        f.rs = rs;
        // Ripple is a share of friction: what is believed of the one goes for the other.
        f.ss = ss + shaft.roughness * far * (f.mean * f.mean);
    }

    /// Takes a measurement of one of the means, whose covariances with all are `column`: innovation `y`, its variance
    /// `s`, and the share of the covariance that goes.
    #[inline(never)]
    fn take(&mut self, column: [T; 5], s: T, y: T, share: T) {
        let gain = T::ONE / s;
        let [t, w, h, r, slope] = column;
        let step = gain * y;
        self.motion.position += t * step;
        self.motion.velocity += w * step;
        let f = &mut self.friction;
        f.mean = (f.mean + h * step).limit(T::splat(0.1), T::splat(10.0));
        let most = T::splat(0.6) * f.mean;
        f.ripple = (f.ripple + r * step).limit(-most, most);
        f.slope += slope * step;
        let gone = gain * share;
        let (kt, kw, kh, kr, ks) = (t * gone, w * gone, h * gone, r * gone, slope * gone);
        self.tt -= kt * t;
        self.tw -= kt * w;
        self.th -= kt * h;
        self.tr -= kt * r;
        self.ts -= kt * slope;
        self.ww -= kw * w;
        self.wh -= kw * h;
        self.wr -= kw * r;
        self.ws -= kw * slope;
        f.hh -= kh * h;
        f.hr -= kh * r;
        f.hs -= kh * slope;
        f.rr -= kr * r;
        f.rs -= kr * slope;
        f.ss -= ks * slope;
        // Rounding would make a variance negative that is all but gone.
        for variance in [&mut self.tt, &mut self.ww, &mut f.hh, &mut f.rr, &mut f.ss] {
            *variance = variance.max(T::ZERO);
        }
    }

    fn at_position(&self) -> [T; 5] {
        [self.tt, self.tw, self.th, self.tr, self.ts]
    }

    /// The position was measured, with a variance: what it was off by, squared, and the variance of that. However far it is
    /// off, the belief is not widened: what a shaft that runs away does between two edges shows its friction.
    #[inline(never)]
    pub(super) fn correct(&mut self, measured: T, variance: T) -> Surprise<T> {
        let y = measured - self.motion.position;
        let s = self.tt + variance;
        self.take(self.at_position(), s, y, T::ONE);
        Surprise { square: y * y, variance: s }
    }

    /// No edge has come: the position is below `end` (`side` 1) or above it (`side` −1). The belief becomes the normal
    /// distribution with mean and variance of the one that is cut off there, its edge blurred by the variance `blur`.
    #[inline(never)]
    pub(super) fn keep_within(&mut self, end: T, side: T, blur: T) {
        let s = self.tt + blur;
        let away = side * (end - self.motion.position);
        // So far away that nothing is cut off.
        if away > T::ZERO && away * away > T::splat(3.5 * 3.5) * s {
            return;
        }
        let deviation = s.sqrt();
        let alpha = away / deviation;
        let (lambda, share) = cut_off(alpha);
        self.take(self.at_position(), s, -(side * deviation * lambda), share);
    }

    /// The shaft rests somewhere in its count.
    pub(super) fn rest(&mut self) {
        self.motion.position = T::splat(0.5);
        self.motion.velocity = T::ZERO;
        (self.th, self.tr, self.ts) = (T::ZERO, T::ZERO, T::ZERO);
        (self.tw, self.ww, self.wh, self.wr, self.ws) = (T::ZERO, T::ZERO, T::ZERO, T::ZERO, T::ZERO);
        self.tt = T::ONE / T::from_i32(12);
    }

    /// `true` while every mean, and the variance that divides, is a number.
    pub(super) fn is_finite(&self) -> bool {
        let (motion, f) = (&self.motion, &self.friction);
        let means = motion.position + motion.velocity + (f.mean + f.ripple + f.slope);
        let variances = self.tt + self.ww + (f.hh + f.rr + f.ss);
        means.is_finite() && variances.is_finite() && self.tt >= T::ZERO
    }
}

/// A standard normal distribution that is cut off above `alpha`, below 3.5: how far its mean falls, and the share of
/// its variance that goes.
fn cut_off<T: Real>(alpha: T) -> (T, T) {
    // λ = φ(α)/Φ(α), with Boyd's bound of Mills' ratio (1959), which is right to 1.2 %.
    let t = alpha.abs();
    let mills = T::PI / ((T::PI - T::ONE) * t + (t * t + (T::PI + T::PI)).sqrt());
    let lambda = if alpha < T::ZERO {
        T::ONE / mills
    } else {
        let density = (T::splat(0.5) * (t * t)).exp_neg() * T::splat(0.398_942_280_401_432_7);
        density / (T::ONE - density * mills)
    };
    (lambda, (lambda * (lambda + alpha)).limit(T::ZERO, T::splat(0.99)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A belief of which a test makes something else.
    fn with(change: impl FnOnce(&mut Belief<f32>)) -> bool {
        let mut belief = Belief::default();
        belief.rest();
        change(&mut belief);
        belief.is_finite()
    }

    #[test]
    fn a_belief_is_given_up_as_soon_as_one_of_its_numbers_is_none() {
        assert!(with(|_| ()));
        for bad in [f32::NAN, f32::INFINITY] {
            let alone: [fn(&mut Belief<f32>, f32); 10] = [
                |b, x| b.motion.position = x,
                |b, x| b.motion.velocity = x,
                |b, x| b.friction.mean = x,
                |b, x| b.friction.ripple = x,
                |b, x| b.friction.slope = x,
                |b, x| b.tt = x,
                |b, x| b.ww = x,
                |b, x| b.friction.hh = x,
                |b, x| b.friction.rr = x,
                |b, x| b.friction.ss = x,
            ];
            for (number, set) in alone.iter().enumerate() {
                assert!(!with(|b| set(b, bad)), "{bad} in number {number}");
            }
        }
        // A position that is measured divides by its variance, to which that of the measurement is added.
        assert!(!with(|b| b.tt = -1e-6));
        assert!(with(|b| b.tt = 0.0), "that of an edge remains");
    }

    #[test]
    fn a_belief_is_given_up_before_its_numbers_can_no_longer_be_added_and_not_because_they_are_large() {
        let pairs: [fn(&mut Belief<f32>, f32); 8] = [
            |b, x| (b.motion.position, b.motion.velocity) = (x, x),
            |b, x| (b.motion.velocity, b.friction.mean) = (x, x),
            |b, x| (b.friction.mean, b.friction.ripple) = (x, x),
            |b, x| (b.friction.ripple, b.friction.slope) = (x, x),
            |b, x| (b.tt, b.ww) = (x, x),
            |b, x| (b.ww, b.friction.hh) = (x, x),
            |b, x| (b.friction.hh, b.friction.rr) = (x, x),
            |b, x| (b.friction.rr, b.friction.ss) = (x, x),
        ];
        for (number, set) in pairs.iter().enumerate() {
            // A sum of two that is no number of 32 bits, and one that is, of which the product is none.
            assert!(!with(|b| set(b, 3e38)), "pair {number}");
            assert!(with(|b| set(b, 3e19)), "pair {number}");
        }
    }

    type Matrix = [[f64; 5]; 5];

    const SHAFT: Shaft<f64> =
        Shaft { damping: 0.03, stiffness: 0.04, decay: 0.02, walk: 1e-4, gain_doubt: 0.3, roughness: 0.005 };

    /// Some covariance of position, velocity, mean, ripple and slope.
    const SOME: Matrix = [
        [0.080, 0.010, 0.003, -0.004, 0.0010],
        [0.010, 0.020, 0.002, 0.001, -0.0020],
        [0.003, 0.002, 0.060, -0.005, 0.0004],
        [-0.004, 0.001, -0.005, 0.030, 0.0007],
        [0.001, -0.002, 0.0004, 0.0007, 0.0050],
    ];

    /// A belief in a motion, of which the friction is 1.2 and 0.1 more, with the slope 0.05.
    fn some(velocity: f64) -> Belief<f64> {
        let [t, w, h, r, s] = SOME;
        let friction = Friction {
            mean: 1.2,
            ripple: 0.1,
            slope: 0.05,
            hh: h[2],
            hr: h[3],
            hs: h[4],
            rr: r[3],
            rs: r[4],
            ss: s[4],
        };
        let motion = Motion { position: 0.3, velocity };
        let ([tt, tw, th, tr, ts], [_, ww, wh, wr, ws]) = (t, w);
        Belief { motion, friction, tt, tw, th, tr, ts, ww, wh, wr, ws }
    }

    fn covariance(b: &Belief<f64>) -> Matrix {
        let f = &b.friction;
        [
            [b.tt, b.tw, b.th, b.tr, b.ts],
            [b.tw, b.ww, b.wh, b.wr, b.ws],
            [b.th, b.wh, f.hh, f.hr, f.hs],
            [b.tr, b.wr, f.hr, f.rr, f.rs],
            [b.ts, b.ws, f.hs, f.rs, f.ss],
        ]
    }

    fn means(b: &Belief<f64>) -> [f64; 5] {
        [b.motion.position, b.motion.velocity, b.friction.mean, b.friction.ripple, b.friction.slope]
    }

    fn product(a: &Matrix, b: &Matrix) -> Matrix {
        core::array::from_fn(|i| core::array::from_fn(|j| (0..5).map(|k| a[i][k] * b[k][j]).sum()))
    }

    fn turned(a: &Matrix) -> Matrix {
        core::array::from_fn(|i| core::array::from_fn(|j| a[j][i]))
    }

    /// The covariance of what a matrix makes of numbers with another one.
    fn through(f: &Matrix, p: &Matrix) -> Matrix {
        product(&product(f, p), &turned(f))
    }

    #[track_caller]
    fn same(a: &Matrix, b: &Matrix) {
        for (x, y) in a.iter().flatten().zip(b.iter().flatten()) {
            assert!((x - y).abs() < 1e-12, "{a:?}\n{b:?}");
        }
    }

    #[test]
    fn a_period_spreads_the_belief_as_the_equations_of_the_page_and_the_disc_turns_under_it() {
        for (way, velocity, pull) in [(1.0, 0.5, 0.09), (-1.0, -0.5, -0.09)] {
            let (load, fall) = (0.1, 0.04);
            let mut belief = some(velocity);
            let gone = belief.advance(&SHAFT, pull, (load, fall), true);
            // a = D − w (h + r) sgn ω − c ω
            let a = pull - way * load * 1.3 - 0.03 * velocity;
            let delta = velocity + 0.5 * a;
            let (b, keep) = (-way * load, 1.0 - 0.03 + 0.04 * 1.3);
            let moves = [
                [1.0, 1.0, 0.5 * b, 0.5 * b, 0.0],
                [0.0, keep, b, b, 0.0],
                [0.0, 0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, 1.0, 0.0],
                [0.0, 0.0, 0.0, 0.0, 1.0],
            ];
            let mut expected = through(&moves, &SOME);
            expected[1][1] += 1e-4 + (0.3 * a) * (0.3 * a);
            // s' = s − Δ (k² r + 2 ζ k s), the damping for the way either way; r' = r + Δ s'
            let (down, left) = (-delta * 0.04, 1.0 - delta.abs() * 0.02);
            let turns = [
                [1.0, 0.0, 0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0, 0.0, 0.0],
                [0.0, 0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, 1.0 + delta * down, delta * left],
                [0.0, 0.0, 0.0, down, left],
            ];
            expected = through(&turns, &expected);
            // A ripple that is a share of friction gets rough with its square.
            expected[4][4] += 0.005 * delta.abs() * 1.2 * 1.2;
            same(&covariance(&belief), &expected);
            let slope = down * 0.1 + left * 0.05;
            for (mean, expected) in
                means(&belief).iter().zip([0.3 + delta, velocity + a, 1.2, 0.1 + delta * slope, slope])
            {
                assert!((mean - expected).abs() < 1e-12, "{:?}", means(&belief));
            }
            assert!((gone - delta).abs() < 1e-12);
        }
    }

    #[test]
    fn a_measured_position_is_weighed_by_its_variance_and_what_goes_with_it_is_learnt() {
        let mut belief = some(0.5);
        let surprise = belief.correct(0.4, 0.02);
        assert!((surprise.square - 0.01).abs() < 1e-12 && (surprise.variance - 0.1).abs() < 1e-12);
        let column = SOME[0];
        let before = [0.3, 0.5, 1.2, 0.1, 0.05];
        for ((mean, before), c) in means(&belief).iter().zip(before).zip(column) {
            assert!((mean - (before + c * 0.1 / 0.1)).abs() < 1e-12, "{:?}", means(&belief));
        }
        let expected =
            core::array::from_fn(|i| core::array::from_fn(|j| SOME[i][j] - column[i] * column[j] / 0.1));
        same(&covariance(&belief), &expected);
    }

    #[test]
    fn a_shaft_comes_to_rest_after_the_square_of_its_velocity_over_twice_its_slowing() {
        for way in [1.0, -1.0] {
            let mut motion = Motion { position: 0.3, velocity: 0.2 * way };
            let (gone, a, lacks) = motion.glide(&SHAFT, 0.05 * way, 0.4, 1.5);
            let slowing = 0.4 * 1.5 - 0.05 + 0.03 * 0.2;
            assert!((a + slowing * way).abs() < 1e-12 && (lacks - (slowing - 0.2)).abs() < 1e-12);
            let stops = 0.2 * 0.2 / (2.0 * slowing) * way;
            assert!((gone - stops).abs() < 1e-12 && (motion.position - 0.3 - stops).abs() < 1e-12, "{gone}");
            assert_eq!(motion.velocity, 0.0);
            // One that goes on.
            let mut motion = Motion { position: 0.3, velocity: 0.2 * way };
            let (gone, .., lacks) = motion.glide(&SHAFT, 0.05 * way, 0.1, 1.5);
            let after = 0.2 - (0.1 * 1.5 - 0.05 + 0.03 * 0.2);
            assert!((motion.velocity - after * way).abs() < 1e-12 && lacks == 0.0);
            assert!(
                (gone - 0.5 * (0.2 + after) * way).abs() < 1e-12
                    && (motion.position - 0.3 - gone).abs() < 1e-12
            );
        }
        // From rest it goes the way in which it is pulled.
        let mut motion = Motion { position: 0.3, velocity: 0.0 };
        motion.glide(&SHAFT, -0.5, 0.1, 1.5);
        assert!((motion.velocity + 0.35).abs() < 1e-12, "{}", motion.velocity);
    }

    #[test]
    fn a_shaft_whose_velocity_is_known_may_stop_though_it_is_known_to_move() {
        let mut belief = some(0.1);
        (belief.tw, belief.ww, belief.wh, belief.wr, belief.ws) = (0.0, 0.0, 0.0, 0.0, 0.0);
        belief.friction.hh = 0.0;
        (belief.friction.hr, belief.friction.rr) = (0.0, 0.0);
        let shaft = Shaft { walk: 0.0, gain_doubt: 0.0, ..SHAFT };
        belief.advance(&shaft, 0.05, (0.4, 0.0), true);
        assert!(belief.is_finite() && belief.motion.velocity == 0.0, "{belief:?}");
    }

    #[test]
    fn no_measurement_makes_friction_vanish_or_its_ripple_more_than_six_tenths_of_it() {
        for (measured, mean, ripple) in [(1e3, 10.0, -6.0), (-1e3, 0.1, 0.06)] {
            let mut belief = some(0.5);
            belief.correct(measured, 0.02);
            assert_eq!((belief.friction.mean, belief.friction.ripple), (mean, ripple), "{measured}");
        }
    }

    #[test]
    fn a_normal_distribution_that_is_cut_off_has_the_mean_and_the_variance_of_the_tables() {
        // φ/Φ and its product with φ/Φ + α.
        for (alpha, lambda, share) in [
            (-3.0, 3.283_099, 0.929_44),
            (-1.0, 1.525_135, 0.800_90),
            (0.0, 0.797_885, core::f64::consts::FRAC_2_PI),
            (1.0, 0.287_600, 0.370_31),
            (2.0, 0.055_248, 0.113_55),
        ] {
            let (has, goes) = cut_off::<f64>(alpha);
            assert!((has / lambda - 1.0).abs() < 0.012, "{alpha}: {has}");
            assert!((goes / share - 1.0).abs() < 0.05, "{alpha}: {goes}");
        }
        assert_eq!(cut_off::<f64>(-1e3).1, 0.99, "some variance stays, however far it is off");
    }

    #[test]
    fn silence_leaves_what_is_far_from_the_edge_and_moves_what_is_near_away_from_it() {
        let known = |position: f64, side: f64| {
            let mut belief = some(0.5);
            belief.motion.position = position;
            (belief.tt, belief.tr, belief.ts) = (0.03, 0.0, 0.0);
            belief.keep_within(if side > 0.0 { 1.0 } else { 0.0 }, side, 0.01);
            belief
        };
        // Deviation and blur together 0.2: the edge is 3.4 and 3.6 of them away.
        for (side, near, far) in [(1.0, 0.32, 0.28), (-1.0, 0.68, 0.72)] {
            assert_eq!(known(far, side).motion.position, far);
            let belief = known(near, side);
            let moved = (near - belief.motion.position) * side;
            assert!(moved > 0.0 && moved < 1e-3, "{side}: {moved}");
            // At the edge: by 0.798 deviations, as far as the variance is the position's; and 0.637 of it goes.
            let belief = known(if side > 0.0 { 1.0 } else { 0.0 }, side);
            let (end, share) = (belief.motion.position, 1.0 - belief.tt / 0.03);
            let inside = if side > 0.0 { 1.0 - end } else { end };
            assert!((inside / (0.797_885 * 0.2 * 0.75) - 1.0).abs() < 0.012, "{side}: {inside}");
            assert!((share / (core::f64::consts::FRAC_2_PI * 0.75) - 1.0).abs() < 0.03, "{side}: {share}");
            // Beyond it: 1.525 deviations.
            let belief = known(if side > 0.0 { 1.2 } else { -0.2 }, side);
            let back = if side > 0.0 { 1.2 - belief.motion.position } else { belief.motion.position + 0.2 };
            assert!((back / (1.525_135 * 0.2 * 0.75) - 1.0).abs() < 0.012, "{side}: {back}");
        }
    }

    #[test]
    fn a_shaft_at_rest_is_anywhere_in_its_count() {
        let mut belief = some(0.5);
        belief.rest();
        // A uniform distribution; friction is as it was, and nothing goes with the place any more.
        assert_eq!((belief.motion, belief.tt), (Motion { position: 0.5, velocity: 0.0 }, 1.0 / 12.0));
        assert_eq!(belief.friction, some(0.5).friction);
        let p = covariance(&belief);
        assert!(p[0][1..] == [0.0; 4] && p[1] == [0.0; 5], "{p:?}");
    }
}
