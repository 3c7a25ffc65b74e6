//! Functions put together by hand, whose longest way is known.

use super::{Bounds, CallFact, Cost, Facts, Fault, Image, LoopFact, Stacks, traced};

/// One function after the other from address 0x1000 on, in half-words.
fn image(functions: &[(&str, &[u16])]) -> Image {
    let (mut code, mut table) = (Vec::new(), Vec::new());
    for (name, words) in functions {
        table.push((*name, code.len() as u32, 2 * words.len() as u32));
        code.extend(words.iter().flat_map(|w| w.to_le_bytes()));
    }
    Image::of_code(0x1000, code, &table)
}

fn round(most: u64, by: Option<&str>) -> Facts {
    let why = "counted by hand".to_owned();
    let (function, by) = ("f".to_owned(), by.map(str::to_owned).into_iter().collect());
    let fact = LoopFact { function, of: None, outer: None, by, most: Some(most), step: None, why };
    Facts { loops: vec![fact], ..Facts::default() }
}

fn bound_with(image: &Image, facts: &Facts) -> Result<Cost, Vec<Fault>> {
    Bounds::new(image, facts, &Facts::default()).of("f")
}

fn bound(image: &Image) -> Result<Cost, Vec<Fault>> {
    bound_with(image, &Facts::default())
}

fn cost(instructions: u64, cycles: u64) -> Cost {
    Cost { instructions, cycles }
}

const BX_LR: u16 = 0x4770;
/// subs r1, #1
const COUNT: u16 = 0x3901;

#[test]
fn the_way_with_most_instructions_and_the_one_with_most_cycles_are_found_each() {
    // cmp r0, #0; beq 1f; movs r0, #1; 1: bx lr
    let image = image(&[("f", &[0x2800, 0xd000, 0x2001, BX_LR])]);
    // Not taken: 4 instructions in 1 + 1 + 1 + 4 cycles. Taken: 3 in 1 + 4 + 4.
    assert_eq!(bound(&image), Ok(cost(4, 9)));
}

#[test]
fn what_a_condition_switches_off_is_charged() {
    // cmp r0, #0; it eq; addeq r1, #1; bx lr
    let image = image(&[("f", &[0x2800, 0xbf08, 0x3101, BX_LR])]);
    assert_eq!(bound(&image), Ok(cost(4, 7)));
}

#[test]
fn a_call_through_a_register_that_holds_a_constant_on_every_way_is_one() {
    let g: (&str, &[u16]) = ("g", &[0x2001, BX_LR]);
    // movw r4, #0x100d; blx r4; mov r2, r4; blx r2; bx lr, with g at 0x100c: movs r0, #1; bx lr
    let f: (&str, &[u16]) = ("f", &[0xf241, 0x040d, 0x47a0, 0x4622, 0x4790, BX_LR]);
    assert_eq!(bound(&image(&[f, g])), Ok(cost(9, 24)));
    // cmp r0, #0; beq 1f; movw r4, #0x100d; 1: blx r4; bx lr
    let one_way: (&str, &[u16]) = ("f", &[0x2800, 0xd001, 0xf241, 0x040d, 0x47a0, BX_LR]);
    let refused = bound(&image(&[one_way, g])).unwrap_err();
    assert!(matches!(refused.as_slice(), [Fault::Indirect { address: 0x1008, .. }]), "{refused:?}");
}

#[test]
fn a_result_that_the_next_instruction_takes_costs_a_cycle() {
    // vmul.f32 s0, s0, s1; vadd.f32 s0, s0, s2; bx lr
    let image = image(&[("f", &[0xee20, 0x0a20, 0xee30, 0x0a01, BX_LR])]);
    assert_eq!(bound(&image), Ok(cost(3, 7)));
}

#[test]
fn a_call_costs_what_is_called() {
    // f: push {r4, lr}; bl g; pop {r4, pc}   g: bx lr
    let image = image(&[("f", &[0xb510, 0xf000, 0xf801, 0xbd10]), ("g", &[BX_LR])]);
    assert_eq!(bound(&image), Ok(cost(4, 3 + 4 + 4 + 6)));
    assert_eq!(Stacks::new(&image).of("f").map(|s| s.bytes), Ok(8));
}

#[test]
fn a_path_up_to_a_call_ends_there_also_in_what_is_called() {
    // f: push {r4, lr}; bl g; bl h; bl g; pop {r4, pc}   g: bx lr   h: bx lr   k: push {r4, lr}; bl f; pop {r4, pc}
    let f = [0xb510, 0xf000, 0xf805, 0xf000, 0xf804, 0xf000, 0xf801, 0xbd10];
    let k = [0xb510, 0xf7ff, 0xfff3, 0xbd10];
    let image = image(&[("f", &f), ("g", &[BX_LR]), ("h", &[BX_LR]), ("k", &k)]);
    let (none, case) = (Facts::default(), Facts::default());
    let up_to_h = cost(4, 3 + 4 + 4 + 4);
    assert_eq!(Bounds::new(&image, &none, &case).until("f", "h"), Ok(up_to_h));
    assert_eq!(Bounds::new(&image, &none, &case).until("k", "h"), Ok(up_to_h + cost(2, 3 + 4)));
    // To the last of two calls; and nothing leads to the function itself.
    assert_eq!(Bounds::new(&image, &none, &case).until("f", "g"), Ok(cost(6, 3 + 4 + 4 + 4 + 4 + 4)));
    assert!(Bounds::new(&image, &none, &case).until("f", "k").is_err());
}

#[test]
fn a_jump_to_another_function_is_a_call_that_does_not_come_back() {
    // f: b.w g   g: bx lr
    let image = image(&[("f", &[0xf000, 0xb800]), ("g", &[BX_LR])]);
    assert_eq!(bound(&image), Ok(cost(2, 8)));
}

#[test]
fn a_loop_goes_round_as_often_as_is_stated() {
    // movs r1, #5; 1: subs r1, #1; bne 1b; bx lr
    let image = image(&[("f", &[0x2105, COUNT, 0xd1fd, BX_LR])]);
    assert_eq!(bound_with(&image, &round(5, None)), Ok(cost(12, 1 + 4 * (1 + 4) + (1 + 1) + 4)));
}

#[test]
fn an_unrolled_loop_is_bounded_by_what_it_does() {
    // 1: ldrb r2, [r0]; ldrb r3, [r0, #1]; subs r1, #2; bne 1b; bx lr
    let image = image(&[("f", &[0x7802, 0x7843, 0x3902, 0xd1fb, BX_LR])]);
    // Six bytes are three rounds, and one more in which the loop might have checked if it is over.
    assert_eq!(bound_with(&image, &round(6, Some("ldrb"))), bound_with(&image, &round(4, None)));
    let nothing_to_count = bound_with(&image, &round(6, Some("str")));
    assert!(matches!(&nothing_to_count.unwrap_err()[..], [Fault::Unbounded { .. }]));
}

#[test]
fn rounds_that_call_something_rare_are_rare() {
    // f: push {r4, lr}; 1: subs r1, #1; beq 2f; cmp r1, #3; bne 1b; bl g; b 1b; 2: pop {r4, pc}
    let f = [0xb510, COUNT, 0xd004, 0x2903, 0xd1fb, 0xf000, 0xf802, 0xe7f8, 0xbd10];
    let image = image(&[("f", &f), ("g", &[BX_LR])]);
    let (f, g, why) = ("f".to_owned(), "g".to_owned(), "counted by hand".to_owned());
    let calls = vec![CallFact { function: f, of: g, most: 1, why }];
    let facts = Facts { calls, ..round(10, None) };
    // One of nine whole rounds calls g: six instructions and its one; the others have four.
    let rounds = (6 + 1) + 8 * 4;
    let bound = bound_with(&image, &facts).unwrap();
    assert_eq!(bound.instructions, 1 + rounds + 2 + 1);
}

#[test]
fn a_loop_without_a_stated_bound_is_an_error() {
    let image = image(&[("f", &[0x2105, COUNT, 0xd1fd, BX_LR])]);
    assert!(matches!(&bound(&image).unwrap_err()[..], [Fault::Unbounded { address: 0x1002, .. }]));
}

#[test]
fn a_jump_into_the_middle_of_a_loop_is_an_error() {
    // cmp r0, #0; beq 2f; 1: subs r1, #1; 2: subs r2, #1; bne 1b; bx lr
    let image = image(&[("f", &[0x2800, 0xd000, COUNT, 0x3a01, 0xd1fc, BX_LR])]);
    let faults = bound_with(&image, &round(5, None)).unwrap_err();
    assert!(matches!(&faults[..], [Fault::Irreducible { .. }]));
}

#[test]
fn recursion_is_an_error() {
    // push {lr}; bl f; pop {pc}
    let image = image(&[("f", &[0xb500, 0xf7ff, 0xfffd, 0xbd00])]);
    assert_eq!(bound(&image), Err(vec![Fault::Recursion("f → f".to_owned())]));
    assert_eq!(Stacks::new(&image).of("f"), Err(Fault::Recursion("f".to_owned())));
}

#[test]
fn a_call_or_jump_that_the_code_does_not_lead_to_is_an_error() {
    // bx r3; blx r3; tbb [pc, r0]; ldr pc, [r0]
    for way in [&[0x4718][..], &[0x4798, BX_LR], &[0xe8df, 0xf000], &[0xf8d0, 0xf000]] {
        let image = image(&[("f", way)]);
        assert!(matches!(&bound(&image).unwrap_err()[..], [Fault::Indirect { address: 0x1000, .. }]));
        assert!(matches!(Stacks::new(&image).of("f"), Err(Fault::Indirect { .. })));
    }
}

#[test]
fn code_that_runs_past_its_end_and_instructions_without_a_cost_are_errors() {
    assert!(matches!(&bound(&image(&[("f", &[COUNT])])).unwrap_err()[..], [Fault::RunsOff { .. }]));
    // cpsid i; bx lr
    let image = image(&[("f", &[0xb672, BX_LR])]);
    assert!(matches!(&bound(&image).unwrap_err()[..], [Fault::NoCost { address: 0x1000, .. }]));
}

#[test]
fn the_stack_is_as_deep_as_what_lies_on_it_at_once() {
    // sub sp, #16; vpush {d8}; vpop {d8}; add sp, #16; bx lr
    let image = image(&[("f", &[0xb084, 0xed2d, 0x8b02, 0xecbd, 0x8b02, 0xb004, BX_LR])]);
    assert_eq!(Stacks::new(&image).of("f").map(|s| s.bytes), Ok(24));
}

#[test]
fn several_registers_from_the_stack_leave_it_as_deep_as_it_was() {
    // sub sp, #16; ldm.w sp, {r0, r1, r2, r3}; add sp, #16; bx lr
    let image = image(&[("f", &[0xb084, 0xe89d, 0x000f, 0xb004, BX_LR])]);
    assert_eq!(Stacks::new(&image).of("f").map(|s| s.bytes), Ok(16));
}

#[test]
fn a_way_that_was_gone_costs_what_it_costs_by_hand() {
    // As in the first of these: the branch is taken in the one call and not in the other.
    let image = image(&[("f", &[0x2800, 0xd000, 0x2001, BX_LR])]);
    let trace = [0x1000, 0x1002, 0x1006, 0x1000, 0x1002, 0x1004, 0x1006];
    let calls = traced(&image, &[0x1000], trace.into_iter()).unwrap();
    assert_eq!(calls[&0x1000], [cost(3, 9), cost(4, 7)]);
    assert_eq!(traced(&image, &[0x1000], [0x2000].into_iter()), Err(Fault::Untraceable { address: 0x2000 }));
}

#[test]
fn a_word_that_may_lie_across_two_costs_more() {
    // ldr r0, [r1]; bx lr   and   ldr r0, [sp, #4]; bx lr   and   ldrh r0, [r1]; bx lr
    assert_eq!(bound(&image(&[("f", &[0x6808, BX_LR])])), Ok(cost(2, 4 + 4)));
    assert_eq!(bound(&image(&[("f", &[0x9801, BX_LR])])), Ok(cost(2, 2 + 4)));
    assert_eq!(bound(&image(&[("f", &[0x8808, BX_LR])])), Ok(cost(2, 3 + 4)));
}

#[test]
fn what_only_looks_like_what_is_counted_does_not_bound_a_loop() {
    // 1: strb r2, [r0]; subs r1, #1; bne 1b; bx lr   and   str r2, [sp] in its place
    for store in [0x7002, 0x9200] {
        let image = image(&[("f", &[store, COUNT, 0xd1fc, BX_LR])]);
        let faults = bound_with(&image, &round(6, Some("str"))).unwrap_err();
        assert!(matches!(&faults[..], [Fault::Unbounded { .. }]));
    }
}

#[test]
fn a_length_that_depends_on_a_condition_is_not_known() {
    // f: push {lr}; …; movs r2, #4; bl memcpy; pop {pc}   with cmp r0, #0; it eq before the length, or two nops
    let f = |before: [u16; 2]| [0xb500, before[0], before[1], 0x2204, 0xf000, 0xf801, 0xbd00];
    let (always, sometimes) = (f([0xbf00, 0xbf00]), f([0x2800, 0xbf08]));
    assert!(bound(&image(&[("f", &always), ("memcpy", &[BX_LR])])).is_ok());
    let faults = bound(&image(&[("f", &sometimes), ("memcpy", &[BX_LR])])).unwrap_err();
    assert!(matches!(&faults[..], [Fault::Length { .. }]));
}

#[test]
fn a_way_through_a_call_that_is_stated_never_to_be_made_is_never_gone() {
    // cmp r0, #0; beq 1f; nop; nop; bl g; 1: bx lr
    let f = [0x2800, 0xd003, 0xbf00, 0xbf00, 0xf000, 0xf801, BX_LR];
    let image = image(&[("f", &f), ("g", &[BX_LR])]);
    let why = "it is not".to_owned();
    let never = CallFact { function: "f".to_owned(), of: "g".to_owned(), most: 0, why };
    let facts = Facts { calls: vec![never], ..Facts::default() };
    // Six instructions and one; of those, what is left is cmp, beq, taken, and bx lr.
    assert_eq!(bound(&image).unwrap().instructions, 7);
    assert_eq!(bound_with(&image, &facts), Ok(cost(3, 9)));
    // A call that costs nothing is gone through.
    let none = Facts::default();
    assert_eq!(Bounds::new(&image, &none, &none).without("g").of("f").unwrap().instructions, 6);
}

#[test]
fn a_fact_tells_whether_it_was_needed() {
    let image = image(&[("f", &[0x2105, COUNT, 0xd1fd, BX_LR])]);
    let (facts, none) = (round(5, None), Facts::default());
    let mut bounds = Bounds::new(&image, &facts, &none);
    assert_eq!(bounds.used(false).count(), 0);
    bounds.of("f").unwrap();
    assert!(bounds.used(false).eq(facts.names()));
    assert_eq!(bounds.used(true).count(), 0);
}

#[test]
fn a_stack_pointer_that_a_small_core_moves_by_a_constant_is_followed() {
    // push {r7, lr}; add r7, sp, #0; ldr r6, 1f; add sp, r6; subs r6, r7, #0; mov sp, r6; pop {r7, pc}; 1: .word -1024
    let code = [0xb580, 0xaf00, 0x4e02, 0x44b5, 0x1e3e, 0x46b5, 0xbd80, 0xbf00, 0xfc00, 0xffff];
    let image = image(&[("f", &code[..7]), ("constant", &code[7..])]);
    assert_eq!(Stacks::new(&image).of("f").map(|s| s.bytes), Ok(8 + 1024));
}

#[test]
fn a_jump_that_is_a_call_into_the_same_function_is_a_jump() {
    // push {lr}; bl 1f; udf; 1: pop {pc}
    let image = image(&[("f", &[0xb500, 0xf000, 0xf801, 0xde00, 0xbd00])]);
    assert_eq!(Stacks::new(&image).of("f").map(|s| s.bytes), Ok(4));
}

#[test]
fn a_stack_pointer_from_a_register_is_an_error() {
    // mov sp, r7; bx lr
    let image = image(&[("f", &[0x46bd, BX_LR])]);
    assert!(matches!(Stacks::new(&image).of("f"), Err(Fault::StackPointer { .. })));
}
