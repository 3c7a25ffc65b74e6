//! Items that follow from the list of friction models.

macro_rules! frictions {
    ($($module:ident $model:ident $params:ident $doc:literal;)+) => {
        $(
            mod $module;
            pub use $module::{$model, $params};
        )+

        crate::choice! {
            /// Friction model, and its parameters.
            pub enum FrictionParams<T>: Default {
                $(#[doc = $doc] $model($params<T>) = stringify!($module),)+
            }
        }

        impl<T: Real> FrictionParams<T> {
            /// Each model of the list, with its defaults.
            #[must_use]
            pub fn all() -> [Self; [$(stringify!($model)),+].len()] {
                [$(FrictionParams::$model($params::default())),+]
            }
        }

        /// A checked friction: whichever model was chosen.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Friction<T> {
            $(#[doc = $doc] $model($model<T>),)+
        }

        $(
            impl<T> From<$params<T>> for FrictionParams<T> {
                fn from(p: $params<T>) -> Self {
                    FrictionParams::$model(p)
                }
            }
        )+

        impl<T: Arithmetic> Friction<T> {
            /// The frictions of several lanes as one; none if they are not of one model.
            #[must_use]
            #[allow(unreachable_patterns, reason = "the list may have one model")]
            pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Option<Friction<L>> {
                $({
                    let is = each(&|f| if matches!(f, Friction::$model(_)) { T::ONE } else { T::ZERO });
                    if L::all(L::ONE.less_or_equal(is)) {
                        return Some(Friction::$model($model::in_lanes(&|get| {
                            each(&|f| match f {
                                Friction::$model(f) => get(f),
                                _ => T::ZERO,
                            })
                        })));
                    }
                })+
                None
            }

            /// The parameters it was built from.
            #[must_use]
            pub fn params(&self) -> FrictionParams<T> {
                match self {
                    $(Friction::$model(f) => FrictionParams::$model(*f.params()),)+
                }
            }
        }

        impl<T: Arithmetic> FrictionModel<T> for Friction<T> {
            type Params = FrictionParams<T>;

            fn build(p: &FrictionParams<T>) -> Result<Self, ParamError<T>> where T: Real {
                Ok(match p {
                    $(FrictionParams::$model(p) => Friction::$model($model::build(p)?),)+
                })
            }
            // Always, where lanes call it: a vector's instructions do not pass a call. For boards the compiler chooses.
            #[cfg_attr(target_os = "none", inline)]
            #[cfg_attr(not(target_os = "none"), inline(always))]
            fn level(&self, velocity: T) -> T {
                match self {
                    $(Friction::$model(f) => f.level(velocity),)+
                }
            }
            // A copy in each of its callers would cost a board's flash.
            #[inline(never)]
            fn curve(&self) -> Option<Stribeck<T>> where T: Real {
                match self {
                    $(Friction::$model(f) => f.curve(),)+
                }
            }
            #[cfg_attr(target_os = "none", inline)]
            #[cfg_attr(not(target_os = "none"), inline(always))]
            fn at_rest(&self) -> T {
                match self {
                    $(Friction::$model(f) => f.at_rest(),)+
                }
            }
            #[cfg_attr(target_os = "none", inline)]
            #[cfg_attr(not(target_os = "none"), inline(always))]
            fn sliding(&self) -> T {
                match self {
                    $(Friction::$model(f) => f.sliding(),)+
                }
            }
            fn envelope(&self) -> Interval<T> where T: Real {
                match self {
                    $(Friction::$model(f) => f.envelope(),)+
                }
            }
            fn exponential(&self) -> Option<Exponential<T>> where T: Real {
                match self {
                    $(Friction::$model(f) => f.exponential(),)+
                }
            }
            fn falls(&self) -> Option<Fall<T>> where T: Real {
                match self {
                    $(Friction::$model(f) => f.falls(),)+
                }
            }
            fn bristles(&self) -> Option<Bristles<T>> where T: Real {
                match self {
                    $(Friction::$model(f) => f.bristles(),)+
                }
            }
            fn check_divisor(&self) -> Result<(), ParamError<T>> where T: Real {
                match self {
                    $(Friction::$model(f) => f.check_divisor(),)+
                }
            }
        }
    };
}
pub(super) use frictions;
