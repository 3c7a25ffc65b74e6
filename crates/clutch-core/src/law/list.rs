//! Items that follow from the list of laws.

macro_rules! laws {
    (@with ($dollar:tt) $($module:ident $law:ident $params:ident $doc:literal $(in $lanes:ident)?;)+) => {
        /// Calls a macro with the list of laws, for code that has an item for each: `name Law;` and so on.
        #[doc(hidden)]
        #[macro_export]
        macro_rules! each_law {
            ($dollar callback:ident) => {
                $dollar callback! { $($module $law;)+ }
            };
        }

        /// Calls a macro with the laws that run in lanes: `lanes Law;` and so on.
        #[doc(hidden)]
        #[macro_export]
        macro_rules! each_law_in_lanes {
            ($dollar callback:ident) => {
                $dollar callback! { $($($lanes $law;)?)+ }
            };
        }

        $(
            mod $module;
            pub use $module::{$law, $params};
        )+

        crate::choice! {
            /// Control law, and its gains.
            pub enum LawParams<T> {
                $(#[doc = $doc] $law($params<T>) = stringify!($module),)+
            }
        }

        $(
            impl<T> From<$params<T>> for LawParams<T> {
                fn from(p: $params<T>) -> Self {
                    LawParams::$law(p)
                }
            }
        )+

        impl<T: Real> LawParams<T> {
            /// Each law of the list, with its defaults.
            #[must_use]
            pub fn all() -> [Self; [$(stringify!($law)),+].len()] {
                [$(LawParams::$law($params::default())),+]
            }

            /// The law of a name in scenarios, with its defaults.
            #[must_use]
            pub fn named(name: &str) -> Option<Self> {
                Self::all().into_iter().find(|law| <Self as Choice<T>>::name(law) == name)
            }

            /// `true` if the law follows a path; `false` for an open-loop law.
            #[must_use]
            pub fn follows(&self) -> bool {
                match self {
                    $(LawParams::$law(_) => <$law<T> as Listed<T>>::FOLLOWS,)+
                }
            }

            /// The law's name, as people read it.
            #[must_use]
            pub fn title(&self) -> &'static str {
                match self {
                    $(LawParams::$law(_) => <$law<T> as Listed<T>>::TITLE,)+
                }
            }

            /// The law's own filter of the encoder's counts, if it has one.
            #[must_use]
            pub fn filter(&self) -> Option<&EdgeTimedParams<T>> {
                match self {
                    $(LawParams::$law(p) => <$law<T> as Listed<T>>::filter(p),)+
                }
            }

            /// The law's answer to a departure from the speed, if it has one.
            #[must_use]
            pub fn damping(&self) -> Option<Damping<T>> {
                match self {
                    $(LawParams::$law(p) => <$law<T> as Listed<T>>::damping(p),)+
                }
            }

            /// Condition on the law's parameters for such a form, in words; empty without one.
            #[must_use]
            pub fn sampled_if(&self) -> &'static str {
                match self {
                    $(LawParams::$law(_) => <$law<T> as Listed<T>>::SAMPLED_IF,)+
                }
            }

            /// The law as a certificate of the sampled loop takes it, if it is of such a form.
            #[must_use]
            pub fn sampled(&self) -> Option<SampledForm<T>> {
                match self {
                    $(LawParams::$law(p) => <$law<T> as Listed<T>>::sampled(p),)+
                }
            }
        }

        /// The closed set of laws: what a configuration file, the wire and a log can name.
        ///
        /// ```
        /// use clutch_core::law::{Beside, ControlLaw, Law, LawParams, SmcParams, Tick};
        /// let params = LawParams::Smc(SmcParams::default());
        /// let (model, output) = Default::default();
        /// let law = Law::<f64>::new(&params, &Beside::paper(&model, &output))?;
        /// let mut state = Default::default();
        /// // The shaft is 0.1° ahead: the surface is beyond the layer, the brake gets K_p = 3 V.
        /// let tick = Tick { error: -0.1_f64.to_radians(), ..Tick::default() };
        /// assert_eq!(law.update(&mut state, &tick).voltage, 3.0);
        /// # Ok::<(), clutch_core::ParamError>(())
        /// ```
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Law<T> {
            $(#[doc = $doc] $law($law<T>),)+
        }

        /// Memory of the law that runs.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum LawState<T: Real> {
            $(#[doc = $doc] $law(<$law<T> as ControlLaw<T>>::State),)+
        }

        impl<T: Real> Default for LawState<T> {
            /// The first law's, at rest; another law takes it for its own at rest.
            #[allow(unreachable_code, reason = "the first of the list is taken")]
            fn default() -> Self {
                $(return LawState::$law(Default::default());)+
            }
        }

        /// The terms of whichever law ran.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum LawTerms<T: Real> {
            $(#[doc = $doc] $law(<$law<T> as ControlLaw<T>>::Terms),)+
        }

        impl<T: Real> Default for LawTerms<T> {
            #[allow(unreachable_code, reason = "the first of the list is taken")]
            fn default() -> Self {
                $(return LawTerms::$law(Default::default());)+
            }
        }

        impl<T: Real> Terms<T> for LawTerms<T> {
            #[inline]
            fn values(&self) -> &[T] {
                match self {
                    $(LawTerms::$law(terms) => Terms::values(terms),)+
                }
            }

            #[inline]
            fn are_finite(&self) -> bool {
                match self {
                    $(LawTerms::$law(terms) => Terms::are_finite(terms),)+
                }
            }
        }

        #[cfg(feature = "defmt")]
        impl<T: Real + defmt::Format> defmt::Format for LawTerms<T> {
            fn format(&self, f: defmt::Formatter<'_>) {
                match self {
                    $(LawTerms::$law(terms) => {
                        defmt::write!(f, "{=str} {}", stringify!($law), Terms::<T>::values(terms));
                    })+
                }
            }
        }

        const _: () = {
            $(assert!(<$law<f64> as ControlLaw<f64>>::TERMS.len() <= MAX_TERMS);)+
        };

        impl<T: Real> Law<T> {
            /// Checks gains, output stage and, for a law that has a model, the believed plant.
            ///
            /// # Errors
            /// As the chosen law's constructor.
            pub fn new(p: &LawParams<T>, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>> {
                beside.output.check_for(beside.model.actuator.kind())?;
                Ok(match p {
                    $(LawParams::$law(p) => Law::$law(Listed::build(p, beside)?),)+
                })
            }

            /// The output stage.
            #[must_use]
            pub fn output(&self) -> &Output<T> {
                match self {
                    $(Law::$law(law) => Listed::output(law),)+
                }
            }

            /// The sliding surface, if the law has one.
            #[must_use]
            pub fn surface(&self, asked: &Asked<'_, T>) -> Option<Surface<T>> {
                match self {
                    $(Law::$law(law) => Listed::surface(law, asked),)+
                }
            }

            /// A state of another law becomes this one's, at rest.
            // A function of its own in machine code: a servo's state is its law's, and a bound leaves it out.
            #[cold]
            #[inline(never)]
            fn begin_anew(&self, state: &mut LawState<T>) {
                match self {
                    $(Law::$law(_) => *state = LawState::$law(Default::default()),)+
                }
            }

            /// Terms of this law from their values; what is missing is 0, what is too much is left out.
            #[must_use]
            pub fn terms_of(&self, values: &[T]) -> LawTerms<T> {
                match self {
                    $(Law::$law(_) => {
                        let mut terms = <$law<T> as ControlLaw<T>>::Terms::default();
                        for (to, from) in terms.iter_mut().zip(values) {
                            *to = *from;
                        }
                        LawTerms::$law(terms)
                    })+
                }
            }
        }

        impl<T: Real> ControlLaw<T> for Law<T> {
            type State = LawState<T>;
            type Terms = LawTerms<T>;
            /// None: which law was chosen is not known here.
            const TERMS: &'static [&'static str] = &[];

            fn term_names(&self) -> &'static [&'static str] {
                match self {
                    $(Law::$law(_) => <$law<T> as ControlLaw<T>>::TERMS,)+
                }
            }

            fn start(&self, tick: &Tick<T>, applied: T) -> Self::State {
                match self {
                    $(Law::$law(law) => LawState::$law(ControlLaw::start(law, tick, applied)),)+
                }
            }

            // A function of its own, here and for what else a state is begun with: a board's stack holds one of them at a
            // time.
            #[inline(never)]
            fn restart(&self, state: &mut Self::State, tick: &Tick<T>, applied: T) {
                match self {
                    $(Law::$law(law) => *state = LawState::$law(ControlLaw::start(law, tick, applied)),)+
                }
            }

            #[inline]
            fn sees(&self, state: &mut Self::State, seen: impl FnOnce() -> Seen<T>) {
                match self {
                    $(Law::$law(law) => {
                        if let LawState::$law(own) = state {
                            law.sees(own, seen);
                        }
                    })+
                }
            }

            #[inline]
            fn update(&self, state: &mut Self::State, tick: &Tick<T>) -> Command<T, Self::Terms> {
                match self {
                    $(Law::$law(law) => {
                        if !matches!(state, LawState::$law(_)) {
                            self.begin_anew(state);
                        }
                        let Command { voltage, limit, terms } = match state {
                            LawState::$law(own) => law.update(own, tick),
                            // The line above leaves no other.
                            _ => Command::default(),
                        };
                        Command { voltage, limit, terms: LawTerms::$law(terms) }
                    })+
                }
            }
        }
    };
    ($($list:tt)+) => {
        // A macro that makes a macro needs its dollar handed in.
        $crate::law::list::laws! { @with ($) $($list)+ }
    };
}
pub(super) use laws;

/// `select` of the memory of a law that runs in lanes: by it one lane begins anew. The fields are those beside its output's.
macro_rules! selected {
    ($state:ident: $($field:ident)+) => {
        impl<T: $crate::Arithmetic> $state<T> {
            /// The memory `a` where the mask is true, `b` elsewhere.
            #[must_use]
            pub fn select(mask: T::Mask, a: &Self, b: &Self) -> Self {
                $state {
                    $($field: T::select(mask, a.$field, b.$field),)+
                    output: $crate::law::OutputState::select(mask, &a.output, &b.output),
                }
            }
        }
    };
}
pub(super) use selected;
