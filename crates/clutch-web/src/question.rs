//! Questions, and who answers them.

use crate::bits::bits;
use crate::drawn::drawn;
use crate::json::{object, text};
use clutch_sim::progress::UNWATCHED;
use clutch_sim::scenario::{Table, Value};
use clutch_sim::{Keep, Run, Scenario};
use std::path::Path;

/// A run: a built-in scenario, and values for keys as `--set` takes them.
#[derive(Clone, PartialEq)]
struct Asked {
    scenario: String,
    set: Vec<(String, String)>,
}

/// A run that was asked for.
struct Kept {
    asked: Asked,
    done: Result<(Scenario, Run), String>,
}

/// The one who answers, and keeps the runs of the last question: those that no slider touched are not run again.
#[derive(Default)]
pub struct Answerer {
    kept: Vec<Kept>,
}

/// A line of TOML, the language of scenarios, with lists as JSON writes them, too.
const EXPECTED: &str = "expected runs = or bits = [[\"SCENARIO\", [[\"KEY\", \"VALUE\"], …]], …]";

impl Answerer {
    /// One who was asked nothing.
    #[must_use]
    pub const fn new() -> Answerer {
        Answerer { kept: Vec::new() }
    }

    /// The answer to a question, in JSON: to `runs = [["pd_2", [["law.pd.kp_v_rad", "4000"]]]]` runs as they are drawn on common
    /// axes, to `bits = …` their hashes. An object with `error` to a question that is none; in a run's place, if it has none.
    #[must_use]
    pub fn answer(&mut self, question: &str) -> String {
        let asked = |value: &Value| value.as_array()?.iter().map(Asked::new).collect::<Option<Vec<_>>>();
        let table: Table = question.parse().unwrap_or_default();
        match (table.get("runs").and_then(asked), table.get("bits").and_then(asked)) {
            (Some(runs), None) => self.runs(runs),
            (None, Some(runs)) => object(runs.iter().map(|asked| {
                let hash = asked.run().map(|(_, run)| format!("{:08x}", bits(&run)));
                (asked.scenario.as_str(), text(&hash.unwrap_or_else(|error| error)))
            })),
            _ => object([("error", text(&format!("{question}: {EXPECTED}")))]),
        }
    }

    fn runs(&mut self, asked: Vec<Asked>) -> String {
        let mut before = std::mem::take(&mut self.kept);
        self.kept = asked
            .into_iter()
            .map(|asked| match before.iter().position(|k| k.asked == asked) {
                Some(place) => before.swap_remove(place),
                None => Kept { done: asked.run(), asked },
            })
            .collect();
        let done: Vec<_> = self.kept.iter().map(|k| k.done.as_ref().map_err(String::as_str)).collect();
        drawn(&done)
    }
}

impl Asked {
    fn new(value: &Value) -> Option<Asked> {
        let pair = |value: &Value| match value.as_array()?.as_slice() {
            [key, value] => Some((key.as_str()?.to_owned(), value.as_str()?.to_owned())),
            _ => None,
        };
        match value.as_array()?.as_slice() {
            [Value::String(scenario), Value::Array(set)] => {
                Some(Asked { scenario: scenario.clone(), set: set.iter().map(pair).collect::<Option<_>>()? })
            }
            _ => None,
        }
    }

    fn run(&self) -> Result<(Scenario, Run), String> {
        let scenario = Scenario::load(Path::new(&self.scenario), &self.set).map_err(|e| e.to_string())?;
        let run = scenario.run(Keep::Trace, UNWATCHED).map_err(|e| e.to_string())?;
        Ok((scenario, run))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value as Json, json};

    fn answer(question: &str) -> Json {
        serde_json::from_str(&Answerer::new().answer(question)).expect("JSON")
    }

    #[test]
    fn a_run_has_the_figures_of_the_simulator() {
        let set = [("reference.ramp.rate_deg_s".to_owned(), "3".to_owned())];
        let scenario = Scenario::load(Path::new("bench_smc_2"), &set).expect("it is built in");
        let run = scenario.run(Keep::Trace, UNWATCHED).expect("it runs");
        let answer = answer(r#"runs = [["bench_smc_2", [["reference.ramp.rate_deg_s", "3"]]]]"#);
        for figure in clutch_sim::Metrics::FIGURES {
            assert_eq!(
                answer["runs"][0]["metrics"][figure.field].as_f64(),
                figure.of(&run.metrics),
                "{}",
                figure.name
            );
        }
        let window = &answer["runs"][0]["window"];
        let samples = window["counts"].as_array().map_or(0, Vec::len);
        assert!(samples > 40 && window["time_s"].as_array().map(Vec::len) == Some(samples), "{window}");
    }

    #[test]
    fn a_wrong_value_is_said_in_the_place_of_its_run_and_the_others_run() {
        let answer = answer(
            r#"runs = [["bench_pd_2", [["law.pd.kp_v_rad", "-1"]]], ["bench_smc_2", []], ["bench_pd_2", [["law.pd.kq", "1"]]]]"#,
        );
        let error = |i: usize| answer["runs"][i]["error"].as_str().unwrap_or_default().to_owned();
        assert!(error(0).contains("law.pd.kp_v_rad = -1") && error(0).contains("at least 0"), "{}", error(0));
        assert_eq!(error(1), "");
        assert!(error(2).contains("law.pd.kq"), "{}", error(2));
        assert!(answer["window"]["from_s"].is_number());
    }

    #[test]
    fn what_is_no_question_is_answered_with_what_one_is() {
        for wrong in [
            "",
            "runs",
            "runs = 1",
            "runs = [[1, []]]",
            r#"runs = [["pd_2", [["a"]]]]"#,
            "bits = []\nruns = []",
        ] {
            let error = answer(wrong)["error"].as_str().unwrap_or_default().to_owned();
            assert!(error.starts_with(wrong) && error.ends_with(EXPECTED), "{error}");
        }
        assert_eq!(answer("runs = []"), json!({ "window": null, "runs": [] }));
    }

    #[test]
    fn runs_that_are_kept_answer_as_new_ones_do() {
        let [pd, smc] = [r#"["bench_pd_2", []]"#, r#"["bench_smc_2", []]"#];
        let mut answerer = Answerer::new();
        let first = answerer.answer(&format!("runs = [{pd}]"));
        let _ = answerer.answer(&format!("runs = [{smc}, {pd}]"));
        assert_eq!(answerer.answer(&format!("runs = [{pd}]")), first);
    }

    #[test]
    fn the_hash_of_a_run_tells_another_seed() {
        let of = |seed: &str| answer(&format!(r#"bits = [["bench_pd_2", [["run.seed", "{seed}"]]]]"#));
        assert_eq!(of("1"), of("1"));
        assert_ne!(of("1"), of("2"));
    }
}
