//! The path of a run, with the points of a table kept elsewhere.

use super::points::MAX_KNOTS;
use clutch_core::reference::{self, Interpolation, Knot, Reference, ReferenceParams, Steepness, Table};
use clutch_core::{Encoder, FixedCounts, Micros, ParamError, Target};

/// A path, without the points of a table.
#[derive(Clone, Copy, Debug)]
pub struct Path {
    kind: Kind,
    encoder: Encoder,
    period: Micros,
    start: FixedCounts,
    /// Whole counts at the start: a path is given from there on.
    first: FixedCounts,
}

#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is one of it")]
enum Kind {
    Formula(Reference<'static, f32>),
    Table(Interpolation, usize),
}

impl Path {
    /// The path of these parameters; `knots` are the points of a table.
    pub(super) fn new(
        p: &ReferenceParams<'static, f32>,
        knots: &[Knot],
        start: FixedCounts,
        encoder: Encoder,
        period: Micros,
    ) -> Result<Path, ParamError<f32>> {
        let kind = match p {
            ReferenceParams::Table(Table { interpolation, .. }) => {
                let table = ReferenceParams::Table(Table { knots, interpolation: *interpolation });
                Reference::<f32>::new(&table, start, encoder, period)?;
                Kind::Table(*interpolation, knots.len())
            }
            formula => Kind::Formula(Reference::new(formula, start, encoder, period)?),
        };
        let path = Path { kind, encoder, period, start, first: FixedCounts(0) };
        // At its begin a table is at its first point, whenever that comes.
        let position = knots.first().map_or(FixedCounts(0), |knot| knot.position);
        let first = path.since_first(0, knots, |_| Target { position, ..Target::default() });
        let first = first.position.0 >> FixedCounts::FRACTION_BITS;
        Ok(Path { first: FixedCounts::from_counts(first), ..path })
    }

    /// The target of the shaft at a tick, from the count on which the run begins; `knots` are the
    /// points of a table, and may have more behind them.
    #[must_use]
    #[inline] // into its user, which is compiled for speed
    pub fn target(&self, knots: &[Knot], tick: u64) -> Target<f32> {
        self.since_first(tick, knots, |table| table.at(tick, self.encoder, self.period))
    }

    /// The same, with what [`Path::prepare`] has computed of a table.
    #[must_use]
    #[inline] // as the one above
    pub fn target_with(&self, knots: &[Knot], prepared: &Prepared, tick: u64) -> Target<f32> {
        self.since_first(tick, knots, |table| {
            let prepared = reference::Prepared { steepness: &prepared.steepness, slopes: &prepared.slopes };
            table.at_with(prepared, tick, self.encoder, self.period)
        })
    }

    /// Computes what the targets of a table have of each point, so that no period does.
    #[inline(never)]
    pub fn prepare(&self, knots: &[Knot], prepared: &mut Prepared) {
        if let Kind::Table(interpolation, points) = self.kind {
            let table = Table { knots: knots.get(..points).unwrap_or(&[]), interpolation };
            // Two loops: the numbers of two lists side by side are not seen to end, and could overflow.
            for (point, of) in prepared.steepness.iter_mut().enumerate().take(points) {
                *of = table.steepness(point);
            }
            for (point, of) in prepared.slopes.iter_mut().enumerate().take(points) {
                *of = table.slope(point);
            }
        }
    }

    #[inline]
    fn since_first(&self, tick: u64, knots: &[Knot], on: impl Fn(&Table<'_>) -> Target<f32>) -> Target<f32> {
        let target = match &self.kind {
            Kind::Formula(reference) => reference.at(tick),
            Kind::Table(interpolation, points) => {
                let knots = knots.get(..*points).unwrap_or(&[]);
                let target = on(&Table { knots, interpolation: *interpolation });
                Target { position: target.position.plus(self.start), ..target }
            }
        };
        Target { position: FixedCounts(target.position.0.wrapping_sub(self.first.0)), ..target }
    }
}

/// Share of each point in the targets of a table.
#[derive(Clone, Debug)]
pub struct Prepared {
    steepness: [Steepness; MAX_KNOTS],
    slopes: [f32; MAX_KNOTS],
}

impl Default for Prepared {
    /// Of no table.
    #[inline] // in place: a copy of it would be on the stack of who keeps it
    fn default() -> Self {
        Prepared { steepness: [Steepness::default(); MAX_KNOTS], slopes: [0.0; MAX_KNOTS] }
    }
}
