//! The longest path through a function.

use super::constant::{number, only_reads};
use super::cost::{cycles, refill, stall};
use super::decode::{Flow, Instruction};
use super::facts::{Facts, means};
use super::graph::{Graph, Loop};
use super::image::{Function, Image};
use super::{Fault, facts};
use std::collections::{BTreeMap, BTreeSet};
use std::iter::Sum;
use std::ops::{Add, Mul};

/// Instructions and cycles, each by itself: the longest path in one is not always the longest in
/// the other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Executed instructions; those that a condition switches off count.
    pub instructions: u64,
    /// Cycles of the core.
    pub cycles: u64,
}

impl Cost {
    fn max(self, o: Cost) -> Cost {
        Cost { instructions: self.instructions.max(o.instructions), cycles: self.cycles.max(o.cycles) }
    }

    fn min(self, o: Cost) -> Cost {
        Cost { instructions: self.instructions.min(o.instructions), cycles: self.cycles.min(o.cycles) }
    }

    fn cycles(cycles: u64) -> Cost {
        Cost { instructions: 0, cycles }
    }
}

impl Add for Cost {
    type Output = Cost;
    fn add(self, o: Cost) -> Cost {
        Cost { instructions: self.instructions + o.instructions, cycles: self.cycles + o.cycles }
    }
}

impl Sum for Cost {
    fn sum<I: Iterator<Item = Cost>>(all: I) -> Cost {
        all.fold(Cost::default(), Add::add)
    }
}

impl Mul<u64> for Cost {
    type Output = Cost;
    fn mul(self, n: u64) -> Cost {
        Cost { instructions: self.instructions * n, cycles: self.cycles * n }
    }
}

/// Bounds of the functions of one image under one set of facts.
pub struct Bounds<'a> {
    image: &'a Image,
    facts: &'a Facts,
    /// Facts that hold in this case only; they are asked first.
    case: &'a Facts,
    /// A function that costs nothing.
    free: Option<&'a str>,
    known: BTreeMap<(u32, Option<u64>), Cost>,
    /// Functions under examination, the outermost first.
    within: Vec<u32>,
    faults: BTreeSet<String>,
    found: Vec<Fault>,
    /// Loops, and the facts used for them.
    told: BTreeMap<u32, String>,
    /// The facts that were used, of the case and of all cases.
    used: BTreeSet<(bool, String)>,
}

/// Calls of one function that are few.
#[derive(Default)]
struct Capped {
    /// Cost of one call.
    cost: Cost,
    /// Highest number of calls, each time that the calling function is called.
    most: u64,
    /// Blocks with these calls.
    blocks: BTreeSet<usize>,
}

/// A way from block to block, or out of the function.
type Ways = BTreeMap<(usize, Option<usize>), Cost>;

impl<'a> Bounds<'a> {
    /// Nothing bounded yet.
    #[must_use]
    pub fn new(image: &'a Image, facts: &'a Facts, case: &'a Facts) -> Self {
        Bounds {
            image,
            facts,
            case,
            free: None,
            known: BTreeMap::new(),
            within: Vec::new(),
            faults: BTreeSet::new(),
            found: Vec::new(),
            told: BTreeMap::new(),
            used: BTreeSet::new(),
        }
    }

    /// The same as if calls of the function of this name cost nothing, to see its share.
    #[must_use]
    pub fn without(self, name: &'a str) -> Self {
        Bounds { free: Some(name), ..self }
    }

    /// The bound of the function of this name, from its first instruction to its return.
    ///
    /// # Errors
    /// Everything that prevents a bound.
    pub fn of(&mut self, name: &str) -> Result<Cost, Vec<Fault>> {
        let function = self.image.function(name).map_err(|f| vec![f])?;
        let cost = self.function(function, None);
        if self.found.is_empty() { Ok(cost) } else { Err(std::mem::take(&mut self.found)) }
    }

    /// The bound from the first instruction of a function to any call of another, in it or in what it calls: also
    /// to the last of several. The code after that, and the other function itself, cost nothing. A generic function that the image
    /// has several times is each of them.
    ///
    /// # Errors
    /// Everything that prevents a bound; the second function is not called.
    pub fn until(&mut self, name: &str, until: &str) -> Result<Cost, Vec<Fault>> {
        let image = self.image;
        let all = |name: &str| {
            let found: Vec<&Function> = image.functions().filter(|f| f.name == name).collect();
            if found.is_empty() { Err(vec![Fault::NoFunction(name.to_owned())]) } else { Ok(found) }
        };
        let ends: BTreeSet<u32> = all(until)?.iter().map(|f| f.address).collect();
        let mut known = BTreeMap::new();
        let reached = all(name)?.into_iter().filter_map(|function| self.up_to(function, &ends, &mut known));
        match reached.reduce(Cost::max) {
            _ if !self.found.is_empty() => Err(std::mem::take(&mut self.found)),
            Some(cost) => Ok(cost),
            None => Err(vec![Fault::NoReturn { function: format!("{name}, up to {until}") }]),
        }
    }

    /// None if the call is not reached from there. `known`: the functions that were looked at.
    fn up_to(
        &mut self,
        function: &Function,
        ends: &BTreeSet<u32>,
        known: &mut BTreeMap<u32, Option<Cost>>,
    ) -> Option<Cost> {
        if ends.contains(&function.address) {
            return Some(Cost::default());
        }
        if let Some(cost) = known.get(&function.address) {
            return *cost;
        }
        if self.within.contains(&function.address) {
            self.fault(Fault::Recursion(function.name.clone()));
            return None;
        }
        self.within.push(function.address);
        let cost = self.up_to_calls(function, ends, known);
        self.within.pop();
        known.insert(function.address, cost);
        cost
    }

    fn up_to_calls(
        &mut self,
        function: &Function,
        ends: &BTreeSet<u32>,
        known: &mut BTreeMap<u32, Option<Cost>>,
    ) -> Option<Cost> {
        let mut graph = match Graph::new(self.image, function) {
            Ok(graph) => graph,
            Err(fault) => {
                self.fault(fault);
                return None;
            }
        };
        // For each block, the place of the last call from which the end is reached, and the cost from there on.
        let mut last: BTreeMap<usize, (usize, Cost)> = BTreeMap::new();
        for (n, block) in graph.blocks.iter().enumerate() {
            for (k, i) in block.instructions.iter().enumerate() {
                let target = match i.flow {
                    Flow::Call(target) => Some(target),
                    _ if k + 1 == block.instructions.len() => block.tail_call,
                    _ => None,
                };
                let Some(callee) = target.and_then(|t| self.image.function_at(t)) else { continue };
                // A call that the case rules out is none, and nothing behind it is reached.
                if self.never(function, callee) {
                    break;
                }
                if let Some(rest) = self.up_to(callee, ends, known) {
                    last.insert(n, (k, rest + Cost::cycles(refill(i))));
                }
            }
        }
        // Only the blocks from which the end is still to come; of those that are its last, only what is before.
        let reaches = graph.reaching(&last.keys().copied().collect());
        for (n, block) in graph.blocks.iter_mut().enumerate() {
            block.returns = false;
            block.tail_call = None;
            block.next.retain(|to| reaches.contains(to));
            match last.get(&n) {
                Some((k, _)) if block.next.is_empty() => block.instructions.truncate(k + 1),
                _ => {}
            }
        }
        if last.is_empty() { None } else { self.longest_to(function, &graph, &last) }
    }

    fn longest_to(
        &mut self,
        function: &Function,
        graph: &Graph,
        ends: &BTreeMap<usize, (usize, Cost)>,
    ) -> Option<Cost> {
        let mut capped = BTreeMap::new();
        let mut ways = self.ways(function, graph, None, &mut capped, Some(ends));
        let loops = match graph.loops() {
            Ok(loops) => loops,
            Err(block) => {
                let (function, address) = (function.name.clone(), graph.address(block));
                self.fault(Fault::Irreducible { function, address });
                return None;
            }
        };
        for round in &loops {
            let most = self.rounds(function, graph, &loops, round, None);
            collapse(&mut ways, round, most, capped.values());
        }
        let path = reach(&ways, 0, None).1.remove(&None)?;
        Some(capped.values().fold(path, |sum, c| sum + c.cost * c.most))
    }

    /// The statement about the number of calls of one function in another.
    fn cap(&mut self, function: &str, callee: &str) -> Option<&'a facts::CallFact> {
        let cap = both(&self.case.calls, &self.facts.calls)
            .find(|(_, f)| means(&f.function, function) && means(&f.of, callee));
        self.used.extend(cap.map(|(case, f)| (case, f.name())));
        cap.map(|(_, f)| f)
    }

    /// True if one function is stated never to call another.
    fn never(&mut self, function: &Function, callee: &Function) -> bool {
        self.cap(&function.name, &callee.name).is_some_and(|c| c.most == 0)
    }

    /// The functions examined so far, with the bound of each; a function that works on memory has
    /// one for each length.
    pub fn functions(&self) -> impl Iterator<Item = (&Function, Option<u64>, Cost)> {
        let named = |((address, length), cost): (&(u32, Option<u64>), &Cost)| {
            Some((self.image.function_at(*address)?, *length, *cost))
        };
        self.known.iter().filter_map(named)
    }

    /// The loops that were met, by address, and the fact that bounds each.
    pub fn loops(&self) -> impl Iterator<Item = (u32, &str)> {
        self.told.iter().map(|(a, t)| (*a, t.as_str()))
    }

    /// The facts that the bounds rest on, by name: those of the case, or those of all cases.
    pub fn used(&self, of_the_case: bool) -> impl Iterator<Item = &str> {
        self.used.iter().filter(move |(case, _)| *case == of_the_case).map(|(_, name)| name.as_str())
    }

    fn fault(&mut self, fault: Fault) -> Cost {
        if self.faults.insert(fault.to_string()) {
            self.found.push(fault);
        }
        Cost::default()
    }

    /// `length`: bytes, for a function that works on memory.
    fn function(&mut self, function: &Function, length: Option<u64>) -> Cost {
        if let Some(cost) = self.known.get(&(function.address, length)) {
            return *cost;
        }
        if self.within.contains(&function.address) {
            let name = |a: &u32| self.image.function_at(*a).map_or("?", |f| f.name.as_str());
            let chain: Vec<&str> = self.within.iter().map(name).chain([function.name.as_str()]).collect();
            return self.fault(Fault::Recursion(chain.join(" → ")));
        }
        self.within.push(function.address);
        let cost = match Graph::new(self.image, function) {
            Ok(graph) => self.longest(function, &graph, length),
            Err(fault) => self.fault(fault),
        };
        self.within.pop();
        self.known.insert((function.address, length), cost);
        cost
    }

    fn longest(&mut self, function: &Function, graph: &Graph, length: Option<u64>) -> Cost {
        let mut capped = BTreeMap::new();
        let mut ways = self.ways(function, graph, length, &mut capped, None);
        let loops = match graph.loops() {
            Ok(loops) => loops,
            Err(block) => {
                let (function, address) = (function.name.clone(), graph.address(block));
                return self.fault(Fault::Irreducible { function, address });
            }
        };
        for round in &loops {
            let most = self.rounds(function, graph, &loops, round, length);
            collapse(&mut ways, round, most, capped.values());
        }
        let Some(path) = reach(&ways, 0, None).1.remove(&None) else {
            return self.fault(Fault::NoReturn { function: function.name.clone() });
        };
        capped.values().fold(path, |sum, c| sum + c.cost * c.most)
    }

    /// The cost of each way: the block that it leaves, and the jump. With `ends`, the function is left at these calls.
    fn ways(
        &mut self,
        function: &Function,
        graph: &Graph,
        length: Option<u64>,
        capped: &mut BTreeMap<u32, Capped>,
        ends: Option<&BTreeMap<usize, (usize, Cost)>>,
    ) -> Ways {
        let mut ways = Ways::new();
        for (n, block) in graph.blocks.iter().enumerate() {
            // A block with a call that is stated never to be made is never executed, but up to an end before it.
            let barred = block.instructions.iter().position(|i| match i.flow {
                Flow::Call(target) => self.image.function_at(target).is_some_and(|f| self.never(function, f)),
                _ => false,
            });
            let reached = ends.and_then(|e| e.get(&n)).is_some_and(|(k, _)| barred.is_none_or(|b| *k < b));
            if barred.is_some() && !reached {
                continue;
            }
            let mut cost = Cost::default();
            for (k, i) in block.instructions.iter().enumerate() {
                let Some(c) = cycles(i) else {
                    let (address, text) = (i.address, format!("{} ({})", i.text, i.name));
                    self.fault(Fault::NoCost { function: function.name.clone(), address, text });
                    continue;
                };
                let stalled = block.instructions.get(k + 1).map_or(0, |next| stall(i, next));
                cost = cost + Cost { instructions: 1, cycles: c + stalled };
                if let Some((_, rest)) = ends.and_then(|e| e.get(&n)).filter(|(at, _)| *at == k) {
                    or_longer(&mut ways, (n, None), cost + *rest);
                    // The last block of all: nothing of it is called as a whole.
                    if block.next.is_empty() || barred.is_some() {
                        break;
                    }
                }
                if let Flow::Call(target) = i.flow {
                    cost = cost + Cost::cycles(refill(i));
                    let so_far = &block.instructions[..k];
                    cost = cost + self.call(function, (n, i), target, so_far, length, capped);
                }
            }
            let Some((last, so_far)) = block.instructions.split_last().filter(|_| barred.is_none()) else {
                continue;
            };
            for &to in &block.next {
                let first = &graph.blocks[to].instructions[0];
                let jumped = if first.address == last.address + last.size { 0 } else { refill(last) };
                or_longer(&mut ways, (n, Some(to)), cost + Cost::cycles(jumped + stall(last, first)));
            }
            if block.returns {
                or_longer(&mut ways, (n, None), cost + Cost::cycles(refill(last)));
            }
            let mut never = |target| self.image.function_at(target).is_some_and(|f| self.never(function, f));
            if let Some(target) = block.tail_call.filter(|target| !never(*target)) {
                let callee = self.call(function, (n, last), target, so_far, length, capped);
                or_longer(&mut ways, (n, None), cost + Cost::cycles(refill(last)) + callee);
            }
        }
        ways
    }

    /// The cost that a call adds in its place. The cost of calls with a capped number is kept
    /// separately.
    fn call(
        &mut self,
        function: &Function,
        (block, i): (usize, &Instruction),
        target: u32,
        before: &[Instruction],
        length: Option<u64>,
        capped: &mut BTreeMap<u32, Capped>,
    ) -> Cost {
        let Some(callee) = self.image.function_at(target) else {
            let (function, address) = (function.name.clone(), i.address);
            return self.fault(Fault::NoTarget { function, address, target });
        };
        let cap = self.cap(&function.name, &callee.name);
        if self.free == Some(callee.name.as_str()) {
            return Cost::default();
        }
        let bytes = length_register(&callee.name).and_then(|register| {
            let handed_on = length.filter(|_| length_register(&function.name).is_some());
            let stated =
                self.facts.lengths.iter().find(|f| means(&f.function, &function.name) && callee.name == f.of);
            let known = handed_on.or_else(|| constant(before, register));
            // The rest of a longer copy may be stated, too.
            match (known, stated) {
                (Some(known), Some(f)) if handed_on.is_some() => {
                    self.used.insert((false, f.name()));
                    Some(if f.rest { known % (f.most + 1) } else { known.min(f.most) })
                }
                (Some(known), _) => Some(known),
                (None, stated) => {
                    self.used.extend(stated.map(|f| (false, f.name())));
                    stated.map(|f| f.most)
                }
            }
        });
        if length_register(&callee.name).is_some() && bytes.is_none() {
            let (function, callee) = (function.name.clone(), callee.name.clone());
            return self.fault(Fault::Length { function, address: i.address, callee });
        }
        let cost = self.function(callee, bytes);
        match cap {
            Some(c) => {
                // Calls of different lengths: the costliest of them.
                let known = capped.entry(target).or_default();
                known.cost = known.cost.max(cost);
                known.most = c.most;
                known.blocks.insert(block);
                Cost::default()
            }
            None => cost,
        }
    }

    /// Executions of a loop's head each time that the loop is entered.
    fn rounds(
        &mut self,
        function: &Function,
        graph: &Graph,
        loops: &[Loop],
        round: &Loop,
        length: Option<u64>,
    ) -> u64 {
        let address = graph.address(round.head);
        let from = self.image.inlined_from(address);
        let outer = loops.iter().any(|l| l.head != round.head && round.body.contains(&l.head));
        let fact = both(&self.case.loops, &self.facts.loops).find(|(_, f)| {
            means(&f.function, &function.name)
                && f.outer.is_none_or(|o| o == outer)
                && f.of.as_ref().is_none_or(|of| from.iter().any(|name| means(of, name)))
        });
        self.used.extend(fact.map(|(case, f)| (case, f.name())));
        let fact = fact.map(|(_, f)| f);
        let worked = |f: &facts::LoopFact| Some(length? / f.step? + 1);
        let stated = fact.and_then(|f| [f.most, worked(f)].into_iter().flatten().min());
        let each = fact.filter(|f| !f.by.is_empty()).map_or(1, |f| graph.least_each_round(round, &f.by));
        if let (Some(stated), Some(fact), 1..) = (stated, fact, each) {
            // In the last round, the head may be executed and none of the counted instructions.
            let most = if !fact.by.is_empty() { stated / each + 1 } else { stated };
            self.told.insert(address, format!("{}: {most}: {}", function.name, fact.why));
            return most.max(1);
        }
        let from = from.join(" < ");
        self.fault(Fault::Unbounded { function: function.name.clone(), address, from });
        1
    }
}

/// The facts of a case, and then those of all cases.
fn both<'f, F>(case: &'f [F], all: &'f [F]) -> impl Iterator<Item = (bool, &'f F)> {
    case.iter().map(|f| (true, f)).chain(all.iter().map(|f| (false, f)))
}

/// The register in which a function on memory gets its number of bytes.
fn length_register(name: &str) -> Option<&'static str> {
    let name = name.rsplit("::").next().unwrap_or(name);
    let name = name.strip_prefix("__aeabi_").map_or((name, false), |n| (n, true));
    match name {
        (n, true) if n.starts_with("memset") || n.starts_with("memclr") => Some("r1"),
        (n, _) if ["memcpy", "memmove", "memset"].iter().any(|m| n.starts_with(m)) => Some("r2"),
        _ => None,
    }
}

/// The constant that a register has been given last, under any condition.
fn constant(before: &[Instruction], register: &str) -> Option<u64> {
    let names = |i: &Instruction| i.operands.iter().any(|o| o.trim_matches(['[', ']', '^']) == register);
    let changes = |i: &&Instruction| match i.flow {
        Flow::Call(_) | Flow::Indirect => true,
        _ => names(i) && !only_reads(i),
    };
    let last = before.iter().rev().find(changes)?;
    let [to, value] = &last.operands[..] else { return None };
    if !["mov", "movs", "movw"].contains(&last.name.as_str()) || last.conditional || to != register {
        return None;
    }
    number(value).map(u64::from)
}

/// The longest ways from a block within `only`, to each block and out of the function; the ways
/// that leave `only` or lead back to the block are not followed.
fn reach(
    ways: &Ways,
    from: usize,
    only: Option<&BTreeSet<usize>>,
) -> (Vec<usize>, BTreeMap<Option<usize>, Cost>) {
    let inside = |b: usize| only.is_none_or(|o| o.contains(&b));
    let next = |b: usize| ways.range((b, None)..=(b, Some(usize::MAX)));
    // In an order in which each block comes after all that lead to it.
    let (mut order, mut seen, mut open) = (Vec::new(), BTreeSet::new(), vec![(from, false)]);
    while let Some((b, done)) = open.pop() {
        if done {
            order.push(b);
        } else if seen.insert(b) {
            open.push((b, true));
            open.extend(
                next(b)
                    .filter_map(|((_, to), _)| *to)
                    .filter(|&t| t != from && inside(t))
                    .map(|t| (t, false)),
            );
        }
    }
    order.reverse();
    let mut longest: BTreeMap<Option<usize>, Cost> = BTreeMap::from([(Some(from), Cost::default())]);
    for &b in &order {
        let so_far = longest.get(&Some(b)).copied().unwrap_or_default();
        for ((_, to), cost) in next(b) {
            if to.is_some_and(|t| t == from || !inside(t)) {
                continue;
            }
            let total = so_far + *cost;
            longest.entry(*to).and_modify(|c| *c = c.max(total)).or_insert(total);
        }
    }
    (order, longest)
}

/// Adds a way, or makes the one that is there as long.
fn or_longer(ways: &mut Ways, way: (usize, Option<usize>), cost: Cost) {
    ways.entry(way).and_modify(|c| *c = c.max(cost)).or_insert(cost);
}

/// Puts a loop into its head: a way out of the loop costs all rounds, too.
fn collapse<'c>(ways: &mut Ways, round: &Loop, most: u64, capped: impl Iterator<Item = &'c Capped>) {
    let (once, out) = rounds_and_ways_out(ways, round, &round.body);
    let again = most - 1;
    let mut rounds = once * again;
    // Rounds that contain calls of a capped number are as few.
    for c in capped.filter(|c| c.most < again && !c.blocks.is_disjoint(&round.body)) {
        let rest = round.body.difference(&c.blocks).copied().collect();
        let (without, _) = rounds_and_ways_out(ways, round, &rest);
        rounds = rounds.min(once * c.most + without * (again - c.most));
    }
    ways.retain(|(from, _), _| !round.body.contains(from));
    for (to, cost) in out {
        let total = rounds + cost;
        or_longer(ways, (round.head, to), total);
    }
}

/// The longest way round a loop, and the ways out of it, by the blocks of `only`.
fn rounds_and_ways_out(
    ways: &Ways,
    round: &Loop,
    only: &BTreeSet<usize>,
) -> (Cost, Vec<(Option<usize>, Cost)>) {
    let (mut once, mut out) = (Cost::default(), Vec::new());
    if !only.contains(&round.head) {
        return (once, out);
    }
    let (order, longest) = reach(ways, round.head, Some(only));
    let at = |b: usize| longest.get(&Some(b)).copied().unwrap_or_default();
    for &b in &order {
        for ((_, to), cost) in ways.range((b, None)..=(b, Some(usize::MAX))) {
            match to {
                Some(t) if *t == round.head => once = once.max(at(b) + *cost),
                Some(t) if round.body.contains(t) => {}
                _ => out.push((*to, at(b) + *cost)),
            }
        }
    }
    (once, out)
}
