//! The settings of a run: one tree of parameters, each declared once, and the keys that follow.

use super::points::FIRST_KNOT;
use clutch_core::law::{LawParams, OutputParams, ShellParams};
use clutch_core::params::{ChoiceInfo, Conversion, Info, Kind, NONE, Range, Row, TableInfo, Unit};
use clutch_core::reference::ReferenceParams;
use clutch_core::{
    Bounds, DacParams, EncoderParams, FNV_64, LimitParams, PlantParams, SafeState, SamplingParams,
    SmoothedDerivativeParams, SpeedLimit, fnv1a_64,
};
use core::fmt::{self, Write as _};

clutch_core::params! {
    /// Waiting times of a board controller, and of encoder and converter for it.
    pub struct RunTimes<> {
        /// The watchdog of encoder and converter.
        watchdog: clutch_core::Micros, "watchdog_us" "" US, Range::ANY;
        /// Time after its sample during which a code is valid.
        valid: clutch_core::Micros, "valid_us" "" US, Range::ANY;
        /// Time without a sample after which the silence check runs.
        silence: clutch_core::Micros, "silence_us" "" US, Range::ANY;
        /// Time without a frame of the host after which the run ends in the safe state; 0 lets it go on.
        host_silence: clutch_core::Micros, "host_silence_us" "" US, Range::ANY;
    }
}

clutch_core::params! {
    /// A run as a board controller takes it. The points of a path that is a table stand elsewhere.
    pub struct RunSettings<'a, f32> {
        /// Ticks of the run, after which it ends in the safe state.
        ticks: u64, "ticks" "" TICKS, Range::ANY;
        /// Position at which the path begins, within a count: 2⁻¹⁶ counts.
        start: u32, "start_counts_x65536" "" NONE, Range::within(0.0, 65535.0);
    }
    nested {
        /// Times.
        times: RunTimes, "times";
        /// Sampling.
        sampling: SamplingParams, "sampling";
        /// The encoder.
        encoder: EncoderParams, "rig.encoder";
        /// The converter.
        dac: DacParams<f32>, "rig.dac";
        /// The difference that gives the velocity: boards have no observer.
        velocity: SmoothedDerivativeParams<f32>, "velocity.smoothed_derivative";
        /// The shaft as the law believes it to be.
        model: PlantParams<f32>, "model";
        /// The law and its gains.
        law: LawParams<f32>, "law";
        /// Output stage.
        output: OutputParams<f32>, "output";
        /// The shell around the law.
        shell: ShellParams<f32>, "shell";
        /// The brake's voltage when control has ended.
        on_fault: SafeState<f32>, "safety.on_fault";
        /// Limits of the supervisor.
        limits: LimitParams<f32>, "safety.limits";
        /// The speed that a path may ask for.
        speed: SpeedLimit<f32>, "rig";
        /// Bounds on the plant.
        bounds: Bounds<f32>, "bounds";
        /// The path.
        reference: ReferenceParams<'a, f32>, "reference";
    }
}

/// All that is declared.
const DECLARED: &TableInfo = &<RunSettings<'static> as clutch_core::params::Table<f32>>::TABLE;

/// Settings, but for the points of a table.
pub const SETTINGS: usize = DECLARED.places();

const _: () = assert!(SETTINGS < FIRST_KNOT as usize, "keys of their own for the points of a table");

/// Hash of the settings (FNV-1a, 64 bit, over `name:type:unit` and a line feed each, in the order of the keys):
/// two ends with the same hash mean the same by each key.
pub const SETTINGS_HASH: u64 = hash_table(FNV_64, Name::NONE, DECLARED);

/// Tables within tables; deeper ones do not compile.
const DEEPEST: usize = 6;

/// The name of a setting: its key in a scenario with that of its tables, as `law.smc.kp_v`.
#[derive(Clone, Copy, Debug)]
pub struct Name {
    parts: [&'static str; DEEPEST],
    used: usize,
}

impl Name {
    const NONE: Name = Name { parts: [""; DEEPEST], used: 0 };

    #[allow(clippy::indexing_slicing, reason = "at compile time, where it is an error of the compiler's")]
    const fn below(mut self, key: &'static str) -> Name {
        self.parts[self.used] = key;
        self.used += 1;
        self
    }

    /// Hashes the name with what follows it.
    #[allow(clippy::indexing_slicing, reason = "at compile time, where it is an error of the compiler's")]
    const fn hash(&self, mut hash: u64) -> u64 {
        let mut i = 0;
        while i < self.used {
            if i > 0 {
                hash = fnv1a_64(hash, b".");
            }
            hash = fnv1a_64(hash, self.parts[i].as_bytes());
            i += 1;
        }
        hash
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, part) in self.parts.iter().take(self.used).enumerate() {
            write!(f, "{}{part}", if i > 0 { "." } else { "" })?;
        }
        Ok(())
    }
}

#[allow(
    clippy::indexing_slicing,
    clippy::panic,
    reason = "at compile time, where it is an error of the compiler's"
)]
const fn hash_table(mut hash: u64, name: Name, table: &TableInfo) -> u64 {
    let mut i = 0;
    while i < table.rows.len() {
        let row = &table.rows[i];
        assert!(!row.optional, "a board needs a number for each setting");
        hash = fnv1a_64(name.below(row.key).hash(hash), b":");
        hash = match row.kind {
            Kind::Real => fnv1a_64(hash, b"f32"),
            Kind::Whole => fnv1a_64(hash, b"whole"),
            Kind::Switch => fnv1a_64(hash, b"switch"),
            Kind::Points => fnv1a_64(hash, b"points"),
            Kind::Text => panic!("a board reads no texts"),
            Kind::Word(words) => {
                let mut w = 0;
                while w < words.len() {
                    hash = fnv1a_64(fnv1a_64(hash, if w > 0 { b"/" } else { b"" }), words[w].name.as_bytes());
                    w += 1;
                }
                hash
            }
        };
        hash = fnv1a_64(fnv1a_64(fnv1a_64(hash, b":"), row.unit.si.as_bytes()), b"\n");
        i += 1;
    }
    i = 0;
    while i < table.nested.len() {
        let below = &table.nested[i];
        assert!(!below.optional && !below.key.is_empty(), "a board needs each table, and enters it");
        let name = name.below(below.key);
        hash = match below.info {
            Info::Table(table) => hash_table(hash, name, table),
            Info::Choice(choice) => hash_choice(hash, name, choice),
        };
        i += 1;
    }
    hash
}

#[allow(clippy::indexing_slicing, reason = "at compile time, where it is an error of the compiler's")]
const fn hash_choice(mut hash: u64, name: Name, choice: &ChoiceInfo) -> u64 {
    hash = fnv1a_64(name.hash(hash), b":");
    let mut i = 0;
    while i < choice.options.len() {
        hash = fnv1a_64(fnv1a_64(hash, if i > 0 { b"/" } else { b"" }), choice.options[i].key.as_bytes());
        i += 1;
    }
    hash = fnv1a_64(hash, b":\n");
    i = 0;
    while i < choice.options.len() {
        hash = hash_table(hash, name.below(choice.options[i].key), choice.options[i].table);
        i += 1;
    }
    hash
}

/// A setting as it is declared. For hosts: it has texts.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Its key on the wire.
    pub key: u16,
    /// Its name.
    pub name: Name,
    /// Meaning of the table within the outer one: some tables stand in several places.
    pub within: &'static str,
    /// Its declaration.
    pub declared: Declared,
}

/// The declaration of a setting.
#[derive(Clone, Copy, Debug)]
pub enum Declared {
    /// A parameter, and the table that it belongs to.
    Row(&'static Row, &'static TableInfo),
    /// A choice between tables.
    Choice(&'static ChoiceInfo),
}

impl Setting {
    /// The setting of that key; none for a key of a table's points, and for one that is none.
    #[must_use]
    pub fn of(key: u16) -> Option<Setting> {
        let (mut table, mut name, mut within, mut rest) = (DECLARED, Name::NONE, "", usize::from(key));
        // Each turn goes to a table below.
        for _ in 0..DEEPEST {
            let found = |name, within, declared| Some(Setting { key, name, within, declared });
            if let Some(row) = table.rows.get(rest) {
                return found(name.below(row.key), within, Declared::Row(row, table));
            }
            rest -= table.rows.len();
            let below = table.nested.iter().find(|below| {
                let here = rest < below.info.places();
                rest -= if here { 0 } else { below.info.places() };
                here
            })?;
            (name, within) = (name.below(below.key), below.doc);
            table = match below.info {
                Info::Table(table) => table,
                Info::Choice(choice) => {
                    let Some(places) = rest.checked_sub(1) else {
                        return found(name, within, Declared::Choice(choice));
                    };
                    rest = places;
                    let option = choice.options.iter().find(|option| {
                        let here = rest < option.table.places();
                        rest -= if here { 0 } else { option.table.places() };
                        here
                    })?;
                    name = name.below(option.key);
                    option.table
                }
            };
        }
        None
    }

    /// Every setting, in the order of the keys.
    pub fn all() -> impl Iterator<Item = Setting> {
        (0..SETTINGS as u16).filter_map(Setting::of)
    }

    /// Its name as a constant in C, as `LAW_SMC_KP_V`: it ends with the unit on the wire, which is not always that of the key.
    #[must_use]
    pub fn constant(&self) -> impl fmt::Display {
        struct Constant(Setting);
        impl fmt::Display for Constant {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                let name = self.0.name;
                let mut write = |text: &str| {
                    text.chars().try_for_each(|c| {
                        f.write_char(if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' })
                    })
                };
                for (i, part) in name.parts.iter().take(name.used).enumerate() {
                    write(if i > 0 { "_" } else { "" })?;
                    let unit = match self.0.declared {
                        Declared::Row(row, _) if i + 1 == name.used => row.unit,
                        _ => NONE,
                    };
                    // The wire carries the number of points.
                    let points = matches!(self.0.declared, Declared::Row(row, _) if row.kind == Kind::Points);
                    match (part.strip_suffix(unit.suffix), unit.conversion) {
                        (Some(stem), _) if points && i + 1 == name.used => write(stem.trim_end_matches('_'))?,
                        (Some(stem), Conversion::Degrees) => {
                            write(stem)?;
                            write("rad")?;
                            write(unit.suffix.strip_prefix("deg").unwrap_or_default())?;
                        }
                        (Some(stem), Conversion::Percent) => {
                            write(stem)?;
                            write("share")?;
                        }
                        _ => write(part)?,
                    }
                }
                Ok(())
            }
        }
        Constant(*self)
    }

    /// Its type, as the hash has it.
    #[must_use]
    pub fn kind(&self) -> impl fmt::Display {
        struct Type(Declared);
        impl fmt::Display for Type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                let join = |f: &mut fmt::Formatter<'_>, names: &mut dyn Iterator<Item = &'static str>| {
                    for (i, name) in names.enumerate() {
                        write!(f, "{}{name}", if i > 0 { "/" } else { "" })?;
                    }
                    Ok(())
                };
                match self.0 {
                    Declared::Choice(choice) => join(f, &mut choice.options.iter().map(|option| option.key)),
                    Declared::Row(row, _) => match row.kind {
                        Kind::Real => f.write_str("f32"),
                        Kind::Whole => f.write_str("whole"),
                        Kind::Switch => f.write_str("switch"),
                        Kind::Points => f.write_str("points"),
                        Kind::Text => f.write_str("text"),
                        Kind::Word(words) => join(f, &mut words.iter().map(|word| word.name)),
                    },
                }
            }
        }
        Type(self.declared)
    }

    /// Its unit on the wire; empty for a plain number.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        match self.declared {
            Declared::Row(row, _) => row.unit.si,
            Declared::Choice(_) => "",
        }
    }

    /// The unit that people are shown with its value: both ends of an interval have that of the interval's key.
    pub(crate) fn shown_unit(&self) -> Unit {
        let Declared::Row(row, _) = self.declared else {
            return NONE;
        };
        let within = self.name.used.checked_sub(2).and_then(|i| self.name.parts.get(i));
        match within.and_then(|key| Unit::of_key(key)) {
            // The wire carries SI: the unit of a key that is converted is not the number's.
            Some(unit) if row.unit == NONE && unit.conversion == Conversion::None => *unit,
            _ => row.unit,
        }
    }

    /// Its meaning.
    #[must_use]
    pub fn doc(&self) -> &'static str {
        match self.declared {
            Declared::Row(row, _) => row.doc,
            Declared::Choice(choice) => choice.doc,
        }
    }
}
