//! Laws that do their worst within a shell: what a bound "with any inner law" has to bear.

use clutch_core::law::{Command, ControlLaw, Limit, Tick};

/// Ways to be bad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Way {
    /// Any voltage in each period.
    Random,
    /// None ever.
    Nothing,
    /// The highest always.
    Full,
    /// None, the highest or any, for a random time each.
    Holds,
    /// Away from the surface: full where the shaft is behind, none where it is ahead.
    AwayFromSurface,
    /// Pumps by the rate: full where it falls behind, none where it gains.
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
    /// Its highest voltage, V.
    pub(crate) highest: f64,
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

    fn hold(&self, memory: &mut Memory) -> f64 {
        if memory.left == 0 {
            memory.left = 1 + (60.0 * self.draw(memory) * self.draw(memory)) as u32;
            let which = self.draw(memory);
            memory.volts = match which {
                w if w < 0.35 => 0.0,
                w if w < 0.7 => self.highest,
                _ => self.highest * self.draw(memory),
            };
        }
        memory.left -= 1;
        memory.volts
    }
}

impl ControlLaw<f64> for Adversary {
    type State = Memory;
    type Terms = [f64; 0];
    const TERMS: &'static [&'static str] = &[];

    fn start(&self, _: &Tick<f64>, _: f64) -> Memory {
        Memory::default()
    }

    fn update(&self, memory: &mut Memory, tick: &Tick<f64>) -> Command<f64, [f64; 0]> {
        let full_if = |condition: bool| if condition { self.highest } else { 0.0 };
        let voltage = match self.way {
            Way::Random => self.highest * self.draw(memory),
            Way::Nothing => 0.0,
            Way::Full => self.highest,
            Way::Holds => self.hold(memory),
            Way::AwayFromSurface => full_if(self.slope * tick.error + tick.error_rate > 0.0),
            Way::WithRate => full_if(tick.error_rate > 0.0),
            Way::WithError => full_if(tick.error > 0.0),
        };
        Command { voltage, limit: Limit::None, terms: [] }
    }
}
