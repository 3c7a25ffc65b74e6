//! Pieces of a law, and whether they leave anything out.

use super::interval::{Interval, at};
use super::shaft::{MEMORY_ROUNDING, SURFACE_ROUNDING, Shaft};
use crate::setup::{Cell, Gains, Setup, Strip};

/// `m`·[0] + `z`·[1] + [2] + `I`·[3], of the measured error and the filter's memory in counts, and the integral in volts.
pub(crate) type Linear = [Interval; 4];

/// A piece.
pub(crate) struct Piece {
    pub(crate) id: u32,
    /// Each is at most 0 in the piece.
    pub(crate) within: Vec<Linear>,
    /// The voltage that goes out is at least the first and at most the second.
    pub(crate) volts: [Linear; 2],
    /// The next integral is at least the first and at most the second; none of a law without.
    pub(crate) next: Option<[Linear; 2]>,
}

fn fixed(x: Interval) -> Linear {
    [at(0.0), at(0.0), x, at(0.0)]
}

fn sum(a: &Linear, factor: Interval, b: &Linear) -> Linear {
    std::array::from_fn(|k| a[k] + factor * b[k])
}

/// The law's pieces, in the order of their numbers.
pub(crate) fn pieces(setup: &Setup, cell: &Cell, shaft: &Shaft) -> Result<Vec<Piece>, String> {
    let [low, high] = shaft.ends(setup.volts);
    let per = shaft.kappa * shaft.speed;
    let rate = [per, -per, at(0.0), at(0.0)];
    let error = [shaft.count, at(0.0), at(0.0), at(0.0)];
    let off = shaft.volts_off;
    let let_go = [fixed((low - off).positive()), fixed(low + off)];
    match setup.law {
        Gains::Linear { kp, kd, forward } => {
            if !cell.strips.is_empty() {
                return Err("a linear law has none".into());
            }
            let demand = sum(&sum(&fixed(shaft.counted(forward)), at(-kp), &error), at(-kd), &rate);
            Ok(limited(&demand, [low, high], off))
        }
        Gains::Integral { kp, ki, kd, forward, tracking, limits } => {
            if !cell.strips.is_empty() {
                return Err("a law with an integral has none".into());
            }
            let forward = shaft.counted(forward);
            let kept = [at(0.0), at(0.0), at(0.0), at(1.0)];
            let integral = sum(&kept, -(at(ki) * at(setup.period_s)), &error);
            let demand =
                sum(&sum(&sum(&fixed(forward), at(1.0), &integral), at(-kp), &error), at(-kd), &rate);
            let follows = at(setup.period_s) / at(tracking);
            let limits = shaft.ends(limits);
            let ends = limits.map(|limit| limit - forward);
            // A limit of the law may lie beyond the converter's end.
            let apart = (limits[0] - low).abs().max((limits[1] - high).abs());
            let rounding = fixed((at(MEMORY_ROUNDING) + follows * apart).most());
            Ok(remembering(
                limited(&demand, [low, high], off),
                |id| {
                    let limit = match id {
                        0 => low,
                        1 => return integral,
                        _ => high,
                    };
                    let cut_off = sum(&fixed(limit), at(-1.0), &demand);
                    sum(&integral, follows, &cut_off)
                },
                ends,
                &rounding,
            ))
        }
        Gains::Shell { slope, boundary } => {
            if !cell.strips.is_empty() {
                return Err("a shell has none".into());
            }
            let sigma = sum(&rate, at(slope), &error);
            let minus = sum(&fixed(at(0.0)), at(-1.0), &sigma);
            // Either piece holds where the law's σ is rounded to the other side of an edge.
            let (least, most) =
                (fixed(at(boundary) - at(SURFACE_ROUNDING)), fixed(at(boundary) + at(SURFACE_ROUNDING)));
            let full = [fixed((high - off).positive()), fixed(high + off)];
            let any = [let_go[0], full[1]];
            Ok(vec![
                Piece { id: 0, within: vec![sum(&least, at(1.0), &minus)], volts: let_go, next: None },
                Piece {
                    id: 1,
                    within: vec![sum(&sigma, at(-1.0), &most), sum(&minus, at(-1.0), &most)],
                    volts: any,
                    next: None,
                },
                Piece { id: 2, within: vec![sum(&least, at(1.0), &sigma)], volts: full, next: None },
            ])
        }
        Gains::Layer { kp, kd, slope, boundary } => {
            complete(&cell.strips)?;
            let law = [kp, kd, boundary].map(at);
            let sigma = sum(&rate, at(slope), &error);
            let mut out = vec![Piece {
                id: 0,
                within: vec![sum(&fixed(at(0.0)), at(-1.0), &sigma)],
                volts: let_go,
                next: None,
            }];
            for (k, strip) in cell.strips.iter().enumerate() {
                holds(&law, [low, high], strip).map_err(|what| format!("[{k}]: {what}"))?;
                let number = u32::try_from(k + 1).map_err(|_| "too many".to_owned())?;
                out.push(piece(number, strip, &sigma, &rate, off));
            }
            Ok(out)
        }
    }
}

fn piece(id: u32, strip: &Strip, sigma: &Linear, rate: &Linear, off: Interval) -> Piece {
    // |σ| = −σ ahead of the surface, |ė| = ė or −ė.
    let surface = sum(&fixed(at(0.0)), at(-1.0), sigma);
    let speed = sum(&fixed(at(0.0)), at(if strip.leads { -1.0 } else { 1.0 }), rate);
    let from = |x: &Linear, least: f64| sum(&fixed(at(least)), at(-1.0), x);
    let to = |x: &Linear, most: f64| sum(x, at(-1.0), &fixed(at(most)));
    let mut within = vec![from(&surface, strip.surface_from), from(&speed, strip.rate_from)];
    within.extend(strip.surface_to.map(|most| to(&surface, most)));
    within.extend(strip.rate_to.map(|most| to(&speed, most)));
    let line = |[per, constant]: [f64; 2], off: Interval| sum(&fixed(at(constant) + off), at(per), &surface);
    Piece { id, within, volts: [line(strip.least, -off), line(strip.most, off)], next: None }
}

/// The part of a demand that the output's ends leave.
fn limited(demand: &Linear, [low, high]: [Interval; 2], off: Interval) -> Vec<Piece> {
    let below = |limit: Interval| sum(demand, at(-1.0), &fixed(limit));
    let above = |limit: Interval| sum(&fixed(limit), at(-1.0), demand);
    let end = |limit: Interval| [fixed((limit - off).positive()), fixed(limit + off)];
    let as_asked = [sum(demand, at(-1.0), &fixed(off)), sum(demand, at(1.0), &fixed(off))];
    vec![
        Piece { id: 0, within: vec![below(low)], volts: end(low), next: None },
        Piece { id: 1, within: vec![above(low), below(high)], volts: as_asked, next: None },
        Piece { id: 2, within: vec![above(high)], volts: end(high), next: None },
    ]
}

/// Each piece with what its integral becomes: as it is computed, or held at one of its ends.
fn remembering(
    pieces: Vec<Piece>,
    computed: impl Fn(u32) -> Linear,
    [lowest, highest]: [Interval; 2],
    rounding: &Linear,
) -> Vec<Piece> {
    let about = |x: &Linear| Some([sum(x, at(-1.0), rounding), sum(x, at(1.0), rounding)]);
    let mut out = Vec::new();
    for piece in pieces {
        let next = computed(piece.id);
        let too_low = sum(&next, at(-1.0), &fixed(lowest));
        let too_high = sum(&fixed(highest), at(-1.0), &next);
        let no_less = sum(&fixed(lowest), at(-1.0), &next);
        let no_more = sum(&next, at(-1.0), &fixed(highest));
        for (more, becomes, after) in [
            (vec![no_less, no_more], next, 0),
            (vec![too_low], fixed(lowest), 3),
            (vec![too_high], fixed(highest), 6),
        ] {
            let within = piece.within.iter().copied().chain(more).collect();
            out.push(Piece { id: piece.id + after, within, volts: piece.volts, next: about(&becomes) });
        }
    }
    out
}

/// The strips hold every `|σ|` and `|ė|`, on both sides.
fn complete(strips: &[Strip]) -> Result<(), String> {
    for leads in [true, false] {
        let mut rate = 0.0;
        loop {
            let column: Vec<&Strip> =
                strips.iter().filter(|s| s.leads == leads && s.rate_from <= rate).collect();
            // Strips that begin here or earlier, and reach beyond.
            let column: Vec<&&Strip> =
                column.iter().filter(|s| s.rate_to.is_none_or(|to| to > rate)).collect();
            let mut surface = 0.0;
            let mut end = f64::INFINITY;
            while surface < f64::INFINITY {
                let beyond =
                    |s: &&&&Strip| s.surface_from <= surface && s.surface_to.is_none_or(|to| to > surface);
                let Some(strip) = column.iter().find(beyond) else {
                    return Err(format!("none holds |σ| {surface} and |ė| {rate} rad/s, ė ≤ 0: {leads}"));
                };
                end = end.min(strip.rate_to.unwrap_or(f64::INFINITY));
                surface = strip.surface_to.unwrap_or(f64::INFINITY);
            }
            if end == f64::INFINITY {
                break;
            }
            rate = end;
        }
    }
    Ok(())
}

/// The lines of a strip lie below and above the demand within the limits.
///
/// Ahead of the surface (31) is, for `S = |σ|` and `D = |ė|`, the least of four straight lines in `S`, the limit is a fifth, and it
/// grows with `D`.
fn holds(law: &[Interval; 3], [low, high]: [Interval; 2], strip: &Strip) -> Result<(), String> {
    let numbers =
        [strip.rate_from, strip.surface_from, strip.least[0], strip.least[1], strip.most[0], strip.most[1]];
    let ends = [strip.rate_to, strip.surface_to];
    if numbers.iter().chain(ends.iter().flatten()).any(|x| !x.is_finite())
        || strip.rate_from < 0.0
        || strip.surface_from < 0.0
    {
        return Err("expected finite numbers, and ranges from at least 0".into());
    }
    let [kp, kd, boundary] = *law;
    // (slope, constant) of the demand's lines at a |ė|.
    let lines = |d: Interval| {
        let damping = kd * d * d / boundary;
        [
            (kp / boundary + damping, at(0.0)),
            (damping, kp),
            (kp / boundary, kd * d),
            (at(0.0), kp + kd * d),
            (at(0.0), high),
        ]
    };
    // A line minus another, at both ends of the strip: never above 0.
    let below = |(a, b): (Interval, Interval), (c, d): (Interval, Interval)| {
        let off = |s: f64| (a - c) * at(s) + (b - d);
        let at_end = match strip.surface_to {
            Some(to) => off(to).high <= 0.0,
            None => (a - c).high <= 0.0 || (a.low == c.low && a.high == c.high && a.low == a.high),
        };
        off(strip.surface_from).high <= 0.0 && at_end
    };
    let least = (at(strip.least[0]), at(strip.least[1]));
    let most = (at(strip.most[0]), at(strip.most[1]));
    let floor = (at(0.0), low);
    if !below(least, floor) && !lines(at(strip.rate_from)).into_iter().all(|line| below(least, line)) {
        return Err("the lower line is above the demand".into());
    }
    let over = match strip.rate_to {
        Some(to) => lines(at(to)).into_iter().any(|line| below(line, most)),
        None => below((at(0.0), high), most),
    };
    if !over || !below(floor, most) {
        return Err("the upper line is below the demand".into());
    }
    Ok(())
}
