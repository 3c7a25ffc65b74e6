//! The depth of the stack.

use super::Fault;
use super::decode::{Flow, Instruction};
use super::graph::Graph;
use super::image::{Function, Image};
use std::collections::BTreeMap;

/// The deepest stack below a function.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Stack {
    /// Bytes.
    pub bytes: u64,
    /// The functions on the way there with what each has on the stack, bytes.
    pub path: Vec<(String, u64)>,
}

/// Stacks of the functions of one image.
pub struct Stacks<'a> {
    image: &'a Image,
    known: BTreeMap<u32, Stack>,
    within: Vec<u32>,
}

impl<'a> Stacks<'a> {
    /// Nothing known yet.
    #[must_use]
    pub fn new(image: &'a Image) -> Self {
        Stacks { image, known: BTreeMap::new(), within: Vec::new() }
    }

    /// The deepest stack below the function of this name.
    ///
    /// # Errors
    /// Recursion, a call through a register, a stack pointer moved by an unknown amount.
    pub fn of(&mut self, name: &str) -> Result<Stack, Fault> {
        let function = self.image.function(name)?;
        self.function(function)
    }

    /// The deepest stack below a function.
    ///
    /// # Errors
    /// As [`Stacks::of`].
    pub fn function(&mut self, function: &Function) -> Result<Stack, Fault> {
        if let Some(stack) = self.known.get(&function.address) {
            return Ok(stack.clone());
        }
        if self.within.contains(&function.address) {
            return Err(Fault::Recursion(function.name.clone()));
        }
        self.within.push(function.address);
        let stack = self.deepest(function)?;
        self.within.pop();
        self.known.insert(function.address, stack.clone());
        Ok(stack)
    }

    fn deepest(&mut self, function: &Function) -> Result<Stack, Fault> {
        let graph = Graph::new(self.image, function)?;
        let mut entered: BTreeMap<usize, i64> = BTreeMap::new();
        let mut deepest = Stack { bytes: 0, path: vec![(function.name.clone(), 0)] };
        let mut open = vec![(0, 0)];
        while let Some((b, mut depth)) = open.pop() {
            // Once more only if it is deeper than before.
            if entered.get(&b).is_some_and(|&d| d >= depth) {
                continue;
            }
            // A loop that makes the stack deeper each time has no end.
            if depth > 1 << 24 {
                return Err(Fault::RunsOff { function: function.name.clone() });
            }
            entered.insert(b, depth);
            let block = &graph.blocks[b];
            for i in &block.instructions {
                depth = moved(i, depth).ok_or_else(|| Fault::StackPointer {
                    function: function.name.clone(),
                    address: i.address,
                    text: i.text.clone(),
                })?;
                let target = match i.flow {
                    Flow::Call(t) => Some(t),
                    Flow::Jump(_) | Flow::Branch(_) => block.tail_call,
                    _ => None,
                };
                let below = target.map(|t| self.callee(function, i, t)).transpose()?.unwrap_or_default();
                let total = depth.max(0) as u64 + below.bytes;
                if total > deepest.bytes {
                    let own = (function.name.clone(), depth.max(0) as u64);
                    deepest = Stack { bytes: total, path: [vec![own], below.path].concat() };
                }
            }
            open.extend(block.next.iter().map(|&n| (n, depth)));
        }
        Ok(deepest)
    }

    fn callee(&mut self, function: &Function, i: &Instruction, target: u32) -> Result<Stack, Fault> {
        let Some(callee) = self.image.function_at(target) else {
            let (function, address) = (function.name.clone(), i.address);
            return Err(Fault::NoTarget { function, address, target });
        };
        self.function(callee)
    }
}

/// The depth after an instruction, bytes; none if the code does not show it.
fn moved(i: &Instruction, depth: i64) -> Option<i64> {
    let first = i.operands.first().map_or("", String::as_str);
    let number = |o: Option<&String>| {
        let digits = o?.strip_prefix('#')?;
        digits.strip_prefix("0x").map_or_else(|| digits.parse().ok(), |h| i64::from_str_radix(h, 16).ok())
    };
    let words = |from: usize| -> i64 {
        let list = i.operands.get(from..).unwrap_or_default();
        list.iter().map(|o| if o.starts_with('d') { 8 } else { 4 }).sum()
    };
    let writes_back = i.text.contains("sp!") || i.text.contains("[sp], #");
    Some(match i.name.as_str() {
        "push" | "vpush" => depth + words(0),
        "pop" | "vpop" => depth - words(0),
        "stmdb" | "vstmdb" if first == "sp" && writes_back => depth + words(1),
        "ldm" | "vldmia" if first == "sp" && writes_back => depth - words(1),
        "sub" | "subw" if first == "sp" => depth + number(i.operands.last())?,
        "add" | "addw" if first == "sp" => depth - number(i.operands.last())?,
        "str" | "strd" if writes_back => {
            depth - number(i.operands.last().map(|o| o.trim_end_matches(']').to_owned()).as_ref())?
        }
        "ldr" | "ldrd" if writes_back => depth - number(i.operands.last())?,
        _ if first == "sp" && !matches!(i.name.as_str(), "cmp" | "stm" | "vstmia") => return None,
        _ => depth,
    })
}
