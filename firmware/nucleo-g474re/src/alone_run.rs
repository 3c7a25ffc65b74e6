//! SMC at 2 °/s on a NUCLEO-G474RE: in SI units and radians.
//!
//! certified_continuous_time: true.
//!
//! as_sampled: the bound of the error is uncertified: no certificate was given.
//!
//! linear_stability: linearly stable: spectral radius 0.948, 0.948, 0.948 with the weakest, a middle and the strongest brake, while nothing saturates or sticks.
//!
//! sticks: not excluded, neither by a bound nor by stability.
//!
//! Written by `clutch scenario rust`, 0.1.0+46cb33152cc7.
#![allow(unused_imports, reason = "each run has other choices")]

use clutch_core::edge_timed::*;
use clutch_core::law::*;
use clutch_core::reference::*;
use clutch_core::*;
use clutch_node::{Alone, AloneMisfit, AloneRun, BoardParams};

/// Law and kind of path.
pub type OfRun = Alone<Smc<f32>, Ramp<f32>>;

/// The controller at power-up of a board.
///
/// # Errors
/// The board is another than the scenario's; after a change by hand a number out of range, too.
pub fn controller(board: &BoardParams) -> Result<OfRun, AloneMisfit> {
    use {ActuatorParams::*, FrictionParams::*, LawParams::*, VelocityParams::*};
    let law = SmcParams {
        kp: 3.0,
        kd: 400.0,
        slope: 70.0,
        boundary: 0.1,
    };
    let servo = ServoParams {
        period: Micros(1000),
        encoder: Encoder::new(20000).map_err(AloneMisfit::Run)?,
        dac: DacParams {
            bits: 12,
            lowest: 0.0,
            highest: 10.0,
        },
        velocity: SmoothedDerivative(SmoothedDerivativeParams {
            smoothing: 0.2,
        }),
        model: PlantParams {
            inertia: 0.0017,
            drive_torque: 0.047088,
            viscous_damping: 0.001,
            actuator: Brake(BrakeActuator {
                gain: 0.14,
                preload: 0.0,
            }),
            friction: Stribeck(StribeckParams {
                mu_static: 0.2,
                mu_dynamic: 0.15,
                stribeck_velocity: 0.001,
                stribeck_exponent: 1.0,
            }),
        },
        law: Smc(law),
        output: OutputParams {
            lowest: 0.0,
            highest: 10.0,
            on_invalid: 10.0,
            bumpless_time: 0.0,
        },
        shell: ShellParams {
            slope: 100.0,
            boundary: 0.0,
        },
    };
    let supervisor = {
        use SafeState::*;
        SupervisorParams {
            on_fault: Hold(SafeHold {
                volts: 4.5,
            }),
            speed: SpeedLimit {
                speed_limit: 6.2831855,
            },
            limits: LimitParams {
                jump: 0.0026179939,
                jumps: 3,
                good_samples: 1,
                following_error: 0.017453292,
                following_time: 0.02,
                saturation_time: 0.2,
                edge_counts: 0.2,
                friction_margin: 1.8,
                grip_margin: 1.2,
                delay_cycles: 0,
                lost: 26,
                late: 26,
                disorder: 2,
                silence_cycles: 3,
                deadline: Micros(500),
                overruns: 26,
            },
        }
    };
    let bounds = {
        use ActuatorKind::*;
        Bounds {
            actuator: Brake,
            preload: 0.0,
            load_share: 0.0,
            inertia: Interval {
                low: 0.0017,
                high: 0.0017,
            },
            drive_torque: Interval {
                low: 0.047088,
                high: 0.047088,
            },
            viscous_damping: Interval {
                low: 0.001,
                high: 0.001,
            },
            brake_gain: Interval {
                low: 0.14,
                high: 0.14,
            },
            motor_gain: Interval {
                low: 0.0,
                high: 0.0,
            },
            friction_at_rest: Interval {
                low: 0.2,
                high: 0.2,
            },
            friction_sliding: Interval {
                low: 0.15,
                high: 0.15,
            },
            friction: Interval {
                low: 0.15,
                high: 0.2,
            },
        }
    };
    let path = {
        use Interpolation::*;
        Ramp {
            rate: 0.034906585,
        }
    };
    let run = AloneRun {
        servo,
        law,
        supervisor,
        bounds,
        path,
        start: FixedCounts(53103),
        ticks: 10001,
        watchdog: Micros(3000),
    };
    Alone::new(&run, board)
}
