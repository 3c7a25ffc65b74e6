//! Types that a single parameter may have.

use super::{Editor, Kind, Range, Table, Unit};
use crate::{Micros, Real};

/// The type of a field that a row of [`params!`](crate::params!) declares.
pub trait Leaf<T: Real>: Clone {
    /// Its kind.
    const KIND: Kind;
    /// `true` if it may be absent.
    const OPTIONAL: bool = false;
    /// The type in which the row writes its default.
    type Literal;
    /// The same for another scalar.
    type As<U: Real>: Leaf<U>;

    /// The value that a row's default stands for; the literal is in the key's unit.
    fn of(literal: Self::Literal, unit: &Unit) -> Self;
    /// A value that stands for none yet.
    fn blank() -> Self;
    /// Shows the value to an editor, which may change it.
    fn edit<P: Table<T>, E: Editor<T>>(&mut self, row: usize, editor: &mut E);
    /// The value as a number, in SI.
    fn number(&self) -> T;
    /// The number, if it is out of the range.
    fn outside(&self, range: &Range, unit: &Unit) -> Option<T>;
    /// The same for another scalar, a real number rounded to the nearest.
    fn cast<U: Real>(&self) -> Self::As<U>;
}

impl<T: Real> Leaf<T> for T {
    const KIND: Kind = Kind::Real;
    type Literal = f64;
    type As<U: Real> = U;

    fn of(literal: f64, unit: &Unit) -> T {
        T::from_f64(unit.to_si(literal))
    }
    fn blank() -> T {
        T::from_f64(f64::NAN)
    }
    #[inline]
    fn edit<P: Table<T>, E: Editor<T>>(&mut self, row: usize, editor: &mut E) {
        editor.real::<P>(row, self);
    }
    #[inline]
    fn number(&self) -> T {
        *self
    }
    #[inline]
    fn outside(&self, range: &Range, unit: &Unit) -> Option<T> {
        (!range.holds(unit, *self)).then_some(*self)
    }
    fn cast<U: Real>(&self) -> U {
        U::from_f64(self.to_f64())
    }
}

macro_rules! whole {
    ($($ty:ident: $from:expr, $to:expr;)+) => { $(
        impl<T: Real> Leaf<T> for $ty {
            const KIND: Kind = Kind::Whole;
            type Literal = u64;
            type As<U: Real> = $ty;

            fn of(literal: u64, _: &Unit) -> $ty {
                $from(literal)
            }
            fn blank() -> $ty {
                $from(0)
            }
            #[inline]
            fn edit<P: Table<T>, E: Editor<T>>(&mut self, row: usize, editor: &mut E) {
                let mut number = $to(*self);
                editor.whole::<P>(row, &mut number);
                *self = $from(number);
            }
            #[inline]
            fn number(&self) -> T {
                T::from_u64($to(*self))
            }
            #[inline]
            fn outside(&self, range: &Range, _: &Unit) -> Option<T> {
                let number = $to(*self);
                (!range.holds_whole(number)).then_some(T::from_u64(number))
            }
            fn cast<U: Real>(&self) -> $ty {
                *self
            }
        }
    )+ };
}

// A number that does not fit saturates: a range that every type holds refuses it.
whole! {
    u8: (|n: u64| u8::try_from(n).unwrap_or(u8::MAX)), u64::from;
    u32: (|n: u64| u32::try_from(n).unwrap_or(u32::MAX)), u64::from;
    u64: (|n: u64| n), u64::from;
    Micros: (|n: u64| Micros(u32::try_from(n).unwrap_or(u32::MAX))), (|m: Micros| u64::from(m.0));
}

impl<T: Real> Leaf<T> for bool {
    const KIND: Kind = Kind::Switch;
    type Literal = bool;
    type As<U: Real> = bool;

    fn of(literal: bool, _: &Unit) -> bool {
        literal
    }
    fn blank() -> bool {
        false
    }
    #[inline]
    fn edit<P: Table<T>, E: Editor<T>>(&mut self, row: usize, editor: &mut E) {
        editor.switch::<P>(row, self);
    }
    fn number(&self) -> T {
        T::from_i32(i32::from(*self))
    }
    fn outside(&self, _: &Range, _: &Unit) -> Option<T> {
        None
    }
    fn cast<U: Real>(&self) -> bool {
        *self
    }
}

impl<T: Real, L: Leaf<T>> Leaf<T> for Option<L> {
    const KIND: Kind = L::KIND;
    const OPTIONAL: bool = true;
    type Literal = L::Literal;
    type As<U: Real> = Option<L::As<U>>;

    fn of(literal: L::Literal, unit: &Unit) -> Option<L> {
        Some(L::of(literal, unit))
    }
    fn blank() -> Option<L> {
        None
    }
    #[inline]
    fn edit<P: Table<T>, E: Editor<T>>(&mut self, row: usize, editor: &mut E) {
        if editor.present::<P>(row, self.is_some()) {
            self.get_or_insert_with(L::blank).edit::<P, E>(row, editor);
        } else {
            *self = None;
        }
    }
    fn number(&self) -> T {
        self.as_ref().map_or(T::ZERO, Leaf::number)
    }
    fn outside(&self, range: &Range, unit: &Unit) -> Option<T> {
        self.as_ref().and_then(|value| value.outside(range, unit))
    }
    fn cast<U: Real>(&self) -> Option<L::As<U>> {
        self.as_ref().map(Leaf::cast)
    }
}
