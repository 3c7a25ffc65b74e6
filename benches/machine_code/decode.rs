//! Instructions, and the successors of each.

use capstone::arch::arm::{ArchExtraMode, ArchMode, ArmCC};
use capstone::prelude::*;

/// The successors of an instruction besides the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flow {
    /// Only to the next.
    Next,
    /// Never to the next.
    Jump(u32),
    /// To the next or there.
    Branch(u32),
    /// There, and from there back to the next.
    Call(u32),
    /// Out of the function.
    Return,
    /// Out of the function or to the next.
    MayReturn,
    /// To a place that the code does not show.
    Indirect,
    /// Nowhere: a trap.
    Trap,
}

/// One instruction.
#[derive(Clone, Debug)]
pub(super) struct Instruction {
    pub address: u32,
    /// Bytes.
    pub size: u32,
    /// Its name without condition and width: `add`, `vldr`.
    pub name: String,
    /// As an assembler would write it.
    pub text: String,
    /// Operands in order, those of a list one by one.
    pub operands: Vec<String>,
    pub flow: Flow,
    /// A condition may switch it off.
    pub conditional: bool,
}

/// Decodes Thumb-2 with the floating-point extension of a Cortex-M4F.
pub(super) struct Decoder(Capstone);

impl Decoder {
    /// A decoder.
    pub(super) fn new() -> Decoder {
        let built =
            Capstone::new().arm().mode(ArchMode::Thumb).extra_mode([ArchExtraMode::MClass].into_iter());
        Decoder(built.detail(true).build().expect("capstone is built with Arm"))
    }

    /// The instructions of `code` up to its end, or to the first bytes that are not an instruction.
    pub(super) fn decode(&self, code: &[u8], address: u32) -> Vec<Instruction> {
        let Ok(all) = self.0.disasm_all(code, u64::from(address)) else { return Vec::new() };
        all.iter().filter_map(|i| self.instruction(i)).collect()
    }

    fn instruction(&self, i: &capstone::Insn<'_>) -> Option<Instruction> {
        let detail = self.0.insn_detail(i).ok()?;
        let arch = detail.arch_detail();
        let conditional = !matches!(arch.arm()?.cc(), ArmCC::ARM_CC_AL | ArmCC::ARM_CC_INVALID);
        let name = self.0.insn_name(i.id())?;
        let op_str = i.op_str().unwrap_or_default();
        let operands: Vec<String> = op_str
            .split([',', '{', '}', ' '])
            .filter(|s| !s.is_empty())
            .map(|s| s.trim_end_matches('!').to_owned())
            .collect();
        let text = format!("{} {op_str}", i.mnemonic().unwrap_or_default());
        let flow = flow(&name, &operands, op_str, conditional);
        Some(Instruction {
            address: i.address() as u32,
            size: i.len() as u32,
            name,
            text,
            operands,
            flow,
            conditional,
        })
    }
}

fn flow(name: &str, operands: &[String], op_str: &str, conditional: bool) -> Flow {
    let first = operands.first().map_or("", String::as_str);
    let last = operands.last().map_or("", String::as_str);
    let target = || {
        let digits = last.strip_prefix('#')?;
        digits.strip_prefix("0x").map_or_else(|| digits.parse().ok(), |h| u32::from_str_radix(h, 16).ok())
    };
    let back = if conditional { Flow::MayReturn } else { Flow::Return };
    match name {
        "b" if conditional => target().map_or(Flow::Indirect, Flow::Branch),
        "b" => target().map_or(Flow::Indirect, Flow::Jump),
        "cbz" | "cbnz" => target().map_or(Flow::Indirect, Flow::Branch),
        "bl" => target().map_or(Flow::Indirect, Flow::Call),
        "bx" if first == "lr" => back,
        "bx" | "blx" | "tbb" | "tbh" => Flow::Indirect,
        "udf" => Flow::Trap,
        "pop" | "ldm" | "ldmdb" if last == "pc" => back,
        "ldr" if first == "pc" && op_str.starts_with("pc, [sp], ") => back,
        _ if first == "pc" && name != "cmp" && name != "push" => Flow::Indirect,
        _ => Flow::Next,
    }
}
