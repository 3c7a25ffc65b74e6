use clutch_benches::machine_code::*;
fn main() {
    let path = std::path::Path::new("/tmp/tgt-budget-fw/thumbv7em-none-eabihf/release/budget");
    let image = Image::read(path).unwrap();
    let facts: Facts = toml::from_str(&std::fs::read_to_string("/tmp/facts.toml").unwrap()).unwrap();
    let mut bounds = Bounds::new(&image, &facts, &[]);
    for name in [
        "nothing",
        "step_pd",
        "step_smc",
        "step_ctc",
        "servo_tick",
        "encode_actuate",
        "decode_sample",
        "whole_tick",
    ] {
        match bounds.of(name) {
            Ok(c) => println!("{name} {c:?}"),
            Err(e) => {
                for e in e {
                    println!("{name}: {e}")
                }
            }
        }
    }
    for (a, t) in bounds.loops() {
        println!("{a:#x} {t}");
    }
    println!("{:?}", image.double_precision());
    println!("{:?}", Stacks::new(&image).of("whole_tick"));
    println!("{:?}", Stacks::new(&image).of("main"));
}
