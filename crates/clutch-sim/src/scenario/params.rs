//! The tables of a scenario: those of core, rig and run, and the few that are a scenario's own.

use crate::friction_map::FrictionMapParams;
use crate::rig::RigParams;
use crate::run::RunParams;
use crate::tables::Text;
use clutch_core::law::{LawParams, OutputParams, ShellParams};
use clutch_core::params::Range;
use clutch_core::reference::ReferenceParams;
use clutch_core::{
    Interval, LimitParams, PlantParams, SafeState, SamplingParams, Tolerances, VelocityParams, params,
};

clutch_core::words! {
    /// Scalar that the servo runs in.
    pub enum ScalarKind {
        /// Single precision, as on a board.
        F32 = "f32",
        /// Double precision.
        F64 = "f64" default,
    }
}

params! {
    /// Times at which the servo is asked, and the scalar that it computes in.
    #[derive(Copy)]
    pub struct ScenarioSampling<f64>: Default {
        /// Scalar that path and servo compute in; a board has `f32`. The shaft is always in `f64`.
        scalar: ScalarKind = "f64", "scalar" "" NONE, Range::ANY;
    }
    flat {
        /// The sampling period.
        sampling: SamplingParams;
    }
}

params! {
    /// Accuracy to which the believed plant is known, (23), and the reaching rate that the certificate shall give: for
    /// the certificate and the check of the path.
    #[derive(Copy)]
    pub struct ScenarioBounds<f64>: Default {
        /// Rate of reaching the sliding surface that the certificate shall give, in (15); above 0 the reaching time gets
        /// a bound.
        reach_rate: f64 = 0.0, "reach_rate_rad_s2" "γ" RAD_S2, Range::at_least(0.0);
        /// The part of `friction_percent` that changes along the disc and with time; the rest is a mean that is off by as
        /// much in ratio either way, (1 + friction)/(1 + ripple). Absent: all of it is the mean's, and the sampled certificate
        /// adds the ripple of the rig.
        ripple: Option<f64>, "ripple_percent" "" PERCENT, Range::at_least(0.0).below(100.0);
    }
    flat {
        /// Accuracy to which each parameter of the model is known.
        tolerances: Tolerances;
    }
    relations(p) {
        /// The ripple is a part of what friction may be off.
        PART: ripple, "at most friction_percent, of which it is a part" =>
            p.ripple.is_none_or(|share| share <= p.tolerances.friction);
    }
}

impl ScenarioBounds {
    /// Shares by which the mean of friction is known, below and above 1, and by which friction departs from it along the
    /// disc; `ripple` is the rig's, which counts where the bounds say nothing of one.
    #[must_use]
    pub fn friction_shares(&self, ripple: f64) -> ([f64; 2], f64) {
        let off = self.tolerances.friction;
        match self.ripple {
            Some(share) => {
                let most = (1.0 + off) / (1.0 + share);
                ([1.0 / most, most], share)
            }
            None => ([1.0 - off, 1.0 + off], ripple),
        }
    }

    /// The part of a bound on friction that is the mean's: all of it, where the bounds say nothing of a ripple.
    pub(crate) fn mean_of(&self, friction: &Interval) -> Interval {
        if self.ripple.is_none() {
            return *friction;
        }
        let ([low, high], _) = self.friction_shares(0.0);
        let off = self.tolerances.friction;
        Interval { low: friction.low / (1.0 - off) * low, high: friction.high / (1.0 + off) * high }
    }
}

params! {
    /// Limits that end a run on a board: those of the supervisor, and how long board and codes wait. docs/safety.md
    /// says why each default is what it is.
    #[derive(Copy)]
    pub struct ScenarioLimits<f64>: Default {
        /// Periods without a valid code after which the board goes to its safe state by itself; at most
        /// `silence_cycles`.
        watchdog_cycles: u32 = 3, "watchdog_cycles" "" CYCLES, Range::within(2.0, 100.0);
        /// Periods after its sample during which a code is valid; at most 65.535 ms.
        valid_cycles: u32 = 2, "valid_cycles" "" CYCLES, Range::within(1.0, 1000.0);
    }
    flat {
        /// Limits that the supervisor watches.
        supervisor: LimitParams;
    }
    relations(p) {
        /// The board keeps no code longer than its host believes.
        WATCHED: watchdog_cycles, "at most silence_cycles: no code stays on longer than a host without samples goes on" =>
            p.watchdog_cycles <= p.supervisor.silence_cycles;
    }
}

params! {
    /// The way a run on a board ends, and what ends it. Only what drives a board needs it; there is no default safe
    /// state.
    pub struct Safety<f64> {
        /// The reason that this safe state is the right one for this rig, in the operator's words; printed before each
        /// run.
        reason: Text, "reason" "" NONE, Range::ANY;
        /// Gains may be changed while a loop runs, from its live view.
        live_gains: bool = false, "live_gains" "" NONE, Range::ANY;
    }
    nested {
        /// Safe state: what the brake does when control has ended.
        on_fault: SafeState, "on_fault";
        /// Limits that end control.
        limits: ScenarioLimits, "limits";
    }
    relations(p) {
        /// A safe state is somebody's choice, who says why.
        REASONED: reason, "why this safe state is right for this rig, as \"a weight drives the shaft\"" =>
            !p.reason.0.trim().is_empty();
    }
}

params! {
    /// A scenario: rig, believed plant, law, path, sampling, bounds, run, safety.
    pub struct ScenarioParams<f64> {
        /// Title of the output, any text.
        name: Text, "name" "" NONE, Range::ANY;
    }
    nested {
        /// The shaft as it is.
        rig: RigParams, "rig";
        /// The shaft as law, observer and certificate believe it to be.
        model: PlantParams, "model";
        /// The law and its gains.
        law: LawParams, "law";
        /// Source of the velocity that the law is given.
        velocity: VelocityParams, "velocity";
        /// Limits of the voltage, bumpless start.
        output: OutputParams, "output";
        /// The shell around the law.
        shell: ShellParams, "shell";
        /// The path.
        reference: ReferenceParams<'static>, "reference";
        /// Sampling period, scalar.
        sampling: ScenarioSampling, "sampling";
        /// Accuracy to which the believed plant is known.
        bounds: ScenarioBounds, "bounds";
        /// Length, beginning, seed and engine.
        run: RunParams, "run";
    }
    optional {
        /// Friction along the disc, from an earlier ride.
        friction_map: FrictionMapParams, "friction_map";
        /// The way a run on a board ends, and what ends it: `clutch loop` and `clutch daq` need it.
        safety: Safety, "safety";
    }
}
