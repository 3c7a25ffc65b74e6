//! The macros that declare choices: between tables, and between words.

/// Declares a choice between tables; with `: Default` the first option is taken where nothing is said.
///
/// ```
/// use clutch_core::params::{Choice, Params, Range};
/// clutch_core::params! {
///     /// A tone.
///     pub struct Tone<T> {
///         /// Its frequency.
///         frequency: T, "frequency_hz" "f" HZ, Range::above(0.0);
///     }
/// }
/// clutch_core::choice! {
///     /// A sound.
///     pub enum Sound<T> {
///         /// Nothing.
///         Silence = "silence",
///         /// One tone.
///         Tone(Tone<T>) = "tone",
///     }
/// }
/// assert_eq!(Sound::<f64>::CHOICE.options[1].key, "tone");
/// assert!(Sound::Tone(Tone { frequency: 0.0 }).check().is_err());
/// ```
#[macro_export]
macro_rules! choice {
    ($(#[doc = $doc:literal])+ $vis:vis enum $name:ident<T> $(: $default:ident)? { $($body:tt)* }) => {
        $crate::__default! { $name [T: $crate::Real] [T] T $($default)? }
        $crate::__choice! {
            [$($doc)+] [$($default)?] [#[derive(Copy)]] [$vis] $name [T = f64] [T: $crate::Real] [T] T { $($body)* }
        }
        $crate::__cast_choice! { $name [] { $($body)* } }
    };
    ($(#[doc = $doc:literal])+ $vis:vis enum $name:ident<$life:lifetime, T> { $($body:tt)* }) => {
        $crate::__choice! {
            [$($doc)+] [] [#[derive(Copy)]] [$vis] $name
            [$life, T = f64] [$life, T: $crate::Real] [$life, T] T { $($body)* }
        }
        $crate::__cast_choice! { $name [$life,] { $($body)* } }
    };
    ($(#[doc = $doc:literal])+ $vis:vis enum $name:ident<f64> $(: $default:ident)? { $($body:tt)* }) => {
        $crate::__default! { $name [] [] f64 $($default)? }
        $crate::__choice! { [$($doc)+] [$($default)?] [] [$vis] $name [] [] [] f64 { $($body)* } }
    };
}

/// The same choice in another scalar.
#[doc(hidden)]
#[macro_export]
macro_rules! __cast_choice {
    (
        $name:ident [$($life:tt)*]
        {$($(#[doc = $option_doc:literal])+ $(#[cfg($cfg:meta)])? $option:ident $(($table:ty))? = $key:expr,)+}
    ) => {
        impl<$($life)* T: $crate::Real> $name<$($life)* T> {
            /// The same in another scalar, each real number rounded to the nearest.
            #[must_use]
            pub fn cast<U: $crate::Real>(&self) -> $name<$($life)* U> {
                match self {
                    $(
                        $(#[cfg($cfg)])?
                        $name::$option $(($crate::__with!(it, $table)))? =>
                            $name::$option $(($crate::__with!(it, $table).cast()))?,
                    )+
                }
            }
        }
    };
}

/// The name: repeats it where the other stands.
#[doc(hidden)]
#[macro_export]
macro_rules! __with {
    ($it:ident, $with:ty) => {
        $it
    };
}

/// The body of [`choice!`].
#[doc(hidden)]
#[macro_export]
macro_rules! __choice {
    (
        [$($doc:literal)+] [$($default:ident)?] [$($meta:tt)*] [$vis:vis] $name:ident
        [$($decl:tt)*] [$($bound:tt)*] [$($arg:tt)*] $t:ident
        {$($(#[doc = $option_doc:literal])+ $(#[cfg($cfg:meta)])? $option:ident $(($table:ty))? = $key:expr,)+}
    ) => {
        $(#[doc = $doc])+
        #[derive(Clone, Debug, PartialEq)]
        $($meta)*
        $vis enum $name<$($decl)*> {
            $($(#[doc = $option_doc])+ $(#[cfg($cfg)])? $option $(($table))?,)+
        }

        impl<$($bound)*> $crate::params::Choice<$t> for $name<$($arg)*> {
            const CHOICE: $crate::params::ChoiceInfo = $crate::params::ChoiceInfo {
                name: stringify!($name),
                doc: $crate::__text!($($doc)+),
                has_default: !concat!($(stringify!($default))?).is_empty(),
                options: &[$($(#[cfg($cfg)])? $crate::params::OptionInfo {
                    key: $key,
                    doc: $crate::__text!($($option_doc)+),
                    table: $crate::__table_of!($t $(, $table)?),
                },)+],
            };

            fn chosen(&self) -> usize {
                let each = [$($(#[cfg($cfg)])? matches!(self, $name::$option { .. }),)+];
                each.iter().position(|is| *is).unwrap_or_default()
            }
        }

        impl<$($bound)*> $crate::params::Params<$t> for $name<$($arg)*> {
            const INFO: $crate::params::Info =
                $crate::params::Info::Choice(<Self as $crate::params::Choice<$t>>::CHOICE);

            /// The first option.
            #[allow(unreachable_code, reason = "the first option that is compiled is taken")]
            fn blank() -> Self {
                $($(#[cfg($cfg)])? {
                    return $name::$option $((<$table as $crate::params::Params<$t>>::blank()))?;
                })+
            }

            #[allow(unused_assignments, unused_mut, reason = "the last option ends the count")]
            fn edit<E: $crate::params::Editor<$t>>(&mut self, editor: &mut E) {
                let before = $crate::params::Choice::<$t>::chosen(self);
                let chosen = editor.choose::<Self>(before);
                let mut place = 0;
                $($(#[cfg($cfg)])? {
                    if chosen == place {
                        if before != place {
                            *self = $name::$option $((<$table as $crate::params::Params<$t>>::blank()))?;
                        }
                        #[allow(irrefutable_let_patterns, reason = "a choice may have one option")]
                        if let $name::$option $(($crate::__with!(it, $table)))? = self {
                            $($crate::params::Params::<$t>::edit($crate::__with!(it, $table), editor);)?
                        }
                    }
                    place += 1;
                })+
                editor.chose::<Self>(chosen);
            }

            fn check(&self) -> Result<(), $crate::ParamError<$t>> {
                match self {
                    $($(#[cfg($cfg)])? $name::$option $(($crate::__with!(it, $table)))? => {
                        $($crate::params::Params::<$t>::check($crate::__with!(it, $table))?;)?
                        Ok(())
                    })+
                }
            }
        }
    };
}

/// The table of an option; an empty one for an option that needs no parameter.
#[doc(hidden)]
#[macro_export]
macro_rules! __table_of {
    ($t:ident, $table:ty) => {
        &<$table as $crate::params::Table<$t>>::TABLE
    };
    ($t:ident) => {
        &$crate::params::TableInfo::EMPTY
    };
}

/// Declares a parameter that is one of several words.
///
/// ```
/// use clutch_core::params::{Kind, Leaf};
/// clutch_core::words! {
///     /// A direction.
///     pub enum Side {
///         /// Towards the motor.
///         Near = "near" default,
///         /// Away from it.
///         Far = "far",
///     }
/// }
/// let Kind::Word(words) = <Side as Leaf<f64>>::KIND else { unreachable!() };
/// assert_eq!(words[1].name, "far");
/// ```
#[macro_export]
macro_rules! words {
    (
        $(#[doc = $doc:literal])+
        $vis:vis enum $name:ident {$($(#[doc = $word_doc:literal])+ $word:ident = $text:literal $($default:ident)?,)+}
    ) => {
        $(#[doc = $doc])+
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        $vis enum $name {
            $($(#[doc = $word_doc])+ $(#[$default])? $word,)+
        }

        impl $name {
            /// Every word, in order.
            pub const ALL: &'static [$name] = &[$($name::$word),+];
            /// Every word with its meaning, in order.
            pub const WORDS: &'static [$crate::params::Word] = &[$($crate::params::Word {
                name: $text,
                doc: $crate::__text!($($word_doc)+),
            }),+];

            /// The word.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $($name::$word => $text,)+
                }
            }

            /// The choice of that name.
            #[must_use]
            pub fn named(name: &str) -> Option<Self> {
                match name {
                    $($text => Some($name::$word),)+
                    _ => None,
                }
            }
        }

        impl<T: $crate::Real> $crate::params::Leaf<T> for $name {
            const KIND: $crate::params::Kind = $crate::params::Kind::Word($name::WORDS);
            type Literal = &'static str;
            type As<U: $crate::Real> = $name;

            fn of(literal: &'static str, _: &$crate::params::Unit) -> Self {
                $name::named(literal).unwrap_or_default()
            }
            fn blank() -> Self {
                $name::default()
            }
            fn edit<P: $crate::params::Table<T>, E: $crate::params::Editor<T>>(
                &mut self,
                row: usize,
                editor: &mut E,
            ) {
                let mut place = *self as usize;
                editor.word::<P>(row, &mut place);
                if let Some(word) = $name::ALL.get(place) {
                    *self = *word;
                }
            }
            fn number(&self) -> T {
                T::from_u64(*self as u64)
            }
            fn outside(&self, _: &$crate::params::Range, _: &$crate::params::Unit) -> Option<T> {
                None
            }
            fn cast<U: $crate::Real>(&self) -> Self {
                *self
            }
        }
    };
}
