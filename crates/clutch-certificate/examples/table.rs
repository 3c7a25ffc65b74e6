//! Scratch.
use clutch_certificate::*;
fn main() {
    let a: Vec<f64> = std::env::args().skip(2).map(|x| x.parse().unwrap()).collect();
    let kind = std::env::args().nth(1).unwrap();
    // law kp kd [f eps] kappa delay rate tol
    let (law, rest) = if kind == "pd" { (Gains::Pd { kp: a[0], kd: a[1] }, &a[2..]) } else { (Gains::Smc { kp: a[0], kd: a[1], slope: a[2], boundary: a[3] }, &a[4..]) };
    let t = rest[3] / 100.0;
    let v = |r: f64| 0.047088 / (r * 0.15 * 0.14);
    let setup = Setup {
        period_s: 0.001, counts_per_rev: 20000, inertia: [0.0017; 2], drive_torque: [0.047088; 2], viscous_damping: [0.001; 2],
        brake_gain: [0.14; 2], sliding: [0.15 * (1.0 - t), 0.15 * (1.0 + t)], at_rest: [0.2 * (1.0 - t), 0.2 * (1.0 + t)],
        rest_not_below_sliding: true, stribeck: [0.001, 1.0], ripple: 0.0, torque_noise: 0.0, delay_ticks: rest[1] as u32,
        converter_step: 20.0 / 4096.0, volts: [0.0, 9.995], rate: rest[2].to_radians(), smoothing: rest[0], law, from_rest: false,
        start_volts: [v(1.0 + t) * 0.98, v(1.0 - t)],
    };
    println!("rho {:?}", stability(&setup).map(|s| s.map(|s| s.radius)));
    let found = search(&setup, &Options::default(), true);
    for c in &found.certificate.cells {
        println!("{:?} {:?} {:.4} rows {} proofs {}", c.sliding, c.form, c.error_bound.to_degrees(), c.rows.len(), c.proofs.len());
    }
    let t = std::time::Instant::now();
    println!("check {:?} in {:?}", checker::check(&found.certificate), t.elapsed());
    println!("open {:?}", found.open);
}
