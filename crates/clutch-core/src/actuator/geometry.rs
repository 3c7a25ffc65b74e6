//! The linkage of the paper's brake:
//!
//! ```text
//! K_COF = r_i K_t A / (A_lever R_a r_c)                        (18)
//! ```

use crate::params::{Range, Table};
use crate::{ParamError, Real};

crate::params! {
    /// The linkage from motor voltage to friction torque, as Table 1 lists it: `K_COF = r_i K_t A/(A_lever R_a r_c)`
    /// (18).
    pub struct BrakeGeometry<T> {
        /// Inner radius of the brake disc.
        inner_radius: T, "inner_radius_m" "r_i" M, Range::above(0.0);
        /// Torque constant of the motor. Not printed in the paper.
        torque_constant: T, "torque_constant_nm_a" "K_t" NM_A, Range::above(0.0);
        /// Area of contact between pad and disc.
        pad_area: T, "pad_area_m2" "A" M2, Range::above(0.0);
        /// Area of the tip of the lever.
        lever_area: T, "lever_area_m2" "A_lever" M2, Range::above(0.0);
        /// Armature resistance. Not printed in the paper.
        armature_resistance: T, "armature_resistance_ohm" "R_a" OHM, Range::above(0.0);
        /// Distance from the motor's shaft to the contact on the disc.
        contact_radius: T, "contact_radius_m" "r_c" M, Range::above(0.0);
    }
    relations(p) {
        /// The gain is a number.
        GAIN: contact_radius, "a distance with which K_COF of (18), made of it and of inner_radius_m, torque_constant_nm_a, pad_area_m2, lever_area_m2 and armature_resistance_ohm, is a finite number above 0 N m/V";
    }
}

impl<T: Real> BrakeGeometry<T> {
    /// `K_COF` of (18), N m/V per unit of μ.
    ///
    /// # Errors
    /// The first parameter that is not a finite number above 0; the last, if the gain is not one.
    pub fn brake_gain(&self) -> Result<T, ParamError<T>> {
        self.check_rows()?;
        let gain = self.inner_radius * self.torque_constant * self.pad_area
            / (self.lever_area * self.armature_resistance * self.contact_radius);
        BrakeGeometry::GAIN.require(self.contact_radius, gain > T::ZERO && gain.is_finite())?;
        Ok(gain)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Table 1's lengths and areas, with K_t/R_a chosen so that K_COF = 0.14.
    pub(in crate::actuator) fn of_table_1() -> BrakeGeometry {
        BrakeGeometry {
            inner_radius: 0.045,
            torque_constant: 0.14 * 0.032 * 0.034 / (0.045 * 0.040),
            pad_area: 0.040,
            lever_area: 0.032,
            armature_resistance: 1.0,
            contact_radius: 0.034,
        }
    }

    #[test]
    fn the_geometry_gives_the_gain_of_18() {
        let g = of_table_1();
        assert!((g.brake_gain().unwrap() - 0.14).abs() < 1e-15);
        let bad = BrakeGeometry { armature_resistance: 0.0, ..g };
        assert_eq!(bad.brake_gain().unwrap_err().field(), "armature_resistance");
    }
}
