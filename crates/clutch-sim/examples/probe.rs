#![allow(missing_docs)]
fn main() {
    let t = std::time::Instant::now();
    let o = clutch_sim::paper::reproduce(&|_| {}).unwrap();
    for c in &o.claims {
        println!("{:5} {:5} {:24} {:.4} {} {:?}", c.as_expected(), c.holds, c.id, c.measured, c.unit, c.band);
    }
    println!("{:#?} {:?}", o.table3, t.elapsed());
}
