//! A law as finitely many pieces: where each holds, and the voltages between which it answers.
//!
//! With the measured error `m` and the filter's memory `z`, in counts, `d = κ (m − z)` is the rate (5); a law may remember an
//! integral `I`, in volts. A piece is a set of inequalities in these, and two straight lines below and above the voltage, and
//! below and above the next integral.

use crate::setup::{Gains, Strip};
use crate::units::{MEMORY_ROUNDING, SURFACE_ROUNDING, Units};

/// `m·m_weight + z·z_weight + I·memory + constant`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Line {
    pub(crate) m: f64,
    pub(crate) z: f64,
    pub(crate) memory: f64,
    pub(crate) constant: f64,
}

impl Line {
    fn constant(constant: f64) -> Line {
        Line { constant, ..Line::default() }
    }

    fn plus(self, other: Line, factor: f64) -> Line {
        Line {
            m: self.m + factor * other.m,
            z: self.z + factor * other.z,
            memory: self.memory + factor * other.memory,
            constant: self.constant + factor * other.constant,
        }
    }

    fn times(self, factor: f64) -> Line {
        Line::default().plus(self, factor)
    }
}

/// A piece of a law.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub(crate) id: u32,
    /// Each is at most 0.
    pub(crate) within: Vec<Line>,
    /// The voltage is between these.
    pub(crate) volts: [Line; 2],
    /// So is the next integral, of a law that remembers one.
    pub(crate) next: [Line; 2],
}

/// `d` in rad/s.
fn rate(u: &Units) -> Line {
    Line { m: u.kappa * u.speed, z: -u.kappa * u.speed, ..Line::default() }
}

/// The law's error in rad.
fn error(u: &Units) -> Line {
    Line { m: u.count, ..Line::default() }
}

/// All pieces of the law.
pub(crate) fn pieces(u: &Units, strips: &[Strip]) -> Vec<Piece> {
    match u.law {
        Gains::Linear { kp, kd, forward } => {
            linear(u, Line::constant(forward).plus(error(u), -kp).plus(rate(u), -kd))
        }
        Gains::Integral { .. } => integral(u),
        Gains::Layer { slope, .. } => layer(u, slope, strips),
        Gains::Shell { slope, boundary } => shell(u, slope, boundary),
    }
}

fn constant(u: &Units, id: u32, volts: f64, within: Vec<Line>) -> Piece {
    let low = (volts - u.volts_off).max(0.0);
    let volts = [Line::constant(low), Line::constant(volts + u.volts_off)];
    Piece { id, within, volts, next: [Line::default(); 2] }
}

/// A demand, and the part of it that the output's limits leave.
fn linear(u: &Units, demand: Line) -> Vec<Piece> {
    let [low, high] = u.volts;
    let below = |limit: f64| demand.plus(Line::constant(1.0), -limit);
    let above = |limit: f64| below(limit).times(-1.0);
    let off = Line::constant(u.volts_off);
    vec![
        constant(u, 0, low, vec![below(low)]),
        Piece {
            id: 1,
            within: vec![above(low), below(high)],
            volts: [demand.plus(off, -1.0), demand.plus(off, 1.0)],
            next: [Line::default(); 2],
        },
        constant(u, 2, high, vec![above(high)]),
    ]
}

/// [`linear`], with what the integral makes of each: it goes on, or ends at what the output can answer.
fn integral(u: &Units) -> Vec<Piece> {
    let Gains::Integral { kp, ki, kd, forward, tracking, limits } = u.law else { return Vec::new() };
    let integral = Line { memory: 1.0, ..Line::default() }.plus(error(u), -ki * u.period);
    let demand = integral.plus(Line::constant(forward), 1.0).plus(error(u), -kp).plus(rate(u), -kd);
    let share = u.period / tracking;
    // The law knows its own limits; the converter's may be a step off.
    let apart = (limits[0] - u.volts[0]).abs().max((limits[1] - u.volts[1]).abs());
    let off = Line::constant(MEMORY_ROUNDING + share * apart);
    let one = Line::constant(1.0);
    let ends = limits.map(|limit| limit - forward);
    let mut out = Vec::new();
    for piece in linear(u, demand) {
        let next = match piece.id {
            1 => integral,
            k => integral.plus(one, share * u.volts[usize::from(k == 2)]).plus(demand, -share),
        };
        let (below, above) = (next.plus(one, -ends[0]), next.times(-1.0).plus(one, ends[1]));
        let kinds = [
            (next, vec![below.times(-1.0), above.times(-1.0)]),
            (Line::constant(ends[0]), vec![below]),
            (Line::constant(ends[1]), vec![above]),
        ];
        for ((next, more), kind) in kinds.into_iter().zip(0..) {
            let mut piece = piece.clone();
            piece.id += 3 * kind;
            piece.within.extend(more);
            piece.next = [next.plus(off, -1.0), next.plus(off, 1.0)];
            out.push(piece);
        }
    }
    out
}

fn shell(u: &Units, slope: f64, boundary: f64) -> Vec<Piece> {
    let sigma = error(u).times(slope).plus(rate(u), 1.0);
    let one = Line::constant(1.0);
    let [low, high] = u.volts;
    // Either piece holds where the law rounds `σ` to the other side of an edge.
    let (least, most) = (boundary - SURFACE_ROUNDING, boundary + SURFACE_ROUNDING);
    let behind = sigma.times(-1.0).plus(one, least);
    let ahead = sigma.plus(one, least);
    let any = [Line::constant((low - u.volts_off).max(0.0)), Line::constant(high + u.volts_off)];
    let inside = vec![sigma.plus(one, -most), sigma.times(-1.0).plus(one, -most)];
    vec![
        constant(u, 0, low, vec![behind]),
        Piece { id: 1, within: inside, volts: any, next: [Line::default(); 2] },
        constant(u, 2, high, vec![ahead]),
    ]
}

fn layer(u: &Units, slope: f64, strips: &[Strip]) -> Vec<Piece> {
    let d = rate(u);
    let sigma = error(u).times(slope).plus(d, 1.0);
    let one = Line::constant(1.0);
    let mut out = vec![constant(u, 0, u.volts[0], vec![sigma.times(-1.0)])];
    for (strip, id) in strips.iter().zip(1..) {
        let side = if strip.leads { -1.0 } else { 1.0 };
        let mut within = vec![sigma.plus(one, strip.surface_from), d.times(-side).plus(one, strip.rate_from)];
        if let Some(to) = strip.surface_to {
            within.push(sigma.times(-1.0).plus(one, -to));
        }
        if let Some(to) = strip.rate_to {
            within.push(d.times(side).plus(one, -to));
        }
        let line = |[per, at]: [f64; 2], off: f64| sigma.times(-per).plus(one, at + off);
        let volts = [line(strip.least, -u.volts_off), line(strip.most, u.volts_off)];
        out.push(Piece { id, within, volts, next: [Line::default(); 2] });
    }
    out
}

/// Edges of the cells of `|ė|`, in units of `√(K_p/K_d)`, where the damping term is as large as the switching one.
const EDGES: [f64; 12] = [0.0, 0.3, 0.5, 0.7, 0.9, 1.1, 1.35, 1.65, 2.0, 2.5, 3.2, 4.2];
/// Lines are this far off the demand, V: what rounds in their making.
const OFF: f64 = 1e-9;

/// (31) ahead of its surface: the voltage before the limits for `S = |σ|` and `D = |ė|`; grows with both.
fn ahead((kp, kd, boundary): (f64, f64, f64), s: f64, d: f64) -> f64 {
    kp * (s / boundary).min(1.0) + kd * (s * d * d / boundary).min(d)
}

/// Strips for (31), none for a linear law; `limits` of the voltage.
pub(crate) fn strips(law: &Gains, [low, high]: [f64; 2]) -> Vec<Strip> {
    let Gains::Layer { kp, kd, boundary, .. } = *law else { return Vec::new() };
    let knee = if kd > 0.0 { libm::sqrt(kp / kd).min(1e3) } else { 1e3 };
    let law = (kp, kd, boundary);
    let mut out = Vec::new();
    for (k, d0) in EDGES.iter().enumerate() {
        let (d0, d1) = (d0 * knee, EDGES.get(k + 1).map(|x| x * knee));
        let least = |s: f64| ahead(law, s, d0).clamp(low, high);
        let most = |s: f64| d1.map_or(high, |d1| ahead(law, s, d1).clamp(low, high));
        let kinks = kinks(law, [low, high], [Some(d0), d1], &least);
        for (i, s0) in kinks.iter().enumerate() {
            let s1 = kinks.get(i + 1).copied();
            let through = |f: &dyn Fn(f64) -> f64, off: f64| {
                let far = s1.unwrap_or(s0 + boundary);
                let per = if s1.is_some() { (f(far) - f(*s0)) / (far - s0) } else { 0.0 };
                [per, f(*s0) - per * s0 + off]
            };
            for leads in [false, true] {
                out.push(Strip {
                    leads,
                    rate_from: d0,
                    rate_to: d1,
                    surface_from: *s0,
                    surface_to: s1,
                    least: through(&least, -OFF),
                    most: through(&most, OFF),
                });
            }
        }
    }
    out
}

/// The `|σ|` at which the demands at two `|ė|` have kinks, from 0 to where the lower one ends.
fn kinks(
    (kp, kd, boundary): (f64, f64, f64),
    limits: [f64; 2],
    rates: [Option<f64>; 2],
    least: &dyn Fn(f64) -> f64,
) -> Vec<f64> {
    let mut kinks = vec![0.0, boundary];
    for d in rates.into_iter().flatten() {
        kinks.push(boundary / d);
        for limit in limits {
            kinks.push(limit * boundary / (kp + kd * d * d));
            kinks.push((limit - kd * d) * boundary / kp);
            kinks.push((limit - kp) * boundary / (kd * d * d));
        }
    }
    // Lines that do not rise have none.
    kinks.retain(|s| s.is_finite() && *s >= 0.0);
    kinks.sort_by(f64::total_cmp);
    kinks.dedup_by(|b, a| *b - *a < 1e-9 * boundary);
    let ended = kinks.iter().position(|s| least(*s) >= limits[1]).unwrap_or(kinks.len() - 1);
    kinks.truncate(ended + 1);
    kinks
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::setup::{Setup, USUAL_END};
    use crate::tests::uniform;

    /// (4) and (31) as the paper writes them, with the limits.
    pub(crate) fn answer(u: &Units, m: f64, z: f64, integral: f64) -> f64 {
        let (e, d) = (m * u.count, u.kappa * (m - z) * u.speed);
        let sat = |x: f64| x.clamp(-1.0, 1.0);
        let demand = match u.law {
            Gains::Linear { kp, kd, forward } => forward - (kp * e + kd * d),
            Gains::Integral { kp, ki, kd, forward, .. } => {
                forward + integral - (kp * e + ki * u.period * e + kd * d)
            }
            Gains::Layer { kp, kd, slope, boundary } => {
                let sigma = slope * e + d;
                -(kp * sat(sigma / boundary) + kd * sat(sigma * d / boundary) * d)
            }
            Gains::Shell { slope, boundary } => {
                let sigma = slope * e + d;
                // Inside any law: one that jumps about.
                let any = (1e4 * (m + 7.0 * z)).sin() * 6.0 + 5.0;
                if sigma.abs() < boundary { any } else { -sigma * f64::INFINITY }
            }
        };
        demand.clamp(u.volts[0], u.volts[1])
    }

    /// The next integral, as the law computes it.
    pub(crate) fn remembered(u: &Units, m: f64, z: f64, integral: f64) -> f64 {
        let Gains::Integral { kp, ki, kd, forward, tracking, limits } = u.law else { return 0.0 };
        let (e, d) = (m * u.count, u.kappa * (m - z) * u.speed);
        let gained = integral - ki * u.period * e;
        let demand = forward + gained - kp * e - kd * d;
        let cut_off = demand.clamp(limits[0], limits[1]) - demand;
        (gained + u.period / tracking * cut_off).clamp(limits[0] - forward, limits[1] - forward)
    }

    /// A law with an integral, with limits of the output a step beyond the converter's.
    pub(crate) fn with_an_integral(tracking: f64, forward: f64) -> Gains {
        Gains::Integral { kp: 1250.0, ki: 10_000.0, kd: 12.9, forward, tracking, limits: [0.0, 10.0] }
    }

    #[test]
    fn wherever_the_measurement_lies_a_piece_holds_it_and_the_laws_voltage() {
        let laws = [
            with_an_integral(0.05, 0.0),
            with_an_integral(0.002, 2.2),
            Gains::Linear { kp: 5000.0, kd: 50.0, forward: 0.0 },
            Gains::Linear { kp: 1660.0, kd: 12.9, forward: 2.24 },
            Gains::Linear { kp: 1660.0, kd: 12.9, forward: -1.5 },
            Gains::Layer { kp: 3.0, kd: 400.0, slope: 70.0, boundary: 0.1 },
            Gains::Layer { kp: 5.0, kd: 50.0, slope: 70.0, boundary: 0.2 },
            Gains::Layer { kp: 12.0, kd: 3.0, slope: 50.0, boundary: 0.3 },
            Gains::Layer { kp: 2.0, kd: 0.0, slope: 50.0, boundary: 0.3 },
            Gains::Shell { slope: 100.0, boundary: 0.1 },
        ];
        for law in laws {
            let u = Units::new(&Setup::paper(law), [0.15; 2], USUAL_END, 2.0);
            let pieces = pieces(&u, &strips(&law, u.volts));
            let mut next = uniform(7);
            for _ in 0..20_000 {
                let reach = 10.0_f64.powf(next(-1.5, 1.2));
                let (m, z) = (next(-reach, reach), next(-reach, reach));
                let integral = if law.remembers() { next(-3.0, 11.0) } else { 0.0 };
                let at = |l: &Line| l.m * m + l.z * z + l.memory * integral + l.constant;
                let volts = answer(&u, m, z, integral);
                let after = remembered(&u, m, z, integral);
                let mut holding = 0;
                for piece in pieces.iter().filter(|p| p.within.iter().all(|l| at(l) <= 1e-9)) {
                    holding += 1;
                    let [low, high] = piece.volts;
                    assert!(
                        at(&low) <= volts + 1e-9 && volts <= at(&high) + 1e-9,
                        "{law:?} {m} {z}: {volts} is not in {} … {} of {}",
                        at(&low),
                        at(&high),
                        piece.id
                    );
                    let [low, high] = piece.next;
                    assert!(
                        at(&low) <= after && after <= at(&high),
                        "{law:?} {m} {z} {integral}: {after} is not in {} … {} of {}",
                        at(&low),
                        at(&high),
                        piece.id
                    );
                }
                assert!(holding > 0, "{law:?} {m} {z}");
            }
        }
    }
}
