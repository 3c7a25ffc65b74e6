//! Flash, static RAM and stack of the controller's image.

use crate::plan::Memory;
use anyhow::{Context, Result};
use clutch_benches::machine_code::{Fault, Image, Stack, Stacks};

/// Start of RAM, on every Cortex-M.
const RAM: u32 = 0x2000_0000;
/// Bytes that an exception puts on the stack: the registers of core and floating-point unit, and a
/// word to align them.
const EXCEPTION: u64 = 104 + 4;
/// The function of an image's one task, where it has embassy's, and the most that its frame may take: no role is made in it.
const TASK: &str = "embassy_executor::raw::TaskStorage<F>::poll";
const FRAME: u64 = 300;

/// Prints flash, static RAM, and the stacks of a period and of a run's making, of an image that is flashed; gives the values over
/// budget.
///
/// # Errors
/// The stack cannot be followed.
pub(crate) fn flashed(image: &Image, budget: &Memory) -> Result<Vec<String>, Fault> {
    let (mut flash, mut ram) = (0, 0);
    for s in image.sections() {
        flash += if s.stored { u64::from(s.size) } else { 0 };
        ram += if s.address >= RAM { u64::from(s.size) } else { 0 };
    }
    let name = &budget.image;
    println!("\nImage `{name}`, bytes: flash {flash}, static RAM {ram}");
    let mut values = vec![("flash", flash, budget.flash), ("static RAM", ram, budget.ram)];
    let mut stacks = Stacks::new(image);
    // What polls the task calls through registers, and has no bound; the frame of the task is there in every period.
    if image.function(TASK).is_ok() {
        let frame = stacks.frame(TASK)?;
        println!("\n| frame of the task, below both stacks | {frame} |\n|---|---|");
        values.push(("frame of the task", frame, FRAME));
    }
    for (what, function, may) in [
        ("stack of a period", &budget.period, budget.stack),
        ("stack of what makes a run, while nothing is driven", &budget.setup, budget.setup_stack),
    ] {
        let stack = stacks.of(function)?;
        println!("\n| {what} | {} |\n|---|---|", stack.bytes);
        stack.path.iter().for_each(|(function, bytes)| println!("| `{function}` | {bytes} |"));
        values.push((what, stack.bytes, may));
    }
    let over = values.iter().filter(|(_, is, may)| is > may);
    Ok(over.map(|(what, is, may)| format!("{name}: {what}: {is} bytes of {may}")).collect())
}

/// Prints the sections with their sizes; gives the values over budget.
pub(crate) fn size(image: &Image, budget: &Memory) -> Vec<String> {
    let (mut flash, mut ram) = (0, 0);
    println!(
        "\nMemory of the image `mps2-controller`, bytes:\n\n| section | address | flash | RAM |\n|---|---|---|---|"
    );
    for s in image.sections() {
        let stored = if s.stored { u64::from(s.size) } else { 0 };
        let lives = if s.address >= RAM { u64::from(s.size) } else { 0 };
        flash += stored;
        ram += lives;
        println!("| `{}` | {:#010x} | {stored} | {lives} |", s.name, s.address);
    }
    println!("| all | | {flash} | {ram} |\n| budget | | {} | {} |", budget.flash, budget.ram);
    let over = [("flash", flash, budget.flash), ("static RAM", ram, budget.ram)];
    over.iter()
        .filter(|(_, is, may)| is > may)
        .map(|(n, is, may)| format!("{n}: {is} bytes of {may}"))
        .collect()
}

/// The stack at its deepest: the thread, an interrupt in it, and the processor's own failure in that.
pub(crate) fn stack(image: &Image, budget: &Memory) -> Result<Vec<String>> {
    let mut stacks = Stacks::new(image);
    let mut handlers = image.handlers();
    let thread = stacks.function(handlers.next().context("the image has no table of exceptions")?)?;
    let mut interrupt = Stack::default();
    let mut failure = Stack::default();
    for handler in handlers {
        let stack = stacks.function(handler)?;
        let deepest = if handler.name.contains("HardFault") { &mut failure } else { &mut interrupt };
        if stack.bytes >= deepest.bytes {
            *deepest = stack;
        }
    }
    println!("\nStack of the image `mps2-controller`, bytes:\n\n| function | bytes |\n|---|---|");
    let mut total = 0;
    for (what, stack, frame) in
        [("thread", &thread, 0), ("interrupt", &interrupt, EXCEPTION), ("failure", &failure, EXCEPTION)]
    {
        total += stack.bytes + frame;
        println!("| **{what}** | {} |", stack.bytes + frame);
        if frame > 0 {
            println!("| the registers, put there by the core | {frame} |");
        }
        for (name, bytes) in &stack.path {
            println!("| `{name}` | {bytes} |");
        }
    }
    println!("| **all** | {total} |\n| budget | {} |", budget.stack);
    Ok((total > budget.stack)
        .then(|| format!("stack: {total} bytes of {}", budget.stack))
        .into_iter()
        .collect())
}
