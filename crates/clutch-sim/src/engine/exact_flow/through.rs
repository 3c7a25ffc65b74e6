//! A piece of the motion through the layer, by quadrature in speed.

use super::flow::Flow;
use super::state::State;
use super::tolerance::TOLERANCE;
use crate::lane::Lane;

/// Way of a quadrature, in Stribeck velocities, downwards and upwards. Of a fall the integrand has poles at π beside the real axis, of a
/// rise, whose balance is taken off, at 2π.
const REACH: (f64, f64) = (6.0, 9.0);
/// Distance of a balance, in ways of a quadrature, below which its pole is taken off. Beyond, the points see it well, and the logarithm
/// that is its integral would lose digits.
const NEAR: f64 = 2.0;
/// Time, in the motion's own, that five terms of a series bridge.
const SHORT: f64 = 0.02;
/// Gauss and Legendre's points.
const POINTS: usize = 12;
/// The lower half of them on [0, 1]: place, weight, and the weights that give the tenth and the eleventh
/// coefficient of a series in Legendre's polynomials. The upper half is its mirror, the last column with the other sign.
const NODES: [[f64; 4]; POINTS / 2] = [
    [0.009219682876640375, 0.023587668193255914, 0.10544099839163595, -0.05626855563529156],
    [0.04794137181476257, 0.05346966299765921, -0.3268652502223004, 0.18937270565563258],
    [0.11504866290284765, 0.08003916427167311, 0.5086168908165707, -0.34604162358432194],
    [0.2063410228566913, 0.10158371336153296, -0.554368149850446, 0.49442267934928263],
    [0.3160842505009099, 0.1167462682691774, 0.4276380562250802, -0.608976901663329],
    [0.43738329574426554, 0.12457352290670139, -0.1604625453605404, 0.6711612378327249],
];

/// A zero of `φ`, which no motion passes, on the way from a speed. `1/φ` has a pole there.
struct Balance<V> {
    /// Way to it.
    way: V,
    /// Residue of `1/φ`, s; 0 where there is no balance, or it is far.
    residue: V,
}

impl<V: Lane> Flow<V> {
    /// The inside of the layer: `t = ∫ ds/φ` and `∫ s ds/φ` from the speed now to one that is guessed. The rest of
    /// the time, a little before or behind the end, is a short series of known terms. Masks: where the state is the one after
    /// it, and where it stops there. Not where the integrand is too steep for [`POINTS`].
    #[inline(always)]
    pub(super) fn through(&self, at: &State<V>, now: V, slip: V, rest: V) -> (V::Mask, V::Mask, State<V>) {
        let s = V::splat;
        let limits = (-at.speed.min(s(REACH.0)), s(REACH.1));
        // With the drag as it is now, and then as it is half-way, the motion is in closed form.
        let (mut way, mut asks) = (V::ZERO, !V::none());
        for _ in 0..2 {
            let closer = guess(now - s(0.5) * self.drag * way, slip, rest, limits);
            way = V::select(asks, closer, way);
            asks = s(1e-3).less(self.drag * rest) & limits.0.less(way) & way.less(limits.1);
            if !V::any(asks) {
                break;
            }
        }
        let balance = self.balance((now, slip), way);
        let rate = |way: V, fall: V| now - self.drag * way - slip * fall;
        let mut ways = [way; POINTS + 1];
        for (i, [node, ..]) in NODES.into_iter().enumerate() {
            ways[i] = s(node) * way;
            ways[POINTS - 1 - i] = way - ways[i];
        }
        let falls = V::near_falls(ways);
        let (mut time, mut moment, mut even, mut odd) = (V::ZERO, V::ZERO, V::ZERO, V::ZERO);
        let part = |i: usize| {
            let (rate, from) = (rate(ways[i], falls[i]), ways[i] - balance.way);
            (from - balance.residue * rate) / (rate * from)
        };
        for (i, [_, weight, tenth, eleventh]) in NODES.into_iter().enumerate() {
            let mirror = POINTS - 1 - i;
            let (low, high) = (part(i), part(mirror));
            time = time + s(weight) * (low + high);
            moment = moment + s(weight) * (low * ways[i] + high * ways[mirror]);
            even = even + s(tenth) * (low + high);
            odd = odd + s(eleventh) * (low - high);
        }
        // ∫ dw/(w − w*)
        let pole = balance.residue * (-way / balance.way).near_log1p();
        let smooth = time * way;
        let time = smooth + pole;
        let moment = moment * way + balance.residue * way + balance.way * pole;
        // The coefficients of a series in Legendre's polynomials fall like those of a power series: what the nodes
        // leave out is about the square of what the last coefficient is. An even integrand has none; the one before is then
        // some three times as large.
        let last = odd.abs().max(even.abs() / s(3.0)) * way.abs();
        let seen = s(TOLERANCE) * smooth.abs().max(last) * time;
        // Much drag may end a motion in a balance before the way that was guessed.
        let end = rate(way, falls[POINTS]);
        let fits = V::ZERO.less(time) & V::ZERO.less(now * end) & (last * last).less_or_equal(seen);
        let stops = V::same(way, -at.speed);
        let left = rest - time;
        let to = State {
            time: at.time + time,
            speed: at.speed + way,
            rate: end,
            way: at.way + at.speed * time + moment,
        };
        let slip = slip * (falls[POINTS] + V::ONE);
        let short = (left.abs() * (end.abs() + slip.abs() + self.drag)).less_or_equal(s(SHORT));
        let fits = fits & !(left.less(V::ZERO) & !short);
        let ends = left.less_or_equal(V::ZERO) | (short & !stops);
        if !V::any(fits & ends) {
            return (fits, stops, to);
        }
        let g1 = slip - self.drag;
        let g2 = g1 * g1 - slip * end;
        let g3 = g1 * g1 * g1 - s(4.0) * g1 * slip * end + slip * end * end;
        let (half, third, fourth) = (left * s(1.0 / 2.0), left * s(1.0 / 3.0), left * s(1.0 / 4.0));
        let way = left * (to.speed + half * end * (V::ONE + third * (g1 + fourth * g2)));
        let more = left * end * (V::ONE + half * (g1 + third * (g2 + fourth * g3)));
        let ended =
            State { time: at.time + rest, speed: to.speed + more, rate: s(f64::NAN), way: to.way + way };
        // It stops at the very end.
        let fits = fits & !(ends & ended.speed.less(V::ZERO));
        (fits, stops & !ends, State::select(ends, &ended, &to))
    }

    /// The balance of the motion from a speed at which `φ` is `now` and `q` is `slip`, if it is near on this way.
    #[inline(always)]
    fn balance(&self, (now, slip): (V, V), along: V) -> Balance<V> {
        let s = V::splat;
        let ratio = now / slip;
        let has = s(-0.999).less(ratio) & ratio.less(s(1e3));
        let none = Balance { way: s(-20.0), residue: V::ZERO };
        if !V::any(has) {
            return none;
        }
        // With the drag as it is now, then with the drag there, and a step of Halley's.
        let linear = now + slip;
        let way = -V::select(has, ratio, V::ONE).near_log1p();
        let way = way + self.drag * way / (linear - self.drag);
        let fall = (-way).near_expm1();
        let off = (now - self.drag * way - slip * fall) / (slip * (fall + V::ONE) - self.drag);
        let way = way - off * (V::ONE - s(0.5) * off);
        let drag = self.drag * (way + V::ONE);
        let has = has & way.abs().less(s(NEAR) * along.abs()) & drag.abs().less(s(0.5) * linear.abs());
        Balance {
            way: V::select(has, way, none.way),
            residue: V::select(has, V::ONE / (linear - drag), none.residue),
        }
    }
}

/// The way in which a motion with constant drag goes, in Stribeck velocities, within limits: `e^w = 1 + φ (e^(Lt) − 1)/L`,
/// `L = φ + q`. Roughly, where more than the limits is asked for.
#[inline(always)]
fn guess<V: Lane>(now: V, slip: V, rest: V, (lowest, highest): (V, V)) -> V {
    let s = V::splat;
    let linear = now + slip;
    let x = linear * rest;
    let grown = x.limit(s(-300.0), s(300.0)).near_expm1() / linear;
    let y = now * V::select(x.abs().less(s(1e-4)), rest + s(0.5) * x * rest, grown);
    let stops = y.less_or_equal(-V::ONE);
    let way = V::select(stops, V::ZERO, y).near_log1p();
    let way = V::select(stops | way.less(lowest), lowest, way);
    V::select(highest.less(way), highest, way)
}
