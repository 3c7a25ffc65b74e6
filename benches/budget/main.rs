//! The highest cost of a control period on a Cortex-M4F: bounds from the machine code of the linked
//! image, the highest values measured in the emulator, and the budgets of firmware/budget.toml.
//! docs/timing.md explains the figures.
//!
//! `cargo bench --bench budget`, with `-- size` or `-- stack` only that part, and with `-- loops`
//! all functions and loops behind the bounds. It fails when a measured value exceeds its bound, or
//! a bound its budget.

mod against_c;
mod chip;
mod emulator;
mod memory;
mod plan;

use against_c::Compared;
use anyhow::{Context, Result, bail};
use chip::OnChip;
use clutch_benches::machine_code::{Bounds, Cost, Fault, Image, traced};
use emulator::Measured;
use plan::{Item, Plan};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::ExitCode;

/// The packages whose images are examined, and their targets: that of the emulated board, those of boards that are
/// flashed. Cycles are bounded on a Cortex-M4F alone.
const EMULATED: (&str, &str) = ("clutch-qemu-mps2", emulator::TARGETS[0]);
const FLASHED: (&str, &str) = ("clutch-nucleo-g474re", emulator::TARGETS[0]);
const WITHOUT_FPU: (&str, &str) = ("clutch-pico-rp2040", emulator::TARGETS[1]);

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let part = arguments.iter().find(|a| ["size", "stack", "loops"].contains(&a.as_str()));
    // A filter for other benchmarks: `cargo bench -- law`.
    if matches!(&arguments[..], [filter] if part.is_none() && !filter.starts_with('-') && !"budget".contains(filter.as_str()))
    {
        return ExitCode::SUCCESS;
    }
    match run(part.map(String::as_str)) {
        Ok(over) if over.is_empty() => ExitCode::SUCCESS,
        Ok(over) => {
            over.iter().for_each(|o| println!("over budget: {o}"));
            ExitCode::FAILURE
        }
        Err(error) => {
            println!("{error:#}");
            ExitCode::FAILURE
        }
    }
}

/// On a machine of CI everything has to be there; elsewhere the missing part is reported.
fn skipped(why: &str) -> Result<()> {
    if std::env::var_os("CI").is_some() {
        bail!("{why}");
    }
    println!("skipped: {why}");
    Ok(())
}

fn run(part: Option<&str>) -> Result<Vec<String>> {
    let firmware = Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware");
    let plan = Plan::read(&firmware.join("budget.toml"))?;
    let no_gcc = emulator::missing("arm-none-eabi-gcc", "--version");
    if let Some(why) = emulator::no_target() {
        skipped(&why)?;
        return Ok(Vec::new());
    }
    let images =
        emulator::build(&firmware, EMULATED, Some(if no_gcc.is_none() { "peer" } else { "measure" }))?;
    let flashed = emulator::build(&firmware, FLASHED, None)?;
    let without_fpu = emulator::build(&firmware, WITHOUT_FPU, None)?;
    let controller = Image::read(&images.join("mps2-controller"))?;
    let mut over = Vec::new();
    let [first, rest @ ..] = &plan.memory[..] else { bail!("firmware/budget.toml has no [[memory]]") };
    if part.is_none_or(|p| p == "size") {
        over.extend(memory::size(&controller, first));
    }
    if part.is_none_or(|p| p == "stack") {
        over.extend(memory::stack(&controller, first)?);
    }
    if part.is_none_or(|p| p != "loops") {
        for budget in rest {
            let folder = if budget.image.starts_with("pico-") { &without_fpu } else { &flashed };
            let image = Image::read(&folder.join(&budget.image))?;
            let double = image.double_precision();
            over.extend(double.iter().map(|s| format!("{}: double precision: {s}", budget.image)));
            over.extend(memory::flashed(&image, budget)?);
        }
    }
    if part.is_some_and(|p| p != "loops") {
        return Ok(over);
    }
    let path = images.join("budget");
    let image = Image::read(&path)?;
    for (name, image) in [("mps2-controller", &controller), ("budget", &image)] {
        let found = image.double_precision();
        over.extend(found.iter().map(|s| format!("{name}: double precision: {s}")));
    }
    let mut others = BTreeMap::new();
    for name in plan.items.iter().filter_map(|i| i.image.as_ref()) {
        others.insert(name.as_str(), Image::read(&flashed.join(name))?);
    }
    let bounds = all_bounds(&image, &others, &plan, part == Some("loops"))?;
    if part == Some("loops") {
        return Ok(over);
    }
    let measured = match emulator::no_emulator() {
        Some(why) => skipped(&why).map(|()| None)?,
        None => Some(emulator::measure(&path)?),
    };
    let on_chip = match clutch_loop::chip_board::no_engine() {
        Some(why) => skipped(&why.to_string()).map(|()| None)?,
        None => Some(chip::measure(&flashed)?),
    };
    if let Some(why) = no_gcc {
        skipped(&format!("{why}: the laws in C are not compared"))?;
    }
    let cycles = match &measured {
        Some(m) => gone(&path, &image, &plan, m)?,
        None => BTreeMap::new(),
    };
    over.extend(table(&plan, &image, &bounds, (measured.as_ref(), on_chip.as_ref()), &cycles));
    measured.iter().for_each(frictions);
    let compared = |m: &&Measured| plan.in_c().any(|symbol| m.counts.contains_key(symbol));
    if let Some(measured) = measured.as_ref().filter(compared) {
        let compared = Compared { plan: &plan, image: &image, bounds: &bounds, measured, cycles: &cycles };
        compared.laws()?;
        compared.servos()?;
    }
    Ok(over)
}

/// Prints the counts of one evaluation of each friction model. A board evaluates curves within its laws and no bristles at
/// all, so that none has a bound or a budget.
fn frictions(measured: &Measured) {
    println!("\nOne evaluation of each friction model, instructions measured:\n");
    println!("| model | least / mean / most |\n|---|---|");
    for name in &measured.names {
        if let Some(model) = name.strip_prefix("friction_") {
            println!("| {model} | {} |", measured.counts[name]);
        }
    }
}

fn told(faults: Vec<Fault>) -> anyhow::Error {
    let lines: Vec<String> = faults.iter().map(ToString::to_string).collect();
    anyhow::anyhow!("no bound:\n{}", lines.join("\n"))
}

/// The bound of an item: to its return, or along the functions that it leads through.
fn bound(item: &Item, bounds: &mut Bounds<'_>) -> Result<Cost, Vec<Fault>> {
    if item.until.is_empty() {
        return bounds.of(&item.symbol);
    }
    let from = std::iter::once(&item.symbol).chain(&item.until);
    from.zip(&item.until).map(|(from, to)| bounds.until(from, to)).sum()
}

/// The bound of each item.
fn all_bounds(
    measuring: &Image,
    others: &BTreeMap<&str, Image>,
    plan: &Plan,
    loops: bool,
) -> Result<Vec<Cost>> {
    let facts = plan.facts();
    let mut all = Vec::new();
    let mut unused: BTreeSet<String> = facts.names().collect();
    for item in &plan.items {
        let case = item.case();
        let image = item.image.as_deref().and_then(|name| others.get(name)).unwrap_or(measuring);
        let mut bounds = Bounds::new(image, &facts, &case);
        all.push(bound(item, &mut bounds).map_err(told).with_context(|| item.name.clone())?);
        unused.retain(|name| !bounds.used(false).any(|used| used == name));
        if let Some(fact) = case.names().find(|name| !bounds.used(true).any(|used| used == name)) {
            bail!("{}: this statement applies to no code: {fact}", item.name);
        }
        if loops {
            let bound = all.last().copied().unwrap_or_default();
            println!("\n{}: {} instructions, {} cycles", item.name, bound.instructions, bound.cycles);
            println!(
                "| function | instructions | cycles | cycles of the bound that it is |\n|---|---|---|---|"
            );
            for (f, length, cost) in bounds.functions() {
                let of = length.map_or(String::new(), |n| format!(" of {n} bytes"));
                let mut without = Bounds::new(image, &facts, &case).without(&f.name);
                let rest = self::bound(item, &mut without).unwrap_or_default();
                let share = bound.cycles.saturating_sub(rest.cycles);
                println!("| {}{of} | {} | {} | {share} |", f.name, cost.instructions, cost.cycles);
            }
            bounds.loops().for_each(|(address, what)| println!("{address:#x} {what}"));
        }
    }
    // A statement that applies to nothing here may apply wrongly tomorrow.
    if !unused.is_empty() {
        bail!(
            "firmware/budget.toml: these statements apply to no code:\n{}",
            Vec::from_iter(unused).join("\n")
        );
    }
    Ok(all)
}

/// The costliest path that was executed, for each traced function: cycles by the table of the
/// bound.
fn gone(path: &Path, image: &Image, plan: &Plan, measured: &Measured) -> Result<BTreeMap<String, Cost>> {
    let facts = plan.facts();
    let (mut ranges, mut entries) = (BTreeMap::new(), BTreeMap::new());
    let ours = plan.items.iter().filter(|i| i.traced).map(|i| (i.measured.as_str(), i.symbol.as_str()));
    let theirs = plan.in_c().map(|symbol| (symbol, symbol));
    for (name, symbol) in ours.chain(theirs) {
        let Ok(function) = image.function(symbol) else { continue };
        let none = Default::default();
        let mut bounds = Bounds::new(image, &facts, &none);
        bounds.of(symbol).map_err(told)?;
        ranges.extend(bounds.functions().map(|(f, ..)| (f.address, f.size)));
        entries.insert(name, function.address);
    }
    let ranges: Vec<(u32, u32)> = ranges.into_iter().collect();
    let addresses: Vec<u32> = entries.values().copied().collect();
    let mut calls = emulator::trace(path, &ranges, |executed| traced(image, &addresses, executed))??;
    let mut most = BTreeMap::new();
    // One function may have been measured under several names, one after the other.
    for name in &measured.names {
        let Some(of) = entries.get(name.as_str()).and_then(|a| calls.get_mut(a)) else { continue };
        let counts = measured.counts[name];
        let took =
            of.get(..counts.calls).with_context(|| format!("{name}: calls are missing in the trace"))?;
        let top = took.iter().fold(Cost::default(), |a, b| Cost {
            instructions: a.instructions.max(b.instructions),
            cycles: a.cycles.max(b.cycles),
        });
        if top.instructions != counts.most {
            bail!("{name}: {} instructions by the trace, {} by the timer", top.instructions, counts.most);
        }
        most.insert(name.clone(), top);
        of.drain(..counts.calls);
    }
    Ok(most)
}

/// Prints the table; gives the values over budget, and those without one.
fn table(
    plan: &Plan,
    image: &Image,
    bounds: &[Cost],
    (measured, on_chip): (Option<&Measured>, Option<&OnChip>),
    cycles: &BTreeMap<String, Cost>,
) -> Vec<String> {
    let mut over = Vec::new();
    println!(
        "\nBounds of the machine code, Cortex-M4F without wait states, and the highest values measured:\n"
    );
    println!(
        "| function | instructions: bound | budget | measured least / mean / most | cycles: bound | budget | measured | share of {} ms at {} MHz |",
        plan.core.period_us as f64 / 1000.0,
        plan.core.clock_hz / 1_000_000
    );
    println!("|---|---|---|---|---|---|---|---|");
    let exceeds = |item: &Item, what: &str, is: u64, may: u64| {
        (is > may).then(|| format!("{}: {what}: {is}, at most {may}", item.name))
    };
    for (item, bound) in plan.items.iter().zip(bounds) {
        let flashed = item.image.is_some();
        let counts = match flashed {
            true => on_chip.and_then(|m| m.get(item.measured.as_str())),
            false => measured.and_then(|m| m.counts.get(&item.measured)),
        };
        let along = cycles.get(&item.measured).map(|c| c.cycles);
        println!(
            "| {} | {} | {} | {} | {} | {} | {} | {:.2} % |",
            item.name,
            bound.instructions,
            item.budget.instructions,
            counts.map_or("–".to_owned(), ToString::to_string),
            bound.cycles,
            item.budget.cycles,
            along.map_or("–".to_owned(), |c| c.to_string()),
            plan.share(bound.cycles),
        );
        over.extend(exceeds(item, "bound, instructions", bound.instructions, item.budget.instructions));
        over.extend(exceeds(item, "bound, cycles", bound.cycles, item.budget.cycles));
        over.extend(exceeds(item, "measured instructions", counts.map_or(0, |c| c.most), bound.instructions));
        over.extend(exceeds(item, "measured cycles", along.unwrap_or(0), bound.cycles));
        let was_measured = if flashed { on_chip.is_some() } else { measured.is_some() };
        if was_measured && counts.is_none() && !item.measured.is_empty() {
            over.push(format!("{}: no run has measured {}", item.name, item.measured));
        }
    }
    let known = |name: &str| {
        plan.items.iter().any(|i| i.image.is_none() && i.measured == name)
            || plan.in_c().any(|symbol| symbol == name)
    };
    // Names that are no function's are those of a law over another friction: some laws have none.
    for name in measured.iter().flat_map(|m| &m.names) {
        if image.function(name).is_ok() && !known(name) {
            over.push(format!("{name}: measured, but without a budget: expected an [[item]] for it"));
        }
    }
    over
}
