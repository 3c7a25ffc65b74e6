//! The walk over a run's settings, and the key of each.

use clutch_core::params::{Choice, ChoiceInfo, Editor, Table};
use core::marker::PhantomData;

/// The place of a setting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    /// Its key.
    pub(super) key: u16,
    /// Number of its table; 0 for a choice.
    pub(super) table: u32,
    /// Its row of the table.
    pub(super) row: u8,
}

/// Something that is done with each setting.
pub(super) trait Visit {
    /// `held` is the parameter's value, as it goes over the wire; its value from now on.
    fn visit(&mut self, place: Place, held: u64) -> u64;

    /// The next setting is a real number.
    fn real(&mut self) {}
}

/// Walks over parameters and counts the keys. A key is the place of a parameter among all that are declared: a table's
/// rows, then the tables below it; a choice, then all that can be chosen. The walk meets each in that order, and skips
/// the options that are not chosen.
pub(super) struct Walk<V> {
    pub(super) visit: V,
    /// The key that comes next.
    key: u16,
    /// Number of the table under way, and the key of its first row.
    table: (u32, u16),
    /// Points of a path that is a table: the path's own parameters do not hold them here.
    pub(super) points: u64,
}

impl<V: Visit> Walk<V> {
    pub(super) fn new(visit: V, points: u64) -> Self {
        Walk { visit, key: 0, table: (0, 0), points }
    }

    /// The next setting.
    #[inline(never)]
    fn wide(&mut self, held: u64) -> u64 {
        let (table, first) = self.table;
        let place = Place { key: self.key, table, row: self.key.wrapping_sub(first) as u8 };
        self.key = self.key.wrapping_add(1);
        self.visit.visit(place, held)
    }

    /// The next setting of 32 bits; more than they hold is none of a list.
    #[inline(never)]
    fn narrow(&mut self, held: u32) -> u32 {
        u32::try_from(self.wide(held.into())).unwrap_or(u32::MAX)
    }

    /// The next setting that is a real number. A call of its own for each row: code for all of it had better be short.
    #[inline(never)]
    fn number(&mut self, held: f32) -> f32 {
        self.visit.real();
        f32::from_bits(self.narrow(held.to_bits()))
    }

    /// A table begins here.
    #[inline(never)]
    fn begin(&mut self, table: u32) {
        self.table = (table, self.key);
    }

    /// Keys of options that are not chosen.
    #[inline]
    fn skip(&mut self, keys: &[u8; MOST], chosen: usize) {
        let keys = keys.get(chosen).or(keys.last()).copied().unwrap_or(0);
        self.key = self.key.wrapping_add(keys.into());
    }
}

/// More than the options of any choice: the last place is that of an option that is none.
const MOST: usize = 24;

/// Keys of the choice `C` that are skipped when an option is chosen: before its first row, and behind its last.
struct Skipped<C>(PhantomData<C>);

impl<C: Choice<f32>> Skipped<C> {
    const BEFORE: [u8; MOST] = skipped(&C::CHOICE, true);
    const BEHIND: [u8; MOST] = skipped(&C::CHOICE, false);
}

#[allow(clippy::indexing_slicing, reason = "at compile time, where it is an error of the compiler's")]
const fn skipped(choice: &ChoiceInfo, before: bool) -> [u8; MOST] {
    assert!(choice.options.len() < MOST, "a place for each option");
    let (mut all, mut i) = (0, 0);
    while i < choice.options.len() {
        all += choice.options[i].table.places();
        i += 1;
    }
    assert!(all <= u8::MAX as usize, "a byte holds the keys of a choice");
    let (mut keys, mut at) = ([if before { 0 } else { all as u8 }; MOST], 0);
    i = 0;
    while i < choice.options.len() {
        let own = choice.options[i].table.places();
        keys[i] = (if before { at } else { all - at - own }) as u8;
        at += own;
        i += 1;
    }
    keys
}

impl<V: Visit> Editor<f32> for Walk<V> {
    #[inline]
    fn real<P: Table<f32>>(&mut self, _: usize, value: &mut f32) {
        *value = self.number(*value);
    }
    #[inline]
    fn whole<P: Table<f32>>(&mut self, _: usize, value: &mut u64) {
        *value = self.wide(*value);
    }
    #[inline]
    fn switch<P: Table<f32>>(&mut self, _: usize, value: &mut bool) {
        *value = self.narrow((*value).into()) == 1;
    }
    #[inline]
    fn word<P: Table<f32>>(&mut self, _: usize, value: &mut usize) {
        *value = self.narrow(*value as u32) as usize;
    }
    #[inline]
    fn other<P: Table<f32>>(&mut self, _: usize, _: Option<&mut dyn core::any::Any>) {
        self.points = self.wide(self.points);
    }
    #[inline]
    fn choose<C: Choice<f32>>(&mut self, chosen: usize) -> usize {
        self.begin(0);
        let chosen = self.narrow(chosen as u32) as usize;
        self.skip(const { &Skipped::<C>::BEFORE }, chosen);
        chosen
    }
    #[inline]
    fn chose<C: Choice<f32>>(&mut self, chosen: usize) {
        self.skip(const { &Skipped::<C>::BEHIND }, chosen);
    }
    #[inline]
    fn table<P: Table<f32>>(&mut self, _: &P) {
        self.begin(const { P::TABLE.id });
    }
}
