//! Units: how a key ends, what people read, and what one of it is in SI.

/// A unit in which a key gives its number. Structs hold SI and radians.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unit {
    /// Ending of the key, without the underscore; empty for a plain number.
    pub suffix: &'static str,
    /// The unit as people read it; empty for a plain number.
    pub text: &'static str,
    /// The unit of the struct's field, as people read it.
    pub si: &'static str,
    /// From the key's number to the struct's.
    pub conversion: Conversion,
}

/// From the number at a key to the number in a struct.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Conversion {
    /// The same number.
    None,
    /// Degrees to radians.
    Degrees,
    /// Percent to a share.
    Percent,
}

impl Unit {
    /// The key's number in SI.
    #[must_use]
    pub const fn to_si(&self, x: f64) -> f64 {
        match self.conversion {
            Conversion::None => x,
            Conversion::Degrees => x.to_radians(),
            Conversion::Percent => x / 100.0,
        }
    }

    /// A number in SI as the key gives it.
    #[must_use]
    pub const fn from_si(&self, x: f64) -> f64 {
        match self.conversion {
            Conversion::None => x,
            Conversion::Degrees => x.to_degrees(),
            Conversion::Percent => x * 100.0,
        }
    }
}

macro_rules! units {
    ($($name:ident $suffix:literal $text:literal $si:literal $conversion:ident;)+) => {
        $(
            #[doc = concat!("`", $text, "`")]
            pub const $name: Unit =
                Unit { suffix: $suffix, text: $text, si: $si, conversion: Conversion::$conversion };
        )+
        /// Every unit, the ones with the longer endings first.
        pub const UNITS: &[Unit] = &[$($name),+];
    };
}

units! {
    NONE "" "" "" None;
    KG_M2 "kg_m2" "kg m²" "kg m²" None;
    NM_S_RAD "nm_s_rad" "N m s/rad" "N m s/rad" None;
    NM_RT_S "nm_rt_s" "N m/√s" "N m/√s" None;
    NM_RAD "nm_rad" "N m/rad" "N m/rad" None;
    NM_V "nm_v" "N m/V" "N m/V" None;
    NM_A "nm_a" "N m/A" "N m/A" None;
    V_S2_RAD "v_s2_rad" "V s²/rad" "V s²/rad" None;
    V_S_RAD "v_s_rad" "V s/rad" "V s/rad" None;
    V_RAD_S "v_rad_s" "V/(rad s)" "V/(rad s)" None;
    V_RAD "v_rad" "V/rad" "V/rad" None;
    RAD_S2 "rad_s2" "rad/s²" "rad/s²" None;
    RAD_S "rad_s" "rad/s" "rad/s" None;
    DEG_S3 "deg_s3" "°/s³" "rad/s³" Degrees;
    DEG_S2 "deg_s2" "°/s²" "rad/s²" Degrees;
    DEG_S "deg_s" "°/s" "rad/s" Degrees;
    DEG "deg" "°" "rad" Degrees;
    PER_S2 "1_s2" "1/s²" "1/s²" None;
    PER_S "1_s" "1/s" "1/s" None;
    M_S2 "m_s2" "m/s²" "m/s²" None;
    M2 "m2" "m²" "m²" None;
    KG "kg" "kg" "kg" None;
    NM "nm" "N m" "N m" None;
    V_S "v_s" "V/s" "V/s" None;
    OHM "ohm" "Ω" "Ω" None;
    HZ "hz" "Hz" "Hz" None;
    US "us" "µs" "µs" None;
    PERCENT "percent" "%" "" Percent;
    TURNS "turns" "turns" "turns" None;
    COUNTS "counts" "counts" "counts" None;
    COUNTS_PER_REV "counts_per_rev" "counts per revolution" "counts per revolution" None;
    WAVES_PER_TURN "waves_per_turn" "waves per turn" "waves per turn" None;
    CYCLES "cycles" "periods" "periods" None;
    TICKS "ticks" "periods" "periods" None;
    BITS "bits" "bits" "bits" None;
    IN_128 "" "within 128 periods" "within 128 periods" None;
    S_DEG "s_deg" "s, °" "s, rad" None;
    S_NM "s_nm" "s, N m" "s, N m" None;
    M "m" "m" "m" None;
    S "s" "s" "s" None;
    V "v" "V" "V" None;
}
