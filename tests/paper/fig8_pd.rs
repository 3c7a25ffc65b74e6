//! Fig. 8: positional errors with PD at 100, 20 and 2 °/s.

use super::{OUTCOME, holds};

#[test]
fn the_figure_has_three_rows_of_simulation_and_experiment() {
    let f = &OUTCOME.figures[0];
    let panels: Vec<_> = f.panels.iter().map(|p| (p.rate_deg_s, p.experiment)).collect();
    assert_eq!(f.number, 8);
    assert_eq!(
        panels,
        [(100.0, false), (100.0, true), (20.0, false), (20.0, true), (2.0, false), (2.0, true)]
    );
}

#[test]
fn from_20_degrees_per_second_up_the_motion_is_smooth_and_within_0_12_degrees() {
    for id in ["pd-smooth-sim", "pd-smooth-exp", "pd-error-sim", "pd-error-exp"] {
        holds(id);
    }
}

#[test]
fn at_2_degrees_per_second_it_sticks_and_slips_with_0_04_and_0_08_degrees() {
    for id in
        ["pd-2-sim", "pd-slow-exp", "pd-error-2-sim", "pd-error-2-exp", "pd-stairs-sim", "pd-stairs-exp"]
    {
        holds(id);
    }
}
