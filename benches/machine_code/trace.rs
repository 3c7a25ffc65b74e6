//! Cycles along a path that was gone.

use super::cost::{cycles, refill, stall};
use super::decode::Instruction;
use super::image::{Function, Image};
use super::{Cost, Fault};
use std::collections::BTreeMap;

/// The dearest call of a function in a trace: addresses of the instructions executed in it and in
/// `callees`, in order.
///
/// # Errors
/// An address outside of these functions, or an instruction without a cost.
pub fn traced_cycles(
    image: &Image,
    function: &Function,
    callees: &[&Function],
    trace: impl Iterator<Item = u32>,
) -> Result<(u64, Cost), Fault> {
    let mut code: BTreeMap<u32, Instruction> = BTreeMap::new();
    for f in callees.iter().copied().chain([function]) {
        code.extend(image.instructions(f)?.into_iter().map(|i| (i.address, i)));
    }
    let (mut most, mut now, mut calls) = (Cost::default(), Cost::default(), 0);
    let mut last: Option<&Instruction> = None;
    let larger = |a: Cost, b: Cost| Cost {
        instructions: a.instructions.max(b.instructions),
        cycles: a.cycles.max(b.cycles),
    };
    for address in trace {
        let Some(i) = code.get(&address) else {
            return Err(Fault::Undecodable { function: function.name.clone(), address });
        };
        let unknown = || Fault::NoCost { function: function.name.clone(), address, text: i.text.clone() };
        if address == function.address {
            // The return that ended the call before.
            now.cycles += last.map_or(0, refill);
            most = larger(most, now);
            (now, last) = (Cost::default(), None);
            calls += 1;
        }
        if let Some(before) = last {
            now.cycles += if before.address + before.size == address { 0 } else { refill(before) };
            now.cycles += stall(before, i);
        }
        now.instructions += 1;
        now.cycles += cycles(i).ok_or_else(unknown)?;
        last = Some(i);
    }
    now.cycles += last.map_or(0, refill);
    Ok((calls, larger(most, now)))
}
