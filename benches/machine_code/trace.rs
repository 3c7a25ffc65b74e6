//! Cycles along the executed paths.

use super::cost::{cycles, refill, stall};
use super::decode::{Flow, Instruction};
use super::image::Image;
use super::{Cost, Fault};
use std::collections::BTreeMap;

/// The cost of each call of the functions at `entries`, in the order of the calls. `trace` has the
/// address of each instruction executed in these functions and in those that they call.
///
/// # Errors
/// An address that is in no function of the image, or an instruction without a cost.
pub fn traced(
    image: &Image,
    entries: &[u32],
    trace: impl Iterator<Item = u32>,
) -> Result<BTreeMap<u32, Vec<Cost>>, Fault> {
    let mut code: BTreeMap<u32, Instruction> = BTreeMap::new();
    for f in image.functions() {
        // Code outside the examined functions is skipped.
        let known = image.instructions(f).unwrap_or_default();
        code.extend(known.iter().map(|i| (i.address, i.clone())));
    }
    let mut calls: BTreeMap<u32, Vec<Cost>> = entries.iter().map(|e| (*e, Vec::new())).collect();
    // The call that goes on: its entry, its cost so far, and how many calls deep it is.
    let mut open: Option<(u32, Cost, u64)> = None;
    let mut last: Option<&Instruction> = None;
    for address in trace {
        let i = code.get(&address).ok_or(Fault::Untraceable { address })?;
        if let (Some((entry, cost, depth)), Some(before)) = (&mut open, last) {
            let jumped = before.address + before.size != address;
            let left = before.flow == Flow::Return || before.flow == Flow::MayReturn && jumped;
            cost.cycles += if jumped { refill(before) } else { 0 };
            match before.flow {
                Flow::Call(_) => *depth += 1,
                _ if left && *depth == 0 => {
                    // The place it returns to is not in the trace, but may be next to it.
                    cost.cycles += if jumped { 0 } else { refill(before) };
                    if let Some(of) = calls.get_mut(entry) {
                        of.push(*cost);
                    }
                    open = None;
                }
                _ if left => *depth -= 1,
                _ => cost.cycles += stall(before, i),
            }
        }
        if open.is_none() && calls.contains_key(&address) {
            open = Some((address, Cost::default(), 0));
        }
        if let Some((_, cost, _)) = &mut open {
            let text = || i.text.clone();
            cost.instructions += 1;
            cost.cycles +=
                cycles(i).ok_or_else(|| Fault::NoCost { function: String::new(), address, text: text() })?;
        }
        last = Some(i);
    }
    if let (Some((entry, mut cost, _)), Some(before)) = (open, last) {
        cost.cycles += refill(before);
        if let Some(of) = calls.get_mut(&entry) {
            of.push(cost);
        }
    }
    Ok(calls)
}
