use clutch_cli::plot::*;
use clutch_core::law::*;
use clutch_core::reference::ReferenceParams;
use clutch_sim::*;
fn main() {
    let mut panels = vec![];
    for (n, rig) in [("simulation", RigParams::paper()), ("bench", RigParams::bench())] {
        for rate in [100.0, 20.0, 2.0_f64] {
            let mut spec = RunSpec::new(
                rig.clone(),
                LawParams::Pd(PdParams::default()),
                ReferenceParams::Ramp(rate.to_radians()),
            );
            spec.run.duration = 10.0;
            let r = simulate::<f64>(&spec).unwrap();
            let pts = r.trace.time.iter().zip(&r.trace.error).map(|(t, e)| (*t, e.to_degrees())).collect();
            panels.push(Panel {
                title: format!("PD, {n}, {rate} °/s"),
                x_label: "time / s".into(),
                y_label: "position error / °".into(),
                series: vec![Series { label: "e".into(), points: pts }],
                ..Default::default()
            });
        }
    }
    let f = Figure { title: "Figure 8: position error with PD control".into(), columns: 3, panels };
    let t = std::time::Instant::now();
    f.save("/tmp/look/a.svg".as_ref()).unwrap();
    eprintln!("{:?}", t.elapsed());
    f.save("/tmp/look/a.png".as_ref()).unwrap();
    eprintln!("{:?}", t.elapsed());
    // odd ones
    let mk = |t: &str, s: Vec<Series>| Panel {
        title: t.into(),
        x_label: "time / s".into(),
        y_label: "θ̇ / (rad/s)".into(),
        series: s,
        ..Default::default()
    };
    let ser = |l: &str, p: Vec<(f64, f64)>| Series { label: l.into(), points: p };
    let sine = |a: f64, b: f64| {
        (0..200).map(|i| (i as f64 * 0.01, b + a * (i as f64 * 0.1).sin())).collect::<Vec<_>>()
    };
    let odd = Figure {
        title: "Odd panels <&> \"quoted\"".into(),
        columns: 3,
        panels: vec![
            mk("empty", vec![]),
            mk("one point", vec![ser("a", vec![(1.0, 2.0)])]),
            mk(
                "NaN",
                vec![ser(
                    "a",
                    sine(1.0, 0.0)
                        .into_iter()
                        .enumerate()
                        .map(|(i, p)| if i % 40 == 0 { (p.0, f64::NAN) } else { p })
                        .collect(),
                )],
            ),
            mk("equal", vec![ser("a", vec![(0.0, 0.3), (1.0, 0.3), (2.0, 0.3)])]),
            mk(
                "tiny",
                vec![
                    ser("a", sine(3e-6, 0.0)),
                    ser("bb", sine(2e-6, 1e-6)),
                    ser("PD, with derivative filter", sine(1e-6, 1e-6)),
                    ser("sliding mode with a long name", sine(1e-6, 2e-6)),
                ],
            ),
            Panel {
                lines: vec![1e6, -1e6],
                ..mk("large", vec![ser("a", sine(2e6, 1e5)), ser("b", sine(1e6, 0.0))])
            },
            Panel {
                step: true,
                y_range: Some((-0.5, 0.5)),
                ..mk(
                    "stairs, clipped; a title so long that it can hardly fit above one panel of a figure",
                    vec![ser("a", (0..30).map(|i| (i as f64 * 0.1, (i as f64 * 0.5).sin())).collect())],
                )
            },
            Panel {
                series: (0..8).map(|k| ser(&format!("series {k}"), sine(1.0, k as f64))).collect(),
                ..mk("eight", vec![])
            },
            mk("offset", vec![ser("a", sine(0.0001, 1.0))]),
            mk(
                "circle",
                vec![ser(
                    "a",
                    (0..1000)
                        .map(|i| {
                            let a = i as f64 * 0.01;
                            (a.cos() * a, a.sin() * a)
                        })
                        .collect(),
                )],
            ),
            mk("huge", vec![ser("a", vec![(0.0, 1e300), (1.0, -1e140), (2.0, 1e140), (f64::INFINITY, 0.0)])]),
            mk(
                "epoch",
                vec![ser("a", (0..100).map(|i| (1.7e9 + i as f64 * 0.05, -1e-310 * i as f64)).collect())],
            ),
        ],
    };
    odd.save("/tmp/look/b.svg".as_ref()).unwrap();
    odd.save("/tmp/look/b.png".as_ref()).unwrap();
}
