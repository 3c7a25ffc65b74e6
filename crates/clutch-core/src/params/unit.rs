//! Units: how a key ends, what people read, and what one of it is in SI.

/// A unit in which a key gives its number. Structs hold SI and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Ending of the key, without the underscore; empty for a plain number.
    pub suffix: &'static str,
    /// The unit as people read it; empty for a plain number.
    pub text: &'static str,
    /// The unit of the struct's field, as people read it.
    pub si: &'static str,
    /// From the key's number to the struct's.
    pub conversion: Conversion,
    /// The quantity, where another unit of it is easily taken by mistake; else empty.
    pub quantity: &'static str,
    /// One of it in the quantity's SI unit.
    pub size: f64,
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

    /// From SI to this unit, for a number that people are shown.
    #[must_use]
    pub const fn factor(&self) -> f64 {
        match self.conversion {
            Conversion::None => 1.0 / self.size,
            Conversion::Degrees | Conversion::Percent => self.from_si(1.0),
        }
    }

    /// The unit with which a key or a column ends; the longest that fits.
    #[must_use]
    pub fn of_key(key: &str) -> Option<&'static Unit> {
        let ends = |u: &&Unit| {
            let stem = key.strip_suffix(u.suffix);
            !u.suffix.is_empty() && stem.is_some_and(|stem| stem.is_empty() || stem.ends_with('_'))
        };
        UNITS.iter().filter(ends).max_by_key(|u| u.suffix.len())
    }
}

const DEGREE: f64 = core::f64::consts::PI / 180.0;

macro_rules! units {
    ($($name:ident $suffix:literal $text:literal $si:literal $conversion:ident $quantity:literal $size:expr;)+) => {
        $(
            #[doc = concat!("`", $text, "`")]
            pub const $name: Unit = Unit {
                suffix: $suffix,
                text: $text,
                si: $si,
                conversion: Conversion::$conversion,
                quantity: $quantity,
                size: $size,
            };
        )+
        /// Every unit; some only so that a mistake is seen.
        pub const UNITS: &[Unit] = &[$($name),+];
    };
}

units! {
    NONE "" "" "" None "" 1.0;
    KG_M2 "kg_m2" "kg m²" "kg m²" None "" 1.0;
    NM_S_RAD "nm_s_rad" "N m s/rad" "N m s/rad" None "" 1.0;
    NM_RT_S "nm_rt_s" "N m/√s" "N m/√s" None "" 1.0;
    NM_RAD "nm_rad" "N m/rad" "N m/rad" None "" 1.0;
    NM_S "nm_s" "N m/s" "N m/s" None "" 1.0;
    NM_V "nm_v" "N m/V" "N m/V" None "" 1.0;
    NM_A "nm_a" "N m/A" "N m/A" None "" 1.0;
    V_S2_RAD "v_s2_rad" "V s²/rad" "V s²/rad" None "" 1.0;
    V_S_RAD "v_s_rad" "V s/rad" "V s/rad" None "" 1.0;
    V_RT_S_RAD "v_rt_s_rad" "V √(s/rad)" "V √(s/rad)" None "" 1.0;
    V_RAD_S "v_rad_s" "V/(rad s)" "V/(rad s)" None "" 1.0;
    V_RAD "v_rad" "V/rad" "V/rad" None "" 1.0;
    RAD_S2 "rad_s2" "rad/s²" "rad/s²" None "acceleration" 1.0;
    RAD_S_RT_S "rad_s_rt_s" "rad/s/√s" "rad/s/√s" None "" 1.0;
    RAD_S "rad_s" "rad/s" "rad/s" None "velocity" 1.0;
    DEG_S3 "deg_s3" "°/s³" "rad/s³" Degrees "jerk" DEGREE;
    DEG_S2 "deg_s2" "°/s²" "rad/s²" Degrees "acceleration" DEGREE;
    DEG_S "deg_s" "°/s" "rad/s" Degrees "velocity" DEGREE;
    DEG "deg" "°" "rad" Degrees "angle" DEGREE;
    PER_RAD "1_rad" "1/rad" "1/rad" None "" 1.0;
    S_RAD "s_rad" "s/rad" "s/rad" None "" 1.0;
    PER_S2 "1_s2" "1/s²" "1/s²" None "" 1.0;
    PER_S "1_s" "1/s" "1/s" None "" 1.0;
    M_S2 "m_s2" "m/s²" "m/s²" None "" 1.0;
    M2 "m2" "m²" "m²" None "" 1.0;
    KG "kg" "kg" "kg" None "" 1.0;
    NM "nm" "N m" "N m" None "torque" 1.0;
    V_S "v_s" "V/s" "V/s" None "" 1.0;
    OHM "ohm" "Ω" "Ω" None "" 1.0;
    HZ "hz" "Hz" "Hz" None "frequency" 1.0;
    US "us" "µs" "µs" None "time" 1e-6;
    PERCENT "percent" "%" "" Percent "" 1.0;
    TURNS "turns" "turns" "turns" None "" 1.0;
    COUNTS "counts" "counts" "counts" None "" 1.0;
    COUNTS_PER_REV "counts_per_rev" "counts per revolution" "counts per revolution" None "" 1.0;
    WAVES_PER_TURN "waves_per_turn" "waves per turn" "waves per turn" None "" 1.0;
    CYCLES_PER_S "cycles_per_s" "cycles/s" "cycles/s" None "" 1.0;
    CYCLES "cycles" "periods" "periods" None "" 1.0;
    TICKS "ticks" "periods" "periods" None "" 1.0;
    BITS "bits" "bits" "bits" None "" 1.0;
    IN_128 "" "within 128 periods" "within 128 periods" None "" 1.0;
    S_DEG "s_deg" "s, °" "s, rad" None "" 1.0;
    DEG_FACTOR "deg_factor" "°, 1" "°, 1" None "" 1.0;
    S_NM "s_nm" "s, N m" "s, N m" None "" 1.0;
    M "m" "m" "m" None "length" 1.0;
    S "s" "s" "s" None "time" 1.0;
    V "v" "V" "V" None "voltage" 1.0;
    RAD_S3 "rad_s3" "rad/s³" "rad/s³" None "jerk" 1.0;
    RAD "rad" "rad" "rad" None "angle" 1.0;
    MS "ms" "ms" "ms" None "time" 1e-3;
    MRAD_S "mrad_s" "mrad/s" "mrad/s" None "velocity" 1e-3;
    MV "mv" "mV" "mV" None "voltage" 1e-3;
    MNM "mnm" "mN m" "mN m" None "torque" 1e-3;
    MM "mm" "mm" "mm" None "length" 1e-3;
}
