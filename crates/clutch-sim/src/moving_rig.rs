//! A rig that moves on step by step: sensor out, voltage in, time on.
//!
//! [`crate::simulate`] steps it from sample to sample; the simulated board steps it by the real
//! clock, with voltages that change between samples.

use crate::engine::exact_flow::{Bed, Pushed};
use crate::engine::{
    Bristle, DormandPrince, Engine, EngineError, EngineKind, Event, Input, Motion, Shaft, Volts,
};
use crate::rig::Rig;
use clutch_core::friction::{Bend, ELEMENTS, FrictionModel};
use clutch_core::{Counts, FixedCounts};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use std::collections::VecDeque;

/// The whole number at or below `x`; saturates. Every tick waits for it, and `libm`'s floor, which gives a
/// double, takes three times as long without SSE4.1.
#[inline]
fn floor(x: f64) -> i64 {
    let towards_zero = x as i64;
    towards_zero.saturating_sub(i64::from(towards_zero as f64 > x))
}

/// The engine that moves it.
#[derive(Clone)]
enum Moves {
    /// The shaft as the exact flow takes it; none if that refuses the rig.
    Exactly(Option<Bed<f64>>),
    InSteps(DormandPrince),
    Bending(Bristle),
}

/// A rig in motion; a clone goes its own way.
#[derive(Clone)]
pub struct MovingRig {
    rig: Rig,
    engine: Moves,
    seed: u64,
    /// Periods that have begun.
    begun: u64,
    shaft: Shaft,
    /// Position at which the motion began, rad.
    origin: f64,
    time: f64,
    /// At the pad, V.
    volts: f64,
    /// On the way to the pad, V.
    arriving: f64,
    commanded: f64,
    /// Share of the voltage that presses.
    share: f64,
    line: VecDeque<f64>,
    noise: Pcg64,
    torque_noise: f64,
    events: Vec<Event>,
}

/// A shaft at a position and a velocity, with so much torque of the drive; bristles bend as in steady sliding, at rest as they
/// have to.
fn begin(rig: &Rig, (position, velocity): (f64, f64), drive: f64, volts: f64) -> Shaft {
    let mut shaft = Shaft::new(position, velocity);
    let plant = &rig.model.plant;
    if let Some(bristles) = plant.friction().bristles() {
        let torque = drive + plant.actuator().torque(volts);
        // The disc's friction there is a multiple of the mean.
        let normal = plant.actuator().normal(volts) * rig.model.friction_factor(position);
        shaft.bend = if velocity != 0.0 {
            bristles.steady(velocity)
        } else if normal > 0.0 {
            bristles.holding(torque / normal)
        } else {
            Bend::none()
        };
    }
    shaft
}

fn noise(seed: u64) -> Pcg64 {
    Pcg64::seed_from_u64(seed ^ 0x006e_6f69_7365)
}

impl MovingRig {
    /// A shaft at `position` (rad) and `velocity` (rad/s), with `volts` on the brake since long.
    ///
    /// `engine` must be one that takes the rig: see [`crate::RunSpec::engine`].
    #[must_use]
    pub fn new(
        rig: Rig,
        engine: EngineKind,
        seed: u64,
        (position, velocity): (f64, f64),
        volts: f64,
    ) -> Self {
        let delay = rig.params.delay_ticks as usize;
        MovingRig {
            engine: match engine {
                EngineKind::ExactFlow => {
                    Moves::Exactly(rig.refuses_exact_flow().is_none().then(|| Bed::of(&rig.model)).flatten())
                }
                EngineKind::DormandPrince | EngineKind::Auto => Moves::InSteps(DormandPrince::default()),
                EngineKind::Bristle => Moves::Bending(Bristle::default()),
            },
            seed,
            begun: 0,
            shaft: begin(&rig, (position, velocity), rig.drive.torque(0.0, 0.0), volts),
            rig,
            origin: position,
            time: 0.0,
            volts,
            arriving: volts,
            commanded: volts,
            share: 1.0,
            line: std::iter::repeat_n(volts, delay.saturating_sub(1)).collect(),
            noise: noise(seed),
            torque_noise: 0.0,
            events: Vec::new(),
        }
    }

    /// The same rig, moved by this engine from now on: a second opinion on the motion, at a tolerance of its own. Friction
    /// with bristles is not for it.
    #[must_use]
    pub fn by(self, engine: DormandPrince) -> Self {
        MovingRig { engine: Moves::InSteps(engine), ..self }
    }

    /// The rig.
    #[must_use]
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// The shaft now.
    #[must_use]
    pub fn shaft(&self) -> &Shaft {
        &self.shaft
    }

    /// Time since the start, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Reading of an encoder that floors to whole counts.
    #[must_use]
    pub fn counts(&self) -> Counts {
        let per_radian: f64 = self.rig.encoder.counts_per_radian();
        Counts(floor(self.shaft.position * per_radian) as i32)
    }

    /// Reading of an ideal sensor.
    #[must_use]
    pub fn fine_counts(&self) -> FixedCounts {
        FixedCounts::from_real(self.shaft.position * self.rig.encoder.counts_per_radian::<f64>())
    }

    /// A sampling period begins: a voltage comes out of the delay line, the torque noise gets its
    /// next value.
    pub fn begin_period(&mut self) {
        if self.rig.params.delay_ticks > 0 {
            self.line.push_back(self.commanded);
            self.arriving = self.line.pop_front().unwrap_or(self.commanded);
        }
        self.begun += 1;
        if self.rig.params.torque_noise > 0.0 {
            let x: f64 = StandardNormal.sample(&mut self.noise);
            self.torque_noise = self.rig.params.torque_noise * x;
        }
    }

    /// The converter gives this voltage from now on, V.
    pub fn command(&mut self, volts: f64) {
        self.commanded = volts;
        if self.rig.params.delay_ticks == 0 {
            self.arriving = volts;
        }
    }

    /// The pad presses from now on with this share of its force; at 0 it has no contact. For a brake that lets go at 0 V. No
    /// part of [`MovingRig::state`].
    pub fn press(&mut self, share: f64) {
        self.share = share;
    }

    /// The converter's board was reset: it gives this voltage, V, and nothing is on its way any more. It has no periods until
    /// it is configured, with which a delay would end.
    pub fn reset(&mut self, volts: f64) {
        self.commanded = volts;
        self.arriving = volts;
        self.line.iter_mut().for_each(|on_its_way| *on_its_way = volts);
    }

    /// Time passes, s; what happened in it.
    ///
    /// # Errors
    /// A motion that the engine cannot follow.
    pub fn advance(&mut self, duration: f64) -> Result<&[Event], EngineError> {
        self.events.clear();
        if duration > 0.0 {
            let volts = |share: f64| match self.rig.params.actuator_time_constant {
                None => Volts::Held(share * self.arriving),
                Some(time_constant) => {
                    Volts::Lag { from: share * self.volts, to: share * self.arriving, time_constant }
                }
            };
            let at_the_pad = volts(1.0).at(duration);
            let input = Input {
                time: self.time,
                duration,
                origin: self.origin,
                volts: volts(self.share),
                drive: &self.rig.drive,
                noise: self.torque_noise,
            };
            let (model, shaft, events) = (&self.rig.model, &mut self.shaft, &mut self.events);
            match &mut self.engine {
                // Torque and voltage are constant: no corner, no zero within the period.
                Moves::Exactly(Some(bed)) => {
                    let pushed = Pushed::by(model, &input);
                    bed.advance(&pushed, (input.time, duration), shaft, events, None)?;
                }
                Moves::Exactly(None) => {
                    let needs = self.rig.refuses_exact_flow().unwrap_or("a friction that it knows");
                    return Err(EngineError::Refused(needs));
                }
                Moves::InSteps(engine) => engine.advance(model, &input, shaft, events)?,
                Moves::Bending(engine) => engine.advance(model, &input, shaft, events)?,
            }
            self.volts = at_the_pad;
            self.time += duration;
        }
        Ok(&self.events)
    }

    /// Puts the shaft at a position (rad) and a velocity (rad/s), under these volts since long or under those that there
    /// are; all else goes on. Bristles bend as in steady sliding, at rest as they have to under the volts at the pad.
    pub fn place(&mut self, position: f64, velocity: f64, volts: Option<f64>) {
        if let Some(volts) = volts {
            self.reset(volts);
            (self.volts, self.arriving) = (volts, volts);
        }
        let drive = self.rig.drive.torque(self.time, position - self.origin);
        self.shaft = begin(&self.rig, (position, velocity), drive, self.volts);
        match &mut self.engine {
            Moves::Exactly(_) => {}
            Moves::InSteps(engine) => engine.begin_with([0.0; 2]),
            Moves::Bending(engine) => *engine = Bristle::default(),
        }
    }

    /// The state as bits, for [`MovingRig::restore`]; what follows from rig and seed is not in it.
    #[must_use]
    pub fn state(&self) -> Vec<u64> {
        let steps = match &self.engine {
            Moves::Exactly(_) => [0.0; 2],
            Moves::InSteps(engine) => engine.steps(),
            Moves::Bending(engine) => [engine.step(), 0.0],
        };
        let motion = match self.shaft.motion {
            Motion::Stuck => 0,
            Motion::Forward => 1,
            Motion::Backward => 2,
        };
        let numbers = [
            self.shaft.position,
            self.shaft.velocity,
            self.origin,
            self.time,
            self.volts,
            self.arriving,
            self.commanded,
            steps[0],
            steps[1],
        ];
        let Bend { each, slides } = self.shaft.bend;
        let slides = slides.iter().rev().fold(0, |bits, slides| 2 * bits + u64::from(*slides));
        let numbers = numbers.iter().chain(&each).chain(&self.line).map(|x| x.to_bits());
        [self.begun, motion, slides].into_iter().chain(numbers).collect()
    }

    /// Takes a state that a rig of the same parameters and seed had; false, and nothing is changed, if it is none.
    #[must_use]
    pub fn restore(&mut self, state: &[u64]) -> bool {
        let [begun, motion, slides, numbers @ ..] = state else { return false };
        let numbers: Vec<f64> = numbers.iter().map(|bits| f64::from_bits(*bits)).collect();
        let [position, velocity, origin, time, volts, arriving, commanded, step, from_rest, rest @ ..] =
            &numbers[..]
        else {
            return false;
        };
        let Some((each, line)) = rest.split_first_chunk::<ELEMENTS>() else { return false };
        let motion = match motion {
            0 => Motion::Stuck,
            1 => Motion::Forward,
            2 => Motion::Backward,
            _ => return false,
        };
        if *slides >= 1 << ELEMENTS || line.len() != self.line.len() || !numbers.iter().all(|x| x.is_finite())
        {
            return false;
        }
        let bend = Bend { each: *each, slides: std::array::from_fn(|i| slides >> i & 1 == 1) };
        self.shaft = Shaft { position: *position, velocity: *velocity, motion, bend };
        (self.origin, self.time) = (*origin, *time);
        (self.volts, self.arriving, self.commanded) = (*volts, *arriving, *commanded);
        self.line = line.iter().copied().collect();
        match &mut self.engine {
            Moves::Exactly(_) => {}
            Moves::InSteps(engine) => engine.begin_with([*step, *from_rest]),
            Moves::Bending(engine) => *engine = Bristle::with_step(*step),
        }
        // The numbers drawn so far are drawn again.
        (self.noise, self.torque_noise, self.begun) = (noise(self.seed), 0.0, *begun);
        if self.rig.params.torque_noise > 0.0 {
            for _ in 0..*begun {
                let x: f64 = StandardNormal.sample(&mut self.noise);
                self.torque_noise = self.rig.params.torque_noise * x;
            }
        }
        true
    }

    /// Sets the time anew, s: a sum of many periods drifts, a product does not.
    pub fn set_time(&mut self, time: f64) {
        self.time = time;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_floored_as_libm_floors() {
        let special =
            [0.0, -0.0, 0.5, -0.5, 1.0, -1.0, 1e300, -1e300, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE];
        let near = (-40_i32..40).flat_map(|n| {
            let x = f64::from(n) * 0.25;
            [x, f64::from_bits(x.to_bits() + 1), f64::from_bits(x.to_bits().saturating_sub(1))]
        });
        for x in special.into_iter().chain(near) {
            assert_eq!(floor(x), libm::floor(x) as i64, "{x:?}");
        }
    }
}
