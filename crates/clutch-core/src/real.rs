//! The scalar of the control path: `f32` on a board, `f64` on a host.
//!
//! Elementary functions come from [`libm`] on every target, also under std; those that a board
//! computes at each tick in `f32` are short polynomials of basic operations. Nothing here is fused
//! into a multiply-add. So one input gives one output, bit for bit, on x86-64, ARM and RISC-V: the
//! simulator runs the arithmetic of the board.

use crate::arithmetic::Arithmetic;
use crate::limit::Limit;
use core::fmt::Display;
use core::ops::{AddAssign, SubAssign};

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// `f32` or `f64`; sealed. Its arithmetic is [`Arithmetic`]'s; the rest is what constructors need.
///
/// ```
/// use clutch_core::{Arithmetic, Real};
/// fn sgn<T: Real>(x: T) -> T { x.sgn() }
/// assert_eq!(sgn(-2.0_f32), -1.0);
/// assert_eq!(sgn(0.0_f64), 0.0); // the field's convention here: sgn(0) = 0
/// ```
pub trait Real:
    sealed::Sealed
    + Arithmetic<Mask = bool, Limit = Limit>
    + PartialOrd
    + Display
    + Send
    + Sync
    + AddAssign
    + SubAssign
{
    /// π.
    const PI: Self;
    /// The distance from 1 to the next larger value.
    const EPSILON: Self;
    /// The largest argument of [`Arithmetic::exp_neg`].
    const EXP_NEG_MAX: Self;

    /// The nearest value to `x`.
    fn from_f64(x: f64) -> Self;
    /// This value in double precision (exact).
    fn to_f64(self) -> f64;
    /// The nearest value to the integer `n`.
    fn from_i32(n: i32) -> Self;
    /// The nearest value to the integer `n`.
    fn from_i64(n: i64) -> Self;
    /// The nearest values to two integers.
    #[inline]
    fn from_both(both: [i64; 2]) -> [Self; 2] {
        both.map(Self::from_i64)
    }
    /// The nearest value to the integer `n`.
    fn from_u64(n: u64) -> Self;
    /// The integer part, saturating; NaN gives 0.
    fn to_i64(self) -> i64;
    /// The integer part, saturating at 0 and 65 535; NaN gives 0.
    fn to_u16(self) -> u16;
    /// e to the power of self.
    fn exp(self) -> Self;
    /// Natural logarithm; −∞ for 0, NaN for a negative argument.
    fn ln(self) -> Self;
    /// Largest integer not above self.
    fn floor(self) -> Self;
    /// Sine and cosine for |self| ≤ π/4, without double precision in `f32`.
    ///
    /// Outside that range the result is not a sine.
    fn sin_cos_octant(self) -> (Self, Self);
}

/// Marks a path that is seldom taken: on a board a jump past it is cheaper than to compute it and select.
#[cold]
#[inline]
fn seldom() {}

/// The arithmetic of a scalar, but for what its precision decides.
macro_rules! scalar {
    ($scalar:ident: $abs:ident $sqrt:path, $pow:ident) => {
        type Mask = bool;
        type Limit = Limit;
        const ZERO: $scalar = 0.0;
        const ONE: $scalar = 1.0;

        #[inline]
        fn less(self, other: $scalar) -> bool {
            self < other
        }
        #[inline]
        fn less_or_equal(self, other: $scalar) -> bool {
            self <= other
        }
        #[inline]
        fn select(mask: bool, a: $scalar, b: $scalar) -> $scalar {
            if mask { a } else { b }
        }
        // Always, as the next: a function of its own would become a selection before its caller sees the branch.
        #[inline(always)]
        fn branch(mask: bool, a: impl FnOnce() -> $scalar, b: impl FnOnce() -> $scalar) -> $scalar {
            if mask { a() } else { b() }
        }
        #[inline(always)]
        fn put_where(mask: bool, to: &mut $scalar, value: impl FnOnce() -> $scalar) {
            if mask {
                *to = value();
            }
        }
        #[inline]
        fn limit_of(limit: Limit) -> Limit {
            limit
        }
        #[inline]
        fn select_limit(mask: bool, a: Limit, b: Limit) -> Limit {
            if mask { a } else { b }
        }
        #[inline]
        fn decided(limit: Limit) -> bool {
            limit != Limit::None
        }
        #[inline]
        fn all(mask: bool) -> bool {
            mask
        }
        #[inline]
        fn abs(self) -> $scalar {
            libm::$abs(self)
        }
        #[inline]
        fn sqrt(self) -> $scalar {
            $sqrt(self)
        }
        #[inline]
        fn powf(self, n: $scalar) -> $scalar {
            libm::$pow(self, n)
        }
        // The bits of libm's, in one comparison where the other is a number that the compiler knows.
        #[inline]
        fn max(self, other: $scalar) -> $scalar {
            if self >= other || other.is_nan() { self } else { other }
        }
        #[inline]
        fn min(self, other: $scalar) -> $scalar {
            if self < other || other.is_nan() { self } else { other }
        }
        #[inline]
        fn limit(self, lo: $scalar, hi: $scalar) -> $scalar {
            let above = if self >= lo { self } else { lo };
            if above < hi { above } else { hi }
        }
        #[inline]
        fn is_finite(self) -> bool {
            $scalar::is_finite(self)
        }
        #[inline]
        fn limited(self, lowest: $scalar, highest: $scalar, invalid: $scalar) -> ($scalar, Limit) {
            if self >= lowest {
                if self <= highest { (self, Limit::None) } else { (highest, Limit::Highest) }
            } else if self < lowest {
                (lowest, Limit::Lowest)
            } else {
                (invalid, Limit::Invalid)
            }
        }
        #[inline]
        fn sgn(self) -> $scalar {
            if self > 0.0 {
                1.0
            } else if self < 0.0 {
                -1.0
            } else {
                0.0
            }
        }
        #[inline]
        fn sat(self) -> $scalar {
            // Between the ends, where a law spends its time, two comparisons decide; NaN fails both.
            if self < 1.0 {
                return if self > -1.0 { self } else { -1.0 };
            }
            seldom();
            if self >= 1.0 { 1.0 } else { 0.0 }
        }
    };
}

impl Arithmetic for f64 {
    scalar!(f64: fabs libm::sqrt, pow);

    #[inline]
    fn splat(x: f64) -> f64 {
        x
    }
    #[inline]
    fn exp_neg(self) -> f64 {
        libm::exp(-self)
    }
}

impl Real for f64 {
    const PI: f64 = core::f64::consts::PI;
    const EPSILON: f64 = f64::EPSILON;
    const EXP_NEG_MAX: f64 = f64::MAX;

    #[inline]
    fn from_f64(x: f64) -> f64 {
        x
    }
    #[inline]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline]
    fn from_i32(n: i32) -> f64 {
        f64::from(n)
    }
    #[inline]
    fn from_i64(n: i64) -> f64 {
        n as f64
    }
    #[inline]
    fn from_u64(n: u64) -> f64 {
        n as f64
    }
    #[inline]
    fn to_i64(self) -> i64 {
        self as i64
    }
    #[inline]
    fn to_u16(self) -> u16 {
        self as u16
    }
    #[inline]
    fn exp(self) -> f64 {
        libm::exp(self)
    }
    #[inline]
    fn ln(self) -> f64 {
        libm::log(self)
    }
    #[inline]
    fn floor(self) -> f64 {
        libm::floor(self)
    }
    #[inline]
    fn sin_cos_octant(self) -> (f64, f64) {
        libm::sincos(self)
    }
}

#[cfg(not(all(feature = "vsqrt", target_arch = "arm", target_abi = "eabihf")))]
use libm::sqrtf as root;

/// The square root, rounded as IEEE 754 has it, and so as [`libm::sqrtf`] rounds it.
#[cfg(all(feature = "vsqrt", target_arch = "arm", target_abi = "eabihf"))]
#[allow(unsafe_code)]
fn root(x: f32) -> f32 {
    // A call, for rustc 1.95 lets no other assembly have a register of floats here (rust-lang/rust#159976).
    #[unsafe(naked)]
    extern "C" fn vsqrt(x: f32) -> f32 {
        // By this ABI the argument and the result are in `s0`, and every core that has the ABI has the instruction.
        core::arch::naked_asm!(".fpu fpv4-sp-d16", "vsqrt.f32 s0, s0", "bx lr")
    }
    vsqrt(x)
}

impl Arithmetic for f32 {
    scalar!(f32: fabsf root, powf);

    #[inline]
    fn splat(x: f64) -> f32 {
        x as f32
    }
    /// 2⁻ⁿ 2⁻ᶠ with f in ±1/2: a polynomial, minimax to 1.1e-7 with the value and slope of 2⁻ᶠ at 0.
    /// On a Cortex-M4F these are 28 instructions; `libm::expf` takes up to 82.
    #[inline]
    fn exp_neg(self) -> f32 {
        use core::f32::consts::{LN_2, LOG2_E};
        // A sum with it is rounded to an integer, and has 127 − n in its low bits.
        const TO_INTEGER: f32 = 12_582_912.0 + 127.0; // 1.5 · 2²³, and the bias of an exponent
        let y = self * LOG2_E;
        let rounded = TO_INTEGER - y;
        let f = y + (rounded - TO_INTEGER);
        let power = f32::from_bits(rounded.to_bits() << 23);
        let tail = 0.240_222_83 + f * (-0.055_505_585 + f * (0.009_669_66 + f * -0.001_330_051_6));
        power * (1.0 + f * (-LN_2 + f * tail))
    }
}

/// True on a processor that has no instruction to convert 64 bits.
const WORDS_OF_32_BITS: bool = cfg!(target_pointer_width = "32");

/// The nearest number: small integers, which are nearly all, by the one instruction for 32 bits.
#[inline]
fn nearest(n: i64) -> f32 {
    match i32::try_from(n) {
        Ok(small) => small as f32,
        Err(_) if n < 0 => -nearest_wide(n.unsigned_abs()),
        Err(_) => nearest_wide(n.unsigned_abs()),
    }
}

/// The same of two, which are asked once whether both are small.
#[inline]
fn nearest_of_both(both: [i64; 2]) -> [f32; 2] {
    // Beyond 32 bits the upper word is not the sign of the lower one.
    let [beyond, other] = both.map(|n| (n >> 32) as i32 ^ (n as i32 >> 31));
    if beyond | other == 0 {
        return both.map(|n| n as i32 as f32);
    }
    let [a, b] = both;
    let Both(a, b) = both_nearest(a, b);
    [a, b]
}

/// Two numbers that a function of C gives in registers.
#[repr(C)]
struct Both(f32, f32);

// A function of its own, and of C: its caller then has nothing of it in memory.
#[cold]
#[inline(never)]
extern "C" fn both_nearest(a: i64, b: i64) -> Both {
    let of = |n: i64| {
        let size = nearest_wide(n.unsigned_abs());
        if n < 0 { -size } else { size }
    };
    Both(of(a), of(b))
}

/// The same without a sign.
#[inline]
fn nearest_unsigned(n: u64) -> f32 {
    match u32::try_from(n) {
        Ok(small) => small as f32,
        Err(_) => nearest_wide(n),
    }
}

/// The nearest number to one above 0: its highest 32 bits, of which 24 are kept; the rest decides a tie by being there.
// A function of its own: inlined, the compiler computes it each time, and then selects.
#[cold]
#[inline(never)]
fn nearest_wide(n: u64) -> f32 {
    let zeros = n.leading_zeros() & 63;
    let bits = n << zeros;
    let highest = (bits >> 32) as u32 | u32::from(bits as u32 != 0);
    highest as f32 * f32::from_bits((127 + 32 - zeros) << 23)
}

/// The integer part, saturating, of a number that is nearly always within 32 bits; NaN gives 0.
#[inline]
fn integer_part(x: f32) -> i64 {
    #[cold]
    #[inline(never)]
    fn wide(x: f32) -> i64 {
        x as i64
    }
    if x.abs() < 2_147_483_648.0 { i64::from(x as i32) } else { wide(x) }
}

impl Real for f32 {
    const PI: f32 = core::f32::consts::PI;
    const EPSILON: f32 = f32::EPSILON;
    const EXP_NEG_MAX: f32 = 87.0; // the least power of e that is a normal number

    #[inline]
    fn from_f64(x: f64) -> f32 {
        x as f32
    }
    #[inline]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline]
    fn from_i32(n: i32) -> f32 {
        n as f32
    }
    #[inline]
    fn from_i64(n: i64) -> f32 {
        if WORDS_OF_32_BITS { nearest(n) } else { n as f32 }
    }
    #[inline]
    fn from_both(both: [i64; 2]) -> [f32; 2] {
        if WORDS_OF_32_BITS { nearest_of_both(both) } else { both.map(|n| n as f32) }
    }
    #[inline]
    fn from_u64(n: u64) -> f32 {
        if WORDS_OF_32_BITS { nearest_unsigned(n) } else { n as f32 }
    }
    #[inline]
    fn to_i64(self) -> i64 {
        if WORDS_OF_32_BITS { integer_part(self) } else { self as i64 }
    }
    #[inline]
    fn to_u16(self) -> u16 {
        // By 32 bits: a Cortex-M4F has one instruction for them that saturates, and none for 16.
        (self as u32).min(u16::MAX.into()) as u16
    }
    #[inline]
    fn exp(self) -> f32 {
        libm::expf(self)
    }
    #[inline]
    fn ln(self) -> f32 {
        libm::logf(self)
    }
    #[inline]
    fn floor(self) -> f32 {
        libm::floorf(self)
    }
    /// Taylor series to x⁹ and x¹⁰: the remainder at π/4 is below 2e-9. `libm::sinf` works in
    /// double precision inside, which costs a thousand instructions on a Cortex-M4F.
    #[inline]
    fn sin_cos_octant(self) -> (f32, f32) {
        let x2 = self * self;
        let sin = self
            * (1.0 + x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0 + x2 * (1.0 / 362_880.0)))));
        let cos = 1.0
            + x2 * (-0.5
                + x2 * (1.0 / 24.0
                    + x2 * (-1.0 / 720.0 + x2 * (1.0 / 40_320.0 + x2 * (-1.0 / 3_628_800.0)))));
        (sin, cos)
    }
}

/// Sine and cosine of a phase given in 2⁻⁶⁴ turns, so that whole turns wrap exactly.
///
/// ```
/// let (s, c) = clutch_core::sin_cos_turns::<f64>(1 << 62); // a quarter turn
/// assert_eq!((s, c), (1.0, 0.0));
/// ```
pub fn sin_cos_turns<T: Real>(phase: u64) -> (T, T) {
    // The nearest quarter turn, and what is left: within ±1/8 turn.
    let quarter = phase.wrapping_add(1 << 61) >> 62;
    let rest = phase.wrapping_sub(quarter << 62) as i64;
    // 2π · 2⁻⁶⁴ rad per unit.
    let unit = T::from_f64(core::f64::consts::TAU / 18_446_744_073_709_551_616.0);
    let (s, c) = (T::from_i64(rest) * unit).sin_cos_octant();
    match quarter & 3 {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_of_a_phase_agrees_with_libm_all_round_the_circle() {
        for i in 0..10_000_u64 {
            let phase = i.wrapping_mul(0x9E37_79B9_7F4A_7C15);
            let angle = phase as f64 / 18_446_744_073_709_551_616.0 * core::f64::consts::TAU;
            let (s, c) = sin_cos_turns::<f64>(phase);
            assert!((s - libm::sin(angle)).abs() < 1e-15, "sin {angle}");
            assert!((c - libm::cos(angle)).abs() < 1e-15, "cos {angle}");
            let (s, c) = sin_cos_turns::<f32>(phase);
            assert!((f64::from(s) - libm::sin(angle)).abs() < 1.2e-7, "sinf {angle}");
            assert!((f64::from(c) - libm::cos(angle)).abs() < 1.2e-7, "cosf {angle}");
        }
    }

    #[test]
    fn integers_become_the_same_number_on_every_board() {
        // Around each power of two, where rounding changes: 24 bits are exact, 32 are one word.
        for power in 0..63 {
            for off in -300..300_i64 {
                let n = (1_i64 << power).wrapping_add(off);
                assert_eq!(nearest(n), n as f32, "{n}");
                assert_eq!(nearest(n.wrapping_neg()), n.wrapping_neg() as f32, "-{n}");
                for both in [[n, off], [off, n.wrapping_neg()], [n, n.wrapping_neg()]] {
                    assert_eq!(nearest_of_both(both), both.map(|n| n as f32), "{both:?}");
                }
                assert_eq!(nearest_unsigned(n as u64), n as u64 as f32, "{n} unsigned");
            }
        }
    }

    #[test]
    fn numbers_become_the_same_integer_on_every_board() {
        let ends = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN_POSITIVE, -0.0];
        let all = (0..=u32::MAX).step_by(65_537).map(f32::from_bits);
        for x in all.chain(ends).chain([2_147_483_648.0, -2_147_483_648.0, 2_147_483_520.0]) {
            assert_eq!(integer_part(x), x as i64, "{x}");
        }
    }

    #[test]
    fn numbers_become_the_same_code_on_every_board() {
        let ends =
            [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MIN_POSITIVE, -0.0, -1.0, 4_294_967_296.0];
        // A prime step through the bits, and all around each code: the last number below it, itself, and the next.
        let all = (0..=u32::MAX).step_by(65_537).map(f32::from_bits);
        let codes = (0..=65_600_u32)
            .flat_map(|n| [-1, 0, 1].map(|off| (n as f32).to_bits().wrapping_add_signed(off)));
        for x in all.chain(ends).chain(codes.map(f32::from_bits)) {
            assert_eq!(x.to_u16(), x as u16, "{x}");
        }
    }

    #[test]
    fn the_short_exponential_is_as_good_as_single_precision_and_one_at_zero() {
        assert_eq!(0.0_f32.exp_neg(), 1.0);
        assert!(f32::NAN.exp_neg().is_nan());
        // A prime step through the bits meets every power of two, all parts of each.
        for bits in (0..=f32::EXP_NEG_MAX.to_bits()).step_by(1009) {
            let x = f32::from_bits(bits);
            let (short, exact) = (f64::from(x.exp_neg()), libm::exp(-f64::from(x)));
            assert!((short - exact).abs() <= 1.5e-7, "exp(-{x}) = {short}, {exact}");
            assert!((short - exact).abs() <= 1.6e-7 * (1.0 + f64::from(x)) * exact, "exp(-{x}) = {short}");
        }
    }

    /// A hash of a function's bits over numbers of all sizes between two limits.
    fn bits(lowest: f64, highest: f64, of: impl Fn(f64) -> u64) -> u64 {
        let mut hash = crate::FNV_64;
        let steps = if cfg!(miri) { 500 } else { 200_000 };
        for k in 0..steps {
            // Evenly by the logarithm: small arguments and large ones.
            let share = (k * 7919 % 200_003) as f64 / 200_003.0;
            let x = lowest * 2.0_f64.powi((share * 60.0) as i32 - 60)
                + (highest - lowest) * share * share * share;
            hash = crate::fnv1a_64(hash, &of(x).to_le_bytes());
        }
        hash
    }

    #[test]
    #[cfg_attr(miri, ignore = "Miri gives the last bits of some operations at random")]
    fn the_elementary_functions_have_the_bits_of_the_guarantee() {
        let single = |f: fn(f32) -> f32| move |x: f64| u64::from(f(x as f32).to_bits());
        let found = [
            ("exp, f64", bits(-700.0, 700.0, |x| Real::exp(x).to_bits())),
            ("ln, f64", bits(1e-300, 1e300, |x| Real::ln(x).to_bits())),
            ("power, f64", bits(1e-9, 1e3, |x| Arithmetic::powf(x, 0.1 + x / 300.0).to_bits())),
            ("sine, f64", bits(-0.785, 0.785, |x| x.sin_cos_octant().0.to_bits())),
            ("cosine, f64", bits(-0.785, 0.785, |x| x.sin_cos_octant().1.to_bits())),
            ("exp, f32", bits(-87.0, 88.0, single(Real::exp))),
            ("ln, f32", bits(1e-37, 1e38, single(Real::ln))),
            (
                "power, f32",
                bits(1e-9, 1e3, |x| Arithmetic::powf(x as f32, 0.1 + x as f32 / 300.0).to_bits().into()),
            ),
            ("short exponential", bits(0.0, 87.0, single(Arithmetic::exp_neg))),
            ("sine, f32", bits(-0.785, 0.785, |x| (x as f32).sin_cos_octant().0.to_bits().into())),
            ("cosine, f32", bits(-0.785, 0.785, |x| (x as f32).sin_cos_octant().1.to_bits().into())),
        ];
        let guaranteed = [
            ("exp, f64", 0xc1a2e07227e12390),
            ("ln, f64", 0x0996f302b478527a),
            ("power, f64", 0x350b670aa54a39e6),
            ("sine, f64", 0x448ca37c67777382),
            ("cosine, f64", 0x10c4db08862b3cb0),
            ("exp, f32", 0x03d49ff70c8e7e96),
            ("ln, f32", 0xf46cb23ffec5e1e1),
            ("power, f32", 0xc9572cac8c8f2303),
            ("short exponential", 0x2644f9a93ff0a6fd),
            ("sine, f32", 0x11f6671f7741bb8a),
            ("cosine, f32", 0x44b3985f093f11c1),
        ];
        assert_eq!(
            found, guaranteed,
            "other last bits, by our own functions or by another libm than 0.2.16: docs/bits.md"
        );
    }

    #[test]
    fn the_larger_and_the_smaller_of_two_are_those_of_libm() {
        // A number has inherent methods of these names, which are the platform's.
        fn limited<T: Real>(x: T, (lo, hi): (T, T)) -> [T; 2] {
            [Arithmetic::limit(x, lo, hi), Arithmetic::min(Arithmetic::max(x, lo), hi)]
        }
        let values = [0.0, -0.0, 1.0, -1.0, 1e-40, f64::MAX, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
        for (a, b) in values.into_iter().flat_map(|a| values.map(|b| (a, b))) {
            assert_eq!(Arithmetic::max(a, b).to_bits(), libm::fmax(a, b).to_bits(), "{a}, {b}");
            assert_eq!(Arithmetic::min(a, b).to_bits(), libm::fmin(a, b).to_bits(), "{a}, {b}");
            let (c, d) = (a as f32, b as f32);
            assert_eq!(Arithmetic::max(c, d).to_bits(), libm::fmaxf(c, d).to_bits(), "{c}, {d} in f32");
            assert_eq!(Arithmetic::min(c, d).to_bits(), libm::fminf(c, d).to_bits(), "{c}, {d} in f32");
            for x in values.into_iter().filter(|_| a <= b) {
                let [limit, both] = limited(x, (a, b)).map(f64::to_bits);
                assert_eq!(limit, both, "{x} in [{a}, {b}]");
                let [limit, both] = limited(x as f32, (c, d)).map(f32::to_bits);
                assert_eq!(limit, both, "{x} in [{c}, {d}] in f32");
            }
        }
    }

    #[test]
    fn limit_sends_nan_to_the_lower_end_and_never_panics() {
        assert_eq!(f64::NAN.limit(1.0, 2.0), 1.0);
        assert_eq!(5.0_f32.limit(2.0, 1.0), 1.0); // even for an empty interval
    }

    #[test]
    fn sat_is_the_identity_inside_and_the_sign_outside() {
        assert_eq!(0.25_f64.sat(), 0.25);
        assert_eq!(f64::INFINITY.sat(), 1.0);
        assert_eq!((-3.0_f32).sat(), -1.0);
        assert_eq!(f32::NAN.sat(), 0.0);
    }

    #[test]
    fn a_scalar_is_one_lane() {
        fn one_lane<T: Real>() {
            assert_eq!(T::splat(0.25).to_f64(), 0.25);
            assert_eq!(T::limit_of(Limit::Highest), Limit::Highest);
            assert_eq!(T::select_limit(true, Limit::Lowest, Limit::None), Limit::Lowest);
            assert_eq!(T::select_limit(false, Limit::Lowest, Limit::None), Limit::None);
            assert!(T::all(T::ZERO.less(T::ONE)) && !T::all(T::ONE.less_or_equal(T::ZERO)));
        }
        one_lane::<f32>();
        one_lane::<f64>();
    }
}
