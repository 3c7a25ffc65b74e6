#![allow(missing_docs)]
use clutch_core::law::*;
use clutch_core::reference::ReferenceParams;
use clutch_core::*;
use clutch_sim::engine::EventKind;
use clutch_sim::*;
fn main() {
    let pd = LawParams::Pd(PdParams::default());
    let smc = LawParams::Smc(SmcParams::default());
    let mut runs = vec![];
    for (name, rig) in [("paper", RigParams::paper()), ("bench", RigParams::bench())] {
        for (ln, law) in [("PD", pd), ("SMC", smc)] {
            for rate in [2.0, 6.0, 10.0, 20.0_f64] {
                let mut rs = vec![];
                for seed in 1..=4 {
                    let mut spec = RunSpec::new(rig.clone(), law, ReferenceParams::Ramp(rate.to_radians()));
                    spec.run.seed = seed;
                    rs.push(simulate::<f64>(&spec).unwrap());
                }
                runs.push((name, ln, rate, rs));
            }
        }
    }
    for (name, ln, rate, rs) in &runs {
        let mut d: Vec<f64> = vec![];
        for r in rs { let mut s=None; for e in &r.events { match e.kind { EventKind::Stick => s=Some(e.time), EventKind::BreakAway => if let Some(x)=s.take() { d.push((e.time-x)*1e3) } } } }
        d.sort_by(f64::total_cmp);
        if !d.is_empty() { println!("{name} {ln} {rate}: n {} durations ms p10 {:.2} p50 {:.2} p90 {:.2}", d.len(), d[d.len()/10], d[d.len()/2], d[d.len()*9/10]); }
    }
    for gap in [1.25, 1.5, 1.75, 2.0, 2.5, 3.0] { for ticks in [3, 4, 5, 6, 8, 10] {
        print!("gap {gap} ticks {ticks}: ");
        let det = StickSlip::<f64>::new(&StickSlipParams { gap, ticks }, Encoder::PAPER, Micros(1000)).unwrap();
        for (_, _, rate, rs) in &runs {
            let (mut c, mut t) = (0.0, 0.0);
            for r in rs {
                let mut st = StickSlipState::default(); let mut b = 0;
                for (k, n) in r.trace.counts.iter().enumerate() { det.update(&mut st, Counts(*n), rate.to_radians()); if k < 1000 { b = st.cycles(); } }
                c += (st.cycles() - b) as f64 / 16.0; t += r.metrics.stick_slip_cycles_per_s / 4.0;
            }
            print!("{c:.1}/{t:.1} ");
        }
        println!();
    }}
}
