//! The variables of each unit, and their description.

use std::fmt::Write as _;

/// A unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The shaft with drive, actuator, encoder and converter.
    Rig,
    /// The law, with its path.
    Law,
}

/// The type of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Float64,
    Int32,
    Boolean,
    String,
}

/// A variable of a unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Variable {
    /// Its number within the unit.
    pub(crate) reference: u32,
    pub(crate) name: &'static str,
    pub(crate) kind: Kind,
    /// `input`, `output`, `parameter` or `independent`.
    causality: &'static str,
    unit: &'static str,
    description: &'static str,
}

const fn variable(
    reference: u32,
    name: &'static str,
    kind: Kind,
    causality: &'static str,
    unit: &'static str,
    description: &'static str,
) -> Variable {
    Variable { reference, name, kind, causality, unit, description }
}

pub(crate) const TIME: u32 = 0;
pub(crate) const SCENARIO: u32 = 1;
pub(crate) const SET: u32 = 2;
pub(crate) const VOLTAGE: u32 = 3;
pub(crate) const COUNTS: u32 = 4;
pub(crate) const POSITION: u32 = 5;
pub(crate) const VELOCITY: u32 = 6;
pub(crate) const STUCK: u32 = 7;
pub(crate) const CODE: u32 = 8;
pub(crate) const TARGET_POSITION: u32 = 9;
pub(crate) const TARGET_VELOCITY: u32 = 10;
pub(crate) const ERROR: u32 = 11;

const TIME_S: Variable = variable(TIME, "time", Kind::Float64, "independent", "s", "Time.");
const SCENARIO_FILE: Variable = variable(
    SCENARIO,
    "scenario",
    Kind::String,
    "parameter",
    "",
    "Scenario file, or name of a built-in scenario; the scenario within the unit if empty.",
);
const SET_KEYS: Variable = variable(
    SET,
    "set",
    Kind::String,
    "parameter",
    "",
    "Keys of the scenario that are changed, as law.smc.kp_v=4, with semicolons or line feeds between.",
);

const RIG: &[Variable] = &[
    TIME_S,
    SCENARIO_FILE,
    SET_KEYS,
    variable(
        VOLTAGE,
        "voltage_v",
        Kind::Float64,
        "input",
        "V",
        "Voltage that the converter is to give; that of the run's start until it is set.",
    ),
    variable(COUNTS, "counts", Kind::Int32, "output", "", "Counts of the encoder."),
    variable(POSITION, "position_rad", Kind::Float64, "output", "rad", "Position of the shaft."),
    variable(
        VELOCITY,
        "velocity_rad_s",
        Kind::Float64,
        "output",
        "rad/s",
        "Velocity of the shaft; exactly 0 while it sticks.",
    ),
    variable(STUCK, "stuck", Kind::Boolean, "output", "", "True while friction holds the shaft."),
];

const LAW: &[Variable] = &[
    TIME_S,
    SCENARIO_FILE,
    SET_KEYS,
    variable(
        COUNTS,
        "counts",
        Kind::Int32,
        "input",
        "",
        "Counts of the encoder; those of the run's start until they are set.",
    ),
    variable(VOLTAGE, "voltage_v", Kind::Float64, "output", "V", "Voltage that the converter gives."),
    variable(CODE, "code", Kind::Int32, "output", "", "Code for the converter."),
    variable(
        TARGET_POSITION,
        "target_position_rad",
        Kind::Float64,
        "output",
        "rad",
        "Position of the target.",
    ),
    variable(
        TARGET_VELOCITY,
        "target_velocity_rad_s",
        Kind::Float64,
        "output",
        "rad/s",
        "Velocity of the target.",
    ),
    variable(ERROR, "error_rad", Kind::Float64, "output", "rad", "Target minus position, as the law saw it."),
];

impl Part {
    /// Both.
    pub const ALL: [Part; 2] = [Part::Rig, Part::Law];

    /// The unit's name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Part::Rig => "rig",
            Part::Law => "law",
        }
    }

    /// The text by which the library knows which unit is meant, and of which version.
    pub(crate) fn token(self) -> String {
        format!("clutch-{}-{}", self.name(), env!("CARGO_PKG_VERSION"))
    }

    pub(crate) fn variables(self) -> &'static [Variable] {
        match self {
            Part::Rig => RIG,
            Part::Law => LAW,
        }
    }

    /// The variable of a number and a type.
    pub(crate) fn variable(self, reference: u32, kind: Kind) -> Option<&'static Variable> {
        self.variables().iter().find(|v| v.reference == reference && v.kind == kind)
    }
}

impl Variable {
    pub(crate) fn is_settable(&self) -> bool {
        matches!(self.causality, "input" | "parameter")
    }
}

/// The model description of a unit: the file `modelDescription.xml`.
#[must_use]
pub fn description(part: Part) -> String {
    let (about, steps) = match part {
        Part::Rig => ("A shaft restrained by friction, with its encoder and converter.", true),
        Part::Law => ("The law of a scenario, with its path; a step is one sampling period.", false),
    };
    let mut out = format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="clutch.{}" instantiationToken="{}" description="{about}" version="{}" generationTool="clutch" license="MIT OR Apache-2.0">
  <CoSimulation modelIdentifier="clutch_fmi" canHandleVariableCommunicationStepSize="{steps}" canGetAndSetFMUState="true"/>
  <UnitDefinitions>
    <Unit name="s"><BaseUnit s="1"/></Unit>
    <Unit name="V"><BaseUnit kg="1" m="2" s="-3" A="-1"/></Unit>
    <Unit name="rad"><BaseUnit rad="1"/></Unit>
    <Unit name="rad/s"><BaseUnit rad="1" s="-1"/></Unit>
  </UnitDefinitions>
  <DefaultExperiment startTime="0" stopTime="10" stepSize="0.001"/>
  <ModelVariables>
"#,
        part.name(),
        part.token(),
        env!("CARGO_PKG_VERSION"),
    );
    for v in part.variables() {
        let Variable { reference, name, kind, causality, unit, description } = v;
        let head = format!(
            r#"name="{name}" valueReference="{reference}" causality="{causality}" description="{description}""#
        );
        let unit = if unit.is_empty() { String::new() } else { format!(r#" unit="{unit}""#) };
        let start = if *causality == "input" { r#" start="0""# } else { "" };
        let _ = match (kind, *causality) {
            (Kind::Float64, "independent") => {
                writeln!(out, r#"    <Float64 {head} variability="continuous"{unit}/>"#)
            }
            (Kind::Float64, _) => {
                writeln!(out, r#"    <Float64 {head} variability="discrete"{unit}{start}/>"#)
            }
            (Kind::Int32, _) => writeln!(out, r#"    <Int32 {head} variability="discrete"{start}/>"#),
            (Kind::Boolean, _) => writeln!(out, r#"    <Boolean {head} variability="discrete"/>"#),
            (Kind::String, _) => {
                writeln!(out, r#"    <String {head} variability="fixed"><Start value=""/></String>"#)
            }
        };
    }
    out += "  </ModelVariables>\n  <ModelStructure>\n";
    let outputs = || part.variables().iter().filter(|v| v.causality == "output");
    for v in outputs() {
        let _ = writeln!(out, r#"    <Output valueReference="{}"/>"#, v.reference);
    }
    for v in outputs() {
        let _ = writeln!(out, r#"    <InitialUnknown valueReference="{}"/>"#, v.reference);
    }
    out + "  </ModelStructure>\n</fmiModelDescription>\n"
}
