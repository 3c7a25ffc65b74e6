//! The laws, the servo and the codec over their sets.

use crate::inputs::{CORNERS, Random, ticks};
use crate::kernels::{self, Axis, Bytes, decode_sample, encode_actuate, nothing, servo_tick};
use crate::meter::{Tally, instructions, line};
use clutch_core::law::{Beside, ControlLaw, Glide, LawParams, Listed, OutputParams, Seen, Tick};
use clutch_core::{
    Counts, Encoder, FixedCounts, FrictionMap, Micros, Place, Plant, PlantParams, Servo, ServoParams,
    StribeckParams, Target,
};
use clutch_wire::{Actuate, Decoder, Message, Sample};

pub const PERIOD: Micros = Micros(1000);
/// Number of ordinary and of wild inputs.
pub const OF_EACH: u32 = 1000;

/// With a bumpless start: its offset is the state of a law.
pub fn output() -> OutputParams<f32> {
    OutputParams { bumpless_time: 0.05, lowest: 0.5, ..OutputParams::default() }
}

fn law<L: ControlLaw<f32>>(
    name: &'static str,
    step: extern "C" fn(&L, &mut L::State, &Tick<f32>) -> f32,
    law: &L,
) {
    let mut tally = Tally::new(name);
    let mut random = Random::new(1);
    let mut state = L::State::default();
    ticks(&mut Random::new(2), OF_EACH, |tick, _| {
        if random.below(8) == 0 {
            state = law.start(&tick, random.around(10.0));
        }
        let arguments = [&raw const *law as usize, &raw mut state as usize, &raw const tick as usize];
        // SAFETY: the arguments are those of the function.
        tally.add(unsafe { instructions(step as usize, arguments) });
    });
    tally.print();
}

/// Measures and prints.
pub fn measure() -> Option<()> {
    // SAFETY: a function without arguments.
    line("nothing", unsafe { instructions(nothing as extern "C" fn() as usize, [0; 3]) });

    rides()?;

    // Laws with a model: friction whose curve needs no power, and one that does.
    let friction = StribeckParams { stribeck_exponent: 2.0, ..StribeckParams::default() };
    let (plain, output) = (PlantParams::default(), output());
    let curved = PlantParams { friction: friction.into(), ..plain };
    let beside = |model| Beside { period: PERIOD, ..Beside::paper(model, &output) };
    macro_rules! laws {
        ($($module:ident $law:ident;)+) => {$(
            use clutch_core::law::$law;
            let params = <$law<f32> as Listed<f32>>::busiest();
            let name = concat!("step_", stringify!($module));
            let curved_name = concat!("step_", stringify!($module), "_powf");
            for (name, model) in [(name, &plain), (curved_name, &curved)] {
                let built = <$law<f32> as Listed<f32>>::build(&params, &beside(model)).ok()?;
                law(name, kernels::$module::step, &built);
            }
        )+};
    }
    clutch_core::each_law!(laws);

    servo()?;
    codec();
    Some(())
}

/// Points of a map, each four counts, of which fifteen are a wave.
fn points() -> [u16; 256] {
    core::array::from_fn(|i| {
        let within = (i % 15) as u16;
        let up = if within < 8 { within } else { 15 - within };
        FrictionMap::ONE - 600 + 170 * up
    })
}

/// Glide on a disc at 2 °/s, from count to count; then with rests, jumps, ends of the map and paths of any kind. Once
/// without a map, once with the disc's.
fn rides() -> Option<()> {
    let (model, output, rate) = (PlantParams::default(), output(), 0.0349_f32);
    let law =
        Glide::build(&Glide::busiest(), &Beside { period: PERIOD, ..Beside::paper(&model, &output) }).ok()?;
    let (pace, hold) = (
        rate * 1e-3 * Encoder::PAPER.counts_per_radian::<f32>(),
        Plant::new(&model).ok()?.holding_voltage_sliding(),
    );
    let points = points();
    let map = FrictionMap::new(0, 4, &points).ok()?;
    let step = kernels::glide::step as extern "C" fn(&Glide<f32>, &mut _, &Tick<f32>) -> f32;
    for (name, mapped) in [("step_glide_ride", false), ("step_glide_map", true)] {
        let mut tally = Tally::new(name);
        let mut random = Random::new(5);
        let path = Tick { target_velocity: rate, ..Tick::default() };
        let (mut state, mut shaft, mut pace_now) = (law.start(&path, hold), 10.0_f32, pace);
        for call in 0..4 * OF_EACH {
            let mut tick = Tick { error: random.around(1e-4), ..path };
            if call >= 2 * OF_EACH {
                match random.below(64) {
                    0 => pace_now = 0.0,
                    1 | 2 => pace_now = pace,
                    3 => pace_now = random.around(4.0),
                    4 => shaft = random.around(2000.0),
                    5 => tick = random.wild(),
                    6 => state = law.start(&tick, random.around(10.0)),
                    _ => {}
                }
            }
            shaft += pace_now;
            let position = FixedCounts::from_counts(shaft as i64);
            let place: Place<f32> = map.at(position);
            let friction = if place.is_known() { place.friction(0.0) } else { 1.0 };
            let place = if mapped { place } else { Place::default() };
            law.sees(&mut state, || Seen { position, applied: hold / friction, place });
            let arguments = [&raw const law as usize, &raw mut state as usize, &raw const tick as usize];
            // SAFETY: the arguments are those of the function.
            tally.add(unsafe { instructions(step as usize, arguments) });
        }
        tally.print();
    }
    Some(())
}

fn servo() -> Option<()> {
    let mut tally = Tally::new("servo_tick");
    let mut random = Random::new(3);
    let target = Target::<f32>::default();
    for law in LawParams::all() {
        let servo = Servo::<f32>::new(&ServoParams::paper(law)).ok()?;
        let mut axis = Axis { servo, state: servo.start(Counts(0), &target, 0.0), target };
        for call in 0..OF_EACH {
            // Near the target, and anywhere; a target that is not a number, now and then.
            let near = call % 4 != 0;
            let any = FixedCounts((u64::from(random.next()) << 32 | u64::from(random.next())) as i64);
            axis.target = Target {
                position: if near { FixedCounts::from_counts(i64::from(random.below(40))) } else { any },
                velocity: if near { 0.35 } else { CORNERS.get(call as usize % CORNERS.len()).copied()? },
                acceleration: random.around(10.0),
            };
            let counts = if near { random.below(40) } else { random.next() };
            let arguments = [&raw mut axis as usize, counts as usize, 0];
            let function = servo_tick as extern "C" fn(&mut Axis, i32) -> u16;
            // SAFETY: the arguments are those of the function.
            tally.add(unsafe { instructions(function as usize, arguments) });
        }
    }
    tally.print();
    Some(())
}

fn codec() {
    let mut random = Random::new(4);
    let mut decoding = Tally::new("decode_sample");
    let mut decoder = Decoder::new();
    let mut message: Option<Message> = None;
    for call in 0..2 * OF_EACH {
        let bytes = Bytes::of(&Message::Sample(Sample {
            run: random.next() as u16,
            sequence: call as u16,
            time_us: random.next(),
            counts: if call % 16 == 0 { 0 } else { random.next() as i32 },
            status: random.below(8) as u8,
        }));
        let bytes = match call % 4 {
            0 => bytes.corrupted(random.below(20) as usize, random.next() as u8),
            _ => bytes,
        };
        let arguments = [&raw mut decoder as usize, &raw const bytes as usize, &raw mut message as usize];
        let function = decode_sample as extern "C" fn(&mut Decoder, &Bytes, &mut Option<Message>);
        // SAFETY: the arguments are those of the function.
        decoding.add(unsafe { instructions(function as usize, arguments) });
    }
    decoding.print();

    let mut encoding = Tally::new("encode_actuate");
    let mut frame: Option<clutch_wire::Frame> = None;
    for _ in 0..2 * OF_EACH {
        let mut any = || if random.below(4) == 0 { 0 } else { random.next() as u16 };
        let answer = Actuate { run: any(), sequence: any(), code: any(), valid_us: any() };
        let arguments = [&raw const answer as usize, &raw mut frame as usize, 0];
        let function = encode_actuate as extern "C" fn(&Actuate, &mut Option<clutch_wire::Frame>);
        // SAFETY: the arguments are those of the function.
        encoding.add(unsafe { instructions(function as usize, arguments) });
    }
    encoding.print();
}
