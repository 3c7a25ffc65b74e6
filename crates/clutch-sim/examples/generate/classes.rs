//! Python's classes: which there are, and what the declarations do not say of them.

use super::places::Place;
use clutch_core::params::{ChoiceInfo, TableInfo};

/// Properties of a class of which its declaration says nothing. A class without a line here is named after its table,
/// and its example shows its first parameter.
struct Known {
    /// Name of the declared table.
    table: &'static str,
    /// Name of the class, if it is another.
    name: &'static str,
    /// `true` if methods are written by hand, as a class of that name in `_mixins.py`; all frictions have those of one.
    mixin: bool,
    example: &'static str,
}

const fn known(table: &'static str, name: &'static str, mixin: bool, example: &'static str) -> Known {
    Known { table, name, mixin, example }
}

const KNOWN: &[Known] = &[
    known(
        "ScenarioParams",
        "_Scenario",
        false,
        r#">>> clutch.Scenario(law=clutch.Smc(kp_v=4), reference=clutch.Ramp(rate_deg_s=2)).name
'SMC, ramp'
>>> try:
...     clutch.Scenario(law=clutch.Smc(), reference=clutch.Ramp(rate_deg_s=-2))
... except clutch.ParamError as error:
...     print(error.field)
reference.ramp"#,
    ),
    known(
        "RigParams",
        "Rig",
        true,
        r">>> rig = clutch.Rig(delay_ticks=1, friction=clutch.StribeckFriction(mu_static=0.25))
>>> rig.friction.mu_static
0.25",
    ),
    known(
        "StribeckParams",
        "StribeckFriction",
        false,
        r">>> clutch.StribeckFriction(mu_static=0.25)
StribeckFriction(mu_static=0.25, mu_dynamic=0.15, stribeck_velocity_rad_s=0.001, stribeck_exponent=1.0)",
    ),
    known(
        "CoulombParams",
        "CoulombFriction",
        false,
        r">>> clutch.CoulombFriction(mu_static=0.3)
CoulombFriction(mu_static=0.3, mu_dynamic=0.15)",
    ),
    known(
        "LugreParams",
        "LugreFriction",
        false,
        r">>> clutch.Rig(friction=clutch.LugreFriction()).friction.stiffness_1_rad
2000.0",
    ),
    known(
        "DahlParams",
        "DahlFriction",
        false,
        r">>> clutch.DahlFriction()
DahlFriction(mu_dynamic=0.15, stiffness_1_rad=2000.0)",
    ),
    known(
        "ElastoPlasticParams",
        "ElastoPlasticFriction",
        false,
        r">>> clutch.ElastoPlasticFriction(mu_elastic=0.1).mu_elastic
0.1",
    ),
    known(
        "MaxwellParams",
        "MaxwellFriction",
        false,
        r"Three elements, none in the third place; the fourth bears what the others leave:

>>> clutch.MaxwellFriction(share_a=0.5, share_b=0.3, share_c=0.0).attraction_1_s
50.0",
    ),
    known(
        "BrakeGeometry",
        "BrakeGeometry",
        true,
        r"The paper's lengths and areas with an assumed motor:

>>> brake = clutch.BrakeGeometry(
...     inner_radius_m=0.045, torque_constant_nm_a=0.0508, pad_area_m2=0.040,
...     lever_area_m2=0.032, armature_resistance_ohm=0.6, contact_radius_m=0.034,
... )
>>> rig = clutch.Rig(actuator=brake)",
    ),
    known(
        "BrakeActuator",
        "BrakeActuator",
        false,
        r">>> clutch.Rig(actuator=clutch.BrakeActuator(preload_nm=0.01)).actuator
BrakeActuator(gain_nm_v=0.14, preload_nm=0.01)",
    ),
    known(
        "MotorActuator",
        "MotorActuator",
        false,
        r">>> motor = clutch.MotorActuator(gain_nm_v=0.05, preload_nm=0.25)
>>> rig = clutch.Rig(actuator=motor)
>>> model = clutch.Model(actuator=motor, drive_torque_nm=0)",
    ),
    known(
        "BothActuator",
        "BothActuator",
        false,
        r">>> clutch.BothActuator(brake_gain_nm_v=0.14, motor_gain_nm_v=0.02).preload_nm
0.0",
    ),
    known(
        "RippleParams",
        "Ripple",
        false,
        r">>> ripple = clutch.Ripple(
...     rms=0.05, lowest_waves_per_turn=100, highest_waves_per_turn=400, spacing_waves_per_turn=50
... )
>>> clutch.Rig(ripple=ripple).ripple.rms
0.05",
    ),
    known(
        "RunoutParams",
        "Runout",
        false,
        r">>> clutch.Rig(runout=clutch.Runout(amplitude=0.2, phase_deg=90)).runout
Runout(amplitude=0.2, waves_per_turn=1, phase_deg=90.0)",
    ),
    known("RigEncoder", "Encoder", false, ""),
    known("RigDac", "Dac", false, ""),
    known(
        "SpringDrive",
        "SpringDrive",
        false,
        r">>> clutch.SpringDrive(stiffness_nm_rad=0.02, rest_deg=180)
SpringDrive(stiffness_nm_rad=0.02, rest_deg=180.0)",
    ),
    known(
        "TableDrive",
        "TableDrive",
        false,
        r">>> clutch.TableDrive(points_s_nm=[(0, 0.045), (2, 0.055)])
TableDrive(points_s_nm=((0.0, 0.045), (2.0, 0.055)))",
    ),
    known(
        "BeltDrive",
        "BeltDrive",
        false,
        r">>> clutch.BeltDrive(stiffness_nm_rad=0.5, speed_deg_s=2)
BeltDrive(stiffness_nm_rad=0.5, damping_nm_s_rad=0.0, speed_deg_s=2.0)",
    ),
    known(
        "RampDrive",
        "RampDrive",
        false,
        r">>> clutch.RampDrive(from_nm=0, rate_nm_s=0.01)
RampDrive(from_nm=0.0, rate_nm_s=0.01)",
    ),
    known(
        "SineDrive",
        "SineDrive",
        false,
        r">>> clutch.SineDrive(mean_nm=0.047, amplitude_nm=0.01, frequency_hz=2)
SineDrive(mean_nm=0.047, amplitude_nm=0.01, frequency_hz=2.0, phase_turns=0.0)",
    ),
    known(
        "ChirpDrive",
        "ChirpDrive",
        false,
        r">>> clutch.ChirpDrive(mean_nm=0.047, amplitude_nm=0.01, from_hz=0.1, to_hz=10, duration_s=20)
ChirpDrive(mean_nm=0.047, amplitude_nm=0.01, from_hz=0.1, to_hz=10.0, duration_s=20.0)",
    ),
    known(
        "HandDrive",
        "HandDrive",
        false,
        r">>> clutch.HandDrive(mean_nm=0.06, rms_nm=0.008, lowest_frequency_hz=0.2, highest_frequency_hz=4)
HandDrive(mean_nm=0.06, rms_nm=0.008, lowest_frequency_hz=0.2, highest_frequency_hz=4.0)",
    ),
    known(
        "PlantParams",
        "Model",
        false,
        r">>> clutch.Model(drive_torque_nm=0.054).friction.mu_dynamic
0.15",
    ),
    known(
        "SmcParams",
        "Smc",
        false,
        r">>> clutch.Smc(kp_v=4)
Smc(kp_v=4.0, kd_v_s_rad=400.0, slope_1_s=70.0, boundary_rad_s=0.1)",
    ),
    known(
        "VoltageParams",
        "Voltage",
        false,
        r">>> clutch.Voltage(end_v=2, rate_v_s=0.1)
Voltage(start_v=0.0, end_v=2.0, rate_v_s=0.1, wait_s=0.0, returns=False)",
    ),
    known(
        "HoldParams",
        "HoldLaw",
        false,
        r">>> clutch.HoldLaw()
HoldLaw(margin=1.25)",
    ),
    known(
        "OutputParams",
        "Output",
        false,
        r">>> clutch.Output(highest_v=8, on_invalid_v=8)
Output(lowest_v=0.0, highest_v=8.0, on_invalid_v=8.0, bumpless_time_s=0.0)",
    ),
    known(
        "Ramp",
        "Ramp",
        false,
        r">>> clutch.Ramp(rate_deg_s=2)
Ramp(rate_deg_s=2.0)",
    ),
    known(
        "Trapezoid",
        "Trapezoid",
        false,
        r">>> clutch.Trapezoid(distance_deg=90, speed_deg_s=20, acceleration_deg_s2=100)
Trapezoid(distance_deg=90.0, speed_deg_s=20.0, acceleration_deg_s2=100.0)",
    ),
    known(
        "JerkLimited",
        "JerkLimited",
        false,
        r">>> path = clutch.JerkLimited(
...     distance_deg=90, speed_deg_s=20, acceleration_deg_s2=100, jerk_deg_s3=1000
... )",
    ),
    known(
        "MinimumJerk",
        "MinimumJerk",
        false,
        r">>> clutch.MinimumJerk(distance_deg=90, duration_s=6)
MinimumJerk(distance_deg=90.0, duration_s=6.0)",
    ),
    known(
        "Sine",
        "Sine",
        false,
        r">>> clutch.Sine(rate_deg_s=10, amplitude_deg=1.5, frequency_hz=1)
Sine(rate_deg_s=10.0, amplitude_deg=1.5, frequency_hz=1.0, phase_turns=-0.25)",
    ),
    known(
        "Chirp",
        "Chirp",
        false,
        r">>> clutch.Chirp(rate_deg_s=10, amplitude_deg=0.5, from_hz=0.1, to_hz=3, duration_s=10).to_hz
3.0",
    ),
    known(
        "Table",
        "TablePath",
        false,
        r">>> clutch.TablePath(points_s_deg=[(0.5, 0), (2, 20)])
TablePath(points_s_deg=((0.5, 0.0), (2.0, 20.0)), interpolation='cubic')",
    ),
    known(
        "FrictionMapParams",
        "FrictionMap",
        false,
        r#">>> clutch.FrictionMap(rig="disc 7", points_deg_factor=[(0.1 * i, 1 + 0.01 * (i % 3)) for i in range(50)]).rig
'disc 7'"#,
    ),
    known("ScenarioSampling", "Sampling", false, ""),
    known(
        "ScenarioBounds",
        "Bounds",
        false,
        r">>> clutch.Bounds(friction_percent=20, brake_gain_percent=20).friction_percent
20.0",
    ),
    known(
        "RunParams",
        "RunOptions",
        false,
        r">>> clutch.RunOptions(duration_s=10, seed=7).seed
7",
    ),
    known(
        "SafeHold",
        "HoldVoltage",
        false,
        r">>> clutch.HoldVoltage(volts_v=4.5)
HoldVoltage(volts_v=4.5)",
    ),
    known(
        "SafeRamp",
        "RampVoltage",
        false,
        r">>> clutch.RampVoltage(rate_v_s=50, volts_v=4.5)
RampVoltage(rate_v_s=50.0, volts_v=4.5)",
    ),
    known(
        "SafeHoldThenRelease",
        "HoldThenRelease",
        false,
        r">>> clutch.HoldThenRelease(volts_v=4.5, after_s=2)
HoldThenRelease(volts_v=4.5, after_s=2.0)",
    ),
    known(
        "ScenarioLimits",
        "Limits",
        false,
        r">>> clutch.Limits(following_error_deg=0.5).following_time_s
0.02",
    ),
    known(
        "Safety",
        "Safety",
        false,
        r#">>> clutch.Safety(reason="a weight drives the shaft", on_fault=clutch.HoldVoltage(volts_v=4.5))
Safety(reason='a weight drives the shaft', live_gains=False, on_fault=HoldVoltage(volts_v=4.5))"#,
    ),
];

/// A class.
pub(crate) struct Class<'a> {
    /// Its name.
    pub(crate) name: String,
    /// The class in `_mixins.py` with the methods that are written by hand, if it has some.
    pub(crate) mixin: Option<String>,
    /// An example for its documentation; empty if there is none.
    pub(crate) example: &'static str,
    /// The place at which a file has it; the first of several.
    pub(crate) place: &'a Place,
}

/// The class of each table.
///
/// # Errors
/// Two tables with one name; a table that is two options.
pub(crate) fn classes(places: &[Place]) -> Result<Vec<Class<'_>>, String> {
    let mut all: Vec<Class<'_>> = Vec::new();
    for place in places {
        let name = name(place);
        match all.iter_mut().find(|class| class.name == name) {
            None => {}
            Some(class) if same(class.place, place) => {
                // The class has its key where it is an option.
                class.place = if class.place.option.is_some() { class.place } else { place };
                continue;
            }
            Some(class) => {
                return Err(format!("two tables are {name}, {} and {}", class.place.key, place.key));
            }
        }
        let known = KNOWN.iter().find(|known| known.table == place.table.name);
        let of_its_own = || known.is_some_and(|known| known.mixin).then(|| name.clone());
        all.push(Class {
            mixin: if is_friction(place) { Some("Friction".to_owned()) } else { of_its_own() },
            name,
            example: known.map_or("", |known| known.example),
            place,
        });
    }
    match KNOWN.iter().find(|known| places.iter().all(|place| place.table.name != known.table)) {
        Some(gone) => Err(format!("no table is called {}", gone.table)),
        None => Ok(all),
    }
}

/// The same table, under the same name wherever it is an option.
fn same(a: &Place, b: &Place) -> bool {
    let option = |place: &Place| place.option.map(|(choice, option)| (choice.name, option.key));
    let (one, other) = (option(a), option(b));
    a.table.id == b.table.id && (one == other || one.is_none() || other.is_none())
}

/// Name of the class of a table.
pub(crate) fn name(place: &Place) -> String {
    match (KNOWN.iter().find(|known| known.table == place.table.name), place.option) {
        (Some(known), _) => known.name.to_owned(),
        // An option without parameters has only its key.
        (None, Some((_, option))) if place.table.name.is_empty() => {
            option.key.split('_').map(|word| word[..1].to_uppercase() + &word[1..]).collect()
        }
        (None, _) if is_friction(place) => plain(place.table) + "Friction",
        (None, _) => plain(place.table),
    }
}

fn is_friction(place: &Place) -> bool {
    place.option.is_some_and(|(choice, _)| choice.name == "FrictionParams")
}

fn plain(table: &TableInfo) -> String {
    table.name.strip_suffix("Params").unwrap_or(table.name).to_owned()
}

/// Name of the union of a choice's classes.
pub(crate) fn union(choice: &ChoiceInfo) -> &'static str {
    choice.name.strip_suffix("Params").unwrap_or(choice.name)
}
