//! Writes a small log whose every number is known, for viewers and for the tests in Python.
//!
//! ```text
//! cargo run -p clutch-log --example write_demo -- demo.mcap [ticks]
//! ```

use clutch_log::{
    Arrival, CommandRecord, CommandSource, EventKind, EventRecord, Header, LinkRecord, LogWriter, Record,
    SampleRecord, Source, TruthRecord,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("usage: write_demo FILE [TICKS]")?;
    let ticks: u64 = arguments.next().map_or(Ok(1000), |t| t.parse())?;
    let header = Header {
        scenario_name: "demo".into(),
        scenario_toml: "name = \"demo\"\n".into(),
        parameters: vec![("law.kp".into(), "12.5".into()), ("plant.inertia".into(), "0.0042".into())],
        law_hash: 0x0123_4567_89ab_cdef,
        port: "/dev/ttyUSB0".into(),
        source: Source::Simulation,
        term_names: vec!["surface_rad_s".into(), "equivalent_v".into(), "switching_v".into()],
        started_unix_ns: 1_700_000_000_000_000_000,
        extra: vec![("operator".into(), "nobody".into())],
        ..Header::default()
    };
    let mut log = LogWriter::create(&path, &header)?;
    for tick in 0..ticks {
        let (time_ns, t) = (tick * 1_000_000, tick as f64 * 1e-3);
        let missing = tick % 100 == 99;
        let arrival = if missing { Arrival::Missing } else { Arrival::Fresh };
        log.write(&Record::Sample(SampleRecord {
            tick,
            time_ns,
            arrival: arrival.into(),
            sequence: tick as u16,
            board_time_us: tick as u32 * 1000,
            counts: tick as i32 * 3 - 500,
            status: 1,
            age_us: 120,
            lateness_us: (tick % 7) as u32,
            superseded: false,
            wake_us: 0,
            position: 0.25 * t - 0.001,
        }))?;
        log.write(&Record::Command(CommandRecord {
            tick,
            time_ns,
            state: 3,
            source: if missing { CommandSource::Unanswered } else { CommandSource::Law }.into(),
            limit: 0,
            code: (tick % 4096) as u16,
            voltage: 5.0 * t,
            demand: 5.0 * t + 0.001,
            target_fixed: tick as i64 * 3 * 65536,
            target_position: 0.25 * t,
            target_velocity: 0.25,
            target_acceleration: -0.0,
            error: (6.0 * t).sin() * 1e-3,
            error_rate: (6.0 * t).cos() * 6e-3,
            terms: [t, -t, if tick == 0 { f64::NAN } else { 1.0 / t }].into_iter().collect(),
        }))?;
        log.write(&Record::Truth(TruthRecord {
            tick,
            time_ns,
            position: 0.25 * t,
            velocity: 0.25,
            stuck: tick < 10,
        }))?;
        if tick % 100 == 0 {
            log.write(&Record::Link(LinkRecord {
                tick,
                time_ns,
                received: tick - tick / 100,
                lost: tick / 100,
                ..LinkRecord::default()
            }))?;
        }
        if tick == 500 {
            log.write(&Record::Event(EventRecord {
                tick,
                time_ns,
                kind: EventKind::StateChange.into(),
                from: 3,
                to: 4,
                cause: 5,
                value: 42.5,
            }))?;
        }
    }
    println!("{}", log.finish()?);
    Ok(())
}
