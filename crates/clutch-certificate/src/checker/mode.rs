//! Events of a tick, and how far they take a direction.

use super::interval::{Interval, at};
use super::law::{Linear, Piece};
use super::shaft::{Shaft, TARGET_STEP};
use crate::setup::{Case, Form, ModeId};

/// `weights·y + constant`.
#[derive(Clone)]
pub(crate) struct Sum {
    pub(crate) weights: Vec<Interval>,
    pub(crate) constant: Interval,
}

impl Sum {
    fn zero(n: usize) -> Sum {
        Sum { weights: vec![at(0.0); n], constant: at(0.0) }
    }

    fn add(&mut self, factor: Interval, other: &Sum) {
        for (own, other) in self.weights.iter_mut().zip(&other.weights) {
            *own = *own + factor * *other;
        }
        self.constant = self.constant + factor * other.constant;
    }

    fn is_fixed(&self) -> bool {
        self.weights.iter().all(|w| *w == at(0.0))
    }
}

/// A mode: what holds in it, `(a, b)` with `a·y ≤ b`, and what is known of the voltages.
pub(crate) struct Mode {
    case: Case,
    form: Form,
    pub(crate) within: Vec<(Vec<Interval>, Interval)>,
    measured: Sum,
    /// The law's answer is at least the first and at most the second.
    answer: [Sum; 2],
    /// So is the voltage on the brake.
    applied: [Sum; 2],
    /// And the next integral, with its coordinate, of a law that remembers one.
    memory: Option<(usize, [Sum; 2])>,
}

/// `(e, s, z, p …, I, last)`: `I` of a law that remembers an integral; the last is `m₋` in the exact form and the rounding in the noise form.
const E: usize = 0;
const S: usize = 1;
const Z: usize = 2;
const P: usize = 3;

impl Mode {
    /// The mode; none if its voltage, known beforehand, is not one of its case.
    pub(crate) fn possible(shaft: &Shaft, piece: &Piece, form: Form, id: ModeId, n: usize) -> Option<Mode> {
        let coordinate = |i: usize| {
            let mut sum = Sum::zero(n);
            sum.weights[i] = at(1.0);
            sum
        };
        // The target's step is known to one of its own steps.
        let step = Interval { low: -TARGET_STEP, high: TARGET_STEP };
        let mut measured = coordinate(n - 1);
        match form {
            Form::Noise => measured.add(at(1.0), &coordinate(E)),
            Form::Exact => measured.constant = shaft.path + step - at(f64::from(id.counts)),
        }
        let of = |linear: &Linear| {
            let mut sum = Sum::zero(n);
            sum.add(linear[0], &measured);
            sum.add(linear[1], &coordinate(Z));
            sum.constant = sum.constant + linear[2];
            if piece.next.is_some() {
                sum.weights[n - 2] = sum.weights[n - 2] + linear[3];
            }
            sum
        };
        let answer = [of(&piece.volts[0]), of(&piece.volts[1])];
        let memory = piece.next.map(|next| (n - 2, next.map(|linear| of(&linear))));
        let applied = if shaft.delay == 0 { answer.clone() } else { [coordinate(P), coordinate(P)] };
        let fixed = applied.iter().all(Sum::is_fixed);
        let (least, most) = (applied[0].constant.low, applied[1].constant.high);
        let impossible = fixed
            && match id.case {
                Case::Slides => false,
                Case::LetGo => least > shaft.lets_go,
                Case::TouchesAndLeaves => most < shaft.lets_go || least > shaft.stays,
                Case::TouchesAndStays => most < shaft.lets_go.max(shaft.stays),
            };
        if impossible {
            return None;
        }

        let mut within = Vec::new();
        // factor · sum ≤ limit.
        let mut at_most = |factor: f64, sum: &Sum, limit: Interval| {
            let mut scaled = Sum::zero(n);
            scaled.add(at(factor), sum);
            within.push((scaled.weights, limit - scaled.constant));
        };
        let rate = coordinate(S);
        at_most(1.0, &rate, shaft.path);
        let mut rounding = measured.clone();
        rounding.add(at(-1.0), &coordinate(E));
        at_most(1.0, &rounding, at(1.0));
        at_most(-1.0, &rounding, at(0.0));
        let mut seen = Sum::zero(n);
        seen.add(shaft.kappa, &measured);
        seen.add(-shaft.kappa, &coordinate(Z));
        at_most(1.0, &seen, shaft.path + at(TARGET_STEP));
        for linear in &piece.within {
            at_most(1.0, &of(linear), at(0.0));
        }
        match id.case {
            Case::Slides => at_most(1.0, &rate, shaft.path - shaft.slow),
            Case::LetGo => {
                at_most(1.0, &applied[0], at(shaft.lets_go));
                at_most(-1.0, &rate, shaft.slow - shaft.path);
            }
            Case::TouchesAndLeaves | Case::TouchesAndStays => {
                if id.case == Case::TouchesAndLeaves {
                    at_most(-1.0, &applied[1], at(-shaft.lets_go));
                    at_most(1.0, &applied[0], at(shaft.stays));
                } else {
                    at_most(-1.0, &applied[1], at(-shaft.lets_go.max(shaft.stays)));
                }
                // It can touch Stribeck's speeds only as far as it can be slowed in a tick.
                let (least_drive, most_brake) = (shaft.drives.0, shaft.brakes.1);
                let spared = least_drive.min(most_brake * at(shaft.lets_go));
                let mut slowed = Sum::zero(n);
                slowed.add(at(-1.0), &rate);
                slowed.add(-most_brake, &applied[1]);
                at_most(1.0, &slowed, shaft.slow - spared - shaft.path);
            }
        }
        Some(Mode { case: id.case, form, within, measured, answer, applied, memory })
    }

    /// The most that `c·x` can be after the tick.
    pub(crate) fn next(&self, shaft: &Shaft, c: &[f64]) -> Sum {
        let n = c.len();
        let (ce, cs, cz) = (at(c[E]), at(c[S]), at(c[Z]));
        let mut out = Sum::zero(n);
        // With a factor above 0 the upper voltage is the worst, else the lower; a factor of unknown sign is tiny, and both stand.
        let volts = |out: &mut Sum, factor: Interval, between: &[Sum; 2]| {
            let side = if factor.low >= 0.0 { 1 } else { 0 };
            out.add(factor, &between[side]);
            if factor.low < 0.0 && factor.high > 0.0 {
                // (upper − lower) times the part above 0.
                out.add(at(factor.high), &between[1]);
                out.add(at(-factor.high), &between[0]);
            }
        };
        let step = Interval { low: -TARGET_STEP, high: TARGET_STEP };
        out.weights[E] = ce;
        out.constant = ce * step;
        match self.case {
            Case::Slides | Case::LetGo => {
                let ((least, most), drives) = if self.case == Case::Slides {
                    (shaft.brakes, shaft.drives)
                } else {
                    (shaft.brakes_anywhere, shaft.drives_anywhere)
                };
                let (above, below) = integrals(cs + ce, cs);
                out.weights[S] = ce + cs;
                out.constant = out.constant + below * drives.1 - above * drives.0;
                volts(&mut out, above * most - below * least, &self.applied);
            }
            Case::TouchesAndLeaves | Case::TouchesAndStays => {
                out.constant = out.constant + (cs + ce) * shaft.path;
                let (slows, gains) = ((-cs).positive(), (-ce).positive());
                out.constant = out.constant + slows * shaft.slow + gains * (shaft.path + shaft.slow);
                out.weights[S] = -gains;
                if self.case == Case::TouchesAndLeaves {
                    let up = slows + at(0.5) * gains;
                    // A hair more than 0 where the voltage just holds.
                    out.constant = out.constant + up * (shaft.drives_anywhere.1 + at(1e-12));
                    volts(&mut out, -(up * shaft.brakes_leaving), &self.applied);
                }
            }
        }
        let mut seen = shaft.kappa * cz;
        if self.form == Form::Exact {
            seen = seen + at(c[n - 1]);
        }
        out.add(seen, &self.measured);
        out.weights[Z] = out.weights[Z] + (at(1.0) - shaft.kappa) * cz;
        if let Some((i, between)) = &self.memory {
            volts(&mut out, at(c[*i]), between);
        }
        for k in 0..shaft.delay {
            let c = at(c[P + k]);
            if k + 1 == shaft.delay {
                volts(&mut out, c, &self.answer);
            } else {
                out.weights[P + k + 1] = out.weights[P + k + 1] + c;
            }
        }
        out
    }
}

/// `∫ w⁺` and `∫ w⁻` over a tick, of a weight that goes straight from `first` to `last`.
fn integrals(first: Interval, last: Interval) -> (Interval, Interval) {
    let mean = at(0.5) * (first + last);
    if first.low >= 0.0 && last.low >= 0.0 {
        return (mean, at(0.0));
    }
    if first.high <= 0.0 && last.high <= 0.0 {
        return (at(0.0), -mean);
    }
    // Each part is a triangle: half its height times its share of the tick.
    let (high, low) = (first.max(last).positive(), (-first).max(-last).positive());
    let whole = high + low;
    if whole.low <= 0.0 {
        // A weight lost in rounding.
        let most = first.abs().max(last.abs());
        return (Interval { low: 0.0, high: most.high }, Interval { low: 0.0, high: most.high });
    }
    (at(0.5) * high * high / whole, at(0.5) * low * low / whole)
}
