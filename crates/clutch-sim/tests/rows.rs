//! Every parameter of a scenario, at its limits, below and above them, and as no number: in a file, by `--set` and in a
//! row of a sweep. A parameter that is refused is named with its key, its value and what is expected, unit included;
//! one that is taken arrives in the parameters as it was given.

use clutch_core::params::{
    Choice, Conversion, Editor, Info, Kind, Params, Range, Row, Table as Parameters, TableInfo,
};
use clutch_sim::scenario::ScenarioParams;
use clutch_sim::scenario::describe::{Entry, entries, row_is_required, table_is_required};
use clutch_sim::sweep::Sweep;
use clutch_sim::{Points, Scenario, ScenarioError, Text};
use std::any::Any;
use std::collections::BTreeMap;
use toml::{Table, Value};

/// Values with which a scenario is good, where one made of the range alone is not. Keys or their ends.
const SAMPLES: &[(&str, &str)] = &[
    ("points_deg_factor", "[[0.0, 1.0], [0.3, 1.1], [0.6, 0.9], [0.9, 1.0]]"),
    ("name", "\"rows\""),
    ("rig.base", "\"paper\""),
    ("rig.ripple.rms", "0.05"),
    ("rig.runout.amplitude", "0.2"),
    ("bounds.ripple_percent", "0.0"), // a part of the default friction_percent
    ("amplitude_deg", "0.1"),
    ("actuator.motor.preload_nm", "0.1"),
    ("volts_v", "4.5"),
    ("safety.reason", "\"a weight drives the shaft\""),
];

/// A parameter and a good scenario that has its table.
struct Place {
    key: String,
    row: &'static Row,
    base: Table,
}

/// Every parameter of every table and of every option.
fn places() -> Vec<Place> {
    let mut keys = Vec::new();
    keys_of(&<ScenarioParams as Params<f64>>::INFO, "", &mut keys);
    let place = |(key, row): (String, &'static Row)| {
        let mut base = Table::new();
        fill(&<ScenarioParams as Params<f64>>::INFO, "", &key, &mut base);
        drive(&mut base);
        Place { key, row, base }
    };
    keys.into_iter().map(place).collect()
}

/// Rig and model get the same actuator, and what drives an output with two sides.
fn drive(base: &mut Table) {
    let there = ["rig", "model"].iter().find_map(|of| base.get(*of)?.get("actuator").cloned());
    let Some(actuator) = there else { return };
    let mut set = |table: &str, key: &str, value: Value| {
        let table = base.entry(table).or_insert(Value::Table(Table::new()));
        table.as_table_mut().unwrap().insert(key.to_owned(), value);
    };
    if actuator.get("motor").is_some() || actuator.get("both").is_some() {
        set("output", "lowest_v", Value::Float(-10.0));
    }
    if actuator.get("motor").is_some() {
        set("output", "on_invalid_v", Value::Float(0.0));
    }
    set("rig", "actuator", actuator.clone());
    set("model", "actuator", actuator);
}

fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

fn keys_of(info: &'static Info, path: &str, keys: &mut Vec<(String, &'static Row)>) {
    let mut table = |table, path: &str| {
        for entry in entries(table) {
            match entry {
                Entry::Row(row, _) => keys.push((join(path, row.key), row)),
                Entry::Below(nested) => keys_of(nested.info, &join(path, nested.key), keys),
            }
        }
    };
    match info {
        Info::Table(info) => table(info, path),
        Info::Choice(choice) => choice.options.iter().for_each(|o| table(o.table, &join(path, o.key))),
    }
}

/// Fills in what a file has to say, and the table of the key `wanted`.
fn fill(info: &'static Info, path: &str, wanted: &str, out: &mut Table) {
    let leads = |path: &str| wanted.starts_with(&format!("{path}."));
    let (table, path, out) = match info {
        Info::Table(table) => (table, path.to_owned(), out),
        Info::Choice(choice) => {
            let options = choice.options.iter();
            let option =
                options.clone().find(|o| leads(&join(path, o.key))).or(options.clone().next()).unwrap();
            let below = out.entry(option.key).or_insert(Value::Table(Table::new()));
            (option.table, join(path, option.key), below.as_table_mut().unwrap())
        }
    };
    for entry in entries(table) {
        match entry {
            Entry::Row(row, _) if row_is_required(row) => {
                out.insert(row.key.to_owned(), sample(&join(&path, row.key), row));
            }
            Entry::Row(..) => {}
            Entry::Below(nested) => {
                let at = join(&path, nested.key);
                if leads(&at) || table_is_required(nested) {
                    let mut below = Table::new();
                    fill(nested.info, &at, wanted, &mut below);
                    out.insert(nested.key.to_owned(), Value::Table(below));
                }
            }
        }
    }
}

/// A good value.
fn sample(key: &str, row: &Row) -> Value {
    if let Some((_, text)) = SAMPLES.iter().find(|(end, _)| key == *end || key.ends_with(&format!(".{end}")))
    {
        return value(text);
    }
    if !row.default.is_empty() {
        return value(row.default);
    }
    let Range { low, high, .. } = row.range;
    let middle = match (low.is_finite(), high.is_finite()) {
        (true, true) => (low + high) / 2.0,
        (true, false) => low + 1.0,
        _ => 1.0,
    };
    match row.kind {
        Kind::Real => Value::Float(middle),
        Kind::Whole => Value::Integer(middle as i64),
        Kind::Switch => Value::Boolean(true),
        Kind::Word(words) => Value::String(words[0].name.to_owned()),
        Kind::Text => Value::String("text".to_owned()),
        Kind::Points => value("[[0.0, 0.0], [1.0, 1.0]]"),
    }
}

fn value(text: &str) -> Value {
    format!("x = {text}").parse::<Table>().expect(text).remove("x").expect("a value")
}

/// A value as an error shows it.
fn shown(value: &Value) -> String {
    match value {
        Value::Float(x) => x.to_string(),
        other => other.to_string(),
    }
}

/// Values outside of a range, and values at its ends or just within.
fn around(row: &Row) -> (Vec<Value>, Vec<Value>) {
    let Range { low, low_in, high, high_in, divides } = row.range;
    let (mut out, mut within) = (Vec::new(), Vec::new());
    match row.kind {
        Kind::Real => {
            out.extend([f64::NAN, f64::INFINITY, f64::NEG_INFINITY].map(Value::Float));
            for (end, taken, sign) in [(low, low_in, -1.0), (high, high_in, 1.0)] {
                if !end.is_finite() {
                    continue;
                }
                let hair = 1e-9 * end.abs().max(1.0);
                out.push(Value::Float(end + sign * hair));
                if taken { &mut within } else { &mut out }.push(Value::Float(end));
                within.push(Value::Float(end - sign * hair));
            }
            if divides {
                // Its inverse is not finite.
                out.push(Value::Float(1e-310));
            }
        }
        Kind::Whole => {
            // The largest that a file can hold: as a real number it is one more.
            let high = if high < i64::MAX as f64 { high as i64 } else { i64::MAX };
            let low = low.max(0.0) as i64;
            out.push(Value::Integer(low - 1));
            out.extend([value("nan"), value("inf"), value("-inf"), value("2.5"), value("\"3\"")]);
            within.extend([Value::Integer(low), Value::Float(low as f64)]);
            if row.range.high.is_finite() {
                out.extend(high.checked_add(1).map(Value::Integer));
                within.push(Value::Integer(high));
            }
        }
        Kind::Switch => {
            out.extend([value("1"), value("nan"), value("\"yes\"")]);
            within.extend([value("true"), value("false")]);
        }
        Kind::Word(words) => {
            out.extend([value("\"nothing of that kind\""), value("1"), value("nan")]);
            within.extend(words.iter().map(|word| Value::String(word.name.to_owned())));
        }
        Kind::Text => {
            out.extend([value("3"), value("nan")]);
            within.push(value("\"any ° text\""));
        }
        Kind::Points => {
            out.extend(
                ["[[0.0, nan], [1.0, 1.0]]", "[[inf, 0.0]]", "[[1.0, 0.0], [1.0, 1.0]]", "[[0.0]]", "nan"]
                    .map(value),
            );
            if low.is_finite() {
                out.push(value(&format!("[[{:?}, 0.0], [{:?}, 1.0]]", low - 1e-9, low + 1.0)));
                within.push(value(&format!("[[{low:?}, 0.0], [{:?}, 1.0]]", low + 1.0)));
            }
            within.push(value("[[0.0, 0.0], [1.0, 1.0]]"));
        }
    }
    (out, within)
}

/// True if a message speaks of a row's own range, or of the kind of its value.
fn speaks_of_the_range(row: &Row, message: &str) -> bool {
    match row.kind {
        // The message about a base lists its words.
        Kind::Word(words) => words.iter().all(|word| message.contains(word.name)),
        kind => message.starts_with(&format!("expected {}", row.range.words(kind, &row.unit, false))),
    }
}

#[track_caller]
fn is_refused(place: &Place, value: &Value, outcome: Result<Scenario, ScenarioError>, how: &str) {
    let Place { key, row, .. } = place;
    let error = match outcome {
        Ok(_) => panic!("{key} = {value}, {how}: taken"),
        Err(error) => error,
    };
    let said = format!("{key} = {value}, {how}: {error}");
    assert_eq!(error.key, *key, "{said}");
    let point = row.kind == Kind::Points && error.value.starts_with('[') && error.value.contains("] (point ");
    assert!(error.value == shown(value) || point, "{said}");
    assert!(speaks_of_the_range(row, &error.message), "{said}");
    assert!(error.message.contains(row.unit.text), "{said}");
    // A path with the key, the value and the unit: what a person reads.
    assert!(error.to_string().starts_with(&format!("rows: {key} = ")), "{said}");
}

/// The parameter is what was given, or something that depends on other keys is wrong with the scenario.
#[track_caller]
fn is_taken(place: &Place, value: &Value, outcome: Result<Scenario, ScenarioError>, how: &str) {
    let Place { key, row, .. } = place;
    match outcome {
        // An engine is refused for the rig's friction: a relation that no table holds.
        Err(error) if key == "run.engine" => {
            assert!(error.message.contains("friction"), "{key} = {value}, {how}: {error}")
        }
        Err(error) => assert!(
            error.key != *key
                || !speaks_of_the_range(row, &error.message)
                || !error.message.contains("expected"),
            "{key} = {value}, {how}: {error}"
        ),
        Ok(scenario) => {
            let mut values = Values::default();
            scenario.params().clone().edit(&mut values);
            let found = values.found.get(key).unwrap_or_else(|| panic!("{key}, {how}: not there"));
            let expected = Values::of(row, value);
            assert!(*found == expected, "{key} = {value}, {how}: {found:?} instead of {expected:?}");
        }
    }
}

/// The value of each parameter, by its key.
#[derive(Default)]
struct Values {
    path: Vec<&'static str>,
    found: BTreeMap<String, Given>,
}

#[derive(Debug, PartialEq)]
enum Given {
    Number(f64),
    Word(usize),
    Text(String),
    Points(Vec<(f64, f64)>),
    /// A list that the core only borrows.
    Borrowed,
}

impl Values {
    fn insert<P: Parameters<f64>>(&mut self, row: usize, given: Given) {
        let path = self.path.iter().filter(|part| !part.is_empty());
        let key = path.fold(String::new(), |path, part| join(&path, part));
        self.found.insert(join(&key, P::ROWS[row].key), given);
    }

    /// The value that a parameter should have.
    fn of(row: &Row, value: &Value) -> Given {
        let number = |x: f64| match row.unit.conversion {
            Conversion::None => x,
            Conversion::Degrees => x.to_radians(),
            Conversion::Percent => x / 100.0,
        };
        match (row.kind, value) {
            (Kind::Word(words), Value::String(text)) => {
                Given::Word(words.iter().position(|word| word.name == text).unwrap())
            }
            (Kind::Points, Value::Array(_)) if row.field == "knots" => Given::Borrowed,
            (Kind::Points, Value::Array(points)) => {
                let pair = |p: &Value| (p[0].as_float().unwrap(), p[1].as_float().unwrap());
                Given::Points(points.iter().map(pair).collect())
            }
            (_, Value::Float(x)) => Given::Number(number(*x)),
            (_, Value::Integer(n)) => Given::Number(number(*n as f64)),
            (_, Value::Boolean(on)) => Given::Number(f64::from(*on)),
            (_, Value::String(text)) => Given::Text(text.clone()),
            (_, other) => panic!("{other}"),
        }
    }
}

impl Editor<f64> for Values {
    fn real<P: Parameters<f64>>(&mut self, row: usize, value: &mut f64) {
        self.insert::<P>(row, Given::Number(*value));
    }
    fn whole<P: Parameters<f64>>(&mut self, row: usize, value: &mut u64) {
        self.insert::<P>(row, Given::Number(*value as f64));
    }
    fn switch<P: Parameters<f64>>(&mut self, row: usize, value: &mut bool) {
        self.insert::<P>(row, Given::Number(f64::from(*value)));
    }
    fn word<P: Parameters<f64>>(&mut self, row: usize, value: &mut usize) {
        self.insert::<P>(row, Given::Word(*value));
    }
    fn other<P: Parameters<f64>>(&mut self, row: usize, value: Option<&mut dyn Any>) {
        let given = match value {
            None => Given::Borrowed,
            Some(value) => match value.downcast_ref::<Points>() {
                Some(points) => Given::Points(points.0.clone()),
                None => Given::Text(value.downcast_ref::<Text>().unwrap().0.clone()),
            },
        };
        self.insert::<P>(row, given);
    }
    fn enter<P: Parameters<f64>>(&mut self, nested: usize, present: bool) -> bool {
        self.path.push(P::TABLE.nested[nested].key);
        present
    }
    fn leave<P: Parameters<f64>>(&mut self, _: usize) {
        self.path.pop();
    }
    fn choose<C: Choice<f64>>(&mut self, chosen: usize) -> usize {
        self.path.push(C::CHOICE.options[chosen].key);
        chosen
    }
    fn chose<C: Choice<f64>>(&mut self, _: usize) {
        self.path.pop();
    }
}

/// The scenario from a file, by `--set`, and as the second row of a sweep whose first is good.
fn each_way(place: &Place, value: &Value) -> [(&'static str, Result<Scenario, ScenarioError>); 3] {
    let Place { key, row, base } = place;
    let mut file = base.clone();
    let parts: Vec<&str> = key.split('.').collect();
    let mut at = &mut file;
    for part in &parts[..parts.len() - 1] {
        at = at.entry(*part).or_insert(Value::Table(Table::new())).as_table_mut().unwrap();
    }
    at.insert(row.key.to_owned(), value.clone());
    let set = [(key.clone(), value.to_string())];
    let rows = vec![vec![sample(key, row)], vec![value.clone()]];
    let sweep = Sweep::new("rows", base.clone(), vec![key.clone()], rows).unwrap();
    sweep.scenario(0).unwrap_or_else(|e| panic!("{key}, in a sweep: {e}"));
    [
        ("in a file", Scenario::parse("rows", &file.to_string(), &[])),
        ("by --set", Scenario::parse("rows", &base.to_string(), &set)),
        ("in a row of a sweep", sweep.scenario(1)),
    ]
}

#[test]
fn every_table_is_part_of_a_good_scenario() {
    let places = places();
    for Place { key, base, .. } in &places {
        Scenario::parse("rows", &base.to_string(), &[])
            .unwrap_or_else(|e| panic!("{key}: {e}; a value for SAMPLES?\n{base}"));
    }
    assert!(places.len() > 90, "{}", places.len());
}

#[test]
fn a_value_out_of_range_is_refused_with_its_key_its_value_and_its_unit() {
    for place in places() {
        for value in around(place.row).0 {
            for (how, outcome) in each_way(&place, &value) {
                is_refused(&place, &value, outcome, how);
            }
        }
    }
}

#[test]
fn a_value_at_the_end_of_its_range_is_taken_as_it_is() {
    for place in places() {
        for value in around(place.row).1 {
            for (how, outcome) in each_way(&place, &value) {
                is_taken(&place, &value, outcome, how);
            }
        }
    }
}

#[test]
fn a_whole_number_has_a_range_that_its_parameter_holds() {
    for Place { key, row, .. } in places() {
        assert!(
            row.kind != Kind::Whole || row.range.high.is_finite(),
            "{key}: what does not fit would saturate"
        );
    }
}

#[test]
fn a_table_that_is_laid_over_a_base_is_named_with_its_own_key() {
    // The rig of this base has other tables with keys that end alike.
    let place = places().into_iter().find(|place| place.key == "rig.drive.hand.rms_nm").unwrap();
    let mut base = place.base;
    base["rig"]["base"] = Value::String("bench".to_owned());
    let set = [("rig.drive.hand.rms_nm".to_owned(), "-1".to_owned())];
    let error = Scenario::parse("bench", &base.to_string(), &set).unwrap_err().to_string();
    assert_eq!(error, "bench: rig.drive.hand.rms_nm = -1: expected a finite number of at least 0 N m");
}

#[test]
fn an_angle_of_the_supervisor_is_refused_in_degrees() {
    let place = places().into_iter().find(|place| place.key == "safety.limits.jump_deg").unwrap();
    let set = [("safety.limits.jump_deg".to_owned(), "-1".to_owned())];
    let error = Scenario::parse("board", &place.base.to_string(), &set).unwrap_err().to_string();
    assert_eq!(error, "board: safety.limits.jump_deg = -1: expected a finite number above 0 °");
    // A limit that depends on the encoder is given in degrees, too.
    let set = [("safety.limits.jump_deg".to_owned(), "0.001".to_owned())];
    let error = Scenario::parse("board", &place.base.to_string(), &set).unwrap_err().to_string();
    assert_eq!(
        error,
        "board: safety.limits.jump_deg = 0.001: expected an angle of at least one count of rig.encoder.counts_per_rev \
         and below 2³⁰ of them, °"
    );
}

#[test]
fn a_table_in_two_places_is_named_by_its_own() {
    // The same friction model is the rig's and the model's.
    let place = places().into_iter().find(|place| place.key == "model.friction.stribeck.mu_static").unwrap();
    let set = [("model.friction.stribeck.mu_static".to_owned(), "0".to_owned())];
    let error = Scenario::parse("two", &place.base.to_string(), &set).unwrap_err();
    assert_eq!((error.key.as_str(), error.value.as_str()), ("model.friction.stribeck.mu_static", "0"));
    let set = [("rig.friction.stribeck.mu_static".to_owned(), "0".to_owned())];
    Scenario::parse("two", &place.base.to_string(), &set).unwrap();
}

/// Law and velocity each have a filter; a constructor's error has the table alone, and the value tells which.
#[test]
fn of_two_filters_the_one_that_is_wrong_is_named() {
    let base = places().into_iter().find(|place| place.key == "law.glide.filter.ripple_share").unwrap().base;
    let velocity = "velocity.edge_timed.ripple_waves_per_turn";
    let law = "law.glide.filter.ripple_waves_per_turn";
    for (wrong, good) in [(law, velocity), (velocity, law)] {
        let set =
            [(good, "340.0"), (wrong, "20000.0")].map(|(key, value)| (key.to_owned(), value.to_owned()));
        let error = Scenario::parse("two", &base.to_string(), &set).unwrap_err();
        assert_eq!((error.key.as_str(), error.value.as_str()), (wrong, "20000"), "{error}");
    }
}

/// A relation of keys names another one; these relate the value to no other.
const BY_ITSELF: &[&str] = &[
    "at least one point",
    "times of at least 0 s that rise from point to point",
    "a list of 4 to 100 000 points",
    "the rig and the ride that it is of, as \"disc 7, 2 °/s\"",
    "factors of 0.1 to 10",
    "an angle less than 1 ° from the one before: the ripple of a disc has waves of about 1 °",
    "why this safe state is right for this rig, as \"a weight drives the shaft\"",
];

fn relations_of(info: &'static Info, found: &mut Vec<(&'static str, &'static str)>) {
    let mut table = |table: &'static TableInfo| {
        found.extend(table.relations.iter().map(|relation| (table.name, relation.expected)));
        for nested in table.nested {
            relations_of(nested.info, found);
        }
    };
    match info {
        Info::Table(info) => table(info),
        Info::Choice(choice) => choice.options.iter().for_each(|option| table(option.table)),
    }
}

#[test]
fn what_relates_two_parameters_names_the_other() {
    let mut keys = Vec::new();
    keys_of(&<ScenarioParams as Params<f64>>::INFO, "", &mut keys);
    let mut relations = Vec::new();
    relations_of(&<ScenarioParams as Params<f64>>::INFO, &mut relations);
    assert!(relations.len() > 40, "{}", relations.len());
    let is_key = |word: &str| {
        let ends = |key: &str| key == word || key.ends_with(&format!(".{word}"));
        // Of a table, too: `rig.friction`.
        let begins = |key: &str| key.contains(&format!("{word}.")) && word.contains('.');
        keys.iter().any(|(key, _)| ends(key) || begins(key))
    };
    let names_none = |expected: &str| {
        let mut words = expected
            .split(|c: char| !(c.is_alphanumeric() || "._".contains(c)))
            .map(|word| word.trim_matches('.'));
        !words.any(|word| (word.contains('_') || word.contains('.')) && is_key(word))
    };
    let wrong: Vec<_> = relations
        .into_iter()
        .filter(|(_, expected)| names_none(expected) && !BY_ITSELF.contains(expected))
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}
