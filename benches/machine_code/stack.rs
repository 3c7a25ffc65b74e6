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

    /// What the function of this name takes of the stack as it begins, up to its first call or jump, bytes.
    ///
    /// # Errors
    /// There is no such function.
    pub fn frame(&self, name: &str) -> Result<u64, Fault> {
        let function = self.image.function(name)?;
        let code = self.image.instructions(function)?;
        let before = code.iter().take_while(|i| matches!(i.flow, Flow::Next));
        let depth = before.fold(0, |depth, i| moved(i, depth).unwrap_or(depth));
        Ok(depth.max(0).cast_unsigned())
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
        let mut registers = Registers::default();
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
            // A register need not have in this block what it had in another.
            registers = Registers { frame: registers.frame, ..Registers::default() };
            for i in &block.instructions {
                let by_register = registers.moved(self.image, i, depth);
                depth = by_register.or_else(|| moved(i, depth)).ok_or_else(|| Fault::StackPointer {
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

/// Registers by which a Cortex-M0+ moves the stack pointer: its instructions have room for small numbers alone.
#[derive(Default)]
struct Registers {
    /// The depth to which r7 points: the frame's end, for the whole function.
    frame: Option<i64>,
    constants: BTreeMap<String, i64>,
    depths: BTreeMap<String, i64>,
}

impl Registers {
    /// The depth after an instruction that takes the stack pointer from a register, bytes; none for any other.
    fn moved(&mut self, image: &Image, i: &Instruction, depth: i64) -> Option<i64> {
        let operand = |n: usize| i.operands.get(n).map_or("", String::as_str);
        let (first, second) = (operand(0), operand(1));
        let last = i.operands.last().and_then(|o| number(o));
        match (i.name.as_str(), first, second) {
            ("add", "r7", "sp") => self.frame = Some(depth - last?),
            ("ldr", _, "[pc") => {
                let at = ((i.address + 4) & !3).checked_add_signed(i32::try_from(last?).ok()?)?;
                self.constants.insert(first.to_owned(), image.word(at)?.cast_signed().into());
            }
            ("sub" | "subs", _, "r7") => drop(self.depths.insert(first.to_owned(), self.frame? + last?)),
            ("sub" | "subs", _, _) if i.operands.len() == 2 && self.depths.contains_key(first) => {
                self.depths.entry(first.to_owned()).and_modify(|depth| *depth += last.unwrap_or(0));
            }
            ("add", "sp", register) if i.operands.len() == 2 && last.is_none() => {
                return self.constants.get(register).map(|constant| depth - constant);
            }
            ("mov", "sp", register) => return self.depths.get(register).copied(),
            ("cmp" | "str" | "strb" | "strh" | "push", _, _) => {}
            _ => {
                self.constants.remove(first);
                self.depths.remove(first);
            }
        }
        None
    }
}

/// The number of an operand.
fn number(operand: &str) -> Option<i64> {
    let digits = operand.trim_end_matches(']').strip_prefix('#')?;
    digits.strip_prefix("0x").map_or_else(|| digits.parse().ok(), |h| i64::from_str_radix(h, 16).ok())
}

/// The depth after an instruction, bytes; none if the code does not show it.
fn moved(i: &Instruction, depth: i64) -> Option<i64> {
    let first = i.operands.first().map_or("", String::as_str);
    let number = |o: Option<&String>| o.and_then(|o| number(o));
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
        "str" | "strd" if writes_back => depth - number(i.operands.last())?,
        "ldr" | "ldrd" if writes_back => depth - number(i.operands.last())?,
        // Several registers from or to where it points, which it goes on to do.
        "ldm" | "stm" | "vldmia" | "vstmia" if first == "sp" && !writes_back => depth,
        _ if first == "sp" && i.name != "cmp" => return None,
        _ => depth,
    })
}
