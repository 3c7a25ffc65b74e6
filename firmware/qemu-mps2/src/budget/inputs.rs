//! Inputs that try the corners: zeros of both signs, edges, subnormal and huge numbers, infinities,
//! NaN; and pseudo-random ones, the same in each run.

use clutch_core::law::Tick;

/// The corners of one quantity: around ±0.1, where the boundary layer ends, too.
pub const CORNERS: [f32; 22] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.1,
    -0.1,
    0.100_000_01,
    -0.100_000_01,
    1e-3,
    -1e-3,
    30.0,
    -30.0,
    f32::MIN_POSITIVE,
    1e-40, // subnormal
    -1e-40,
    1e20,
    -1e20,
    f32::MAX,
    f32::MIN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
];

/// Marsaglia's xorshift32.
pub struct Random(u32);

impl Random {
    /// From a seed that is not 0.
    pub fn new(seed: u32) -> Random {
        Random(seed)
    }

    /// The next number.
    pub fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    /// 0 to `below` − 1.
    pub fn below(&mut self, below: u32) -> u32 {
        ((u64::from(self.next()) * u64::from(below)) >> 32) as u32
    }

    /// Between −`scale` and `scale`.
    pub fn around(&mut self, scale: f32) -> f32 {
        (self.next() as i32 as f32) / 2_147_483_648.0 * scale
    }

    fn corner(&mut self) -> f32 {
        CORNERS.get(self.below(CORNERS.len() as u32) as usize).copied().unwrap_or(0.0)
    }

    /// A state of a shaft near its path: within 1°, 0.1 rad/s of it, at up to 1 rad/s.
    pub fn ordinary(&mut self) -> Tick<f32> {
        Tick {
            error: self.around(0.0175),
            error_rate: self.around(0.1),
            target_velocity: self.around(1.0),
            target_acceleration: self.around(10.0),
        }
    }

    /// Corners, or any 32 bits.
    pub fn wild(&mut self) -> Tick<f32> {
        let mut one = || if self.below(2) == 0 { self.corner() } else { f32::from_bits(self.next()) };
        Tick { error: one(), error_rate: one(), target_velocity: one(), target_acceleration: one() }
    }
}

/// Each pair of corners as error and rate, then as many ordinary and wild ones as asked for.
pub fn ticks(random: &mut Random, of_each: u32, mut each: impl FnMut(Tick<f32>, bool)) {
    for error in CORNERS {
        for error_rate in CORNERS {
            let Tick { target_velocity, target_acceleration, .. } = random.ordinary();
            each(Tick { error, error_rate, target_velocity, target_acceleration }, false);
        }
    }
    for _ in 0..of_each {
        each(random.ordinary(), true);
        each(random.wild(), false);
    }
}
