//! The vector: as many doubles as a register of the processor holds. Eight, in several registers where they have to be, were
//! up to a fifth faster with SSE, but on uneven discs mostly slower, by up to nine tenths, and with AVX2 little different on
//! even ones; and this crate took a quarter longer to compile.
//!
//! The only unsafe code of this crate: a vector of a set of instructions is made out of nothing, as [`Arithmetic`] asks, and
//! not out of the token that proves the set to be there. [`at`] has seen the token before any vector is made. Nothing outside
//! of this file can name a vector, and [`InLanes`] is given one by [`at`] alone. Its result may hold vectors for later – the
//! processor stays the one that it is –, but where they are used only [`Lane::apart`] brings their instructions back.

use super::elementary::{self, Powers, Scaled};
use crate::lane::{Lane, MOST_LANES};
use clutch_core::Arithmetic;
use clutch_core::law::Limit;
use fearless_simd::{Bytes as _, Level, Select as _, Simd, SimdBase as _, SimdFloat as _, SimdMask as _};
use std::fmt;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A set of instructions as a constant.
trait Instructions: Simd + 'static {
    /// Its token; only what runs under [`at`] may use it.
    const TOKEN: Self;
}

/// Work that is done in lanes.
pub(crate) trait InLanes {
    /// Its result.
    type Output;
    /// Does it.
    fn run<V: Powers>(self) -> Self::Output;
}

macro_rules! instructions {
    ($($(#[$when:meta])* $set:ident;)+) => {
        $(
            $(#[$when])*
            impl Instructions for fearless_simd::$set {
                // SAFETY: used by vectors alone, and these only under `at`, which was given such a token by a processor
                // that has the instructions.
                const TOKEN: Self = unsafe { fearless_simd::$set::assume_supported() };
            }
        )+

        /// Does some work by the instructions of a level; none where there are no lanes.
        pub(crate) fn at<W: InLanes>(level: Level, work: W) -> Option<W::Output> {
            match level {
                $(
                    $(#[$when])*
                    Level::$set(token) => {
                        Some(token.vectorize(
                            // A call would leave the instructions behind.
                            #[inline(always)]
                            || work.run::<Vector<fearless_simd::$set>>(),
                        ))
                    }
                )+
                #[allow(unreachable_patterns, reason = "those of other processors")]
                _ => None,
            }
        }
    };
}
instructions! {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))] Sse2;
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))] Sse4_2;
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))] Avx2;
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))] Avx512;
    #[cfg(target_arch = "aarch64")] Neon;
}

/// The levels that this processor has, the lowest first, by the names of their instructions.
pub(crate) fn levels() -> Vec<(&'static str, Level)> {
    let best = Level::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    let lower = [
        ("sse2", best.as_sse2().map(Level::Sse2)),
        ("sse4.2", best.as_sse4_2().map(Level::Sse4_2)),
        ("avx2", best.as_avx2().map(Level::Avx2)),
        ("avx512", best.as_avx512().map(Level::Avx512)),
    ];
    #[cfg(target_arch = "aarch64")]
    let lower = [("neon", Some(best))];
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64")))]
    let lower = [("none", Some(best))];
    lower.into_iter().filter_map(|(name, level)| Some((name, level?))).collect()
}

/// A register of doubles.
#[derive(Clone, Copy)]
struct Vector<S: Simd>(S::f64s);

/// A vector as a constant.
const fn constant<S: Instructions>(x: f64) -> Vector<S> {
    const { assert!(size_of::<S::f64s>() == Vector::<S>::WIDTH * size_of::<f64>()) }
    const { assert!(Vector::<S>::WIDTH <= MOST_LANES) }
    // SAFETY: a vector is documented to have the layout of an array of so many doubles, but for its alignment, which a copy
    // of bytes does not need.
    Vector(unsafe { std::mem::transmute_copy(&[x; MOST_LANES]) })
}

impl<S: Instructions> Default for Vector<S> {
    #[inline(always)]
    fn default() -> Self {
        Self::splat(0.0)
    }
}

impl<S: Instructions> fmt::Debug for Vector<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries((0..Self::WIDTH).map(|i| self.lane(i))).finish()
    }
}

impl<S: Instructions> PartialEq for Vector<S> {
    #[inline(always)]
    fn eq(&self, other: &Self) -> bool {
        self.0.simd_eq(other.0).all_true()
    }
}

macro_rules! operators {
    ($($of:ident $f:ident $op:tt;)+) => { $(
        impl<S: Instructions> $of for Vector<S> {
            type Output = Self;
            #[inline(always)]
            fn $f(self, other: Self) -> Self {
                Vector(self.0 $op other.0)
            }
        }
    )+ };
}
operators! { Add add +; Sub sub -; Mul mul *; Div div /; }

impl<S: Instructions> Neg for Vector<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Vector(-self.0)
    }
}

impl<S: Instructions> Arithmetic for Vector<S> {
    type Mask = S::mask64s;
    /// Number of the limit in each lane.
    type Limit = Self;
    const ZERO: Self = constant(0.0);
    const ONE: Self = constant(1.0);

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Vector(S::f64s::splat(S::TOKEN, x))
    }
    #[inline(always)]
    fn less(self, other: Self) -> Self::Mask {
        self.0.simd_lt(other.0)
    }
    #[inline(always)]
    fn less_or_equal(self, other: Self) -> Self::Mask {
        self.0.simd_le(other.0)
    }
    #[inline(always)]
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self {
        Vector(mask.select(a.0, b.0))
    }
    #[inline(always)]
    fn limit_of(limit: Limit) -> Self {
        Self::splat(f64::from(limit as u8))
    }
    #[inline(always)]
    fn select_limit(mask: Self::Mask, a: Self, b: Self) -> Self {
        Self::select(mask, a, b)
    }
    #[inline(always)]
    fn decided(limit: Self) -> Self::Mask {
        Self::limit_of(Limit::None).less(limit)
    }
    #[inline(always)]
    fn all(mask: Self::Mask) -> bool {
        mask.all_true()
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Vector(self.0.abs())
    }
    #[inline(always)]
    fn exp_neg(self) -> Self {
        if Self::all(self.abs().less(Self::splat(700.0))) {
            return (-self).exp();
        }
        Self::of(|i| Arithmetic::exp_neg(self.lane(i)))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Vector(self.0.sqrt())
    }
    #[inline(always)]
    fn powf(self, n: Self) -> Self {
        if Self::all(elementary::has_pow(self, n)) {
            return Self::apart(
                #[inline(always)]
                || elementary::pow(self, n),
            );
        }
        Self::of(|i| Arithmetic::powf(self.lane(i), n.lane(i)))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        let number = self.0.simd_eq(self.0);
        Self::select(number & !self.less(other), self, other)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        let number = other.0.simd_eq(other.0);
        Self::select(number & !self.less(other), other, self)
    }
    #[inline(always)]
    fn is_finite(self) -> Self::Mask {
        self.abs().less_or_equal(Self::splat(f64::MAX))
    }
    #[inline(always)]
    fn limited(self, lowest: Self, highest: Self, invalid: Self) -> (Self, Self) {
        let (below, above, number) = (self.less(lowest), highest.less(self), self.0.simd_eq(self.0));
        let of = Self::limit_of;
        let limit =
            Self::select(above, of(Limit::Highest), Self::select(below, of(Limit::Lowest), of(Limit::None)));
        let value = Self::select(above, highest, Self::select(below, lowest, self));
        (Self::select(number, value, invalid), Self::select(number, limit, of(Limit::Invalid)))
    }
    #[inline(always)]
    fn sgn(self) -> Self {
        let below = Self::select(self.less(Self::ZERO), -Self::ONE, Self::ZERO);
        Self::select(Self::ZERO.less(self), Self::ONE, below)
    }
    #[inline(always)]
    fn sat(self) -> Self {
        let within = Self::select(self.less(Self::ONE), self, Self::ONE);
        let within = Self::select(self.less_or_equal(-Self::ONE), -Self::ONE, within);
        Self::select(self.0.simd_eq(self.0), within, Self::ZERO)
    }
}

/// The functions that lanes have of their own, each once for a set of instructions.
macro_rules! elementary {
    ($($f:ident)+) => { $(
        #[inline(always)]
        fn $f(self) -> Self {
            Self::apart(
                #[inline(always)]
                || elementary::$f(self),
            )
        }
    )+ };
}

impl<S: Instructions> Lane for Vector<S> {
    const WIDTH: usize = S::f64s::LEN;

    #[inline(always)]
    fn apart<R>(work: impl FnOnce() -> R) -> R {
        S::TOKEN.vectorize(work)
    }
    #[inline(always)]
    fn of(mut each: impl FnMut(usize) -> f64) -> Self {
        let mut all = S::f64s::splat(S::TOKEN, 0.0);
        for i in 0..Self::WIDTH {
            all[i] = each(i);
        }
        Vector(all)
    }
    #[inline(always)]
    fn lane(&self, i: usize) -> f64 {
        self.0[i]
    }
    #[inline(always)]
    fn put(&mut self, i: usize, x: f64) {
        self.0[i] = x;
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        self.0.store_slice(to);
    }
    #[inline(always)]
    fn any(mask: Self::Mask) -> bool {
        mask.any_true()
    }
    #[inline(always)]
    fn bits(mask: Self::Mask) -> u64 {
        mask.to_bitmask()
    }
    #[inline(always)]
    fn same(a: Self, b: Self) -> Self::Mask {
        a.0.simd_eq(b.0)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Vector(self.0.floor())
    }
    #[inline(always)]
    fn sincos(self) -> (Self, Self) {
        if Self::all(self.abs().less(Self::splat(elementary::REDUCIBLE))) {
            return Self::apart(
                #[inline(always)]
                || elementary::sincos(self),
            );
        }
        (Self::of(|i| libm::sincos(self.lane(i)).0), Self::of(|i| libm::sincos(self.lane(i)).1))
    }
    elementary! { exp log }
    #[inline(always)]
    fn near_exp(self) -> Self {
        elementary::near_exp(self)
    }
    #[inline(always)]
    fn near_expm1(self) -> Self {
        elementary::near_expm1(self)
    }
    #[inline(always)]
    fn near_log1p(self) -> Self {
        elementary::near_log1p(self)
    }
}

impl<S: Instructions> Scaled for Vector<S> {
    #[inline(always)]
    fn power_of_two(self) -> Self {
        // 2⁵² + n has n in its low bits.
        let biased = (self + Self::splat(4_503_599_627_370_496.0 + 1023.0)).0.bitcast::<S::u64s>();
        Vector((biased << 52).bitcast())
    }
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        let word = |upper: u64| S::u64s::splat(S::TOKEN, upper << 32);
        let moved = self.0.bitcast::<S::u64s>() + word(0x3ff0_0000 - 0x3fe6_a09e);
        let mantissa = (moved & S::u64s::splat(S::TOKEN, 0x000f_ffff_ffff_ffff)) + word(0x3fe6_a09e);
        // As above, the other way round.
        let exponent = (moved >> 52) | word(0x4330_0000);
        let exponent = Vector(exponent.bitcast()) - Self::splat(4_503_599_627_370_496.0 + 1023.0);
        (exponent, Vector(mantissa.bitcast()))
    }
}

impl<S: Instructions> Powers for Vector<S> {
    #[inline(always)]
    fn trunc(self) -> Self {
        Vector(self.0.trunc())
    }
    #[inline(always)]
    fn binade(self) -> Self {
        let exponent = S::u64s::splat(S::TOKEN, 0x7ff0_0000_0000_0000);
        Vector((self.0.bitcast::<S::u64s>() & exponent).bitcast())
    }
    #[inline(always)]
    fn upper(self) -> Self {
        let upper = S::u64s::splat(S::TOKEN, 0xffff_ffff_0000_0000);
        Vector((self.0.bitcast::<S::u64s>() & upper).bitcast())
    }
    #[inline(always)]
    fn upper_sum(self) -> Self {
        // From one binade to the next a mantissa is worth twice as much: half of it, and the 1 that it lacked.
        let word = |upper: u64| S::u64s::splat(S::TOKEN, upper << 32);
        let half = (self.0.bitcast::<S::u64s>() >> 1) & word(0xffff_ffff);
        Vector(((half | word(0x2000_0000)) + word(0x0008_0000)).bitcast())
    }
}
