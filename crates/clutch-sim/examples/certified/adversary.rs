//! Laws that do their worst within a shell: what a bound "with any inner law" has to bear.

use clutch_core::Real;
use clutch_core::law::{Command, ControlLaw, Limit, Tick};

/// Ways to be bad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Way {
    /// Any voltage in each period.
    Random,
    /// The lowest ever.
    Nothing,
    /// The highest always.
    Full,
    /// The lowest, the highest or any, for a random time each.
    Holds,
    /// Away from the surface: slowest where the shaft is behind, fastest where it is ahead.
    AwayFromSurface,
    /// Pumps by the rate: slowest where it falls behind, fastest where it gains.
    WithRate,
    /// Pumps by the error.
    WithError,
}

impl Way {
    /// Each of them.
    pub(crate) const ALL: [Way; 7] = [
        Way::Random,
        Way::Nothing,
        Way::Full,
        Way::Holds,
        Way::AwayFromSurface,
        Way::WithRate,
        Way::WithError,
    ];
}

/// A bad law.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Adversary {
    /// Its way.
    pub(crate) way: Way,
    /// Seed of what it does at random.
    pub(crate) seed: u64,
    /// Its lowest and highest voltage, V.
    pub(crate) lowest: f64,
    pub(crate) highest: f64,
    /// A higher voltage drives, and does not brake.
    pub(crate) motor: bool,
    /// Slope of the shell's surface, 1/s.
    pub(crate) slope: f64,
}

/// The memory of a bad law.
#[derive(Clone, Debug, Default)]
pub(crate) struct Memory {
    draws: u64,
    volts: f64,
    left: u32,
}

impl Adversary {
    /// A number from 0 to 1, another each time.
    fn draw(&self, memory: &mut Memory) -> f64 {
        memory.draws += 1;
        // The finaliser of SplitMix64.
        let mut x = (self.seed ^ 0x5851_f42d).wrapping_add(memory.draws.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn any(&self, memory: &mut Memory) -> f64 {
        self.lowest + (self.highest - self.lowest) * self.draw(memory)
    }

    fn hold(&self, memory: &mut Memory) -> f64 {
        if memory.left == 0 {
            memory.left = 1 + (60.0 * self.draw(memory) * self.draw(memory)) as u32;
            let which = self.draw(memory);
            memory.volts = match which {
                w if w < 0.35 => self.lowest,
                w if w < 0.7 => self.highest,
                _ => self.any(memory),
            };
        }
        memory.left -= 1;
        memory.volts
    }
}

impl<T: Real> ControlLaw<T> for Adversary {
    type State = Memory;
    type Terms = [T; 0];
    const TERMS: &'static [&'static str] = &[];

    fn start(&self, _: &Tick<T>, _: T) -> Memory {
        Memory::default()
    }

    fn update(&self, memory: &mut Memory, tick: &Tick<T>) -> Command<T, [T; 0]> {
        let [error, rate] = [tick.error.to_f64(), tick.error_rate.to_f64()];
        let slow_if = |behind: bool| if behind != self.motor { self.highest } else { self.lowest };
        let voltage = match self.way {
            Way::Random => self.any(memory),
            Way::Nothing => self.lowest,
            Way::Full => self.highest,
            Way::Holds => self.hold(memory),
            Way::AwayFromSurface => slow_if(self.slope * error + rate > 0.0),
            Way::WithRate => slow_if(rate > 0.0),
            Way::WithError => slow_if(error > 0.0),
        };
        Command { voltage: T::from_f64(voltage), limit: Limit::None, terms: [] }
    }
}
