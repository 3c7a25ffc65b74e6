//! Needs of the paper's shaft to be held, known independently of this code. All else that is known so is data: the
//! referee's cases.

use clutch_core::{Plant, PlantParams};
use clutch_tests::assert_near;

#[test]
fn a1_holding_voltages_and_free_acceleration_of_the_papers_shaft() {
    let plant = Plant::<f64>::new(&PlantParams::default()).unwrap();
    assert_near("static holding voltage, V", plant.holding_voltage_static(), 1.681714, 1e-6);
    assert_near("sliding holding voltage, V", plant.holding_voltage_sliding(), 2.242286, 1e-6);
    assert_near("free acceleration, rad/s²", plant.acceleration(0.0, 0.0), 27.69882, 1e-5);
}
