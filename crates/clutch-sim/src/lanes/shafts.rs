//! Shafts in the lanes of one vector.

use super::alike::{Alike, Begin};
use super::in_steps::InSteps;
use super::push::Push;
use crate::engine::exact_flow::{Bed, Whole};
use crate::engine::{EngineKind, Event, Shaft};
use crate::lane::Lane;
use crate::metrics::Sticks;
use clutch_core::Plant;
use std::collections::VecDeque;

/// Engine that moves the shafts of a vector.
pub(super) enum Moves<V: Lane> {
    Exactly {
        bed: Bed<V>,
        /// Of a whole period.
        whole: Whole<V>,
        /// Lane by lane.
        alone: Vec<Bed<f64>>,
    },
    InSteps(InSteps<V>),
}

/// Shafts in the lanes of one vector.
pub(super) struct Shafts<V: Lane> {
    // Kept from period to period.
    pub(super) plant: Plant<V>,
    pub(super) push: Push<V>,
    pub(super) drive: V,
    // Changed by each.
    pub(super) moves: Moves<V>,
    pub(super) position: V,
    pub(super) velocity: V,
    /// Way in which the shaft moves: 1, −1, or 0 while it is stuck.
    pub(super) sign: V,
    /// Voltages on their way to the actuator.
    line: VecDeque<V>,
    pub(super) arriving: V,
    /// Lanes that lanes cannot do.
    pub(super) lost: u64,
    /// Lane by lane.
    pub(super) sticks: Vec<Sticks>,
}

impl<V: Lane> Shafts<V> {
    /// At most as many rigs as there are lanes, as they begin.
    pub(super) fn of(rigs: &[Begin<'_>], alike: &Alike, sticks: &Sticks) -> Option<Self> {
        // Lanes that are left over begin as the last one, and are lost from there.
        let at = |i: usize| rigs[i.min(rigs.len() - 1)];
        let rig = |i: usize| at(i).0.rig();
        let of = |get: &dyn Fn(Begin<'_>) -> f64| V::of(|i| get(at(i)));
        let volts = of(&|(_, volts)| volts);
        let moves = if alike.engine == EngineKind::ExactFlow {
            let alone: Vec<Bed<f64>> =
                (0..V::WIDTH).map(|i| Bed::of(&rig(i).model)).collect::<Option<_>>()?;
            let bed = Bed::in_lanes(&alone);
            Moves::Exactly { whole: bed.whole(V::splat(alike.period)), bed, alone }
        } else {
            Moves::InSteps(InSteps::of(&(0..V::WIDTH).map(at).collect::<Vec<_>>()))
        };
        let plant = Plant::in_lanes(&|get| V::of(|i| get(&rig(i).model.plant)))?;
        Some(Shafts {
            push: Push::of(&plant),
            plant,
            drive: of(&|(moving, _)| moving.rig().drive.torque(0.0, 0.0) + 0.0),
            moves,
            position: of(&|(moving, _)| moving.shaft().position),
            velocity: of(&|(moving, _)| moving.shaft().velocity),
            sign: of(&|(moving, _)| moving.shaft().motion.sign()),
            line: vec![volts; alike.delay].into(),
            arriving: volts,
            lost: u64::MAX.unbounded_shl(rigs.len() as u32),
            sticks: vec![sticks.clone(); V::WIDTH],
        })
    }

    pub(super) fn begin_anew(&mut self, lane: usize, (moving, volts): Begin<'_>, sticks: &Sticks) {
        let shaft = moving.shaft();
        self.position.put(lane, shaft.position);
        self.velocity.put(lane, shaft.velocity);
        self.sign.put(lane, shaft.motion.sign());
        self.line.iter_mut().for_each(|on_its_way| on_its_way.put(lane, volts));
        self.arriving.put(lane, volts);
        self.lost &= !(1 << lane);
        self.sticks[lane] = sticks.clone();
        if let Moves::InSteps(steps) = &mut self.moves {
            steps.begin_anew(lane, (moving, volts));
        }
    }

    /// The converters give these voltages from now on, V.
    #[inline(always)]
    pub(super) fn command(&mut self, volts: V) {
        self.arriving = match self.line.pop_front() {
            None => volts,
            // The voltage that was commanded as many ticks ago as the line is long.
            Some(arrives) => {
                self.line.push_back(volts);
                arrives
            }
        };
    }

    /// A lane has come to the end of the period alone, or has not; what happened in it.
    pub(super) fn ended(
        &mut self,
        lane: usize,
        shaft: Option<&Shaft>,
        time: f64,
        stuck: bool,
        events: &[Event],
    ) {
        let Some(shaft) = shaft else {
            self.lost |= 1 << lane;
            return;
        };
        self.sticks[lane].period(time, stuck, events);
        self.position.put(lane, shaft.position);
        self.velocity.put(lane, shaft.velocity);
        self.sign.put(lane, shaft.motion.sign());
    }

    /// Steps that move it, if it is moved in steps.
    #[inline(always)]
    pub(super) fn steps(&self) -> Option<&InSteps<V>> {
        match &self.moves {
            Moves::Exactly { .. } => None,
            Moves::InSteps(steps) => Some(steps),
        }
    }

    /// As [`Shafts::steps`].
    #[inline(always)]
    pub(super) fn steps_mut(&mut self) -> Option<&mut InSteps<V>> {
        match &mut self.moves {
            Moves::Exactly { .. } => None,
            Moves::InSteps(steps) => Some(steps),
        }
    }
}
