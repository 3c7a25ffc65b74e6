//! Knowledge of single laws in the campaign: rigs on which one is drawn, its gains there, the promises that are its own.
//!
//! A law of the list that has no row is drawn all the same, with its own gains, and held to the promises of all.

use super::healthy_run::RigName;
use clutch_core::law::LawParams;
use clutch_core::params::Choice;

/// Differences of a law from others.
pub(crate) struct OfLaw {
    /// Its keys on a brake: of a rig, with micro-steps or without, for a delay in periods.
    pub(crate) brake: fn(RigName, bool, u32) -> String,
    /// Its keys with which it holds the heaviest shaft with the weakest brake of wide bounds.
    pub(crate) holds_all: &'static str,
    /// Its keys on a motor axis.
    pub(super) motor: &'static str,
    /// True if it bears a period of delay on the paper's rig: under PD that is unstable, and laws that switch swing.
    pub(super) bears_delay: bool,
    /// Time at a limit of the output that ends control, s.
    pub(super) saturated_s: f64,
    /// Error at rest that ends control, °.
    pub(super) following_deg: f64,
    /// Error of a healthy run that the law leaves, °.
    pub(super) healthy_deg: f64,
    /// Samples that may be lost in a row where the law leaves its brake about where it is right: on a ramp, without delay.
    pub(super) steady: Option<u32>,
    /// Speed of the path, °/s, below which it may let go so little of the shaft that friction of the bounds still holds it.
    pub(super) lets_go_above_deg_s: f64,
    /// True if it lets go too little at the start of any path, too.
    pub(super) starts_late: bool,
    /// True if its integral waits: at the start, and on a path slower than 10 °/s.
    pub(super) waits: bool,
    /// True if its voltage is too far off for an encoder's fault to show by what the slowest shaft does.
    pub(super) far_off: bool,
    /// Time for which it may leave the brake open because it waits for edges, s.
    pub(super) silence_s: f64,
    /// Time in which a shaft that no longer shows its way ends control, s.
    pub(super) found_s: f64,
    /// True if it switches between the limits of the output, and so leaves a brake open until the shaft has caught up.
    pub(crate) switches: bool,
}

/// The rate below which glide takes micro-steps.
const MICRO: &str = "micro_below_deg_s = 0.95\n";

/// A switching gain that holds the heaviest shaft with the weakest brake of the healthy shafts' bounds. With less the law lets
/// such a shaft creep ahead of its path, and nothing is healthy any more: the 3 V of Table 2 are for the paper's load.
const SWITCHED: &str = "kp_v = 9.0\n";

/// The promises of all.
const ALL: OfLaw = OfLaw {
    brake: |_, _, _| String::new(),
    holds_all: "",
    motor: "",
    bears_delay: false,
    saturated_s: 0.2,
    following_deg: 1.0,
    healthy_deg: 0.15,
    steady: None,
    lets_go_above_deg_s: 3.0,
    starts_late: false,
    waits: false,
    far_off: false,
    silence_s: 0.0,
    found_s: 0.5,
    switches: false,
};

/// Laws that are drawn first, by rig; all others of the list come later.
pub(super) const fn drawn(rig: RigName) -> &'static [&'static str] {
    match rig {
        RigName::Motor => &["pid", "smc", "ctc", "glide"],
        RigName::Paper => &["pd", "ctc", "smc", "smc_sign", "pid", "hold", "glide"],
        RigName::Bench => &["pd", "ctc", "smc", "pid", "glide"],
    }
}

/// The laws of the list that follow a path.
pub(crate) fn following() -> Vec<&'static str> {
    let follows = LawParams::<f64>::all().into_iter().filter(LawParams::follows);
    follows.map(|law| Choice::<f64>::name(&law)).collect()
}

/// Those that are not drawn first on any rig.
pub(super) fn drawn_later() -> Vec<&'static str> {
    let first = |law: &&str| RigName::ALL.into_iter().any(|rig| drawn(rig).contains(law));
    following().into_iter().filter(|law| !first(law)).collect()
}

/// The steady laws, as often as they are drawn where samples are lost.
pub(super) const STEADY: [&str; 4] = ["pd", "ctc", "ctc", "smc"];

/// Samples that a steady law on a ramp can do without, one after another.
pub(super) const LONGEST_GAP: u32 = 12;

/// The law whose kick over lost samples is promised where an observer is led over them.
pub(super) const LED: &str = "smc";

/// The law that a load that grows drives to its limit.
pub(super) const TO_ITS_LIMIT: &str = "pd";

/// Knowledge of the law of a name.
pub(crate) fn of(law: &str) -> OfLaw {
    match law {
        // It swings: dead reckoning from its last period is off by more.
        "pd" => OfLaw { steady: Some(8), ..ALL },
        "ctc" => OfLaw {
            bears_delay: true,
            steady: Some(LONGEST_GAP),
            lets_go_above_deg_s: 10.0,
            starts_late: true,
            ..ALL
        },
        "smc" => OfLaw {
            holds_all: SWITCHED,
            motor: "kp_v = 1.5\nkd_v_s_rad = 4.0\nslope_1_s = 40.0\nboundary_rad_s = 0.3\n",
            bears_delay: true,
            steady: Some(LONGEST_GAP),
            ..ALL
        },
        // At one limit or the other in every period.
        "smc_sign" => OfLaw { holds_all: SWITCHED, saturated_s: 5.0, switches: true, ..ALL },
        "smc_integral" => OfLaw { holds_all: SWITCHED, ..ALL },
        // Slow to let go at the start. Its error is in degrees, and its voltage as far off.
        "pid" => OfLaw {
            brake: |rig, _, _| {
                let keys = match rig {
                    // Its friction rises and falls along the disc.
                    RigName::Bench => "kp_v_rad = 600.0\nki_v_rad_s = 3000.0\nkd_v_s_rad = 8.0\n",
                    _ => "kp_v_rad = 170.0\nki_v_rad_s = 500.0\nkd_v_s_rad = 1.0\n",
                };
                keys.to_owned()
            },
            motor: "kp_v_rad = 200.0\nki_v_rad_s = 2000.0\nkd_v_s_rad = 4.0\n",
            // It creeps ahead at a slow start on an uneven disc, and waits with the whole brake for its path.
            saturated_s: 0.6,
            following_deg: 6.0,
            healthy_deg: 3.0,
            lets_go_above_deg_s: 6.0,
            waits: true,
            far_off: true,
            ..ALL
        },
        // At rest under a safe state its integral is at most of the output, and has to let go in time.
        "super_twisting" => OfLaw {
            brake: |_, _, _| "k2_v_s = 42.0\n".to_owned(),
            following_deg: 4.0,
            healthy_deg: 2.5,
            ..ALL
        },
        // It takes a shaft at rest for one that slides, and brakes with all it has until a slow path has come.
        "dob" => OfLaw { saturated_s: 1.0, ..ALL },
        // It waits for the edges of a slow shaft, and for that of a first start; after silence and two starts of 25 ms that
        // brought no edge it lets go for good.
        "glide" => OfLaw {
            brake: |_, micro, delay| {
                let micro = if micro { MICRO } else { "" };
                format!("{micro}filter.delay_ticks = {delay}\n")
            },
            // Without them a motor under it stands at each reversal.
            motor: MICRO,
            bears_delay: true,
            starts_late: true,
            silence_s: 0.08,
            found_s: 0.4,
            ..ALL
        },
        "hold" => OfLaw { bears_delay: true, ..ALL },
        _ => ALL,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_law_that_follows_a_path_is_drawn_and_every_name_is_one_of_the_list() {
        let first: Vec<&str> = RigName::ALL.into_iter().flat_map(drawn).copied().collect();
        let later = drawn_later();
        for law in LawParams::<f64>::all() {
            let name = Choice::<f64>::name(&law);
            assert!(!law.follows() || first.contains(&name) != later.contains(&name), "{name}");
        }
        for name in first.iter().chain(&later).chain(&STEADY).chain(&[LED, TO_ITS_LIMIT]) {
            assert!(LawParams::<f64>::named(name).is_some(), "{name}");
        }
    }
}
