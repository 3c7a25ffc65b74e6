//! Before consent.

use clutch_core::supervisor::State;
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_node::{ControllerNode, Outbox};
use clutch_sim::Scenario;
use clutch_sim::scenario::BUILT_IN;
use clutch_wire::{Armed, BoardState, Configured, Decoder, Message, Sample, encode};

#[test]
fn samples_that_pile_up_before_consent_do_not_end_the_run() {
    let built_in = BUILT_IN.iter().find(|b| b.name == "board_smc_2").expect("a built-in scenario");
    let scenario = Scenario::parse(built_in.name, built_in.toml, &[]).unwrap();
    let mut built = BuiltRun::<f64>::new(&scenario, 1).unwrap();
    built.controller.boot = 1;
    let (run, config) = (1, built.controller.config);
    let mut node = ControllerNode::new(built.controller, built.servo, built.supervisor);
    let path = from_scenario::path::<f64>(&scenario).unwrap();
    let (mut line, mut out) = (Decoder::new(), Outbox::default());
    let mut hear = |node: &mut ControllerNode<f64>, now_ns: u64, messages: &[Message]| {
        let bytes: Vec<u8> = messages.iter().flat_map(|m| encode(m).as_bytes().to_vec()).collect();
        out.clear();
        node.receive(now_ns, &mut line, &bytes, &path, &mut out, &mut |_| ());
        !out.as_bytes().is_empty()
    };
    let sample = |sequence: u16, state: BoardState| {
        let time_us = u32::from(sequence) * 1000;
        Message::Sample(Sample { run, sequence, time_us, counts: 5, status: state as u8 })
    };

    hear(&mut node, 0, &[Message::Configured(Configured { run, config, boot: 1 })]);
    assert_eq!(node.state().state(), State::Ready);
    // Samples that wait in the line after a thread was set up for a fifth of a second.
    let waiting: Vec<Message> = (0..200).map(|i| sample(i, BoardState::Ready)).collect();
    hear(&mut node, 200_000_000, &waiting);
    assert_eq!(node.state().state(), State::Ready, "{:?}", node.state().cause());
    // And after consent they are not held against the line either.
    hear(&mut node, 200_100_000, &[Message::Armed(Armed { run, config })]);
    let answered = hear(&mut node, 201_000_000, &[sample(200, BoardState::Armed)]);
    assert!(answered && node.state().state() == State::Running, "{:?}", node.state().cause());
}
