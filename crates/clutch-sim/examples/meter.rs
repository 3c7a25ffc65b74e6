use clutch_core::{Counts, Encoder, Plant};
use clutch_sim::engine::EventKind;
use clutch_sim::meter::Meter;
use clutch_sim::sweep::{Row, Sweep};
use clutch_sim::Keep;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use toml::{Table, Value};
const LAWS: &[(&str, &str)] = &[
    ("glide", "[law.glide.filter]\ndelay_ticks = 1"),
    ("pid", "[law.pid]\nkp_v_rad = 2370.0\nki_v_rad_s = 25000.0\nkd_v_s_rad = 14.5\nbias_v = 2.24\n\n[velocity.smoothed_derivative]\nsmoothing = 0.67"),
    ("pd", "[law.pd]"), ("smc", "[law.smc]"), ("ctc", "[law.ctc]"), ("smc_sign", "[law.smc_sign]"),
];
#[derive(Default, Clone, Copy)]
struct S { truth: u64, seen: u64, must: u64, may: u64, right: u64, missed: u64, gaps: u64, time: f64, in_gaps: u64, calls_right: u64 }
fn main() {
    let arg = |i: usize, d: f64| std::env::args().nth(i).map_or(d, |s| s.parse().unwrap());
    let seeds = arg(5, 4.0) as i64;
    let counts: Vec<i64> = std::env::args().nth(8).map_or(vec![20000, 2000, 200000], |s| vec![s.parse().unwrap()]);
    for n in counts { for (name, law) in LAWS { for rate in [0.05, 0.2, 0.5, 1.0, 2.0, 4.0, 6.0, 10.0, 20.0] {
        let toml = format!("name = \"m\"\n[rig]\nbase = \"bench\"\n[rig.encoder]\ncounts_per_rev = {n}\n{law}\n[reference.ramp]\nrate_deg_s = {rate:?}\n[run]\nduration_s = 5.0");
        let base: Table = toml.parse().unwrap();
        let rows = (1..=seeds).map(|s| vec![Value::Integer(s)]).collect();
        let sweep = Sweep::new("m", base, vec!["run.seed".into()], rows).unwrap();
        let total = Mutex::new(S::default());
        sweep.run(2, Keep::Trace, &AtomicBool::new(false), &|i, row| {
            let Row { run, .. } = match row { Ok(r) => r, Err(e) => { println!("{name} {rate}: {e}"); return; } };
            let sc = sweep.scenario(i).unwrap();
            let spec = sc.spec();
            let enc = Encoder::new::<f64>(n as u32).unwrap();
            let q: f64 = enc.radians_per_count();
            let mut judge = Meter::new(Plant::new(&spec.model).unwrap(), (&spec.law, &spec.velocity), enc, spec.period, run.trace.start_voltage);
            let mut s = S { time: run.metrics.measured_s, ..S::default() };
            let sticks: Vec<(f64, f64)> = run.events.iter().filter(|e| e.kind == EventKind::Stick && e.time >= 1.0).map(|e| (e.time, e.position)).collect();
            s.truth = sticks.len() as u64;
            s.seen = run.detections.iter().filter(|k| **k >= 1000).count() as u64;
            for k in 0..run.trace.counts.len() {
                if let Some(g) = judge.sample(Counts(run.trace.counts[k]), run.trace.voltage[k]) {
                    let (from, to) = ((g.begin as f64 - 1.0) * 1e-3, (g.end) as f64 * 1e-3);
                    if from < 1.0 { continue; }
                    s.gaps += 1;
                    let here = run.trace.counts[g.begin as usize];
                    let inside = sticks.iter().filter(|(t, p)| *t >= from && *t <= to && (p / q).floor() as i32 == here).count() as u64;
                    s.must += u64::from(g.sure); s.may += u64::from(g.possible);
                    s.right += u64::from(g.sure && inside > 0); s.in_gaps += inside;
                    if !g.possible { s.missed += inside; }
                    let called = run.detections.iter().any(|k| *k >= g.begin && *k < g.end);
                    s.calls_right += u64::from(called && inside > 0);
                }
            }
            let mut t = total.lock().unwrap();
            t.truth += s.truth; t.seen += s.seen; t.must += s.must; t.may += s.may; t.right += s.right; t.missed += s.missed; t.gaps += s.gaps; t.in_gaps += s.in_gaps; t.time += s.time; t.calls_right += s.calls_right;
        });
        let t = total.into_inner().unwrap();
        println!("{n:6} {name:9} {rate:5} time {:4.0} gaps {:6} true {:5} in gaps {:5} | silence {:5} right {:5} | must {:5} right {:5} | may {:5} missed {:4}", t.time, t.gaps, t.truth, t.in_gaps, t.seen, t.calls_right, t.must, t.right, t.may, t.missed);
    }}}
}
