//! Guarantees of a set of gains over all plants within bounds.
//!
//! # The sound certificate
//!
//! With `σ = f e + ė` and the plant (1),
//!
//! ```text
//! σ̇ = f ė + θ̈_d − [T_u − μ K_COF v_a − C_d θ̇] / J
//! ```
//!
//! the surface is reached at a rate of at least `γ` if `σ σ̇ ≤ −γ |σ|`. A brake gives two very
//! different sides:
//!
//! * **shaft ahead** (`σ < 0`), the brake is on with `K_p + K_d |ė|` volts. At the worst corner
//!   (`J_max`, `T_max`, weakest brake `μ_min K_min`) this suffices if
//!   `K_p ≥ [T_max + J_max (a_d + γ)] / (μ_min K_min)` and `K_d ≥ J_max f / (μ_min K_min)`.
//! * **shaft behind** (`σ > 0`), the brake can only let go. All that is left is
//!   `|ė| ≤ [T_min − C_max v_d − J_max (a_d + γ)] / (J_max f)`, and no gain buys more.
//!
//! Four additions. The saturation of (31) weakens the `K_d` term to `K_d ė²` where
//! `|ė| < 1 rad/s`, so that up to `(J_max f / μ_min K_min)² / (4 K_d)` volts of `f |ė|` fall to
//! `K_p`; where `K_p` has less to spare, the layer within which nothing is claimed is as many times thicker as it has too
//! little. The voltage ends at `u_max`, which bounds `|ė|` on the ahead side too. A law that is
//! affine in `σ` and saturates, as PD with `f = K_p/K_d` is and as CTC is, obeys the same two
//! conditions outside the layer in which it does not saturate: with `u_max` in place of `K_p`.
//! And the bounds on `|ė|` must keep holding: with `S` the larger of the layer and the start's
//! `|ė|`, the region `|σ| ≤ S`, `|e| ≤ S/f` is never left if both sides hold for every `ė` in it,
//! which is `|ė| ≤ 2 S`, and `ė ≤ v_d` for a shaft that never runs backwards.
//!
//! So `|e| ≤ S/f` from a start on the path, and `|σ|` falls at `γ` until it is within the layer,
//! while the shaft moves. A shaft that is stuck ahead waits for the path: `σ̇ = f θ̇_d + θ̈_d`.
//! The certificate speaks of continuous time and an exact sensor: sampling, encoder steps and
//! delay come on top.
//!
//! A motor has two like sides: on each of them `K_p + K_d |ė|` volts drive against the error, with `k_t` in the place of
//! `μ K`. Friction, which may be on the wrong side on either of them as the shaft may run either way, and the drag at the
//! path's speed come to the load: `K_p ≥ [±T_u + μ_max N_0 + C_max v_d + J_max (a_d + γ)] / k_t,min`, the larger of both
//! signs. A brake with a motor has the brake's side ahead and the motor's behind.
//!
//! # The paper's conditions
//!
//! [`paper_conditions`] gives (26)–(28) as printed. They divide by the strongest brake instead
//! of the weakest and let the voltage be negative: (26) is negative for the paper's own plant,
//! so that any `K_p` passes, and (28) overstates the reaching rate.

use crate::actuator::ActuatorKind;
use crate::bounds::Bounds;
use crate::law::{Asked, Law, Shell, Surface};
use crate::params::{Range, Table};
use crate::{ParamError, Real};

crate::params! {
    /// Requirements of the path and the start, and the reaching rate wanted.
    pub struct Demand<T>: Default {
        /// Highest velocity of the path (23g).
        velocity: T = 0.0, "velocity_rad_s" "v_d" RAD_S, Range::at_least(0.0);
        /// Highest acceleration of the path (23g).
        acceleration: T = 0.0, "acceleration_rad_s2" "a_d" RAD_S2, Range::at_least(0.0);
        /// Reaching rate wanted (15).
        reach_rate: T = 0.0, "reach_rate_rad_s2" "γ" RAD_S2, Range::at_least(0.0);
        /// `|ė|` at the start: 0 on the path, the path's velocity from rest.
        start_error_rate: T = 0.0, "start_error_rate_rad_s" "" RAD_S, Range::at_least(0.0);
        /// Largest jump of the path's velocity on the way.
        velocity_jump: T = 0.0, "velocity_jump_rad_s" "" RAD_S, Range::at_least(0.0);
    }
}

/// The reason that gains are not certified.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Shortfall {
    /// `K_p` is too small: the weakest brake, or motor, does not stop the strongest drive.
    Kp,
    /// `K_d` is too small: it does not pay for `f |ė|`.
    Kd,
    /// The highest voltage is too small.
    Voltage,
    /// The drive is too weak for the path: the shaft that is behind does not catch up.
    Drive,
    /// The start's error rate is beyond what the two sides can follow.
    Start,
    /// The path's velocity jumps on the way: (12) and (13) assume that it does not.
    Jump,
    /// The layer is so thick that `|ė|` within it may exceed what the two sides can follow.
    Layer,
    /// `f` is below `C_max/J_min`: the viscous damping decides instead of the surface.
    Slope,
    /// The law has no sliding surface: PD or CTC without `K_d`, or SMC output that never ends.
    Surface,
}

/// The guarantee, with the worst corner and the margins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certificate<T = f64> {
    /// `f`: slope of the law's sliding surface, 1/s.
    pub slope: T,
    /// Thickness of the layer around the surface in which nothing is claimed, rad/s: the law's, or more where `K_p` is short
    /// of what (31) needs at the law's own.
    pub layer: T,
    /// Worst corner of the ahead side: inertia, kg m².
    pub worst_inertia: T,
    /// Worst corner of the ahead side: driving torque, N m.
    pub worst_torque: T,
    /// Worst corner of the ahead side: weakest brake `μ_min K_min`, or motor, N m/V.
    pub weakest_brake: T,
    /// Worst corner of the behind side: driving torque, N m.
    pub least_torque: T,
    /// `K_p` needed, V.
    pub kp_required: T,
    /// Part of it that falls to `K_p` because (31) weakens the `K_d` term, V.
    pub kp_for_boundary: T,
    /// `K_p` given, V; for PD and CTC the highest voltage.
    pub kp_given: T,
    /// `K_d` needed, V s/rad; 0 for PD and CTC.
    pub kd_required: T,
    /// `K_d` given, V s/rad; 0 for PD and CTC.
    pub kd_given: T,
    /// Largest `γ` that the ahead side, and the driven one behind, allow at `ė = 0`, rad/s²; negative if even 0 is too
    /// much.
    pub reach_rate_possible: T,
    /// `|ė|` up to which the ahead side holds before the voltage ends, rad/s.
    pub error_rate_ahead: T,
    /// `|ė|` up to which the behind side holds, rad/s.
    pub error_rate_behind: T,
    /// `S/f`: bound on `|e|` from a start at `e = 0`, rad; meaningful only if certified.
    pub error_bound: T,
    /// `γ` certified, rad/s².
    pub reach_rate: T,
    /// The shortfall; none = certified.
    pub shortfall: Option<Shortfall>,
}

/// The sound certificate of a law over all plants within bounds; with a shell that of any law within it.
///
/// ```
/// use clutch_core::certificate::{Demand, certify};
/// use clutch_core::law::{Beside, Law, LawParams, SmcSignParams};
/// use clutch_core::{Bounds, PlantParams, Tolerances};
/// let plant = PlantParams::<f64>::default();
/// let params = LawParams::SmcSign(SmcSignParams::default());
/// let law = Law::new(&params, &Beside::paper(&plant, &Default::default()))?;
/// let bounds = Bounds::around(&plant, &Tolerances::default())?;
/// let c = certify(&law, &Default::default(), &bounds, &Demand::default())?;
/// assert!((c.kp_required - 2.242286).abs() < 1e-6);
/// assert!(c.shortfall.is_none()); // the paper's K_p is 3
/// # Ok::<(), clutch_core::ParamError>(())
/// ```
///
/// # Errors
/// A demand negative or not finite, by name.
pub fn certify<T: Real>(
    law: &Law<T>,
    shell: &Shell<T>,
    bounds: &Bounds<T>,
    demand: &Demand<T>,
) -> Result<Certificate<T>, ParamError<T>> {
    demand.check_rows()?;
    let sides = sides(bounds, demand, (law.output().lowest(), law.output().highest()));
    let surface = |asked: &Asked<'_, T>| shell.surface().or_else(|| law.surface(asked));
    if bounds.actuator == ActuatorKind::Both {
        // The motor need not catch the shaft up where the drive does by itself.
        let released = Side { gain: T::ZERO, highest: T::ZERO, ..sides.behind };
        let alone = certify_sides(&surface, bounds, demand, Sides { behind: released, ..sides });
        if alone.certified() {
            return Ok(alone);
        }
    }
    Ok(certify_sides(&surface, bounds, demand, sides))
}

fn certify_sides<T: Real>(
    surface: &dyn Fn(&Asked<'_, T>) -> Option<Surface<T>>,
    bounds: &Bounds<T>,
    demand: &Demand<T>,
    sides: Sides<T>,
) -> Certificate<T> {
    let Sides { ahead: Side { gain: brake, load: torque, highest }, behind, reverses } = sides;
    let inertia = bounds.inertia.high;
    let base = (torque + inertia * (demand.acceleration + demand.reach_rate)) / brake;
    let per_rate = |left: T, slope: T| if slope > T::ZERO { left / slope } else { T::ZERO };
    let ahead = |slope: T| per_rate((highest - base) * brake / inertia, slope);
    let asked = Asked { velocity: demand.velocity, acceleration: demand.acceleration, fastest: &ahead };
    let surface = surface(&asked);
    let missing = surface.is_none();
    let Surface { slope, layer, kp, kd, weakened, .. } =
        surface.unwrap_or(Surface::affine(T::ZERO, (T::ZERO, highest), T::ONE));
    let weakest = if behind.gain > T::ZERO { brake.min(behind.gain) } else { brake };

    // Ahead: the brake against the strongest drive.
    let kd_required = if kd.is_some() { inertia * slope / weakest } else { T::ZERO };
    let share = match kd {
        Some(kd) if weakened && kd > T::ZERO => kd_required * kd_required / (T::from_i32(4) * kd),
        _ => T::ZERO,
    };
    let accelerates = inertia * (demand.acceleration + demand.reach_rate);
    let pushes = if behind.gain > T::ZERO { (behind.load + accelerates) / behind.gain } else { T::ZERO };
    let needed = base.max(pushes);
    let reached = if behind.gain > T::ZERO { highest.min(behind.highest) } else { highest };
    // `L/ε` times as far off the surface the damping term is as many times as large, and its share as many times as small.
    let spare = kp.min(reached) - needed;
    let grows = spare > T::ZERO && spare < share;
    let (layer, kp_for_boundary) = if grows { (layer * (share / spare), spare) } else { (layer, share) };
    let kp_required = needed + kp_for_boundary;
    let reach_rate = |side: &Side<T>| {
        ((kp.min(side.highest) - kp_for_boundary) * side.gain - side.load) / inertia - demand.acceleration
    };
    let ahead_rate = reach_rate(&Side { gain: brake, load: torque, highest });
    // A brake has no gain that buys more behind.
    let reach_rate_possible =
        if behind.gain > T::ZERO { ahead_rate.min(reach_rate(&behind)) } else { ahead_rate };
    let error_rate_ahead = ahead(slope);

    // Behind: the released, or driven, shaft against the path.
    let left = (behind.gain * behind.highest - behind.load) / inertia;
    let error_rate_behind = per_rate(left - demand.acceleration - demand.reach_rate, slope);

    // The region that is never left.
    let follows = |region: T| {
        let rate = region + region;
        // A shaft that nothing drives backwards falls behind by no more than the path's velocity.
        let caught = if reverses { rate } else { rate.min(demand.velocity) };
        rate <= error_rate_ahead && caught <= error_rate_behind
    };
    let region = layer.max(demand.start_error_rate);

    let shortfall = if missing {
        Some(Shortfall::Surface)
    } else if !grows && kp < kp_required {
        // Of a law that gives all it has, and of a shell, the limit is what is short.
        Some(if kd.is_some() { Shortfall::Kp } else { Shortfall::Voltage })
    } else if kd.is_some_and(|kd| kd < kd_required) {
        Some(Shortfall::Kd)
    } else if !grows && reached < kp_required {
        Some(Shortfall::Voltage)
    } else if error_rate_behind <= T::ZERO {
        Some(Shortfall::Drive)
    } else if slope * bounds.inertia.low < bounds.viscous_damping.high {
        Some(Shortfall::Slope)
    } else if demand.velocity_jump > T::ZERO {
        Some(Shortfall::Jump)
    } else if !follows(layer) {
        Some(Shortfall::Layer)
    } else if !follows(region) {
        Some(Shortfall::Start)
    } else {
        None
    };
    Certificate {
        slope,
        layer,
        worst_inertia: inertia,
        worst_torque: torque,
        weakest_brake: brake,
        least_torque: bounds.viscous_damping.high * demand.velocity - behind.load,
        kp_required,
        kp_for_boundary,
        kp_given: kp,
        kd_required,
        kd_given: kd.unwrap_or(T::ZERO),
        reach_rate_possible,
        error_rate_ahead,
        error_rate_behind,
        error_bound: per_rate(region, slope),
        reach_rate: demand.reach_rate,
        shortfall,
    }
}

/// A side of the surface.
#[derive(Clone, Copy)]
struct Side<T> {
    /// Least torque against the error per volt, N m/V.
    gain: T,
    /// Most torque with the error, without inertia, N m; of the side behind negative where the drive catches up.
    load: T,
    /// Most volts against the error.
    highest: T,
}

#[derive(Clone, Copy)]
struct Sides<T> {
    ahead: Side<T>,
    behind: Side<T>,
    /// The actuator drives the shaft backwards, too.
    reverses: bool,
}

fn sides<T: Real>(bounds: &Bounds<T>, demand: &Demand<T>, (lowest, highest): (T, T)) -> Sides<T> {
    let drive = &bounds.drive_torque;
    let drag = bounds.viscous_damping.high * demand.velocity;
    let preload = bounds.friction.high * bounds.preload;
    let [against, with] = bounds.actuator.most_volts(lowest, highest);
    // What drives both ways is ahead on a way back, too, where friction and damping are against it.
    let ahead = if bounds.actuator.drives_above_0() { drive.high + preload + drag } else { drive.high };
    // A force that never lets go is against the shaft that is behind.
    let released = drag - (drive.low - bounds.strongest_brake() * lowest.max(T::ZERO) - preload);
    Sides {
        ahead: Side { gain: bounds.resists_per_volt(), load: ahead, highest: against },
        behind: Side { gain: bounds.drives_per_volt(), load: released, highest: with },
        reverses: bounds.drives(lowest, highest).low < T::ZERO,
    }
}

impl<T: Real> Certificate<T> {
    /// All conditions hold.
    #[must_use]
    pub fn certified(&self) -> bool {
        self.shortfall.is_none()
    }

    /// The bound (15) on the time until the layer is reached from `σ`, s; none where nothing is
    /// certified or the certified rate is 0. `σ` in rad/s.
    #[must_use]
    pub fn reaching_time(&self, surface: T) -> Option<T> {
        let outside = (surface.abs() - self.layer).max(T::ZERO);
        if self.certified() && self.reach_rate > T::ZERO { Some(outside / self.reach_rate) } else { None }
    }
}

/// The paper's own conditions, as printed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperConditions<T = f64> {
    /// Right side of (26), V.
    pub kp: T,
    /// Right side of (27), V s/rad.
    pub kd: T,
    /// (28), rad/s².
    pub gamma: T,
}

/// (26)–(28) for a `K_p` and a slope `f`, as printed. They are not sound: see the module's page.
#[must_use]
pub fn paper_conditions<T: Real>(
    bounds: &Bounds<T>,
    demand: &Demand<T>,
    kp: T,
    slope: T,
) -> PaperConditions<T> {
    let brake = (bounds.friction_at_rest.high + bounds.friction_sliding.high) * bounds.brake_gain.high;
    let (inertia, torque) = (bounds.inertia.low, bounds.drive_torque.low);
    let drag = bounds.viscous_damping.high * demand.velocity;
    PaperConditions {
        kp: (inertia * demand.acceleration + drag - torque) / brake,
        kd: (bounds.inertia.high * slope - bounds.viscous_damping.high) / brake,
        gamma: (kp * brake - inertia * demand.acceleration + drag - torque) / inertia,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::{Beside, CtcParams, LawParams, OutputParams, PdParams, SmcParams, SmcSignParams};
    use crate::{PlantParams, Tolerances};

    fn law(p: LawParams) -> Law<f64> {
        Law::new(&p, &Beside::paper(&PlantParams::default(), &OutputParams::default())).unwrap()
    }

    fn bounds(t: Tolerances) -> Bounds {
        Bounds::around(&PlantParams::default(), &t).unwrap()
    }

    /// Without a shell.
    fn certify_alone(law: &Law<f64>, bounds: &Bounds, demand: &Demand) -> Result<Certificate, ParamError> {
        certify(law, &Shell::default(), bounds, demand)
    }

    fn at_2_deg_s() -> Demand {
        Demand { velocity: 2.0_f64.to_radians(), ..Demand::default() }
    }

    #[test]
    fn table_2_needs_2_2423_volts_and_follows_22_65_degrees_per_second_when_behind() {
        let c = certify_alone(
            &law(LawParams::SmcSign(SmcSignParams::default())),
            &bounds(Tolerances::default()),
            &at_2_deg_s(),
        )
        .unwrap();
        assert!((c.kp_required - 2.242286).abs() < 1e-6);
        assert!((c.error_rate_behind.to_degrees() - 22.65).abs() < 0.01);
        assert!((c.reach_rate_possible - 9.36).abs() < 0.005, "the true γ of K_p = 3");
        assert!(c.certified());
    }

    #[test]
    fn the_boundary_layer_takes_another_fiftieth_of_a_volt() {
        let c = certify_alone(
            &law(LawParams::Smc(SmcParams::default())),
            &bounds(Tolerances::default()),
            &at_2_deg_s(),
        )
        .unwrap();
        // c = J f/(μK) = 0.119/0.021; c²/(4·400)
        assert!((c.kp_for_boundary - libm::pow(0.119 / 0.021, 2.0) / 1600.0).abs() < 1e-12);
        assert!((c.kp_required - 2.242286 - c.kp_for_boundary).abs() < 1e-6);
        assert!((c.error_bound.to_degrees() - (0.1_f64 / 70.0).to_degrees()).abs() < 1e-12);
    }

    /// Of each that a certificate asks for, the very number is enough, and the next below is not.
    #[test]
    fn exactly_what_is_required_is_enough() {
        let of = |p: LawParams, highest: f64| {
            let output = OutputParams { highest, on_invalid: highest, ..OutputParams::default() };
            let law = Law::new(&p, &Beside::paper(&PlantParams::default(), &output)).unwrap();
            certify_alone(&law, &bounds(Tolerances::default()), &at_2_deg_s()).unwrap()
        };
        let sign = |kp: f64, highest| {
            of(LawParams::SmcSign(SmcSignParams { kp, ..SmcSignParams::default() }), highest)
        };
        let needed = sign(3.0, 10.0).kp_required;
        assert_ne!(sign(needed, 10.0).shortfall, Some(Shortfall::Kp));
        assert_eq!(sign(needed.next_down(), 10.0).shortfall, Some(Shortfall::Kp));
        assert_ne!(sign(3.0, needed).shortfall, Some(Shortfall::Voltage));
        assert_eq!(sign(3.0, needed.next_down()).shortfall, Some(Shortfall::Voltage));
        let damped = |kd: f64| of(LawParams::Smc(SmcParams { kp: 6.0, kd, ..SmcParams::default() }), 10.0);
        let needed = damped(400.0).kd_required;
        assert_ne!(damped(needed).shortfall, Some(Shortfall::Kd));
        assert_eq!(damped(needed.next_down()).shortfall, Some(Shortfall::Kd));
    }

    /// `K_p` against the layer, the bound and the verdict, from 2.2 to 2.3 V.
    #[test]
    fn between_2_2423_and_2_2624_volts_the_layer_grows_without_a_cliff() {
        let at = |kp: f64| {
            let law = law(LawParams::Smc(SmcParams { kp, ..SmcParams::default() }));
            certify_alone(&law, &bounds(Tolerances::default()), &at_2_deg_s()).unwrap()
        };
        let plain = at(2.3);
        let edge = plain.kp_required;
        let base = edge - plain.kp_for_boundary;
        assert!((edge - 2.262356).abs() < 1e-5 && plain.layer == 0.1);
        // `L = ε c²/(4 K_d (K_p − base))`, and both ends of the range.
        for kp in [2.2500, 2.2550, 2.2600, 2.2622] {
            let c = at(kp);
            let layer = 0.1 * plain.kp_for_boundary / (kp - base);
            assert!(c.certified() && (c.layer / layer - 1.0).abs() < 1e-9, "{kp} V: {c:?}");
            assert!((c.error_bound - c.layer / 70.0).abs() < 1e-15);
            assert!(c.kp_required <= kp + 1e-12 && c.reach_rate_possible.abs() < 1e-9);
        }
        // Continuous at the edge, and never larger with more volts.
        assert!((at(edge - 1e-9).layer - at(edge + 1e-9).layer).abs() < 1e-7);
        let mut last = f64::INFINITY;
        let mut certified = false;
        for k in 0..=10_000 {
            let c = at(2.2 + 1e-5 * f64::from(k));
            assert!(c.certified() || !certified, "lost again at {} V", c.kp_given);
            if c.certified() {
                // Between neighbours at most by their share of what is left.
                let step = if last.is_finite() { last / c.error_bound } else { 1.0 };
                assert!((1.0..1.004).contains(&step), "{} V: {step}", c.kp_given);
                last = c.error_bound;
            }
            certified = c.certified();
        }
        assert!(certified);
        // The largest layer that (D) lets pass is half the error rate that the brake follows.
        assert_eq!(at(2.2440).shortfall, Some(Shortfall::Layer));
        assert!(at(2.2455).certified() && at(2.2455).layer > 0.62);
        assert_eq!(at(base).shortfall, Some(Shortfall::Kp));
    }

    #[test]
    fn a_shell_has_the_certificate_of_whatever_law_is_within() {
        use crate::ActuatorKind;
        use crate::law::{HoldParams, ShellParams};
        let output = OutputParams::default();
        let around = |boundary: f64, p: LawParams| {
            let p = (law(p), ShellParams { slope: 100.0, boundary });
            let shell = Shell::new(&p.1, &output, ActuatorKind::Brake).unwrap();
            certify(&p.0, &shell, &bounds(Tolerances::default()), &at_2_deg_s()).unwrap()
        };
        for inner in [LawParams::Ctc(CtcParams::default()), LawParams::Hold(HoldParams::default())] {
            assert!(!around(0.0, inner).certified());
            let c = around(0.1, inner);
            assert!(c.certified() && (c.slope, c.layer, c.kp_given) == (100.0, 0.1, 10.0));
        }
        // 2 S must be below what the released shaft follows, 15.86 °/s, and the brake, 54.91 °/s.
        assert_eq!(around(0.5, LawParams::Pd(PdParams::default())).shortfall, Some(Shortfall::Layer));
    }

    #[test]
    fn twenty_per_cent_of_friction_and_brake_gain_ask_for_more_than_the_papers_kp() {
        let t = Tolerances { friction: 0.2, brake_gain: 0.2, drive_torque: 0.1, ..Tolerances::default() };
        let c = certify_alone(&law(LawParams::SmcSign(SmcSignParams::default())), &bounds(t), &at_2_deg_s())
            .unwrap();
        assert!((c.kp_required - 3.854).abs() < 5e-4);
        assert_eq!(c.shortfall, Some(Shortfall::Kp));
    }

    #[test]
    fn the_papers_conditions_come_out_as_printed() {
        let p = paper_conditions(&bounds(Tolerances::default()), &at_2_deg_s(), 3.0, 70.0);
        assert!((p.kp - -0.9603).abs() < 5e-5, "(26)");
        assert!((p.kd - 2.40816).abs() < 5e-6, "(27)");
        assert!((p.gamma - 58.79).abs() < 5e-3, "(28)");
    }

    #[test]
    fn gains_that_pass_the_papers_conditions_fail_the_sound_ones() {
        let weak = SmcParams { kp: 1.0, kd: 3.0, ..SmcParams::default() };
        let p = paper_conditions(&bounds(Tolerances::default()), &at_2_deg_s(), weak.kp, weak.slope);
        assert!(weak.kp > p.kp && weak.kd > p.kd);
        let c =
            certify_alone(&law(LawParams::Smc(weak)), &bounds(Tolerances::default()), &at_2_deg_s()).unwrap();
        assert_eq!(c.shortfall, Some(Shortfall::Kp));
    }

    #[test]
    fn pd_saturates_0_2_rad_per_s_off_its_surface_which_bounds_its_error_to_0_115_degrees() {
        let c = certify_alone(
            &law(LawParams::Pd(PdParams::default())),
            &bounds(Tolerances::default()),
            &at_2_deg_s(),
        )
        .unwrap();
        assert_eq!((c.slope, c.layer), (100.0, 0.2));
        assert!((c.error_bound.to_degrees() - 0.1146).abs() < 1e-4);
        assert!(c.certified());
        // The weakest of many brakes is too weak for all of the 10 V: there is no K_p to raise.
        let weak = bounds(Tolerances { friction: 0.8, ..Tolerances::default() });
        let c = certify_alone(&law(LawParams::Pd(PdParams::default())), &weak, &at_2_deg_s()).unwrap();
        assert_eq!(c.shortfall, Some(Shortfall::Voltage));
        let no_kd = PdParams { kd: 0.0, ..PdParams::default() };
        let c =
            certify_alone(&law(LawParams::Pd(no_kd)), &bounds(Tolerances::default()), &at_2_deg_s()).unwrap();
        assert_eq!(c.shortfall, Some(Shortfall::Surface));
    }

    #[test]
    fn ctc_saturates_too_far_off_its_surface_to_be_certified() {
        let c = certify_alone(
            &law(LawParams::Ctc(CtcParams::default())),
            &bounds(Tolerances::default()),
            &at_2_deg_s(),
        )
        .unwrap();
        assert_eq!(c.shortfall, Some(Shortfall::Layer));
        // (μ_s K u_max − T + C ω)/(J K K_d), at the highest ω that the ahead side allows.
        let speed = 2.0_f64.to_radians() + c.error_rate_ahead;
        let layer = (0.2 * 0.14 * 10.0 - 0.047088 + 0.001 * speed) / (0.0017 * 90.0 * 0.7);
        assert!((c.layer - layer).abs() < 1e-9, "{} instead of {layer}", c.layer);
        assert!((c.slope - 100.0 / 0.7).abs() < 1e-12);
    }

    #[test]
    fn the_reaching_time_is_the_distance_over_the_rate() {
        let d = Demand { reach_rate: 5.0, ..at_2_deg_s() };
        let c = certify_alone(&law(LawParams::Smc(SmcParams::default())), &bounds(Tolerances::default()), &d)
            .unwrap();
        assert!(c.certified());
        assert!((c.reaching_time(-1.1).unwrap() - 0.2).abs() < 1e-12);
        let c = certify_alone(
            &law(LawParams::Smc(SmcParams::default())),
            &bounds(Tolerances::default()),
            &at_2_deg_s(),
        )
        .unwrap();
        assert_eq!(c.reaching_time(-1.1), None);
    }

    #[test]
    fn a_start_from_rest_at_100_degrees_per_second_is_beyond_what_letting_go_can_follow() {
        let v = 100.0_f64.to_radians();
        let d = Demand { velocity: v, start_error_rate: v, ..Demand::default() };
        let c = certify_alone(&law(LawParams::Smc(SmcParams::default())), &bounds(Tolerances::default()), &d)
            .unwrap();
        assert_eq!(c.shortfall, Some(Shortfall::Start));
    }

    #[test]
    fn pd_is_certified_up_to_15_8_degrees_per_second_and_smc_to_100() {
        let certified = |p: LawParams, rate: f64| {
            let d = Demand { velocity: rate.to_radians(), ..Demand::default() };
            certify_alone(&law(p), &bounds(Tolerances::default()), &d).unwrap().shortfall
        };
        // T − C v = J f v for the released shaft: v = T/(J f + C) = 0.2754 rad/s.
        let limit = (0.047088_f64 / (0.0017 * 100.0 + 0.001)).to_degrees();
        assert_eq!(certified(LawParams::Pd(PdParams::default()), limit - 0.01), None);
        assert_eq!(certified(LawParams::Pd(PdParams::default()), limit + 0.01), Some(Shortfall::Layer));
        assert_eq!(certified(LawParams::Smc(SmcParams::default()), 100.0), None);
    }

    #[test]
    fn a_motor_needs_its_gain_on_both_sides_and_a_brake_with_a_motor_no_more_than_the_brake() {
        let actuator = crate::MotorActuator { gain: 0.05, preload: 0.25, load_share: 0.0 };
        let motor = PlantParams { actuator: actuator.into(), drive_torque: 0.01, ..PlantParams::default() };
        let both_ways = OutputParams { lowest: -10.0, on_invalid: 0.0, ..OutputParams::default() };
        let certified = |plant: &PlantParams, output: &OutputParams, smc: SmcParams| {
            let law = Law::new(&LawParams::Smc(smc), &Beside::paper(plant, output)).unwrap();
            certify_alone(&law, &Bounds::around(plant, &Tolerances::default()).unwrap(), &at_2_deg_s())
                .unwrap()
        };
        let smc = SmcParams { kp: 1.5, kd: 4.0, slope: 40.0, boundary: 0.3 };
        let c = certified(&motor, &both_ways, smc);
        // Load and friction on one side, and the drag of the path, over k_t.
        let needed = (0.01 + 0.2 * 0.25 + 0.001 * 2.0_f64.to_radians()) / 0.05;
        assert!((c.kp_required - c.kp_for_boundary - needed).abs() < 1e-12);
        assert!((c.kd_required - 0.0017 * 40.0 / 0.05).abs() < 1e-12);
        assert!(c.certified());
        let short = OutputParams { lowest: -1.2, ..both_ways };
        assert_eq!(certified(&motor, &short, smc).shortfall, Some(Shortfall::Voltage));

        let weak = crate::BothActuator { brake_gain: 0.14, motor_gain: 0.001, preload: 0.0 };
        let both = PlantParams { actuator: weak.into(), ..PlantParams::default() };
        let limits = OutputParams { lowest: -2.0, ..OutputParams::default() };
        let c = certified(&both, &limits, SmcParams::default());
        assert!(c.certified() && (c.kp_required - c.kp_for_boundary - 2.242286).abs() < 1e-6, "{c:?}");
    }

    #[test]
    fn a_slope_below_the_viscous_rate_is_not_certified() {
        let slow = SmcParams { slope: 0.5, ..SmcParams::default() };
        let c =
            certify_alone(&law(LawParams::Smc(slow)), &bounds(Tolerances::default()), &at_2_deg_s()).unwrap();
        assert_eq!(c.shortfall, Some(Shortfall::Slope));
    }

    #[test]
    fn a_path_whose_velocity_jumps_on_the_way_is_not_certified() {
        let d = Demand { velocity_jump: 0.01, ..at_2_deg_s() };
        let c = certify_alone(&law(LawParams::Smc(SmcParams::default())), &bounds(Tolerances::default()), &d)
            .unwrap();
        assert_eq!(c.shortfall, Some(Shortfall::Jump));
    }

    #[test]
    fn bad_demands_and_tolerances_are_named() {
        let l = law(LawParams::Smc(SmcParams::default()));
        let bad = Demand { reach_rate: f64::NAN, ..Demand::default() };
        assert_eq!(
            certify_alone(&l, &bounds(Tolerances::default()), &bad).unwrap_err().field(),
            "reach_rate"
        );
        let t = Tolerances { friction: 1.0, ..Tolerances::default() };
        assert_eq!(Bounds::around(&PlantParams::default(), &t).unwrap_err().field(), "friction");
    }

    #[test]
    fn a_derivative_gain_below_its_need_and_a_path_faster_than_the_drive_are_told_apart() {
        let sign = |kp, kd| {
            let p = SmcSignParams { kp, kd, ..SmcSignParams::default() };
            law(LawParams::SmcSign(p))
        };
        let exact = bounds(Tolerances::default());
        // J f/(μ_d K_COF) = 0.119/0.021 = 5.67 V s/rad.
        let needed = certify_alone(&sign(3.0, 5.7), &exact, &at_2_deg_s()).unwrap();
        assert!(needed.certified() && (needed.kd_required - 0.119 / 0.021).abs() < 1e-9);
        let few = certify_alone(&sign(3.0, 5.6), &exact, &at_2_deg_s()).unwrap();
        assert_eq!(few.shortfall, Some(Shortfall::Kd));
        assert_eq!(few.reaching_time(0.2), None, "what is not certified has no time");
        // The weight gives 27.7 rad/s² and no more, however strong the brake.
        for (acceleration, shortfall) in [(20.0, None), (28.0, Some(Shortfall::Drive))] {
            let demand = Demand { acceleration, ..at_2_deg_s() };
            let c = certify_alone(&sign(9.0, 50.0), &exact, &demand).unwrap();
            assert_eq!(c.shortfall, shortfall, "{acceleration} rad/s²");
        }
    }

    #[test]
    fn where_the_drive_does_not_catch_up_the_motor_beside_the_brake_does() {
        let actuator = crate::BothActuator { brake_gain: 0.14, motor_gain: 0.05, preload: 0.0 };
        let plant = PlantParams { actuator: actuator.into(), ..PlantParams::default() };
        let output = OutputParams { lowest: -10.0, ..OutputParams::default() };
        let p = LawParams::SmcSign(SmcSignParams { kp: 9.0, kd: 50.0, ..SmcSignParams::default() });
        let law = Law::new(&p, &Beside::paper(&plant, &output)).unwrap();
        let bounds = Bounds::around(&plant, &Tolerances::default()).unwrap();
        let at = |acceleration| {
            let c = certify_alone(&law, &bounds, &Demand { acceleration, ..at_2_deg_s() }).unwrap();
            assert!(c.certified(), "{:?} at {acceleration} rad/s²", c.shortfall);
            c.error_rate_behind
        };
        // The weight alone catches up with (27.7 − 20)/70 rad/s; beyond 27.7 rad/s² the motor helps with 9 V.
        assert!((at(20.0) - (0.047088 / 0.0017 - 20.0) / 70.0).abs() < 0.01);
        assert!(at(40.0) > 0.0);
    }

    #[test]
    fn a_layer_without_a_derivative_gain_weakens_nothing_and_lacks_it() {
        let p = SmcParams { kd: 0.0, ..SmcParams::default() };
        let c =
            certify_alone(&law(LawParams::Smc(p)), &bounds(Tolerances::default()), &at_2_deg_s()).unwrap();
        assert_eq!((c.kp_for_boundary, c.shortfall), (0.0, Some(Shortfall::Kd)));
    }

    #[test]
    fn a_motor_whose_lower_limit_ends_too_soon_lacks_voltage() {
        let motor = crate::MotorActuator { gain: 0.05, preload: 0.1, load_share: 0.0 };
        let plant = PlantParams { actuator: motor.into(), ..PlantParams::default() };
        let bounds = Bounds::around(&plant, &Tolerances::default()).unwrap();
        let shortfall = |lowest| {
            let output = OutputParams { lowest, on_invalid: 0.0, ..OutputParams::default() };
            let p = LawParams::Smc(SmcParams { kp: 5.0, ..SmcParams::default() });
            let law = Law::new(&p, &Beside::paper(&plant, &output)).unwrap();
            certify_alone(&law, &bounds, &at_2_deg_s()).unwrap().shortfall
        };
        // The weight and friction take 0.047 + 0.02 N m of 0.05 N m/V.
        assert_eq!((shortfall(-10.0), shortfall(-1.2)), (None, Some(Shortfall::Voltage)));
    }

    #[test]
    fn the_derivative_gain_has_to_suffice_for_the_weaker_of_brake_and_motor() {
        // The brake has 0.15 · 0.14 = 0.021 N m/V while it slides.
        for (motor_gain, weaker) in [(0.01, 0.01), (0.05, 0.021)] {
            let actuator = crate::BothActuator { brake_gain: 0.14, motor_gain, preload: 0.0 };
            let plant = PlantParams { actuator: actuator.into(), ..PlantParams::default() };
            let output = OutputParams { lowest: -10.0, ..OutputParams::default() };
            let bounds = Bounds::around(&plant, &Tolerances::default()).unwrap();
            let needs = |acceleration: f64, kd: f64| {
                let p = LawParams::SmcSign(SmcSignParams { kp: 9.5, kd, ..SmcSignParams::default() });
                let law = Law::new(&p, &Beside::paper(&plant, &output)).unwrap();
                let c = certify_alone(&law, &bounds, &Demand { acceleration, ..at_2_deg_s() }).unwrap();
                (c.kd_required, c.shortfall)
            };
            // Beyond the 27.7 rad/s² of the weight the motor has to help, and J f/k is what its K_d needs.
            let needed = 0.0017 * 70.0 / weaker;
            let (told, shortfall) = needs(30.0, 1.01 * needed);
            assert!(
                (told - needed).abs() < 1e-9 && shortfall.is_none(),
                "{told} for {needed}, {shortfall:?}"
            );
            assert_eq!(needs(30.0, 0.99 * needed).1, Some(Shortfall::Kd), "{motor_gain}");
            // Below it the weight catches up by itself.
            let (told, shortfall) = needs(20.0, 0.119 / 0.021 + 0.01);
            assert!((told - 0.119 / 0.021).abs() < 1e-9 && shortfall.is_none(), "{told}, {shortfall:?}");
        }
    }

    #[test]
    fn an_accelerated_path_and_a_rate_of_reaching_are_paid_for_on_both_sides() {
        let demand = Demand { acceleration: 5.0, reach_rate: 2.0, ..at_2_deg_s() };
        let near = |what: &str, value: f64, expected: f64| {
            assert!((value - expected).abs() < 1e-9 * expected.abs(), "{what}: {value} for {expected}");
        };
        let smc = LawParams::SmcSign(SmcSignParams { kp: 9.0, kd: 50.0, ..SmcSignParams::default() });
        let drag = 0.001 * 2.0_f64.to_radians();

        // A brake: 0.021 N m/V against the weight of 0.047088 N m, which alone catches up.
        let drive = Tolerances { drive_torque: 0.25, ..Tolerances::default() };
        let c = certify_alone(&law(smc), &bounds(drive), &demand).unwrap();
        let (heavy, light) = (1.25 * 0.047088, 0.75 * 0.047088);
        assert!(c.certified(), "{c:?}");
        near("volts", c.kp_required, (heavy + 0.0017 * 7.0) / 0.021);
        // However much it brakes, what is behind is not bought by it.
        near("reaching", c.reach_rate_possible, (9.0 * 0.021 - heavy) / 0.0017 - 5.0);
        near("ahead", c.error_rate_ahead, ((10.0 * 0.021 - heavy) / 0.0017 - 7.0) / 70.0);
        near("behind", c.error_rate_behind, ((light - drag) / 0.0017 - 7.0) / 70.0);
        near("drive", c.least_torque, light);

        // A motor against a load and its own friction, behind: it has to push, and with no more than the output gives.
        let actuator = crate::MotorActuator { gain: 0.05, preload: 0.25, load_share: 0.0 };
        let motor = PlantParams { actuator: actuator.into(), drive_torque: -0.01, ..PlantParams::default() };
        let with = |highest: f64| {
            let output = OutputParams { lowest: -10.0, highest, on_invalid: 0.0, ..OutputParams::default() };
            let law = Law::new(&smc, &Beside::paper(&motor, &output)).unwrap();
            certify_alone(&law, &Bounds::around(&motor, &Tolerances::default()).unwrap(), &demand).unwrap()
        };
        let c = with(10.0);
        let load = 0.01 + 0.2 * 0.25 + drag;
        assert!(c.certified(), "{c:?}");
        near("volts", c.kp_required, (load + 0.0017 * 7.0) / 0.05);
        near("reaching", c.reach_rate_possible, (9.0 * 0.05 - load) / 0.0017 - 5.0);
        near("behind", c.error_rate_behind, ((10.0 * 0.05 - load) / 0.0017 - 7.0) / 70.0);
        assert_eq!([1.4, 1.5].map(|highest| with(highest).shortfall), [Some(Shortfall::Voltage), None]);
    }

    #[test]
    fn a_law_without_a_surface_has_no_rate_off_it_that_it_follows() {
        let p = LawParams::Pd(PdParams { kd: 0.0, ..PdParams::default() });
        let c = certify_alone(&law(p), &bounds(Tolerances::default()), &at_2_deg_s()).unwrap();
        assert_eq!((c.shortfall, c.slope), (Some(Shortfall::Surface), 0.0));
        assert_eq!((c.error_rate_ahead, c.error_rate_behind), (0.0, 0.0));
    }
}
