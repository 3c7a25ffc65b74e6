//! Exponential, logarithm, sine and cosine in lanes, with the bits of `libm`, on whose scalars all results rest; and `near_`
//! functions, which are quicker, of one number and of many by the same steps.
//!
//! The way is that of Sun Microsystems' fdlibm (1993), as `libm` and musl have it: reduce the argument by multiples of ln 2
//! or of π/2, a polynomial, and scale. A scalar branches; here both sides are computed and one is selected. Coefficients and the order
//! of operations are fdlibm's, or the last bit would differ.

use crate::lane::Lane;

const LN2_HI: f64 = 6.931_471_803_691_238e-1;
const LN2_LO: f64 = 1.908_214_929_270_587_7e-10;
const INVERSE_LN2: f64 = core::f64::consts::LOG2_E;
/// Magnitude above which an argument of an exponential is reduced: half of ln 2 in its upper word.
const REDUCED: f64 = f64::from_bits(0x3fd6_2e43_0000_0000);

/// Coefficients of an exponential's polynomial, that of a power among them.
const P: [f64; 5] = [
    1.666_666_666_666_660_2e-1,
    -2.777_777_777_701_559_3e-3,
    6.613_756_321_437_934e-5,
    -1.653_390_220_546_525_2e-6,
    4.138_136_797_057_238_5e-8,
];

/// Access to the exponent of a number, as exponentials and logarithms need it.
pub(crate) trait Scaled: Lane {
    /// 2 to the power of a whole number from −1022 to 1023.
    fn power_of_two(self) -> Self;
    /// Exponent and mantissa of a positive normal number, the mantissa between the square roots of 1/2 and of 2.
    fn split(self) -> (Self, Self);
}

/// Access to the bits of a number, as functions with the bits of `libm` need it.
pub(crate) trait Powers: Scaled {
    /// Whole part, towards 0.
    fn trunc(self) -> Self;
    /// The power of two at or below a magnitude; 0 of 0.
    fn binade(self) -> Self;
    /// The upper half of its bits.
    fn upper(self) -> Self;
    /// A number from 1/2 to 2, and 1 more, to the digits of the upper half of its bits.
    fn upper_sum(self) -> Self;
}

/// The multiple of ln 2 that an argument is reduced by, and what is left in two parts.
#[inline(always)]
fn reduced<V: Powers>(x: V) -> (V, V, V) {
    let half = V::select(x.less(V::ZERO), V::splat(-0.5), V::splat(0.5));
    let k = (V::splat(INVERSE_LN2) * x + half).trunc();
    let k = V::select(V::splat(REDUCED).less_or_equal(x.abs()), k, V::ZERO);
    (k, x - k * V::splat(LN2_HI), k * V::splat(LN2_LO))
}

#[inline(always)]
pub(crate) fn exp<V: Powers>(x: V) -> V {
    let p = |i: usize| V::splat(P[i]);
    let (k, hi, lo) = reduced(x);
    let r = hi - lo;
    let rr = r * r;
    let c = r - rr * (p(0) + rr * (p(1) + rr * (p(2) + rr * (p(3) + rr * p(4)))));
    let y = V::ONE + (r * c / (V::splat(2.0) - c) - lo + hi);
    let y = y * k.power_of_two();
    // 2⁻²⁸ and less: 1 + x, in its upper word.
    V::select(x.abs().less(V::splat(f64::from_bits(0x3e30_0001_0000_0000))), V::ONE + x, y)
}

#[inline(always)]
pub(crate) fn log<V: Powers>(x: V) -> V {
    const LG: [f64; 7] = [
        6.666_666_666_666_735e-1,
        3.999_999_999_940_942e-1,
        2.857_142_874_366_239e-1,
        2.222_219_843_214_978_4e-1,
        1.818_357_216_161_805e-1,
        1.531_383_769_920_937_3e-1,
        1.479_819_860_511_658_6e-1,
    ];
    let lg = |i: usize| V::splat(LG[i]);
    let (k, m) = x.split();
    let f = m - V::ONE;
    let hfsq = V::splat(0.5) * f * f;
    let s = f / (V::splat(2.0) + f);
    let z = s * s;
    let w = z * z;
    let t1 = w * (lg(1) + w * (lg(3) + w * lg(5)));
    let t2 = z * (lg(0) + w * (lg(2) + w * (lg(4) + w * lg(6))));
    s * (hfsq + (t2 + t1)) + k * V::splat(LN2_LO) - hfsq + f + k * V::splat(LN2_HI)
}

/// `e^x` in two parts, a power of two and that times `e^r − 1` with |r| ≤ ln(2)/2, for |x| ≤ 700; neither has `libm`'s last bit.
#[inline(always)]
fn near_power<V: Scaled>(x: V) -> (V, V) {
    let s = V::splat;
    // 1.5·2⁵² and a number is 1.5·2⁵² and the nearest whole one.
    let rounding = s(1.5 / f64::EPSILON);
    let n = (x * s(INVERSE_LN2) + rounding) - rounding;
    let r = x - n * s(core::f64::consts::LN_2);
    // Σ r^i/(i+2)!
    const FACTORIALS: [f64; 10] = [
        1.0 / 2.0,
        1.0 / 6.0,
        1.0 / 24.0,
        1.0 / 120.0,
        1.0 / 720.0,
        1.0 / 5_040.0,
        1.0 / 40_320.0,
        1.0 / 362_880.0,
        1.0 / 3_628_800.0,
        1.0 / 39_916_800.0,
    ];
    let c = |i: usize| s(FACTORIALS[i]);
    let r2 = r * r;
    let r4 = r2 * r2;
    let low = (c(0) + c(1) * r) + (c(2) + c(3) * r) * r2;
    let high = (c(4) + c(5) * r) + (c(6) + c(7) * r) * r2;
    let part = r + r2 * (low + r4 * (high + r4 * (c(8) + c(9) * r)));
    let scale = n.power_of_two();
    (scale, part * scale)
}

/// `e^x` to 3e-14 of it, for |x| ≤ 700.
#[inline(always)]
pub(crate) fn near_exp<V: Scaled>(x: V) -> V {
    let (scale, part) = near_power(x);
    part + scale
}

/// `e^x − 1` to 3e-14 of it, for |x| ≤ 700.
#[inline(always)]
pub(crate) fn near_expm1<V: Scaled>(x: V) -> V {
    let (scale, part) = near_power(x);
    part + (scale - V::ONE)
}

/// `log(1 + x)` without `libm`'s last bit: to 3e-14 of it, for x > −1.
#[inline(always)]
pub(crate) fn near_log1p<V: Scaled>(x: V) -> V {
    let s = V::splat;
    // Where 1 + x is not reduced its rounding would count.
    let near = s(-0.29).less(x) & x.less(s(0.41));
    let (n, m) = (x + V::ONE).split();
    let r = V::select(near, x, m - V::ONE);
    let q = r / (r + s(2.0));
    let z = q * q;
    let z2 = z * z;
    let z4 = z2 * z2;
    // 2 artanh q = 2 Σ q^(2i+1)/(2i+1)
    let c = |i: i32| s(2.0 / f64::from(2 * i + 1));
    let low = (c(0) + c(1) * z) + (c(2) + c(3) * z) * z2;
    let high = (c(4) + c(5) * z) + (c(6) + c(7) * z) * z2;
    let sum = low + z4 * (high + z4 * (c(8) + c(9) * z));
    q * sum + n * s(core::f64::consts::LN_2)
}

/// True where [`pow`] is for these numbers: positive and normal, no power that a scalar takes another way, and a result far
/// within range.
#[inline(always)]
pub(crate) fn has_pow<V: Powers>(x: V, y: V) -> V::Mask {
    let (s, size) = (V::splat, y.abs());
    let small = s(f64::MIN_POSITIVE).less_or_equal(x) & x.is_finite() & size.less(s(0.5));
    let near = s(1e-30).less(x) & x.less(s(1e30)) & size.less(s(8.0));
    let own = V::same(size, s(0.5)) | V::same(size, V::ONE) | V::same(size, s(2.0)) | size.less(s(1e-300));
    (small | near) & !own
}

/// Where [`has_pow`] is true.
#[inline(always)]
pub(crate) fn pow<V: Powers>(x: V, y: V) -> V {
    // log₂(3/2) in two parts, log₂ e likewise, and ln 2.
    const DP: (f64, f64) = (5.849_624_872_207_642e-1, 1.350_039_202_129_749e-8);
    const CP: (f64, f64, f64) =
        (9.617_966_939_259_756e-1, 9.617_967_009_544_373e-1, -7.028_461_650_952_758e-9);
    const LG2: (f64, f64, f64) =
        (core::f64::consts::LN_2, 6.931_471_824_645_996e-1, -1.904_654_299_957_768e-9);
    const L: [f64; 6] = [
        5.999_999_999_999_946e-1,
        4.285_714_285_785_502e-1,
        3.333_333_298_183_774_3e-1,
        2.727_281_238_085_34e-1,
        2.306_607_457_755_617_5e-1,
        2.069_750_178_003_384_2e-1,
    ];
    let (s, l, p) = (|x: f64| V::splat(x), |i: usize| V::splat(L[i]), |i: usize| V::splat(P[i]));
    // x = 2ⁿ m, with m around 1 or around 3/2.
    let (n, m) = x.split();
    let low = m.less(V::ONE);
    let (n, m) = (V::select(low, n - V::ONE, n), V::select(low, m + m, m));
    let top = s(upper(0x3ffb_b67a)).less_or_equal(m);
    let (n, m) = (V::select(top, n + V::ONE, n), V::select(top, s(0.5) * m, m));
    let middle = s(upper(0x3ff3_988f)).less_or_equal(m);
    let around = |x: f64, otherwise: f64| V::select(middle, s(x), s(otherwise));
    let base = around(1.5, 1.0);
    // log₂ of x in two parts.
    let (u, v) = (m - base, V::ONE / (m + base));
    let ss = u * v;
    let s_h = ss.upper();
    let t_h = m.upper_sum() + around(0.5, 0.0);
    let t_l = m - (t_h - base);
    let s_l = v * ((u - s_h * t_h) - s_h * t_l);
    let s2 = ss * ss;
    let r = s2 * s2 * (l(0) + s2 * (l(1) + s2 * (l(2) + s2 * (l(3) + s2 * (l(4) + s2 * l(5))))));
    let r = r + s_l * (s_h + ss);
    let s2 = s_h * s_h;
    let t_h = (s(3.0) + s2 + r).upper();
    let t_l = r - ((t_h - s(3.0)) - s2);
    let (u, v) = (s_h * t_h, s_l * t_h + t_l * ss);
    let p_h = (u + v).upper();
    let p_l = v - (p_h - u);
    let (z_h, z_l) = (s(CP.1) * p_h, s(CP.2) * p_h + p_l * s(CP.0) + around(DP.1, 0.0));
    let t1 = (((z_h + z_l) + around(DP.0, 0.0)) + n).upper();
    let t2 = z_l - (((t1 - n) - around(DP.0, 0.0)) - z_h);
    // Times y.
    let y1 = y.upper();
    let p_l = (y - y1) * t1 + y * t2;
    let p_h = y1 * t1;
    let z = (p_l + p_h).upper();
    let whole = (z.abs() + s(0.5)).trunc();
    let whole = V::select(s(0.5).less(z.abs()), whole, V::ZERO);
    let n = V::select(z.less(V::ZERO), -whole, whole);
    // 2 to the power of that.
    let p_h = p_h - n;
    let t = (p_l + p_h).upper();
    let (u, v) = (t * s(LG2.1), (p_l - (t - p_h)) * s(LG2.0) + t * s(LG2.2));
    let z = u + v;
    let w = v - (z - u);
    let t = z * z;
    let t1 = z - t * (p(0) + t * (p(1) + t * (p(2) + t * (p(3) + t * p(4)))));
    let r = (z * t1) / (t1 - s(2.0)) - (w + z * w);
    (V::ONE - (r - z)) * n.power_of_two()
}

/// Magnitude below which an argument is reduced by π/2 in three parts; beyond it takes more digits of π than these.
pub(crate) const REDUCIBLE: f64 = f64::from_bits(0x4139_21fb_0000_0000);

/// A number by the upper half of its bits.
const fn upper(word: u64) -> f64 {
    f64::from_bits(word << 32)
}

/// Quarters of a turn next to an argument below [`REDUCIBLE`], and what is left, in two parts.
#[inline(always)]
fn quarters<V: Powers>(x: V) -> (V, V, V) {
    // π/2 in parts of 33 bits, and what follows each.
    const PARTS: [(f64, f64); 3] = [
        (1.570_796_326_734_125_6, 6.077_100_506_506_192e-11),
        (6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21),
        (2.022_266_248_711_166_5e-21, 8.478_427_660_368_9e-32),
    ];
    let (magnitude, sign) = (x.abs(), V::select(x.less(V::ZERO), -V::ONE, V::ONE));
    let rounding = V::splat(1.5 / f64::EPSILON);
    let n = (x * V::splat(core::f64::consts::FRAC_2_PI) + rounding) - rounding;
    // Below 9π/4 a scalar looks up the number of quarters.
    let from = |word: u64| V::select(magnitude.less(V::splat(upper(word))), V::ZERO, V::ONE);
    let few = from(0x3fe9_21fc) + from(0x4002_d97d) + from(0x400f_6a7b) + from(0x4015_fdbd);
    let small = magnitude.less(V::splat(upper(0x401c_463c)));
    let n = V::select(small, sign * few, n);
    let part = |i: usize| (V::splat(PARTS[i].0), V::splat(PARTS[i].1));
    let (first, after) = part(0);
    let (mut r, mut w) = (x - n * first, n * after);
    let mut y = r - w;
    // More digits where much cancels; below 9π/4 only next to a multiple of π/2.
    let is = |word: u64| {
        V::splat(upper(word)).less_or_equal(magnitude) & magnitude.less(V::splat(upper(word + 1)))
    };
    let near = is(0x3ff9_21fb) | is(0x4009_21fb) | is(0x4012_d97c) | is(0x4019_21fb) | !small;
    let cancels = |y: V, bits: f64| (y.binade() * V::splat(bits)).less(x.binade()) & near;
    let much = cancels(y, 65_536.0);
    if V::any(much) {
        let (next, after) = part(1);
        let (t, down) = (r, n * next);
        let finer = t - down;
        let rest = n * after - ((t - finer) - down);
        (r, w) = (V::select(much, finer, r), V::select(much, rest, w));
        y = r - w;
        let most = much & cancels(y, 562_949_953_421_312.0);
        if V::any(most) {
            let (next, after) = part(2);
            let (t, down) = (r, n * next);
            let finer = t - down;
            let rest = n * after - ((t - finer) - down);
            (r, w) = (V::select(most, finer, r), V::select(most, rest, w));
            y = r - w;
        }
    }
    let whole = magnitude.less(V::splat(upper(0x3fe9_21fc)));
    (n, V::select(whole, x, y), V::select(whole, V::ZERO, (r - y) - w))
}

/// For magnitudes below [`REDUCIBLE`].
#[inline(always)]
pub(crate) fn sincos<V: Powers>(x: V) -> (V, V) {
    const S: [f64; 6] = [
        -1.666_666_666_666_663_2e-1,
        8.333_333_333_322_49e-3,
        -1.984_126_982_985_795e-4,
        2.755_731_370_707_006_8e-6,
        -2.505_076_025_340_686_3e-8,
        1.589_690_995_211_55e-10,
    ];
    const C: [f64; 6] = [
        4.166_666_666_666_66e-2,
        -1.388_888_888_887_411e-3,
        2.480_158_728_947_673e-5,
        -2.755_731_435_139_066_3e-7,
        2.087_572_321_298_175e-9,
        -1.135_964_755_778_819_5e-11,
    ];
    let (s, c) = (|i: usize| V::splat(S[i]), |i: usize| V::splat(C[i]));
    let half = V::splat(0.5);
    let (n, x0, x1) = quarters(x);
    let z = x0 * x0;
    let w = z * z;
    let r = s(1) + z * (s(2) + z * s(3)) + z * w * (s(4) + z * s(5));
    let v = z * x0;
    let alone = x0 + v * (s(0) + z * r);
    let reduced = x0 - ((z * (half * x1 - v * r) - x1) - v * s(0));
    let sine = V::select(x.abs().less(V::splat(upper(0x3fe9_21fc))), alone, reduced);
    let r = z * (c(0) + z * (c(1) + z * c(2))) + w * w * (c(3) + z * (c(4) + z * c(5)));
    let hz = half * z;
    let w = V::ONE - hz;
    let cosine = w + (((V::ONE - w) - hz) + (z * r - x0 * x1));
    // The quarter within its turn: 0, 1, 2, 3.
    let quarter = n - (n * V::splat(0.25)).floor() * V::splat(4.0);
    let (one, two, three) = (V::splat(0.5), V::splat(1.5), V::splat(2.5));
    let odd = (one.less(quarter) & quarter.less(two)) | three.less(quarter);
    let (a, b) = (V::select(odd, cosine, sine), V::select(odd, sine, cosine));
    let below = two.less(quarter);
    let turned = one.less(quarter) & quarter.less(three);
    // Tiny arguments are their own sine.
    let sine = V::select(below, -a, a);
    (V::select(x.abs().less(V::splat(upper(0x3e46_a09e))), x, sine), V::select(turned, -b, b))
}
