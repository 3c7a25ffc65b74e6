//! Calls through a register that holds a constant wherever they are reached: code compiled for size has a function's
//! address there, if it calls it often.

use super::decode::{Flow, Instruction};
use std::collections::BTreeMap;

/// Registers that hold a constant.
type Known = BTreeMap<String, u32>;

/// Registers that a call may change.
const CHANGED: [&str; 6] = ["r0", "r1", "r2", "r3", "ip", "lr"];

/// Gives each such call its target; `word` is the constant at an address.
pub(super) fn resolve(all: &mut [Instruction], word: impl Fn(u32) -> Option<u32>) {
    if !all.iter().any(is_call) {
        return;
    }
    let at: BTreeMap<u32, usize> = all.iter().enumerate().map(|(n, i)| (i.address, n)).collect();
    let mut before: Vec<Option<Known>> = vec![None; all.len()];
    before[0] = Some(Known::new());
    let mut open = vec![0];
    while let Some(n) = open.pop() {
        let i = &all[n];
        let known = after(i, before[n].clone().unwrap_or_default(), &word);
        let next = i.address + i.size;
        let to = match i.flow {
            Flow::Next | Flow::MayReturn => [Some(next), None],
            Flow::Call(t) | Flow::Branch(t) => [Some(next), Some(t)],
            Flow::Jump(t) => [Some(t), None],
            Flow::Indirect => [is_call(i).then_some(next), None],
            Flow::Return | Flow::Trap => [None, None],
        };
        for n in to.into_iter().flatten().filter_map(|t| at.get(&t).copied()) {
            let met = match &before[n] {
                None => known.clone(),
                // Facts that hold on every way to it.
                Some(old) => old
                    .iter()
                    .filter(|(r, v)| known.get(*r) == Some(v))
                    .map(|(r, v)| (r.clone(), *v))
                    .collect(),
            };
            if before[n].as_ref() != Some(&met) {
                before[n] = Some(met);
                open.push(n);
            }
        }
    }
    for (i, known) in all.iter_mut().zip(before) {
        if is_call(i)
            && let Some(target) = known.unwrap_or_default().get(&i.operands[0])
        {
            i.flow = Flow::Call(target & !1);
        }
    }
}

/// An instruction that changes none of the registers that it names.
pub(super) fn only_reads(i: &Instruction) -> bool {
    match i.name.as_str() {
        "cmp" | "cmn" | "tst" | "teq" | "push" | "b" | "bl" | "blx" | "bx" | "cbz" | "cbnz" | "it" => true,
        name => name.starts_with("str") && !i.text.contains('!') && !i.text.contains("], "),
    }
}

/// The number of an operand, if it is one.
pub(super) fn number(operand: &str) -> Option<u32> {
    let digits = operand.trim_end_matches(']').strip_prefix('#')?;
    digits.strip_prefix("0x").map_or_else(|| digits.parse().ok(), |h| u32::from_str_radix(h, 16).ok())
}

fn is_call(i: &Instruction) -> bool {
    i.name == "blx" && i.flow == Flow::Indirect
}

/// Facts known after an instruction. Each register that it names may be changed, if it is not one of those that
/// change none.
fn after(i: &Instruction, mut known: Known, word: &impl Fn(u32) -> Option<u32>) -> Known {
    let value = match (i.name.as_str(), i.operands.as_slice()) {
        _ if i.conditional => None,
        ("mov" | "movw", [_, from]) => number(from).or_else(|| known.get(from).copied()),
        ("movt", [to, high]) => number(high).zip(known.get(to)).map(|(high, low)| high << 16 | low & 0xffff),
        ("ldr", [_, base, offset]) if base == "[pc" => {
            number(offset).and_then(|n| word(((i.address + 4) & !3).checked_add(n)?))
        }
        _ => None,
    };
    if matches!(i.flow, Flow::Call(_) | Flow::Indirect) {
        known.retain(|register, _| !CHANGED.contains(&register.as_str()));
    } else if !only_reads(i) {
        let written = if i.name == "mov" { &i.operands[..1] } else { &i.operands[..] };
        let named = |register: &String| written.iter().any(|o| o.trim_matches(['[', ']']) == register);
        known.retain(|register, _| !named(register));
    }
    known.extend(i.operands.first().cloned().zip(value));
    known
}
