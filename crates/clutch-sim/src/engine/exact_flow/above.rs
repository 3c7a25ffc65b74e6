//! A piece of the motion above the layer, where `q` is little beside the rest.

use super::flow::{Flow, SLOW};
use super::state::State;
use super::tolerance::TOLERANCE;
use crate::lane::Lane;

/// Speed down to which a motion is brought by such a piece, in Stribeck velocities, where `K` is below the rate of speed. With
/// that `q` is 3e-3 of the rate there.
const TOP: f64 = 5.7;
/// The same for each power of ten of `K` beside the rate: its logarithm.
const TENFOLD: f64 = core::f64::consts::LN_10;

impl<V: Lane> Flow<V> {
    /// The motion where `q` is small: linear, `l̇ = φ₀`, `φ₀ = A − G l`, and what `q` does beside that, `s = l + δ`. With
    /// `W = K e^(−l)/φ₀²` to first order `δ = −φ₀ ∫ W dl`, and the way is less by `∫ (l₁ − l) W dl`: both hold the drag exactly.
    /// `1/φ₀²` is expanded around the slower end, where `e^(−l)` is largest. Without drag `δ = log(1 − I)`, `I = −δ` of first order;
    /// so the second and the third order of speed and way are taken. What is left out is estimated, and held below [`TOLERANCE`] of the
    /// speed. The motion is of this kind where the mask is true, and the state is the one after it.
    #[inline(always)]
    pub(super) fn above(&self, at: &State<V>, from: V, slip: V, rest: V) -> (V::Mask, State<V>) {
        let s = V::splat;
        let (rises, falls) = (V::ZERO.less(from), from.less(V::ZERO));
        let (steps, ten) = (from.abs(), s(10.0));
        let layer = self.stribeck.abs();
        let above = |rate: V, top: V| V::select(rate.less(layer), top + s(TENFOLD), top);
        let top = above(s(100.0) * steps, above(ten * steps, above(steps, s(TOP))));
        // What has been brought down is not brought down again.
        let kind = (rises & !at.speed.less(s(SLOW))) | (falls & (top + V::ONE).less(at.speed));
        if !V::any(kind) {
            return (kind, *at);
        }
        let end = V::apart(
            #[inline(always)]
            || self.linear(at, rest, V::select(rises, V::ZERO, top)),
        );
        let change = end.speed - at.speed;
        let last = from - self.drag * change;
        let per = V::ONE / V::select(rises, from, last);
        // q over the rate of the slower end, at the begin and at the end.
        let y0 = slip * per;
        let both = -y0 * (-change).max(s(-700.0)).near_expm1();
        let y1 = y0 - both;
        // ∫ e^(−l) u dl and ∫ e^(−l) u² dl, u from the slower end on.
        let other = V::select(rises, y1, y0);
        let once = both - change * other;
        let twice = s(2.0) * once - change * change.abs() * other;
        let drag = self.drag * per;
        let first = both + s(2.0) * drag * once;
        let turned = once + s(2.0) * drag * twice;
        let i = V::select(rises, last * per, V::ONE) * first;
        let lost = V::select(rises, change * first, V::ZERO) - turned;
        let second = s(0.5) * (y0 * y0 * change - s(0.5) * both * (s(3.0) * y0 - y1));
        let third = y0 * y0 * y0 * change
            - both * (s(11.0 / 6.0) * y0 * y0 - s(7.0 / 6.0) * y0 * y1 + s(1.0 / 3.0) * y1 * y1);
        let lost = (lost + second + s(1.0 / 3.0) * third) * per;
        let (size, steep) = (i.abs(), drag.abs());
        let mixed = V::select(rises, self.drag * (end.time - at.time), steep);
        let left_out = size * (s(6.0) * steep * steep + size * (mixed + s(0.25) * i * i));
        let small = y0.abs().max(y1.abs()).less(s(0.1));
        // Of a rise the begin is the slower end as long as much drag does not end it in a balance.
        let even = (self.drag * change).less_or_equal(s(0.25) * from.abs());
        let fits = kind & small & even & left_out.less_or_equal(s(TOLERANCE) * at.speed.min(end.speed));
        let speed = end.speed - i * (V::ONE + i * (s(0.5) + i * (s(1.0 / 3.0) + s(0.25) * i)));
        (fits, State { speed, way: end.way - lost, ..end })
    }
}
