//! Fig. 9: positional errors with computed torque at 20 and 2 °/s.

use super::holds;

#[test]
fn with_a_perfect_model_it_is_smooth_and_at_the_encoders_resolution() {
    for id in ["ctc-2-sim", "ctc-error-2-sim", "ctc-above-2-sim", "ctc-error-above-2-sim"] {
        holds(id);
    }
}

#[test]
fn on_the_bench_it_sticks_below_20_degrees_per_second_with_a_much_higher_error() {
    for id in ["ctc-2-exp", "ctc-slow-exp", "ctc-error-exp"] {
        holds(id);
    }
}

#[test]
fn with_the_bench_friction_known_it_is_smooth_again() {
    for id in ["ctc-known-sticks", "ctc-known-error"] {
        holds(id);
    }
}
