//! Cycles of each instruction on a Cortex-M4F whose memory has no wait states.
//!
//! From the tables of the Cortex-M4 Technical Reference Manual (also printed as tables 3-25 and 3-27
//! of TI's SWCU192). The upper end counts where a table gives a range; an instruction that depends
//! on a condition is charged as if it were executed. Not in the tables and not charged: savings by
//! back-to-back loads.

use super::decode::{Flow, Instruction};

/// Cycles to fill the pipeline anew: 1 to 3.
pub(super) const REFILL: u64 = 3;

/// Cycles of an instruction, without the filling of the pipeline where it jumps; none if unknown.
pub(super) fn cycles(i: &Instruction) -> Option<u64> {
    let listed = |from: usize| i.operands.len().saturating_sub(from) as u64;
    let doubles = i.operands.iter().filter(|o| register(o, 'd')).count() as u64;
    Some(match i.name.as_str() {
        "adc" | "add" | "addw" | "adr" | "and" | "asr" | "bfc" | "bfi" | "bic" | "clz" | "cmn" | "cmp"
        | "eor" | "hint" | "it" | "lsl" | "lsr" | "mov" | "movs" | "movt" | "movw" | "mul" | "mvn"
        | "nop" | "orn" | "orr" | "qadd" | "qsub" | "pkhbt" | "pkhtb" | "rbit" | "rev" | "rev16"
        | "revsh" | "ror" | "rrx" | "rsb" | "sbc" | "sbfx" | "ssat" | "sub" | "subw" | "sxtab" | "sxtah"
        | "sxtb" | "sxth" | "teq" | "tst" | "ubfx" | "uqadd8" | "usat" | "uxtab" | "uxtah" | "uxtb"
        | "uxth" => 1,
        "smlabb" | "smlabt" | "smlatb" | "smlatt" | "smlal" | "smulbb" | "smulbt" | "smultb" | "smultt"
        | "smull" | "smmul" | "smmla" | "umaal" | "umlal" | "umull" => 1,
        // 1 and what a store on its way takes.
        "dmb" | "dsb" | "isb" => 4,
        "mla" | "mls" => 2,
        "sdiv" | "udiv" => 12,
        "b" | "bl" | "blx" | "bx" | "cbz" | "cbnz" => 1,
        "ldrb" | "ldrsb" | "strb" => 2,
        // Away from a multiple of their size, a word is moved in up to three pieces, a half-word in two.
        "ldr" | "str" => 2 + if aligned(i) { 0 } else { 2 },
        "ldrh" | "ldrsh" | "strh" => 2 + if aligned(i) { 0 } else { 1 },
        "ldrd" | "strd" => 3,
        "push" | "pop" => 1 + listed(0),
        "ldm" | "ldmdb" | "stm" | "stmdb" => 1 + listed(1),
        "vadd" | "vsub" | "vmul" | "vnmul" | "vcvt" | "vcvtr" | "vabs" | "vneg" | "vcmp" | "vcmpe"
        | "vmrs" | "vmsr" | "fmstat" | "fconsts" => 1,
        "vmov" if i.operands.len() > 2 => 2,
        "vmov" => 1,
        "vmla" | "vmls" | "vnmla" | "vnmls" | "vfma" | "vfms" | "vfnma" | "vfnms" => 3,
        "vdiv" | "vsqrt" => 14,
        "vldr" | "vstr" => 2 + doubles,
        "vpush" | "vpop" => 1 + listed(0) + doubles,
        "vldmia" | "vldmdb" | "vstmia" | "vstmdb" => 1 + listed(1) + doubles,
        _ => return None,
    })
}

/// True if the code shows that an address is a multiple of four: on the stack, or a constant beside
/// the code. The other instructions that move words may only have such addresses.
fn aligned(i: &Instruction) -> bool {
    let Some((_, address)) = i.text.split_once('[') else { return false };
    let Some(offset) = address.strip_prefix("sp").or(address.strip_prefix("pc")) else { return false };
    let digits = offset.trim_start_matches([',', ' ', '#']).trim_end_matches(['!', ']']);
    let number =
        digits.strip_prefix("0x").map_or_else(|| digits.parse().ok(), |h| u32::from_str_radix(h, 16).ok());
    digits.is_empty() || number.is_some_and(|n: u32| n.is_multiple_of(4))
}

/// Cycles for a jump to an address other than the next.
pub(super) fn refill(i: &Instruction) -> u64 {
    if matches!(i.flow, Flow::Next | Flow::Trap) { 0 } else { REFILL }
}

/// One cycle more if `next` needs what `i` has just computed in the floating-point unit.
pub(super) fn stall(i: &Instruction, next: &Instruction) -> u64 {
    let computes = matches!(
        i.name.as_str(),
        "vadd"
            | "vsub"
            | "vmul"
            | "vnmul"
            | "vcvt"
            | "vcvtr"
            | "vmla"
            | "vmls"
            | "vnmla"
            | "vnmls"
            | "vfma"
            | "vfms"
            | "vfnma"
            | "vfnms"
            | "vdiv"
            | "vsqrt"
    );
    let Some(result) = i.operands.first().filter(|_| computes) else { return 0 };
    // The first operand is only written, but for stores, comparisons and accumulation.
    let writes_first = !matches!(
        next.name.as_str(),
        "vstr"
            | "vpush"
            | "vstmia"
            | "vstmdb"
            | "vcmp"
            | "vcmpe"
            | "vmla"
            | "vmls"
            | "vnmla"
            | "vnmls"
            | "vfma"
            | "vfms"
            | "vfnma"
            | "vfnms"
    );
    let read = next.operands.get(usize::from(writes_first)..).unwrap_or_default();
    u64::from(read.iter().any(|o| o == result || pair(o).is_some_and(|p| p.contains(result))))
}

/// The two single registers of a double one.
fn pair(operand: &str) -> Option<[String; 2]> {
    let n: u32 = operand.strip_prefix('d')?.parse().ok()?;
    Some([format!("s{}", 2 * n), format!("s{}", 2 * n + 1)])
}

fn register(operand: &str, kind: char) -> bool {
    operand.strip_prefix(kind).is_some_and(|n| n.parse::<u32>().is_ok())
}
