//! The numbers of one run. A function of many of them at once goes through a vector, whose lanes have the bits
//! of `libm`.

use super::Lane;
use super::elementary::Powers;
use super::vector::{InLanes, at};
use fearless_simd::Level;
use std::sync::LazyLock;

/// The functions of a number that `libm` has by the same names.
macro_rules! libm {
    ($($f:ident)+) => { $(
        #[inline]
        fn $f(self) -> f64 {
            libm::$f(self)
        }
    )+ };
}

impl Lane for f64 {
    const WIDTH: usize = 1;
    const EXPONENT: f64 = f64::INFINITY;

    #[inline(always)]
    fn apart<R>(work: impl FnOnce() -> R) -> R {
        work()
    }
    #[inline]
    fn of(mut each: impl FnMut(usize) -> f64) -> f64 {
        each(0)
    }
    #[inline]
    fn lane(&self, _: usize) -> f64 {
        *self
    }
    #[inline]
    fn put(&mut self, _: usize, x: f64) {
        *self = x;
    }
    #[inline]
    fn any(mask: bool) -> bool {
        mask
    }
    #[inline]
    fn bits(mask: bool) -> u64 {
        mask.into()
    }
    #[inline]
    fn sincos(self) -> (f64, f64) {
        libm::sincos(self)
    }
    #[inline]
    fn exp_of_each<const N: usize>(all: [f64; N]) -> [f64; N] {
        of_each(Function::Exp, all)
    }
    #[inline]
    fn expm1_of_each<const N: usize>(all: [f64; N]) -> [f64; N] {
        of_each(Function::Expm1, all)
    }
    libm! { floor exp expm1 log log1p sin }
}

/// The processor's set of instructions, asked once.
static LEVEL: LazyLock<Level> = LazyLock::new(Level::new);

#[derive(Clone, Copy)]
enum Function {
    Exp,
    Expm1,
}

/// A function of several numbers.
struct OfEach<const N: usize>(Function, [f64; N]);

fn of_each<const N: usize>(function: Function, all: [f64; N]) -> [f64; N] {
    let together = (N > 1).then(|| at(*LEVEL, OfEach(function, all))).flatten();
    together.unwrap_or_else(|| {
        all.map(|x| match function {
            Function::Exp => libm::exp(x),
            Function::Expm1 => libm::expm1(x),
        })
    })
}

impl<const N: usize> InLanes for OfEach<N> {
    type Output = [f64; N];

    #[inline(always)]
    fn run<V: Powers>(self) -> [f64; N] {
        let OfEach(function, mut all) = self;
        for some in all.chunks_mut(V::WIDTH) {
            let last = some.len() - 1;
            let x = V::of(|i| some[i.min(last)]);
            let y = match function {
                Function::Exp => x.exp(),
                Function::Expm1 => x.expm1(),
            };
            for (i, to) in some.iter_mut().enumerate() {
                *to = y.lane(i);
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_number_and_many_have_the_bits_of_libm() {
        let numbers = |seed: usize| -> [f64; 8] {
            std::array::from_fn(|i| ((seed * 8 + i) as f64 * 0.618).fract() * 12.0 - 6.0)
        };
        for seed in 0..if cfg!(miri) { 2 } else { 20_000 } {
            let all = numbers(seed);
            let bits = |of: [f64; 8]| of.map(f64::to_bits);
            assert_eq!(bits(f64::exp_of_each(all)), bits(all.map(libm::exp)), "{all:?}");
            assert_eq!(bits(f64::expm1_of_each(all)), bits(all.map(libm::expm1)), "{all:?}");
            let [first, ..] = all;
            assert_eq!(f64::exp_of_each([first])[0].to_bits(), libm::exp(first).to_bits(), "{first:?}");
            assert_eq!(f64::expm1_of_each([first])[0].to_bits(), libm::expm1(first).to_bits(), "{first:?}");
        }
    }
}
