//! Ports without a board, with the wrong board, or not allowed: each message names the remedy, and
//! nothing is armed.

use crate::harness::{Board, Device, Done, Random, beside_others, folder, program, run, start};
use clutch_wire::{Decoder, Discover, Hello, Message, Refusal, Refused, ResetCause, SCHEMA, VERSION, encode};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;

fn looped(port: &str) -> Done {
    run(&["loop", "board_smc_2", "--port", port])
}

/// A device that understands frames and answers them.
fn board_that_answers(mut answer: impl FnMut(&Message) -> Option<Message> + Send + 'static) -> Device {
    let mut decoder = Decoder::new();
    Device::start(move |bytes| {
        let messages = bytes.iter().filter_map(|byte| decoder.push(*byte)?.ok());
        messages.filter_map(|m| answer(&m)).flat_map(|m| encode(&m).as_bytes().to_vec()).collect()
    })
}

pub(crate) fn hello(asked: &Discover) -> Hello {
    Hello {
        nonce: asked.nonce,
        version: VERSION,
        schema: SCHEMA,
        board: 7,
        boot: 1,
        counts_per_rev: 20_000,
        dac_bits: 12,
        dac_lowest_mv: -10_000,
        dac_highest_mv: 10_000,
        period_min_us: 100,
        period_max_us: 1_000_000,
        watchdog_max_us: 10_000_000,
        boot_code: 0,
        started_by: ResetCause::Power as u8,
        warnings: 0,
        state: 0,
        run: 0,
        config: 0,
    }
}

fn refusing(reason: Refusal, value: u32) -> Device {
    board_that_answers(move |message| match message {
        Message::Discover(_) => {
            Some(Message::Refused(Refused { request: Discover::KIND, reason: reason as u8, value }))
        }
        _ => None,
    })
}

#[test]
fn a_board_of_another_version_is_told_with_both_versions() {
    let _guard = beside_others();
    let ours = format!("this program version {VERSION}");
    let says = ["speaks version 9 of the protocol", &ours, "Flash a firmware of this release"];
    let _ = looped(refusing(Refusal::Version, 9).port()).expect(1).says(&says);
    // The same for a board that does not refuse.
    let careless = board_that_answers(|message| match message {
        Message::Discover(asked) => Some(Message::Hello(Hello { version: 9, ..hello(asked) })),
        _ => None,
    });
    let _ = looped(careless.port()).expect(1).says(&says);
}

#[test]
fn a_board_with_another_table_is_told_with_both_hashes() {
    let _guard = beside_others();
    let ours = format!("{:08x}", SCHEMA as u32);
    let says = ["message table differs", "0badcafe", &ours, "Flash a firmware of this release"];
    let _ = looped(refusing(Refusal::Schema, 0x0bad_cafe).port()).expect(1).says(&says);
    let careless = board_that_answers(|message| match message {
        Message::Discover(asked) => Some(Message::Hello(Hello { schema: 0x0bad_cafe, ..hello(asked) })),
        _ => None,
    });
    let _ = looped(careless.port()).expect(1).says(&says);
}

#[test]
fn a_board_that_answers_once_and_then_no_more_is_told() {
    let _guard = beside_others();
    let device = board_that_answers(|message| match message {
        Message::Discover(asked) => Some(Message::Hello(hello(asked))),
        _ => None,
    });
    let says = ["the board answered at first and then no more", "Unplugged, or reset?"];
    let _ = looped(device.port()).expect(1).says(&says);
}

#[test]
fn random_bytes_are_told_as_another_device() {
    let _guard = beside_others();
    let mut random = Random(3);
    let device = Device::start(move |_| (0..200).map(|_| random.next() as u8).collect());
    let says = [
        device.port(),
        "bytes came, and not one frame among them",
        "Another device is on this port, or it runs at another baud rate",
    ];
    let _ = looped(device.port()).expect(1).says(&says);
}

#[test]
fn an_echo_is_told_as_one() {
    let _guard = beside_others();
    let device = Device::start(<[u8]>::to_vec);
    let says = [device.port(), "what is sent comes back", "a loop-back plug, a terminal with echo"];
    let _ = looped(device.port()).expect(1).says(&says);
}

#[test]
fn silence_is_told_with_what_to_look_at() {
    let _guard = beside_others();
    let device = Device::start(|_| Vec::new());
    let says = [device.port(), "nothing answers", "is the board powered", "clutch daq SCENARIO"];
    let _ = looped(device.port()).expect(1).says(&says);
}

#[test]
fn a_port_that_is_not_there_is_told() {
    let _guard = beside_others();
    let _ = looped("/dev/ttyNOTHERE7").expect(1).says(&["/dev/ttyNOTHERE7: there is no such device"]);
    // A port that was free a moment ago.
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let _ = looped(&format!("tcp://{free}"))
        .expect(1)
        .says(&[&free.to_string(), "nobody listens there; start the board first"]);
    let file = folder("no-port").join("file.txt");
    std::fs::write(&file, "text").unwrap();
    let _ = looped(file.to_str().unwrap()).expect(1).says(&["not a serial device"]);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "text");
}

#[test]
fn a_port_of_somebody_else_is_told_with_how_to_be_let_in() {
    let _guard = beside_others();
    if !rustix::process::geteuid().is_root() {
        println!("skipped: only root can start a program as another user");
        return;
    }
    // In a place from which another user can start it.
    let folder = std::env::temp_dir().join(format!("clutch-other-user-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::set_permissions(&folder, std::fs::Permissions::from_mode(0o755)).unwrap();
    let copy = folder.join("clutch");
    std::fs::copy(program(), &copy).unwrap();
    std::fs::set_permissions(&copy, std::fs::Permissions::from_mode(0o755)).unwrap();
    let device = Device::start(|_| Vec::new());
    std::fs::set_permissions(&device.path, std::fs::Permissions::from_mode(0o600)).unwrap();
    let mut command = std::process::Command::new(&copy);
    command.args(["loop", "board_smc_2", "--port", device.port()]).current_dir("/").uid(65_534).gid(65_534);
    let done = start(command).done();
    let _ = std::fs::remove_dir_all(&folder);
    let says = [device.port(), "permission denied", "mode 0600", "Start as the user who owns it"];
    let _ = done.expect(1).says(&says);
}

#[test]
fn a_board_with_another_encoder_does_not_fit() {
    let _guard = beside_others();
    let board = Board::start(&["board_smc_2", "--patient", "--set", "rig.encoder.counts_per_rev=10000"]);
    let says = [
        "the board does not fit the scenario",
        "encoder: the board has 10000, the scenario rig.encoder.counts_per_rev = 20000",
        "Correct the scenario, or connect the board that it describes",
    ];
    let _ = looped(&board.port).expect(1).says(&says);
    let said = board.end();
    assert!(!said.contains("Armed"), "{said}");
}

#[test]
fn a_law_that_is_not_certified_is_not_run_unasked() {
    let _guard = beside_others();
    let board = Board::start(&["board_smc_2", "--patient"]);
    let weak = ["loop", "board_smc_2", "--set", "law.smc.kp_v=0.1", "--port", &board.port];
    let _ = run(&weak).expect(2).prints(&[
        "not certified",
        "nothing was started",
        "clutch certify",
        "--uncertified",
    ]);
    let said = board.end();
    assert!(!said.contains("client connected"), "{said}");
}

#[test]
fn a_loop_arms_on_its_own_certificate_and_on_no_other() {
    let _guard = beside_others();
    let folder = folder("certificate");
    let file = folder.join("shell.json");
    let file = file.to_str().unwrap();
    // In continuous time these gains are refused above 15.8 °/s; as sampled they have a bound.
    let gains = "law={pd={kp_v_rad=1660.0,kd_v_s_rad=12.9}}";
    let sets = ["velocity.smoothed_derivative.smoothing=0.712", "reference.ramp.rate_deg_s=20.0"];
    let with = |verb: &str, gains: &str, more: &[&str]| {
        let mut args = vec![verb, "board_smc_2", "--set", gains, "--set", sets[0], "--set", sets[1]];
        args.extend(more);
        run(&args)
    };
    let said = ["as sampled: |e| stays below 0.16", "from rest", "NOT certified"];
    let _ = with("certify", gains, &["--sampled", "--save", file]).expect(0).prints(&said);
    let _ = with("loop", gains, &[]).expect(2).prints(&["not certified", "nothing was started"]);
    let log = folder.join("run.mcap");
    let more = ["--certificate", file, "--duration", "1.2", "--log", log.to_str().unwrap()];
    let _ = with("loop", gains, &more).expect(0).prints(&[
        "not certified in continuous time; certified as sampled for the bounds given",
        "|e| below 0.16",
        "certified for a ramp at 20 °/s, 0 ticks of delay",
        "sticks not excluded",
        "as sampled: |e| stays below 0.16",
        "ramp at 20 °/s, from rest",
    ]);
    let _ =
        run(&["log", "info", log.to_str().unwrap()]).expect(0).prints(&["as_sampled: |e| stays below 0.16"]);
    let done = with("loop", gains, &["--certificate", file, "--duration", "1.2", "--json"]).expect(0);
    assert!(done.json()["sampled"]["error_bound_rad"].as_f64().is_some_and(|bound| bound < 0.003));

    // Another gain, another certificate; and a file that is none.
    let others = "law={pd={kp_v_rad=1661.0,kd_v_s_rad=12.9}}";
    let told = ["the certificate is another loop's", "law: ", "1661", "1660", "Nothing was started"];
    let _ = with("loop", others, &["--certificate", file]).expect(1).says(&told);
    let broken = std::fs::read_to_string(file).unwrap().replacen("\"radii\":[", "\"radii\":[0.1,", 1);
    std::fs::write(file, broken).unwrap();
    let _ =
        with("loop", gains, &["--certificate", file]).expect(1).says(&["the proof does not hold", "radii"]);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_scenario_without_a_safe_state_is_not_run() {
    let _guard = beside_others();
    let _ = run(&["loop", "smc_2"]).expect(1).says(&["safety"]);
    let _ =
        run(&["loop", "board_smc_2", "--duration", "-1"]).expect(1).says(&["run.duration_s = -1: expected"]);
    let _ = run(&["daq", "smc_2"]).expect(1).says(&["safety"]);
}
