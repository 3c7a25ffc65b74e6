//! Fig. 10: positional errors with sliding mode at 20, 6 and 2 °/s.

use super::holds;

#[test]
fn in_simulation_stick_slip_is_reduced_and_the_error_stays_below_0_15_degrees() {
    for id in ["smc-reduces-sim", "smc-smooth-sim", "smc-error-sim"] {
        holds(id);
    }
}

#[test]
fn on_the_bench_stick_slip_remains_at_2_and_6_degrees_per_second() {
    for id in ["smc-2-exp", "smc-6-exp"] {
        holds(id);
    }
}
