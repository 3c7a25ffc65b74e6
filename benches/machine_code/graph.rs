//! Blocks of instructions, the ways between them, and loops.

use super::Fault;
use super::decode::{Flow, Instruction};
use super::image::{Function, Image};
use std::collections::{BTreeMap, BTreeSet};

/// Instructions that are executed one after the other.
pub(super) struct Block {
    pub instructions: Vec<Instruction>,
    /// Blocks that may follow.
    pub next: Vec<usize>,
    /// A call that ends the function: its target.
    pub tail_call: Option<u32>,
    /// True if the function may end here.
    pub returns: bool,
}

/// A loop: all blocks from which its head can be reached again without leaving.
pub(super) struct Loop {
    pub head: usize,
    pub body: BTreeSet<usize>,
}

/// A function as blocks; the first is its entry.
pub(super) struct Graph {
    pub blocks: Vec<Block>,
}

impl Graph {
    /// The blocks of a function that its entry reaches.
    pub(super) fn new(image: &Image, function: &Function) -> Result<Graph, Fault> {
        let inside = |a: u32| (function.address..function.address + function.size).contains(&a);
        let mut code: BTreeMap<u32, Instruction> =
            image.instructions(function)?.iter().map(|i| (i.address, i.clone())).collect();
        // On a Cortex-M0+ a jump that is too far for one is a call into the same function.
        for i in code.values_mut() {
            if let Flow::Call(t) = i.flow
                && inside(t)
                && t != function.address
            {
                i.flow = Flow::Jump(t);
            }
        }
        let mut starts = BTreeSet::from([function.address]);
        for i in code.values() {
            let after = i.address + i.size;
            match i.flow {
                Flow::Jump(t) | Flow::Branch(t) => {
                    starts.extend(inside(t).then_some(t));
                    starts.insert(after);
                }
                Flow::Return | Flow::MayReturn | Flow::Trap | Flow::Indirect => drop(starts.insert(after)),
                Flow::Next | Flow::Call(_) => {}
            }
        }
        let (mut blocks, mut index, mut open) = (Vec::new(), BTreeMap::new(), vec![function.address]);
        let mut ways: Vec<Vec<u32>> = Vec::new();
        while let Some(start) = open.pop() {
            if index.contains_key(&start) {
                continue;
            }
            index.insert(start, blocks.len());
            let (block, next) = Graph::block(function, &code, &starts, start)?;
            open.extend(&next);
            blocks.push(block);
            ways.push(next);
        }
        for (block, next) in blocks.iter_mut().zip(ways) {
            block.next = next.iter().map(|a| index[a]).collect();
        }
        Ok(Graph { blocks })
    }

    fn block(
        function: &Function,
        code: &BTreeMap<u32, Instruction>,
        starts: &BTreeSet<u32>,
        start: u32,
    ) -> Result<(Block, Vec<u32>), Fault> {
        let mut block = Block { instructions: Vec::new(), next: Vec::new(), tail_call: None, returns: false };
        let mut at = start;
        loop {
            let Some(i) = code.get(&at) else {
                // A call that ends a function does not come back.
                if block.instructions.last().is_some_and(|i| matches!(i.flow, Flow::Call(_))) {
                    return Ok((block, vec![]));
                }
                return Err(Fault::RunsOff { function: function.name.clone() });
            };
            block.instructions.push(i.clone());
            at += i.size;
            let inside = |t: u32| (function.address..function.address + function.size).contains(&t);
            let next = match i.flow {
                Flow::Next | Flow::Call(_) if !starts.contains(&at) => continue,
                Flow::Next | Flow::Call(_) => vec![at],
                Flow::Jump(t) if inside(t) => vec![t],
                Flow::Branch(t) if inside(t) => vec![at, t],
                Flow::Jump(t) => {
                    block.tail_call = Some(t);
                    vec![]
                }
                Flow::Branch(t) => {
                    block.tail_call = Some(t);
                    vec![at]
                }
                Flow::Return => {
                    block.returns = true;
                    vec![]
                }
                Flow::MayReturn => {
                    block.returns = true;
                    vec![at]
                }
                Flow::Trap => vec![],
                Flow::Indirect => {
                    let (address, text) = (i.address, i.text.clone());
                    return Err(Fault::Indirect { function: function.name.clone(), address, text });
                }
            };
            return Ok((block, next));
        }
    }

    /// The blocks from which one of these is reached, themselves among them.
    pub(super) fn reaching(&self, ends: &BTreeSet<usize>) -> BTreeSet<usize> {
        let before = self.before();
        let (mut found, mut open) = (BTreeSet::new(), Vec::from_iter(ends.iter().copied()));
        while let Some(b) = open.pop() {
            if found.insert(b) {
                open.extend(&before[b]);
            }
        }
        found
    }

    /// Address of a block's first instruction.
    pub(super) fn address(&self, block: usize) -> u32 {
        self.blocks[block].instructions[0].address
    }

    /// All loops, inner ones before those around them.
    ///
    /// # Errors
    /// The block of a loop that can be entered elsewhere than at its head.
    pub(super) fn loops(&self) -> Result<Vec<Loop>, usize> {
        let before = self.before();
        let dominators = self.dominators(&before);
        let mut loops: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        for (from, block) in self.blocks.iter().enumerate() {
            for &head in block.next.iter().filter(|h| dominators[from].contains(h)) {
                let body = loops.entry(head).or_insert_with(|| BTreeSet::from([head]));
                let mut open = vec![from];
                while let Some(b) = open.pop() {
                    if body.insert(b) {
                        open.extend(&before[b]);
                    }
                }
            }
        }
        let mut loops: Vec<Loop> = loops.into_iter().map(|(head, body)| Loop { head, body }).collect();
        loops.sort_by_key(|l| l.body.len());
        self.without_back_edges_nothing_goes_round(&dominators)?;
        Ok(loops)
    }

    /// The least number of instructions of these names on any way round a loop; those that a condition may
    /// switch off and those on the stack, where a function keeps what has no register, do not count.
    pub(super) fn least_each_round(&self, round: &Loop, names: &[String]) -> u64 {
        let count = |b: usize| -> u64 {
            let counts =
                |i: &&Instruction| names.contains(&i.name) && !i.conditional && !i.text.contains("[sp");
            self.blocks[b].instructions.iter().filter(counts).count() as u64
        };
        let mut least: BTreeMap<usize, u64> = BTreeMap::from([(round.head, count(round.head))]);
        let mut open = vec![round.head];
        while let Some(b) = open.pop() {
            for &to in self.blocks[b].next.iter().filter(|t| **t != round.head && round.body.contains(t)) {
                let total = least[&b] + count(to);
                if least.get(&to).is_none_or(|l| total < *l) {
                    least.insert(to, total);
                    open.push(to);
                }
            }
        }
        let back = least.iter().filter(|(b, _)| self.blocks[**b].next.contains(&round.head));
        back.map(|(_, total)| *total).min().unwrap_or(0)
    }

    /// The blocks that lead to each.
    fn before(&self) -> Vec<Vec<usize>> {
        let mut before = vec![Vec::new(); self.blocks.len()];
        for (from, block) in self.blocks.iter().enumerate() {
            block.next.iter().for_each(|&to| before[to].push(from));
        }
        before
    }

    /// For each block, those through which all ways to it lead, itself among them.
    fn dominators(&self, before: &[Vec<usize>]) -> Vec<BTreeSet<usize>> {
        let all: BTreeSet<usize> = (0..self.blocks.len()).collect();
        let mut found = vec![all; self.blocks.len()];
        found[0] = BTreeSet::from([0]);
        loop {
            let mut changed = false;
            for b in 1..self.blocks.len() {
                let mut common = before[b].iter().map(|&p| &found[p]);
                let first = common.next().cloned().unwrap_or_default();
                let mut now = common.fold(first, |a, d| a.intersection(d).copied().collect());
                now.insert(b);
                changed |= now != found[b];
                found[b] = now;
            }
            if !changed {
                return found;
            }
        }
    }

    fn without_back_edges_nothing_goes_round(&self, dominators: &[BTreeSet<usize>]) -> Result<(), usize> {
        let mut missing = vec![0; self.blocks.len()];
        let forward =
            |from: usize| self.blocks[from].next.iter().filter(move |t| !dominators[from].contains(t));
        (0..self.blocks.len()).flat_map(forward).for_each(|&to| missing[to] += 1);
        let mut open: Vec<usize> = (0..self.blocks.len()).filter(|&b| missing[b] == 0).collect();
        while let Some(b) = open.pop() {
            for &to in forward(b) {
                missing[to] -= 1;
                if missing[to] == 0 {
                    open.push(to);
                }
            }
        }
        missing.iter().position(|&m| m > 0).map_or(Ok(()), Err)
    }
}
