//! The paper's figures 8 to 10 and Table 3, with the paper's own tolerances.

mod fig10_smc;
mod fig8_pd;
mod fig9_ctc;
mod table3;

use clutch_sim::paper::{Claim, Outcome, reproduce};
use clutch_sim::progress::UNWATCHED;
use std::sync::LazyLock;

/// One reproduction for all tests.
static OUTCOME: LazyLock<Outcome> = LazyLock::new(|| reproduce(UNWATCHED).expect("the built-in rigs run"));

fn claim(id: &str) -> &'static Claim {
    OUTCOME.claims.iter().find(|c| c.id == id).unwrap_or_else(|| panic!("no claim {id}"))
}

/// The paper's statement holds.
fn holds(id: &str) {
    let c = claim(id);
    assert!(c.holds, "{}: measured {} {} outside {:?}", c.paper, c.measured, c.unit, c.band);
}

#[test]
fn every_statement_holds_or_fails_as_documented() {
    for c in &OUTCOME.claims {
        assert!(c.as_expected(), "{}: {}: {} {} (band {:?})", c.id, c.paper, c.measured, c.unit, c.band);
    }
}

#[test]
fn at_least_two_statements_about_the_experiment_stay_out_of_the_fit() {
    let outside = OUTCOME.claims.iter().filter(|c| c.id.ends_with("-exp") && !c.fitted).count();
    assert!(outside >= 2, "{outside}");
}

#[test]
fn a_claim_that_fails_other_than_documented_is_not_as_expected() {
    let c = claim("pd-slow-sim");
    assert!(!c.holds && c.as_expected());
    let suddenly_holds = Claim { measured: 5.0, holds: true, ..c.clone() };
    assert!(!suddenly_holds.as_expected(), "then the documentation is wrong");
    let fails = Claim { holds: false, deviation: None, ..claim("pd-2-sim").clone() };
    assert!(!fails.as_expected());
}
