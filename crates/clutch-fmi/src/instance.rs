//! A unit with its parameters and its state of the protocol.

use crate::unit::Unit;
use crate::variables::{self as is, Kind, Part};
use clutch_sim::Scenario;
use std::collections::HashMap;
use std::ffi::{CString, c_char, c_void};
use std::path::PathBuf;

/// The outcome of a call, as the standard numbers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub(crate) enum Status {
    Ok = 0,
    Error = 3,
}

/// The longest step, s.
const LONGEST: f64 = 3600.0;

pub(crate) type LogMessage = Option<extern "C" fn(*mut c_void, Status, *const c_char, *const c_char)>;

/// The part that a simulator saves and restores.
#[derive(Clone)]
pub(crate) struct Kept {
    part: Part,
    scenario: String,
    set: String,
    time: f64,
    /// None until initialisation.
    unit: Option<Unit>,
    /// The input before initialisation.
    volts: Option<f64>,
    counts: Option<i32>,
}

pub(crate) struct Instance {
    part: Part,
    resources: PathBuf,
    environment: *mut c_void,
    log: LogMessage,
    pub(crate) kept: Kept,
    /// Texts that were lent, by their variables.
    texts: HashMap<u32, CString>,
}

impl Kept {
    fn new(part: Part) -> Kept {
        Kept {
            part,
            scenario: String::new(),
            set: String::new(),
            time: 0.0,
            unit: None,
            volts: None,
            counts: None,
        }
    }
}

impl Instance {
    pub(crate) fn new(part: Part, resources: PathBuf, environment: *mut c_void, log: LogMessage) -> Instance {
        Instance { part, resources, environment, log, kept: Kept::new(part), texts: HashMap::new() }
    }

    /// Says why to whoever listens, and that it failed.
    pub(crate) fn fail(&self, why: &str) -> Status {
        let text = CString::new(why.replace('\0', " ")).unwrap_or_default();
        if let Some(log) = self.log {
            log(self.environment, Status::Error, c"logStatusError".as_ptr(), text.as_ptr());
        }
        Status::Error
    }

    pub(crate) fn told(&self, outcome: Result<(), String>) -> Status {
        match outcome {
            Ok(()) => Status::Ok,
            Err(why) => self.fail(&why),
        }
    }

    /// Everything as it was at instantiation.
    pub(crate) fn reset(&mut self) {
        self.kept = Kept::new(self.part);
    }

    /// Goes back to a state of such a unit.
    pub(crate) fn restore(&mut self, kept: &Kept) -> Result<(), String> {
        if kept.part != self.part {
            return Err(format!(
                "the state of clutch.{}: expected one of clutch.{}",
                kept.part.name(),
                self.part.name()
            ));
        }
        self.kept.clone_from(kept);
        Ok(())
    }

    /// Reads the scenario and begins.
    pub(crate) fn initialise(&mut self, start: f64) -> Result<(), String> {
        if start != 0.0 {
            return Err(format!("startTime = {start}: expected 0, where paths begin"));
        }
        let file = match self.kept.scenario.as_str() {
            "" => self.resources.join("scenario.toml"),
            given => PathBuf::from(given),
        };
        let mut set = Vec::new();
        for pair in self.kept.set.split([';', '\n']).map(str::trim).filter(|pair| !pair.is_empty()) {
            let (key, value) = pair
                .split_once('=')
                .ok_or_else(|| format!("set = {pair}: expected KEY=VALUE, as law.smc.kp_v=4"))?;
            set.push((key.trim().to_owned(), value.trim().to_owned()));
        }
        let scenario = Scenario::load(&file, &set).map_err(|e| e.to_string())?;
        let mut unit = Unit::new(self.part, scenario)?;
        if let Some(volts) = self.kept.volts {
            unit.set_real(volts)?;
        }
        if let Some(counts) = self.kept.counts {
            unit.set_whole(counts);
        }
        self.kept.unit = Some(unit);
        Ok(())
    }

    pub(crate) fn step(&mut self, now: f64, step: f64) -> Result<(), String> {
        if !(step > 0.0 && step <= LONGEST && now.is_finite()) {
            return Err(format!(
                "a step of {step} s from {now} s: expected one above 0 and at most {LONGEST} s"
            ));
        }
        let unit = self.kept.unit.as_mut().ok_or("a step before initialisation")?;
        unit.step(now, step)?;
        self.kept.time = now + step;
        Ok(())
    }

    fn known(&self, reference: u32, kind: Kind, set: bool) -> Result<(), String> {
        match self.part.variable(reference, kind) {
            Some(variable) if set && !variable.is_settable() => {
                Err(format!("{}: expected an input or a parameter", variable.name))
            }
            Some(_) => Ok(()),
            None => Err(format!("no variable {reference} of type {kind:?} in clutch.{}", self.part.name())),
        }
    }

    fn begun(&self) -> Result<&Unit, String> {
        self.kept.unit.as_ref().ok_or_else(|| "a value before initialisation".to_owned())
    }

    pub(crate) fn real(&self, reference: u32) -> Result<f64, String> {
        self.known(reference, Kind::Float64, false)?;
        if reference == is::TIME { Ok(self.kept.time) } else { Ok(self.begun()?.real(reference)) }
    }

    pub(crate) fn whole(&self, reference: u32) -> Result<i32, String> {
        self.known(reference, Kind::Int32, false)?;
        Ok(self.begun()?.whole(reference))
    }

    pub(crate) fn truth(&self, reference: u32) -> Result<bool, String> {
        self.known(reference, Kind::Boolean, false)?;
        Ok(self.begun()?.stuck())
    }

    /// A text, lent: it lives until its variable is read again.
    pub(crate) fn lent_text(&mut self, reference: u32) -> Result<*const c_char, String> {
        self.known(reference, Kind::String, false)?;
        let text = if reference == is::SCENARIO { &self.kept.scenario } else { &self.kept.set };
        let text = CString::new(text.as_str()).unwrap_or_default();
        Ok(self.texts.entry(reference).insert_entry(text).get().as_ptr())
    }

    pub(crate) fn set_real(&mut self, reference: u32, value: f64) -> Result<(), String> {
        self.known(reference, Kind::Float64, true)?;
        self.kept.volts = Some(value);
        self.kept.unit.as_mut().map_or(Ok(()), |unit| unit.set_real(value))
    }

    pub(crate) fn set_whole(&mut self, reference: u32, value: i32) -> Result<(), String> {
        self.known(reference, Kind::Int32, true)?;
        self.kept.counts = Some(value);
        if let Some(unit) = &mut self.kept.unit {
            unit.set_whole(value);
        }
        Ok(())
    }

    pub(crate) fn set_text(&mut self, reference: u32, value: &str) -> Result<(), String> {
        self.known(reference, Kind::String, true)?;
        if self.kept.unit.is_some() {
            return Err("scenario and set: expected before initialisation".to_owned());
        }
        let text = if reference == is::SCENARIO { &mut self.kept.scenario } else { &mut self.kept.set };
        value.clone_into(text);
        Ok(())
    }
}
