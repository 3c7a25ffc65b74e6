//! The map of a disc, as scenarios have it.

use crate::run::Trace;
use crate::tables::{Points, Text};
use clutch_core::params::Range;
use clutch_core::{Encoder, FrictionMap, ParamError, params};

/// Points of a map per turn: of waves that friction has along a disc, 340 a turn, each has fifteen.
const PER_TURN: f64 = 5000.0;
/// Points that a map may have: twenty turns.
const MOST: usize = 100_000;
/// Factors that a point may have.
const FACTORS: core::ops::RangeInclusive<f64> = 0.1..=10.0;

params! {
    /// Friction along the disc, as an earlier ride has shown it: `clutch identify --map` writes it. The law glide takes it
    /// where it shows to be right; other laws have no use for it.
    pub struct FrictionMapParams<f64> {
        /// Version of the table: a later one may mean something else.
        version: u32 = 1, "version" "" NONE, Range::within(1.0, 1.0);
        /// The rig, and the ride, that it is of: any text.
        rig: Text, "rig" "" NONE, Range::ANY;
        /// Points of angle, from the encoder's zero, and friction, over its mean; angles rise.
        points: Points, "points_deg_factor" "" DEG_FACTOR, Range::within(-36_000.0, 36_000.0);
    }
    relations(p) {
        /// A curve goes through the points.
        ENOUGH: points, "a list of 4 to 100 000 points" => (4..=MOST).contains(&p.points.0.len());
        /// A map is of one disc.
        NAMED: rig, "the rig and the ride that it is of, as \"disc 7, 2 °/s\"" => !p.rig.0.trim().is_empty();
        /// Friction stays friction.
        FACTORS: points, "factors of 0.1 to 10";
        /// No gap.
        CLOSE: points, "an angle less than 1 ° from the one before: the ripple of a disc has waves of about 1 °";
    }
}

/// A map on the grid that a servo reads.
#[derive(Clone, Debug, PartialEq)]
pub struct MapGrid {
    counts_per_rev: u32,
    first: i64,
    step: u32,
    factors: Vec<u16>,
}

impl MapGrid {
    /// Checks the points.
    ///
    /// # Errors
    /// The number of the point (from 0) that is wrong; fewer than four points of the grid between the first and the last.
    pub fn new(p: &FrictionMapParams, encoder: Encoder) -> Result<MapGrid, ParamError> {
        let points = &p.points.0;
        let end = points.len().saturating_sub(1) as f64;
        let (Some(first), Some(last), true) =
            (points.first(), points.last(), (4..=MOST).contains(&points.len()))
        else {
            return Err(FrictionMapParams::ENOUGH.error(end));
        };
        if let Some(i) = points.iter().position(|(_, factor)| !FACTORS.contains(factor)) {
            return Err(FrictionMapParams::FACTORS.error(i as f64));
        }
        if let Some(i) = points.windows(2).position(|w| w[1].0 - w[0].0 >= 1.0) {
            return Err(FrictionMapParams::CLOSE.error((i + 1) as f64));
        }
        let per_degree = f64::from(encoder.counts_per_rev()) / 360.0;
        let step = libm::rint(f64::from(encoder.counts_per_rev()) / PER_TURN);
        let step = step.clamp(1.0, f64::from(FrictionMap::WIDEST));
        // A point of a file that was written for this grid is not left out for a rounding.
        let near = 1e-6 * step;
        let (low, high) = (
            libm::ceil((first.0 * per_degree - near) / step) as i64,
            libm::floor((last.0 * per_degree + near) / step) as i64,
        );
        let mut at = 0;
        let factors: Vec<u16> = (low..=high)
            .map(|i| {
                let degrees = i as f64 * step / per_degree;
                while at + 2 < points.len() && points[at + 1].0 <= degrees {
                    at += 1;
                }
                let factor = f64::from(FrictionMap::ONE) * between(points, at, degrees);
                libm::rint(factor).clamp(0.0, f64::from(u16::MAX)) as u16
            })
            .collect();
        let grid = MapGrid {
            counts_per_rev: encoder.counts_per_rev(),
            first: low * step as i64,
            step: step as u32,
            factors,
        };
        let made = FrictionMap::new(grid.first, grid.step, &grid.factors);
        made.map_err(|_| FrictionMapParams::ENOUGH.error(end))?;
        Ok(grid)
    }

    /// `true` if it was made for an encoder.
    pub(crate) fn is_of(&self, encoder: Encoder) -> bool {
        self.counts_per_rev == encoder.counts_per_rev()
    }

    /// The map.
    #[must_use]
    pub fn map(&self) -> Option<FrictionMap<'_>> {
        FrictionMap::new(self.first, self.step, &self.factors).ok()
    }
}

/// The part that a map had in a run of glide.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct MapInRun {
    /// Share of the run that was within the map, until it was dropped.
    pub within: f64,
    /// Share of the run in which the filter with the map drove.
    pub drove: f64,
    /// Time at which the map was dropped as wrong, if it was, s.
    pub dropped_s: Option<f64>,
}

impl MapInRun {
    /// The part in a run of a scenario with a map; none where the law has no use for one.
    #[must_use]
    pub fn of(trace: &Trace) -> Option<MapInRun> {
        // Parts: 0 none, 1 tried, 2 drives, 3 wrong.
        let (_, part) = trace.terms.iter().find(|(name, _)| *name == "map")?;
        let share = |of: fn(f64) -> bool| {
            part.iter().filter(|&&part| of(part)).count() as f64 / part.len().max(1) as f64
        };
        let dropped = part.iter().position(|&part| part == 3.0).and_then(|at| trace.time.get(at).copied());
        let (within, drove) = (share(|part| part == 1.0 || part == 2.0), share(|part| part == 2.0));
        Some(MapInRun { within, drove, dropped_s: dropped })
    }
}

/// The factor at an angle, of the interval that begins at a point: a cubic with the slopes of the chords around its ends.
fn between(points: &[(f64, f64)], at: usize, degrees: f64) -> f64 {
    let (a, b) = (points[at], points[at + 1]);
    let width = b.0 - a.0;
    let slope = |i: usize| {
        let (before, after) = (points[i.saturating_sub(1)], points[(i + 1).min(points.len() - 1)]);
        (after.1 - before.1) / (after.0 - before.0)
    };
    let u = (degrees - a.0) / width;
    let (m0, m1) = (width * slope(at), width * slope(at + 1));
    let left = 1.0 - u;
    left * left * ((1.0 + 2.0 * u) * a.1 + u * m0) + u * u * ((3.0 - 2.0 * u) * b.1 - left * m1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scenario;
    use clutch_core::{FixedCounts, Place};

    fn map(points: Vec<(f64, f64)>) -> FrictionMapParams {
        FrictionMapParams { version: 1, rig: Text("a test".to_owned()), points: Points(points) }
    }

    #[test]
    fn a_map_of_a_later_version_is_refused_and_one_without_is_of_the_first() {
        let parsed = |head: &str| {
            let points: Vec<_> = (0..30).map(|i| format!("[{}, 1.0]", 0.072 * f64::from(i))).collect();
            let map = format!(
                "[friction_map]\n{head}rig = \"a test\"\npoints_deg_factor = [{}]",
                points.join(", ")
            );
            let law = "[law.glide]\n[reference.ramp]\nrate_deg_s = 2.0";
            let text = format!("name = \"map\"\n[rig]\nbase = \"bench\"\n{law}\n{map}\n");
            Scenario::parse("a file", &text, &[])
        };
        assert_eq!(parsed("").unwrap().table(), parsed("version = 1\n").unwrap().table());
        for later in ["version = 2\n", "version = 2\nwaves = 340\n"] {
            let error = parsed(later).unwrap_err().to_string();
            assert_eq!(error, "a file: friction_map.version = 2: expected a whole number from 1 to 1");
        }
        let unknown = parsed("waves = 340\n").unwrap_err().to_string();
        assert!(unknown.contains("friction_map.waves = 340: unknown key"), "{unknown}");
    }

    #[test]
    fn points_on_the_grid_stay_what_they_are() {
        // 4 counts of 20 000 are 0.072 °.
        let points: Vec<_> =
            (-3..30).map(|i| (0.072 * f64::from(i), 1.0 + 0.01 * f64::from(i % 5))).collect();
        let grid = MapGrid::new(&map(points), Encoder::PAPER).unwrap();
        assert_eq!((grid.first, grid.step, grid.factors.len()), (-12, 4, 33));
        let place: Place<f64> = grid.map().unwrap().at(FixedCounts::from_counts(4 * 4));
        assert!((place.friction(0.0) - 1.04).abs() < 2e-4, "{place:?}");
    }

    #[test]
    fn points_that_make_no_curve_are_refused_by_number() {
        let refused = |points: Vec<(f64, f64)>| {
            let error = MapGrid::new(&map(points), Encoder::PAPER).unwrap_err();
            (error.to_string(), error.value)
        };
        let even = |n: u32| (0..n).map(|i| (0.1 * f64::from(i), 1.0)).collect::<Vec<_>>();
        assert!(refused(even(3)).0.contains("4 to 100 000 points"));
        assert!(refused(even(0)).0.contains("4 to 100 000 points"));
        let mut points = even(20);
        points[7].1 = 0.05;
        assert_eq!(refused(points.clone()).1, 7.0);
        points[7].1 = 1.0;
        points[12..].iter_mut().for_each(|p| p.0 += 1.0);
        assert_eq!(refused(points).1, 12.0);
        // Within a single point of the grid.
        let (error, _) = refused((0..9).map(|i| (1e-4 * f64::from(i), 1.0)).collect());
        assert!(error.contains("points"), "{error}");
    }

    #[test]
    fn other_points_are_joined_by_a_curve() {
        let wave = |degrees: f64| 1.0 + 0.1 * libm::sin(5.0 * degrees);
        let points: Vec<_> =
            (0..400).map(|i| 0.05 * f64::from(i) + 0.02 * f64::from(i % 2)).map(|x| (x, wave(x))).collect();
        for counts in [2_000, 20_000, 200_000] {
            let encoder = Encoder::new::<f64>(counts).unwrap();
            let grid = MapGrid::new(&map(points.clone()), encoder).unwrap();
            for i in 2..grid.factors.len() - 2 {
                let degrees =
                    (grid.first + i as i64 * i64::from(grid.step)) as f64 * 360.0 / f64::from(counts);
                let error = f64::from(grid.factors[i]) / 4096.0 - wave(degrees);
                assert!(error.abs() < 1e-3, "{error} at {degrees} of {counts}");
            }
        }
    }
}
