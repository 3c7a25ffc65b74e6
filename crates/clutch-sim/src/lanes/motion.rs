//! Motion of shafts in lanes through one period, under voltages that whoever drives them gives.

use super::alike::{Alike, Begin};
use super::in_steps::OnTheWay;
use super::layer::{Layer, Period};
use super::shafts::{Moves, Shafts};
use super::steps::{Gathered, step_by_step};
use crate::engine::Event;
use crate::engine::exact_flow::HIGHEST_EDGE;
use crate::lane::{Lane, each};
use crate::metrics::Sticks;

/// Shafts of a block, and their motions on the way through a period.
pub(super) struct Motions<V: Lane> {
    alike: Alike,
    /// Vector by vector.
    pub(super) shafts: Vec<Shafts<V>>,
    layer: Layer<V>,
    steps: Vec<OnTheWay>,
    gathered: Option<Gathered<V>>,
    events: Vec<Event>,
}

impl<V: Lane> Motions<V> {
    /// Rigs as they begin, of which `alike` tells; none if they have no lanes together. `sticks` counts from here.
    pub(super) fn of(rigs: &[Begin<'_>], alike: &Alike, sticks: &Sticks) -> Option<Self> {
        let shafts = rigs.chunks(V::WIDTH).map(|some| Shafts::of(some, alike, sticks));
        let shafts = shafts.collect::<Option<Vec<_>>>()?;
        let gathered = Gathered::of(&shafts);
        let alike = *alike;
        let layer = Layer::of(shafts.len());
        Some(Motions { alike, shafts, layer, steps: Vec::new(), gathered, events: Vec::new() })
    }

    /// The period of a vector begins at `time`, s: its shafts move, but for motions that wait for [`Motions::end`].
    #[inline(always)]
    pub(super) fn begin(&mut self, n: usize, time: f64) {
        let Motions { alike, shafts, layer, steps, .. } = self;
        // In a function of its own, with all that it calls: runs and fleets share it.
        V::apart(
            #[inline(always)]
            || shafts[n].advance(n, time, alike, layer, steps),
        );
    }

    /// The period that all vectors have begun at `time` ends.
    #[inline(always)]
    pub(super) fn end(&mut self, time: f64) {
        let Motions { alike, shafts, layer, steps, gathered, events } = self;
        if layer.is_empty() && steps.is_empty() {
            return;
        }
        V::apart(
            #[inline(always)]
            || {
                layer.end(shafts, time, alike, events);
                if let Some(gathered) = gathered {
                    step_by_step(shafts, gathered, steps, time, alike, events);
                }
            },
        );
    }

    /// A lane of a vector begins anew, with a rig of the same scenario.
    pub(super) fn begin_anew(&mut self, n: usize, lane: usize, rig: Begin<'_>, sticks: &Sticks) {
        self.shafts[n].begin_anew(lane, rig, sticks);
        if let Some(gathered) = &mut self.gathered {
            gathered.begun_anew(&self.shafts[n], n, lane);
        }
    }
}

impl<V: Lane> Shafts<V> {
    /// The period passes. Motions in the layer, those that begin or end, and those that go in steps wait.
    #[inline(always)]
    fn advance(
        &mut self,
        n: usize,
        time: f64,
        alike: &Alike,
        layer: &mut Layer<V>,
        steps: &mut Vec<OnTheWay>,
    ) {
        let Moves::Exactly { bed, whole, .. } = &self.moves else {
            self.begin_steps(n, time, alike, steps);
            return;
        };
        let pushed = self.push.at(self.arriving, self.drive, &self.plant);
        let rests = V::same(self.sign, V::ZERO);
        let (mut sign, mut breaks_away) = (self.sign, V::none());
        let mut stuck = 0;
        if V::any(rests) {
            breaks_away = rests & pushed.holds.less(pushed.torque.abs());
            stuck = V::bits(rests & !breaks_away);
            each(stuck & !self.lost, |i| self.sticks[i].period(time, true, &[]));
            sign = V::select(breaks_away, pushed.torque.sgn(), sign);
        }
        let rest = V::splat(alike.period);
        let speed = bed.speed(sign * self.velocity);
        let flow = bed.flow(&pushed, sign, rest);
        // Most stay outside of the layer.
        let (far, after, along) = flow.stays_outside(speed, rest, whole);
        let done = far & !rests & (after + along).is_finite();
        let way = sign * bed.velocity();
        self.position = V::select(done, self.position + way * along, self.position);
        self.velocity = V::select(done, way * after, self.velocity);
        if !V::all(done) {
            let waits = !(V::bits(done) | stuck | self.lost) & !u64::MAX.unbounded_shl(V::WIDTH as u32);
            // Motions that no exponential here has room for.
            self.lost |= waits & V::bits(!flow.edge.less(V::splat(HIGHEST_EDGE)));
            let period = Period { pushed, sign, way, breaks_away: V::bits(breaks_away) };
            layer.wait(n, (period, &flow), waits & !self.lost, speed);
        }
    }
}
