//! Plain data of a certificate: the box of plants, the law, the cells with their rows, radii and multipliers.
//!
//! Both the search and the [`crate::checker`] read these types, and nothing else is common to them: what is computed here the
//! search alone calls, and the checker derives anew. A saved certificate is this
//! data as JSON: [`crate::file`].

use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeSet;

/// Lower and upper end.
pub type Ends = [f64; 2];

/// A motor in the place of the brake: its voltage makes torque of either sign, and friction is that of a constant normal force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Torque per volt `k_t`, N m/V.
    pub gain: Ends,
    /// Normal force `N_0`, as torque per unit of μ, N m.
    pub preload: f64,
}

/// The sampled loop and every plant it may meet: the box that a certificate speaks of. SI and radians.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Setup {
    /// Sampling period, s.
    pub period_s: f64,
    /// Counts per turn of an encoder that rounds down.
    pub counts_per_rev: u32,
    /// Moment of inertia `J`, kg m².
    pub inertia: Ends,
    /// Driving torque `T_u`, N m.
    pub drive_torque: Ends,
    /// Viscous damping `C_d`, N m s/rad.
    pub viscous_damping: Ends,
    /// Brake gain `K_COF`, N m/V; of a motor 0.
    pub brake_gain: Ends,
    /// The motor of an axis that has one. It goes forwards alone: no voltage that goes out turns a shaft of the box round.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motor: Option<Motor>,
    /// `μ_d` of a fast shaft.
    pub sliding: Ends,
    /// `μ_s` of a resting shaft.
    pub at_rest: Ends,
    /// `true` if no plant of the box has `μ_s < μ_d`.
    pub rest_not_below_sliding: bool,
    /// Stribeck velocity, rad/s, and exponent of (2).
    pub stribeck: [f64; 2],
    /// Largest share by which friction departs from its curve, anywhere on the disc and at any time.
    pub ripple: f64,
    /// Largest magnitude of a further torque, any at any time, N m.
    pub torque_noise: f64,
    /// Whole periods from sample to voltage.
    pub delay_ticks: u32,
    /// One step of the converter, V; 0 if it rounds nothing.
    pub converter_step: f64,
    /// Lowest and highest voltage that go out, V.
    pub volts: Ends,
    /// Velocity of the path, which is a ramp, rad/s.
    pub rate: f64,
    /// `K_Kal` of the smoothed difference (5).
    pub smoothing: f64,
    /// The law.
    pub law: Gains,
    /// `true` if a run may begin at rest; else it begins with the path's velocity. Both begin on the path.
    pub from_rest: bool,
    /// Volts that brake or motor may have had before the first tick.
    pub start_volts: Ends,
}

/// Exponent of Stribeck's curve at which slow speeds end where a law's own gains bound the voltage: a thousandth is left.
pub(crate) const USUAL_END: f64 = 7.0;
/// Share of the path's velocity at which slow speeds of a motor axis end at most. Of shares from 0.01 to 0.5 the bounds of
/// docs/certified.md were least with 0.01 to 0.06, whatever the Stribeck velocity was; from 0.5 on some did not close.
const OF_A_MOTOR: f64 = 0.03;
/// The same in a shell around a brake: of shares from 0.04 to 0.2 it gave the least bounds, and two rigs of docs/tune.md theirs.
const IN_A_SHELL: f64 = 0.04;

impl Gains {
    /// `true` if the law remembers an integral.
    #[must_use]
    pub fn remembers(&self) -> bool {
        matches!(self, Gains::Integral { .. })
    }
}

impl Setup {
    /// Numbers of the state that a cell's rows speak of, the encoder's among them.
    #[must_use]
    pub fn dimension(&self) -> usize {
        4 + self.delay_ticks as usize + usize::from(self.law.remembers())
    }

    /// The paper's shaft, known exactly, with its converter and `K_Kal` of 0.2, on a ramp of 2 °/s that begins at its speed.
    #[must_use]
    pub fn paper(law: Gains) -> Setup {
        Setup {
            period_s: 0.001,
            counts_per_rev: 20_000,
            inertia: [0.0017; 2],
            drive_torque: [0.047_088; 2],
            viscous_damping: [0.001; 2],
            brake_gain: [0.14; 2],
            motor: None,
            sliding: [0.15; 2],
            at_rest: [0.2; 2],
            rest_not_below_sliding: true,
            stribeck: [0.001, 1.0],
            ripple: 0.0,
            torque_noise: 0.0,
            delay_ticks: 0,
            converter_step: 20.0 / 4096.0,
            volts: [0.0, 9.995],
            rate: 2.0_f64.to_radians(),
            smoothing: 0.2,
            law,
            from_rest: false,
            start_volts: [1.68, 2.25],
        }
    }

    /// Exponents of Stribeck's curve, (2), that are tried as [`Cell::slow_exponent`], the most promising first. Within a shell any
    /// voltage may come, and friction of a motor axis does not grow with the voltage: there narrow slow speeds are mostly worth
    /// more than a narrow friction, and end far below the path's.
    pub(crate) fn slow_exponents(&self) -> Vec<f64> {
        let narrow = |share: f64| libm::pow(share * self.rate / self.stribeck[0], self.stribeck[1]);
        let shell = matches!(self.law, Gains::Shell { .. });
        match self.motor {
            Some(_) => vec![narrow(OF_A_MOTOR).min(if shell { 2.0 } else { USUAL_END })],
            None if shell => {
                let narrow = narrow(IN_A_SHELL).min(2.0);
                [narrow, 2.0, USUAL_END].into_iter().filter(|x| *x >= narrow).collect()
            }
            None => vec![USUAL_END],
        }
    }

    /// Voltage from which those of a motor are counted downwards, V: above all of them. So a voltage is never below 0, and more of
    /// it slows the shaft down, as with a brake.
    #[must_use]
    pub fn counted_from(&self) -> f64 {
        self.volts[1].max(self.start_volts[1]).ceil() + 1.0
    }

    /// Fields in which two setups differ, each with its value here and there.
    #[must_use]
    pub fn differences(&self, other: &Setup) -> Vec<(String, Value, Value)> {
        let table = |s: &Setup| match serde_json::to_value(s) {
            Ok(Value::Object(table)) => table,
            _ => serde_json::Map::new(),
        };
        let (own, other) = (table(self), table(other));
        let fields: BTreeSet<&String> = own.keys().chain(other.keys()).collect();
        let value = |table: &serde_json::Map<String, Value>, field: &String| {
            table.get(field).cloned().unwrap_or(Value::Null)
        };
        let both = fields.into_iter().map(|field| (field.clone(), value(&own, field), value(&other, field)));
        both.filter(|(_, own, other)| own != other).collect()
    }
}

/// Forms of a law in the sampled loop that have a certificate, with their gains.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Gains {
    /// (4), with a voltage beside it: `u = u_f − (K_p e + K_d ė)`; of a motor `u_f + (…)`, here and below.
    Linear {
        /// `K_p`, V/rad.
        kp: f64,
        /// `K_d`, V s/rad.
        kd: f64,
        /// `u_f`, V.
        #[serde(default)]
        forward: f64,
    },
    /// The same with an integral `I` of the error, in volts: `u = u_f + I − (K_p e + K_d ė)`. It takes back the part that a limit cuts off, and
    /// it stays within what the output can answer.
    Integral {
        /// `K_p`, V/rad.
        kp: f64,
        /// `K_i`, V/(rad s).
        ki: f64,
        /// `K_d`, V s/rad.
        kd: f64,
        /// `u_f`, V.
        forward: f64,
        /// `T_t`: time in which the integral follows a limit, s.
        tracking: f64,
        /// Lowest and highest voltage that the law may ask for, V.
        limits: Ends,
    },
    /// (31).
    Layer {
        /// `K_p`, V.
        kp: f64,
        /// `K_d`, V s/rad.
        kd: f64,
        /// `f`, 1/s.
        slope: f64,
        /// `ε`, rad/s.
        boundary: f64,
    },
    /// Any law within a shell: any voltage of the output's range while `|σ| < S`, the highest from `σ = −S` on, the
    /// lowest from `σ = S` on; of a motor the lowest from `−S` on, the highest from `S` on.
    Shell {
        /// `f`, 1/s.
        slope: f64,
        /// `S`, rad/s.
        boundary: f64,
    },
}

/// Way in which the encoder's rounding is described.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// An error of 0 to 1 count, free at each tick.
    Noise,
    /// The counts go on by whole numbers, and stay within a count of the angle.
    Exact,
}

/// A piece of (31) ahead of its surface, `σ < 0`: a rectangle of `|σ|` and `|ė|`, and lines below and above the demand.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Strip {
    /// `true` where `ė ≤ 0`.
    pub leads: bool,
    /// `|ė|` from, rad/s.
    pub rate_from: f64,
    /// `|ė|` to, rad/s; none: without end.
    pub rate_to: Option<f64>,
    /// `|σ|` from, rad/s.
    pub surface_from: f64,
    /// `|σ|` to, rad/s; none: without end.
    pub surface_to: Option<f64>,
    /// The demand within the output's limits is at least `[0] |σ| + [1]`, V.
    pub least: [f64; 2],
    /// The demand within the output's limits is at most `[0] |σ| + [1]`, V.
    pub most: [f64; 2],
}

/// Behaviours of the shaft in one tick; there are no others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Case {
    /// Above Stribeck's speeds throughout.
    Slides,
    /// At Stribeck's speeds, with a voltage that holds no shaft.
    LetGo,
    /// Touches Stribeck's speeds, and may speed up from there.
    TouchesAndLeaves,
    /// Touches Stribeck's speeds, and cannot speed up.
    TouchesAndStays,
}

/// A behaviour of shaft, law and encoder in one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModeId {
    /// Number of the law's piece: 0 lets go; of a linear law 1 is straight and 2 full, of a shell 1 is any and 2 full; of a layer 1 is
    /// the first strip. Of an integral 0 to 2 are those of a linear law, 3 to 5 the same with the integral at its lower end, 6 to 8 at its upper.
    pub piece: u32,
    /// The shaft.
    pub case: Case,
    /// Counts since the last sample, in the exact form; else 0.
    pub counts: u32,
}

/// Multipliers of one row in one mode: number of the constraint, and its weight. Constraints are numbered from the rows of
/// the set on to those of the mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Proof {
    /// Number of the row.
    pub row: u32,
    /// Number of the mode in [`Cell::modes`].
    pub mode: u32,
    /// Constraints and their weights.
    pub weights: Vec<(u32, f64)>,
}

/// Multipliers that show a mode impossible: together its constraints contradict each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contradiction {
    /// Number of the mode in [`Cell::modes`].
    pub mode: u32,
    /// Constraints and their weights.
    pub weights: Vec<(u32, f64)>,
}

/// A proven part of the box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// `μ_d` of this cell.
    pub sliding: Ends,
    /// Form of the encoder's rounding.
    pub form: Form,
    /// Speed that the shaft does not exceed at samples, counts per tick.
    pub speed_cap: f64,
    /// Exponent of Stribeck's curve, (2), at which its slow speeds end: what is left of it there, `e` to the power of minus this,
    /// counts as friction at every speed.
    pub slow_exponent: f64,
    /// Pieces of (31) ahead of its surface; none of a linear law.
    pub strips: Vec<Strip>,
    /// Modes, in the order of their numbers.
    pub modes: Vec<ModeId>,
    /// Rows `c` of the set `c·x ≤ r`, of the state `(e, ė, z, p₁ … p_d, I, m₋)` in counts, ticks and volts; `I` of an integral only.
    /// A motor's volts are counted down from [`Setup::counted_from`], and its integral has the other sign.
    pub rows: Vec<Vec<f64>>,
    /// Radii `r`.
    pub radii: Vec<f64>,
    /// Modes that cannot happen while the state is in the set.
    pub impossible: Vec<Contradiction>,
    /// Multipliers of each row in each of the other modes.
    pub proofs: Vec<Proof>,
    /// Bound on `|e|`, rad.
    pub error_bound: f64,
}

/// A sampled-data certificate: a bound on the error of every run of every plant of the box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Certificate {
    /// Version of the format.
    pub version: u32,
    /// The loop and the box.
    pub setup: Setup,
    /// Cells of `μ_d` that cover the box together.
    pub cells: Vec<Cell>,
}

/// Version of the format that this crate writes and reads.
pub const VERSION: u32 = 3;
