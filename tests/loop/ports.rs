//! One program per port.

use crate::harness::{Board, alone, clutch, run, start};

fn a_second_loop_is_refused(listen: &[&str]) {
    let _alone = alone();
    let board = Board::start(&[&["board_smc_2", "--patient"], listen].concat());
    let first =
        start(clutch(&["loop", "board_smc_2", "--duration", "3", "--patient", "--port", &board.port]));
    let _ = board.wait_for(0, "Running");
    let second = run(&["loop", "board_smc_2", "--duration", "3", "--patient", "--port", &board.port]);
    let whose = if board.port.starts_with('/') { "(clutch, process " } else { "" };
    let _ = second.expect(1).says(&[
        &board.port,
        "in use by another program",
        whose,
        "end that program, or choose another port",
    ]);
    // The first one has not noticed.
    let _ = first.done().expect(0).prints(&["the path is done"]);
    let said = board.end();
    assert_eq!(said.matches("Running").count(), 1, "{said}");
    assert!(!said.contains("Faulted"), "{said}");
    let root = rustix::process::geteuid().is_root();
    println!("the second loop ran as {}", if root { "root" } else { "an ordinary user" });
}

#[test]
fn a_second_loop_on_a_pseudo_terminal_is_refused_also_for_root() {
    a_second_loop_is_refused(&[]);
}

#[test]
fn a_second_loop_on_a_tcp_address_is_refused() {
    a_second_loop_is_refused(&["--listen", "tcp://127.0.0.1:0"]);
}

#[test]
fn a_port_is_free_again_after_its_loop_has_ended() {
    let _alone = alone();
    let board = Board::start(&["board_smc_2", "--patient"]);
    for _ in 0..2 {
        let args = [
            "loop",
            "board_smc_2",
            "--duration",
            "0.3",
            "--patient",
            "--set=run.settle_s=0",
            "--port",
            &board.port,
        ];
        let _ = run(&args).expect(0);
    }
    assert_eq!(board.end().matches("Stopped").count(), 2);
}
