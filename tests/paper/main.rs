//! The paper's figures 8 to 10 and Table 3, with the paper's own tolerances.

mod fig10_smc;
mod fig8_pd;
mod fig9_ctc;
mod table3;

use clutch_sim::paper::{Claim, Kind, Outcome, Place, STATEMENTS, Statement, reproduce};
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

fn count(such: impl Fn(&Statement) -> bool) -> usize {
    STATEMENTS.iter().filter(|s| such(s)).count()
}

#[test]
fn of_36_statements_33_come_out_five_without_a_run_and_nine_after_a_fit_as_the_readme_says() {
    let kinds = [Kind::Setting, Kind::Arithmetic, Kind::Simulation, Kind::Experiment];
    assert_eq!(kinds.map(|kind| count(|s| s.measured.kind() == kind)), [3, 2, 15, 16]);
    assert_eq!(OUTCOME.claims.iter().filter(|c| c.holds).count(), 33);
    assert_eq!(count(|s| s.fitted), 9);
}

#[test]
fn the_statements_stand_at_the_setup_three_figures_the_table_and_an_equation() {
    let figures = [8, 9, 10].map(Place::Figure);
    assert_eq!(figures.map(|place| count(|s| s.place == place)), [12, 10, 6]);
    let others = [Place::Setup, Place::Table(3), Place::Equation(32)];
    assert_eq!(others.map(|place| count(|s| s.place == place)), [4, 3, 1]);
}

#[test]
fn at_least_two_statements_about_the_experiment_stay_out_of_the_fit() {
    let outside = count(|s| s.measured.kind() == Kind::Experiment && !s.fitted);
    assert!(outside >= 2, "{outside}");
}

#[test]
fn the_bench_is_fitted_to_statements_about_the_experiment_only() {
    for s in STATEMENTS.iter().filter(|s| s.fitted) {
        assert_eq!(s.measured.kind(), Kind::Experiment, "{}", s.id);
    }
}

#[test]
fn each_statement_has_a_name_of_its_own() {
    let names: std::collections::BTreeSet<_> = STATEMENTS.iter().map(|s| s.id).collect();
    assert_eq!(names.len(), STATEMENTS.len());
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
