#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod laws;
mod proof;
mod trial;

pub use proof::ShellTried;
pub use trial::Score;

use clutch_certificate::Certificate;
use clutch_core::params::Choice;
use clutch_core::reference::ReferenceParams;
use clutch_identify::{Believed, Corner, RigFile, believed};
use clutch_sim::pool;
use clutch_sim::progress::Report;
use clutch_sim::scenario::{Table, Value};
use clutch_sim::smooth_speed::RATE;
use clutch_sim::{Scenario, ScenarioError};
use laws::{FAMILIES, Family, Gains, SMOOTHING, Volts, family_of};
use proof::{Bounds, prove};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::VecDeque;
use trial::{Trial, scores};

/// The request.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Rates at which gains are to be smooth, °/s; none: the scenario's own, or its own path where that is no ramp.
    pub rates_deg_s: Vec<f64>,
    /// Candidates of each law.
    pub candidates: u32,
    /// Gives out gains without a certificate if no law with one is smooth.
    pub uncertified: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options { rates_deg_s: Vec::new(), candidates: 32, uncertified: false }
    }
}

/// Candidates of a law that may be asked for.
const MOST_CANDIDATES: u32 = 10_000;
/// Rates that may be asked for.
const MOST_RATES: usize = 20;
/// Candidates of a law that go on to the corners.
const KEPT: usize = 6;
/// Highest voltage of a motor that goes forwards alone, over that which friction at rest takes.
const HIGHEST_OVER_REST: f64 = 3.0;
/// Seeds of discs: to sort the candidates out, to choose among the rest, to judge, and to accept. None is in two of them.
const FIRST: std::ops::RangeInclusive<u64> = 1..=2;
const CHOOSING: std::ops::RangeInclusive<u64> = 3..=6;
const JUDGING: std::ops::RangeInclusive<u64> = 101..=108;
const ACCEPTING: std::ops::RangeInclusive<u64> = 201..=210;
/// Gains of a law that are looked at behind its best, each on judging and accepting discs of its own, where sticks refused the ones
/// before and were rare: in one of so many runs at most. Chance decides there.
const NEXT_GAINS: usize = 2;
const RARE: u32 = 8;
/// Least time behind the settling time along a path that is no ramp, s.
const LEAST_S: f64 = 1.0;
/// Lengths of their runs on a ramp, s; along another path they are as long as the scenario's.
const SHORT_S: f64 = 2.0;
const LONG_S: f64 = 4.0;
const ACCEPT_S: f64 = 6.0;

/// The outcome of a candidate.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "is")]
pub enum Outcome {
    /// Its gains are given out.
    Chosen,
    /// Smoother ones are.
    Rougher {
        /// The cost of the one that is chosen.
        than: f64,
    },
    /// It has no certificate, and one that has is chosen, or none without one was asked for.
    Uncertified {
        /// The limit.
        why: String,
    },
    /// On discs that it was not chosen on it sticks, or leaves its path.
    Refused {
        /// Its behaviour.
        why: String,
    },
    /// On the discs on which candidates are judged it leaves its path.
    Strays,
    /// No gains were found whose sampled loop is stable.
    Unstable,
}

/// The proof of a candidate.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "is")]
pub enum Verdict {
    /// The error is bounded.
    Certified {
        /// Bound on the error, the largest of all rates, rad.
        error_rad: f64,
        /// Within a shell, whatever law is inside; else by the law's own gains.
        shell: bool,
        /// The bound at each rate, with its scope.
        lines: Vec<String>,
    },
    /// Nothing is.
    Uncertified {
        /// The limit.
        why: String,
    },
    /// No proof was looked for: a smoother candidate was chosen before.
    NotLookedFor,
}

/// Gains of a law: its best, or the next behind a rare stick.
#[derive(Clone, Debug, Serialize)]
pub struct Candidate {
    /// Law, and if it stands in a shell.
    pub name: String,
    /// The gains that were varied.
    pub gains: Vec<(String, f64)>,
    /// Its score on discs that no gain was chosen on.
    pub score: Score,
    /// The proof.
    pub verdict: Verdict,
    /// Chosen, or why not.
    pub outcome: Outcome,
    /// Candidates of this law that were tried, and those that were left out as unstable before.
    pub tried: (u32, u32),
    /// Number of this law's gains that were smoother where gains are chosen, and that a rare stick refused.
    pub before: u32,
    /// The whole scenario.
    #[serde(skip)]
    pub scenario: Option<Scenario>,
}

impl Candidate {
    /// For sorting: a law without stable gains comes last.
    fn rank(&self) -> f64 {
        if self.scenario.is_none() { f64::INFINITY } else { self.score.order() }
    }

    /// Its score on discs that no gain was chosen on.
    fn judged(&mut self, score: Score) {
        let simulated_s = self.score.simulated_s + score.simulated_s;
        self.score = Score { simulated_s, ..score };
        self.outcome = match score.cost {
            Some(_) => Outcome::Uncertified { why: String::new() },
            None => Outcome::Strays,
        };
    }
}

/// The outcome.
#[derive(Clone, Debug, Serialize)]
pub struct Tuned {
    /// Rates of the ramp, °/s, the lowest first; none where the scenario's path is no ramp.
    pub rates_deg_s: Vec<f64>,
    /// Corners of the bounds.
    pub corners: Vec<Corner>,
    /// Candidates, the smoothest first.
    pub candidates: Vec<Candidate>,
    /// Number of the one that is chosen.
    pub chosen: Option<usize>,
    /// Its score from rest, at the lowest rate, or along the path.
    pub from_rest: Option<Score>,
    /// Lowest and highest voltage of a motor that its output was limited to, so that it goes forwards alone, V; none where it has the
    /// scenario's limits.
    pub output_v: Option<[f64; 2]>,
    /// Reason why no law can be certified here, where there is one: of a path that is no ramp, of a lag.
    pub uncovered: Option<String>,
    /// Shells that were tried and not proven, with what limits.
    pub open_shells: Vec<(ShellTried, String)>,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// The proof of the chosen one at the scenario's rate.
    #[serde(skip)]
    pub certificate: Option<Certificate>,
    /// The scenario with the rig that it believes in.
    #[serde(skip)]
    pub believed: Scenario,
}

impl Tuned {
    /// [`Tuned::output_v`] by the keys of a scenario; none where it has its own limits.
    pub fn output_limits(&self) -> impl Iterator<Item = (&'static str, f64)> + use<> {
        self.output_v.into_iter().flat_map(output_keys)
    }

    /// The candidate that is chosen.
    #[must_use]
    pub fn winner(&self) -> Option<&Candidate> {
        self.chosen.and_then(|n| self.candidates.get(n))
    }
}

/// Looks for the law and the gains that move a shaft most smoothly on the worst corner of its bounds, and that are certified:
/// at rates of a ramp, or along the scenario's path where that is no ramp, which has no certificate yet. On a ramp a motor gets
/// limits of its output at which it goes forwards alone, as its certificate asks. `file` is what was identified; without it
/// corners, delay and ripple are the scenario's. The same comes again, on any number of cores. `report` gets each run.
///
/// # Errors
/// A rig with brake and motor on one signal, rates for a path that is no ramp, an option out of range; the end of `report`'s
/// patience.
pub fn tune(
    scenario: &Scenario,
    file: Option<&RigFile>,
    options: &Options,
    report: Report<'_>,
) -> Result<Tuned, ScenarioError> {
    let rates_deg_s = rates(scenario, options)?;
    let Believed { scenario: base, delay_between, corners } = believed(scenario, file)?;
    let lowest = rates_deg_s.first().map(|rate| (RATE.to_owned(), Value::Float(*rate)));
    let base = Scenario::from_table(base.name(), base.table().clone(), lowest.as_slice())?;
    let search = |base: Scenario, output_v: Option<[f64; 2]>| {
        let uncovered = match &delay_between {
            Some(why) => Some(why.clone()),
            None => uncovered(&base)?,
        };
        let (rates_deg_s, corners) = (rates_deg_s.clone(), corners.clone());
        let job = Job { base, rates_deg_s, corners, output_v, uncovered, options, report };
        pool::install(|| job.run())
    };
    let (limited, output_v) = forwards(&base)?;
    let found = search(limited, output_v)?;
    if found.chosen.is_some() || output_v.is_none() || !options.uncertified {
        return Ok(found);
    }
    // Limits that no certificate came of may be in the way.
    let unlimited = search(base, None)?;
    Ok(Tuned { simulated_s: unlimited.simulated_s + found.simulated_s, ..unlimited })
}

/// The rates, checked, the lowest first; none where the path is no ramp.
fn rates(scenario: &Scenario, options: &Options) -> Result<Vec<f64>, ScenarioError> {
    let wrong = |key: &str, value: &str, expected: &str| {
        Err(ScenarioError::value(scenario.name(), key, value, expected))
    };
    let mut rates = options.rates_deg_s.clone();
    match &scenario.params().reference {
        ReferenceParams::Ramp(ramp) if rates.is_empty() => rates.push(ramp.rate.to_degrees()),
        ReferenceParams::Ramp(_) => {}
        path if !rates.is_empty() => {
            let expected = format!(
                "none, as [reference.{}] has velocities of its own, or a path at a rate, [reference.ramp]",
                Choice::<f64>::name(path)
            );
            return wrong("rates", &options.rates_deg_s[0].to_string(), &expected);
        }
        _ => {}
    }
    if let Some(bad) = rates.iter().find(|rate| !(rate.is_finite() && **rate > 0.0)) {
        // Its own rate stands in the scenario.
        let key = if options.rates_deg_s.is_empty() { RATE } else { "rates" };
        return wrong(key, &bad.to_string(), "finite numbers above 0 °/s: tuning is for ramps forwards");
    }
    let run = scenario.params().run;
    if rates.is_empty() && run.duration - run.settle < LEAST_S {
        let expected = format!("at least run.settle_s + {LEAST_S} s, along which errors are taken");
        return wrong("run.duration_s", &run.duration.to_string(), &expected);
    }
    rates.sort_by(f64::total_cmp);
    rates.dedup();
    if rates.len() > MOST_RATES {
        return wrong("rates", &format!("{} rates", rates.len()), &format!("at most {MOST_RATES}"));
    }
    if !(1..=MOST_CANDIDATES).contains(&options.candidates) {
        let expected = format!("a whole number from 1 to {MOST_CANDIDATES}");
        return wrong("candidates", &options.candidates.to_string(), &expected);
    }
    Ok(rates)
}

/// A candidate on its way.
struct Finalist {
    row: Candidate,
    family: &'static Family,
    /// The law's next gains, the best of them first.
    next: VecDeque<(Scenario, Gains)>,
}

/// The shell that was proven, and those before it that were not.
struct Shells {
    proven: Option<(ShellTried, Bounds)>,
    open: Vec<(ShellTried, String)>,
}

struct Job<'a> {
    base: Scenario,
    rates_deg_s: Vec<f64>,
    corners: Vec<Corner>,
    output_v: Option<[f64; 2]>,
    uncovered: Option<String>,
    options: &'a Options,
    report: Report<'a>,
}

impl Job<'_> {
    fn run(&self) -> Result<Tuned, ScenarioError> {
        // A shell holds with any law within: it is looked for meanwhile.
        let (candidates, shells) = rayon::join(|| self.candidates(), || self.shells());
        let (mut candidates, shells) = (candidates?, shells?);
        self.shelled(&mut candidates, &shells)?;
        self.judge(&mut candidates)?;
        self.choose(candidates, shells)
    }

    fn scores(
        &self,
        of: &[&Scenario],
        corners: &[Corner],
        discs: std::ops::RangeInclusive<u64>,
        seconds: f64,
    ) -> Result<Vec<Score>, ScenarioError> {
        let trial = Trial { rates_deg_s: &self.rates_deg_s, corners, discs, seconds };
        scores(of, &trial, self.report)
    }

    /// The best gains of each law: sorted out on the believed rig, chosen on the corners.
    fn candidates(&self) -> Result<Vec<Finalist>, ScenarioError> {
        let volts = Volts::of(&self.base);
        let own = family_of(&self.base.params().law);
        let others = FAMILIES.iter().filter(|f| own.is_none_or(|own| own.name != f.name));
        let order = own.into_iter().chain(others).filter(|f| !(f.for_turns && self.on_a_ramp()));
        order.map(|family| self.best_of(family, &volts)).collect()
    }

    /// `false` along a path that may rest and turn round.
    fn on_a_ramp(&self) -> bool {
        !self.rates_deg_s.is_empty()
    }

    fn best_of(&self, family: &'static Family, volts: &Volts) -> Result<Finalist, ScenarioError> {
        let all = (0..self.options.candidates).map(|n| {
            let gains = family.gains(n, volts);
            Ok((family.scenario(&self.base, &gains)?, gains))
        });
        let all = all.collect::<Result<Vec<_>, ScenarioError>>()?;
        let tried = all.len() as u32;
        let stable: Vec<(Scenario, Gains)> = all.into_iter().filter(|(s, _)| is_stable(s)).collect();
        let unstable = tried - stable.len() as u32;
        let row = Candidate {
            name: family.name.to_owned(),
            gains: Gains::new(),
            score: Score::default(),
            verdict: Verdict::NotLookedFor,
            outcome: Outcome::Unstable,
            tried: (tried, unstable),
            before: 0,
            scenario: None,
        };
        let mut finalist = Finalist { row, family, next: VecDeque::new() };
        if stable.is_empty() {
            return Ok(finalist);
        }
        let first = self.scores(&refs(&stable), &[Corner::BELIEVED], FIRST, SHORT_S)?;
        let mut kept: Vec<(f64, (Scenario, Gains))> = first.iter().map(Score::order).zip(stable).collect();
        kept.sort_by(|a, b| a.0.total_cmp(&b.0)); // stable: ties stay in order
        kept.truncate(KEPT);
        let kept: Vec<(Scenario, Gains)> = kept.into_iter().map(|(_, candidate)| candidate).collect();
        let second = self.scores(&refs(&kept), &self.corners, CHOOSING, LONG_S)?;
        let simulated = first.iter().chain(&second).map(|s| s.simulated_s).sum::<f64>();
        let mut ordered: Vec<(f64, (Scenario, Gains))> = second.iter().map(Score::order).zip(kept).collect();
        ordered.sort_by(|a, b| a.0.total_cmp(&b.0));
        finalist.next = ordered.into_iter().map(|(_, candidate)| candidate).take(1 + NEXT_GAINS).collect();
        if let Some((scenario, gains)) = finalist.next.pop_front() {
            (finalist.row.scenario, finalist.row.gains) = (Some(scenario), gains);
        }
        finalist.row.score.simulated_s = simulated;
        Ok(finalist)
    }

    /// The first shell that is proven.
    fn shells(&self) -> Result<Shells, ScenarioError> {
        let mut shells = Shells { proven: None, open: Vec::new() };
        let inner = any_inner(&self.base)?;
        let Some(inner) = inner.filter(|_| self.uncovered.is_none()) else { return Ok(shells) };
        let one = |shell: &ShellTried| {
            let within = within(&inner, shell)?;
            match edge_trips(&within, shell) {
                Some(why) => Ok(Err(why)),
                None => prove(&within, &self.rates_deg_s),
            }
        };
        let all = proof::shells(&self.base);
        let tried = all.par_iter().map(one).collect::<Result<Vec<_>, ScenarioError>>()?;
        for (shell, found) in all.iter().zip(tried) {
            match found {
                Err(why) => shells.open.push((*shell, why)),
                Ok(bounds) => {
                    shells.proven = Some((*shell, bounds));
                    break;
                }
            }
        }
        Ok(shells)
    }

    /// Puts the shell that is proven around laws that have no certificate of their own.
    fn shelled(&self, all: &mut Vec<Finalist>, shells: &Shells) -> Result<(), ScenarioError> {
        let Some((shell, _)) = &shells.proven else { return Ok(()) };
        let mut more = Vec::new();
        for f in all.iter().filter(|f| !f.family.certified_alone()) {
            let Some(scenario) = &f.row.scenario else { continue };
            let next = f.next.iter().map(|(scenario, gains)| Ok((within(scenario, shell)?, gains.clone())));
            let row = Candidate {
                name: format!("{} in a shell", f.row.name),
                score: Score::default(),
                scenario: Some(within(scenario, shell)?),
                ..f.row.clone()
            };
            more.push(Finalist { row, next: next.collect::<Result<_, ScenarioError>>()?, ..*f });
        }
        all.extend(more);
        Ok(())
    }

    /// Scores on discs that no gain was chosen on.
    fn judge(&self, all: &mut [Finalist]) -> Result<(), ScenarioError> {
        let scenarios: Vec<&Scenario> = all.iter().filter_map(|f| f.row.scenario.as_ref()).collect();
        let judged = self.scores(&scenarios, &self.corners, JUDGING, LONG_S)?;
        let some = all.iter_mut().filter(|f| f.row.scenario.is_some());
        for (f, score) in some.zip(judged) {
            f.row.judged(score);
        }
        all.sort_by(|a, b| a.row.rank().total_cmp(&b.row.rank()));
        Ok(())
    }

    /// The proof of a candidate.
    fn proven(&self, scenario: &Scenario, shells: &Shells) -> Result<Result<Bounds, String>, ScenarioError> {
        if let Some(why) = &self.uncovered {
            return Ok(Err(why.clone()));
        }
        if let Some((_, bounds)) = shells.proven.as_ref().filter(|_| scenario.params().shell.boundary > 0.0)
            && scenario.sampled_setup(&scenario.plan()?.bounds).as_ref() == Ok(&bounds.certificate.setup)
        {
            return Ok(Ok(bounds.clone()));
        }
        prove(scenario, &self.rates_deg_s)
    }

    /// The first that has a certificate and starts from rest; without one if that is asked for.
    fn choose(&self, mut all: Vec<Finalist>, shells: Shells) -> Result<Tuned, ScenarioError> {
        let mut chosen = self.first_of(&mut all, &shells, false)?;
        if chosen.is_none() && self.options.uncertified {
            chosen = self.first_of(&mut all, &shells, true)?;
        }
        let mut candidates: Vec<Candidate> = all.into_iter().map(|f| f.row).collect();
        candidates.sort_by(|a, b| a.rank().total_cmp(&b.rank()));
        let winner = candidates.iter().position(|c| c.outcome == Outcome::Chosen);
        if let Some(than) = winner.and_then(|n| candidates[n].score.cost) {
            for other in &mut candidates {
                if matches!(&other.outcome, Outcome::Uncertified { why } if why.is_empty()) {
                    other.outcome = Outcome::Rougher { than };
                }
            }
        }
        let simulated_s = candidates.iter().map(|c| c.score.simulated_s).sum();
        let (from_rest, certificate) = chosen.map_or((None, None), |(score, proof)| (Some(score), proof));
        Ok(Tuned {
            rates_deg_s: self.rates_deg_s.clone(),
            corners: self.corners.clone(),
            candidates,
            chosen: winner,
            from_rest,
            output_v: self.output_v,
            uncovered: self.uncovered.clone(),
            open_shells: shells.open,
            simulated_s,
            certificate,
            believed: self.base.clone(),
        })
    }

    /// The first row, in the order of cost, that starts from rest, with its score there and its proof; a law's next gains come
    /// into the order where a stick that is rare refuses the ones before.
    fn first_of(
        &self,
        all: &mut Vec<Finalist>,
        shells: &Shells,
        uncertified: bool,
    ) -> Result<Option<(Score, Option<Certificate>)>, ScenarioError> {
        let mut n = 0;
        while let Some(Finalist { row, .. }) = all.get_mut(n) {
            n += 1;
            let open = matches!(row.outcome, Outcome::Uncertified { .. });
            let Some(scenario) = row.scenario.clone().filter(|_| open) else { continue };
            let mut sticks = row.score;
            let mut certificate = None;
            if sticks.runs_with_sticks > 0 && self.on_a_ramp() {
                // It would be refused from rest, too, behind a proof that takes its time.
                let Score { runs_with_sticks, runs, .. } = sticks;
                let why = format!(
                    "it sticks in {runs_with_sticks} of {runs} runs on discs that it was not chosen on"
                );
                row.outcome = Outcome::Refused { why };
            } else {
                if row.verdict == Verdict::NotLookedFor {
                    match self.proven(&scenario, shells)? {
                        Err(why) => {
                            row.verdict = Verdict::Uncertified { why: why.clone() };
                            row.outcome = Outcome::Uncertified { why };
                        }
                        Ok(Bounds { lines, error_rad, certificate: proof }) => {
                            let shell = scenario.params().shell.boundary > 0.0;
                            row.verdict = Verdict::Certified { error_rad, shell, lines };
                            certificate = Some(proof);
                        }
                    }
                }
                if !uncertified && certificate.is_none() {
                    continue;
                }
                sticks = self.accept(row, &scenario)?;
                if row.outcome == Outcome::Chosen {
                    return Ok(Some((sticks, certificate)));
                }
            }
            if let Some(next) = self.next_gains(&mut all[n - 1], &sticks)? {
                let behind = all[n..].partition_point(|other| other.row.rank() <= next.row.rank());
                all.insert(n + behind, next);
            }
        }
        Ok(None)
    }

    /// The next gains of a law, judged, where the ones before stick rarely.
    fn next_gains(&self, refused: &mut Finalist, sticks: &Score) -> Result<Option<Finalist>, ScenarioError> {
        let Score { runs_with_sticks, runs, .. } = *sticks;
        let rare = sticks.cost.is_some() && self.on_a_ramp() && (1..=runs / RARE).contains(&runs_with_sticks);
        let Some((scenario, gains)) = refused.next.pop_front().filter(|_| rare) else { return Ok(None) };
        let before = refused.row.before + 1;
        let score = self.scores(&[&scenario], &self.corners, others(JUDGING, before), LONG_S)?.pop();
        let name = &refused.row.name;
        let best = name.strip_suffix(&format!(" ({before})")).unwrap_or(name);
        let mut row = Candidate {
            name: format!("{best} ({})", before + 1),
            gains,
            score: Score::default(),
            verdict: Verdict::NotLookedFor,
            before,
            scenario: Some(scenario),
            ..refused.row.clone()
        };
        row.judged(score.unwrap_or_default());
        Ok(Some(Finalist { row, family: refused.family, next: std::mem::take(&mut refused.next) }))
    }

    /// Lets a candidate start from rest at the lowest rate, or along the path, on discs of its own: on a ramp it has to slide
    /// once it has settled, and everywhere to stay within what is proven of it. Its score there.
    fn accept(&self, candidate: &mut Candidate, scenario: &Scenario) -> Result<Score, ScenarioError> {
        let trial = Trial {
            rates_deg_s: self.rates_deg_s.get(..1).unwrap_or_default(),
            corners: &self.corners,
            discs: others(ACCEPTING, candidate.before),
            seconds: ACCEPT_S,
        };
        let score = scores(&[scenario], &trial, self.report)?.pop().unwrap_or_default();
        candidate.score.simulated_s += score.simulated_s;
        let within = match candidate.verdict {
            Verdict::Certified { error_rad, .. } => score.max_error_rad <= error_rad,
            _ => true,
        };
        let why = if score.cost.is_none() {
            "from rest it leaves its path".to_owned()
        } else if let (Some(rate), true) = (self.rates_deg_s.first(), score.runs_with_sticks > 0) {
            format!("from rest at {rate} °/s it sticks in {} of {} runs", score.runs_with_sticks, score.runs)
        } else if !within {
            "its error exceeds what is proven: please report this as a defect".to_owned()
        } else {
            candidate.outcome = Outcome::Chosen;
            return Ok(score);
        };
        candidate.outcome = Outcome::Refused { why };
        Ok(score)
    }
}

/// As many discs behind those, on which the gains that were judged before did not run.
fn others(discs: std::ops::RangeInclusive<u64>, before: u32) -> std::ops::RangeInclusive<u64> {
    let (first, last) = discs.into_inner();
    let on = u64::from(before) * (last - first + 1);
    first + on..=last + on
}

fn refs(of: &[(Scenario, Gains)]) -> Vec<&Scenario> {
    of.iter().map(|(scenario, _)| scenario).collect()
}

/// The spectral radius decides where it is known, with every brake of the bounds; where it is not, trials do.
fn is_stable(scenario: &Scenario) -> bool {
    scenario.plan().is_ok_and(|plan| scenario.sampled(&plan.bounds).stable() != Some(false))
}

/// The scenario with a law that stands in a shell, whichever it is.
fn any_inner(base: &Scenario) -> Result<Option<Scenario>, ScenarioError> {
    let inner = FAMILIES.iter().find(|family| !family.certified_alone());
    inner.map(|family| family.scenario(base, &Gains::new())).transpose()
}

/// Limits of an output by their keys, V.
fn output_keys([lowest, highest]: [f64; 2]) -> [(&'static str, f64); 2] {
    [("output.lowest_v", lowest), ("output.highest_v", highest)]
}

/// A motor on a ramp with an output that cannot turn it round, which is what a certificate of a motor axis asks for: its lowest voltage
/// is what friction surely holds, its highest some times what friction at rest takes. Other scenarios are as they are.
fn forwards(base: &Scenario) -> Result<(Scenario, Option<[f64; 2]>), ScenarioError> {
    let as_it_is = || Ok((base.clone(), None));
    let Some(inner) = any_inner(base)? else { return as_it_is() };
    let inner = within(&inner, &proof::shells(base)[0])?;
    let Some(turns) = inner.lowest_forwards(&inner.plan()?.bounds).filter(|volts| *volts < 0.0) else {
        return as_it_is();
    };
    let output = base.params().output;
    let most = HIGHEST_OVER_REST * Volts::of(base).friction;
    // Three digits, towards 0.
    let lowest = output.lowest.max((1e3 * turns).ceil() / 1e3);
    let highest = output.highest.min((1e3 * most).floor() / 1e3);
    if lowest >= 0.0 || (lowest <= output.lowest && highest >= output.highest) {
        return as_it_is();
    }
    let set = output_keys([lowest, highest]).map(|(key, volts)| (key.to_owned(), Value::Float(volts)));
    let limited = Scenario::from_table(base.name(), base.table().clone(), &set)?;
    Ok((limited, Some([lowest, highest])))
}

/// Reason why no law is certified on such a rig and path: a shell asks nothing of the law within, and what a shell is not certified
/// for, no law is.
fn uncovered(base: &Scenario) -> Result<Option<String>, ScenarioError> {
    let Some(inner) = any_inner(base)? else { return Ok(None) };
    let within = within(&inner, &proof::shells(base)[0])?;
    Ok(within.sampled_setup(&within.plan()?.bounds).err().map(|why| why.to_string()))
}

/// A scenario's law in a shell.
fn within(scenario: &Scenario, shell: &ShellTried) -> Result<Scenario, ScenarioError> {
    let mut table = scenario.table().clone();
    table.remove("velocity");
    let rows = [("slope_1_s", shell.slope_1_s), ("boundary_rad_s", shell.boundary_rad_s)];
    let rows: Table = rows.into_iter().map(|(key, x)| (key.to_owned(), Value::Float(x))).collect();
    table.insert("shell".to_owned(), Value::Table(rows));
    Scenario::from_table(scenario.name(), table, &[(SMOOTHING.to_owned(), Value::Float(shell.smoothing))])
}

/// An edge of the encoder alone would have the shell act, which would be rougher than any law.
fn edge_trips(scenario: &Scenario, shell: &ShellTried) -> Option<String> {
    let spec = scenario.spec();
    let count = core::f64::consts::TAU / f64::from(spec.rig.encoder.sensor.counts_per_rev);
    let edge = count * (shell.smoothing / spec.period.seconds::<f64>() + shell.slope_1_s);
    (edge > 0.6 * shell.boundary_rad_s).then(|| {
        format!("an edge of the encoder counts as {edge:.2} rad/s there, and the shell would act on it")
    })
}
