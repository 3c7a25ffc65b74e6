//! The numbers of one run. A function of many of them at once goes through a vector, whose lanes have the bits
//! of `libm`.

use super::Lane;
use super::elementary::{self, Powers, Scaled};
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
    fn store(self, to: &mut [f64]) {
        to[0] = self;
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
    // A playground has to be small.
    #[inline(never)]
    fn near_exp(self) -> f64 {
        elementary::near_exp(self)
    }
    #[inline(never)]
    fn near_expm1(self) -> f64 {
        elementary::near_expm1(self)
    }
    #[inline(never)]
    fn near_log1p(self) -> f64 {
        elementary::near_log1p(self)
    }
    #[inline]
    fn near_falls<const N: usize>(all: [f64; N]) -> [f64; N] {
        at(*LEVEL, Falls(all)).unwrap_or_else(|| all.map(|x| (-x).near_expm1()))
    }
    libm! { floor exp log sin }
}

/// The processor's set of instructions, asked once.
static LEVEL: LazyLock<Level> = LazyLock::new(Level::new);

/// [`Lane::near_falls`].
struct Falls<const N: usize>([f64; N]);

impl<const N: usize> InLanes for Falls<N> {
    type Output = [f64; N];

    #[inline(always)]
    fn run<V: Powers>(self) -> [f64; N] {
        let Falls(mut all) = self;
        for some in all.chunks_mut(V::WIDTH) {
            let last = some.len() - 1;
            let y = (-V::of(|i| some[i.min(last)])).near_expm1();
            for (i, to) in some.iter_mut().enumerate() {
                *to = y.lane(i);
            }
        }
        all
    }
}

impl Scaled for f64 {
    #[inline]
    fn power_of_two(self) -> f64 {
        f64::from_bits(((self + (4_503_599_627_370_496.0 + 1023.0)).to_bits()) << 52)
    }
    #[inline]
    fn split(self) -> (f64, f64) {
        let moved = self.to_bits().wrapping_add((0x3ff0_0000 - 0x3fe6_a09e) << 32);
        let mantissa = (moved & 0x000f_ffff_ffff_ffff) + (0x3fe6_a09e << 32);
        let exponent = f64::from_bits((moved >> 52) | (0x4330_0000 << 32));
        (exponent - (4_503_599_627_370_496.0 + 1023.0), f64::from_bits(mantissa))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_number_and_many_have_the_same_bits() {
        for seed in 0..if cfg!(miri) { 2 } else { 20_000 } {
            let all: [f64; 13] =
                std::array::from_fn(|i| (f64::from(seed * 13 + i as i32) * 0.618).fract() * 12.0 - 6.0);
            let (one_by_one, together) = (all.map(|x| (-x).near_expm1()), f64::near_falls(all));
            assert_eq!(together.map(f64::to_bits), one_by_one.map(f64::to_bits), "{all:?}");
        }
    }
}
