//! The walk over a run's settings: which key each has.

use clutch_core::params::{Choice, Editor, Nested, OptionInfo, Table};
use core::marker::PhantomData;

/// Where a setting stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    /// Its key.
    pub(super) key: u16,
    /// Number of its table; 0 for a choice.
    pub(super) table: u32,
    /// Its row of the table.
    pub(super) row: u8,
}

/// Something done with each setting.
pub(super) trait Visit {
    /// `held` is what the parameter is, as it goes over the wire; what it is from now on.
    fn visit(&mut self, place: Place, held: u64) -> u64;
}

/// Walks over parameters and counts the keys. A key is the place of a parameter among all that are declared: a table's
/// rows, then the tables below it; a choice, then all that can be chosen.
pub(super) struct Walk<'a, V> {
    visit: &'a mut V,
    /// Key of the first row of the table under way.
    at: u16,
    /// Its number.
    table: u32,
    /// Points of a path that is a table: the path's own parameters do not hold them here.
    pub(super) points: u64,
}

impl<'a, V: Visit> Walk<'a, V> {
    pub(super) fn new(visit: &'a mut V, points: u64) -> Self {
        Walk { visit, at: 0, table: 0, points }
    }

    #[inline]
    fn row(&mut self, row: usize, held: u64) -> u64 {
        let place = Place { key: self.at.wrapping_add(row as u16), table: self.table, row: row as u8 };
        self.visit.visit(place, held)
    }
}

/// Most tables below one, and most options of a choice.
const MOST: usize = 16;

/// Keys from the first row of `P` to each table below it.
struct Below<P>(PhantomData<P>);

impl<P: Table<f32>> Below<P> {
    const KEYS: [u16; MOST] = below(P::TABLE.rows.len(), P::TABLE.nested);
}

/// Keys from that of the choice `C` to the first row of each option.
struct Options<C>(PhantomData<C>);

impl<C: Choice<f32>> Options<C> {
    const KEYS: [u16; MOST] = options(C::CHOICE.options);
}

#[allow(clippy::indexing_slicing, reason = "at compile time, where it is an error of the compiler's")]
const fn below(rows: usize, nested: &[Nested]) -> [u16; MOST] {
    let (mut keys, mut at, mut i) = ([0; MOST], rows, 0);
    while i < nested.len() {
        keys[i] = at as u16;
        at += nested[i].info.places();
        i += 1;
    }
    keys
}

#[allow(clippy::indexing_slicing, reason = "at compile time, where it is an error of the compiler's")]
const fn options(options: &[OptionInfo]) -> [u16; MOST] {
    let (mut keys, mut at, mut i) = ([0; MOST], 1, 0);
    while i < options.len() {
        keys[i] = at as u16;
        at += options[i].table.places();
        i += 1;
    }
    keys
}

impl<V: Visit> Editor<f32> for Walk<'_, V> {
    #[inline]
    fn real<P: Table<f32>>(&mut self, row: usize, value: &mut f32) {
        *value = f32::from_bits(self.row(row, value.to_bits().into()) as u32);
    }
    #[inline]
    fn whole<P: Table<f32>>(&mut self, row: usize, value: &mut u64) {
        *value = self.row(row, *value);
    }
    #[inline]
    fn switch<P: Table<f32>>(&mut self, row: usize, value: &mut bool) {
        *value = self.row(row, (*value).into()) == 1;
    }
    #[inline]
    fn word<P: Table<f32>>(&mut self, row: usize, value: &mut usize) {
        *value = usize::try_from(self.row(row, *value as u64)).unwrap_or(usize::MAX);
    }
    #[inline]
    fn other<P: Table<f32>>(&mut self, row: usize, _: Option<&mut dyn core::any::Any>) {
        self.points = self.row(row, self.points);
    }
    #[inline]
    fn enter<P: Table<f32>>(&mut self, nested: usize, _: bool) -> bool {
        self.at = self.at.wrapping_add(Below::<P>::KEYS.get(nested).copied().unwrap_or(0));
        true
    }
    #[inline]
    fn leave<P: Table<f32>>(&mut self, nested: usize) {
        self.at = self.at.wrapping_sub(Below::<P>::KEYS.get(nested).copied().unwrap_or(0));
    }
    #[inline]
    fn choose<C: Choice<f32>>(&mut self, chosen: usize) -> usize {
        self.table = 0;
        let chosen = usize::try_from(self.row(0, chosen as u64)).unwrap_or(usize::MAX);
        self.at = self.at.wrapping_add(Options::<C>::KEYS.get(chosen).copied().unwrap_or(0));
        chosen
    }
    #[inline]
    fn chose<C: Choice<f32>>(&mut self, chosen: usize) {
        self.at = self.at.wrapping_sub(Options::<C>::KEYS.get(chosen).copied().unwrap_or(0));
    }
    #[inline]
    fn table<P: Table<f32>>(&mut self, _: &P) {
        self.table = const { P::TABLE.id };
    }
}
