//! The macros that declare parameters.

use super::{Table, TableRef};
use crate::{ParamError, Real};

impl TableRef {
    /// The table of this type.
    #[must_use]
    pub const fn of<T: Real, P: Table<T>>() -> TableRef {
        TableRef {
            id: P::TABLE.id,
            #[cfg(not(target_os = "none"))]
            info: &P::TABLE,
        }
    }
}

/// A condition that a parameter fulfils together with others: declared with the table, asked for where all
/// the others are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Relation {
    /// The table.
    pub table: TableRef,
    /// The parameter that errors name.
    pub row: u8,
    /// Its number in the table, from 1.
    pub number: u8,
}

impl Relation {
    /// The value, if the condition holds and the value is finite.
    ///
    /// # Errors
    /// The parameter, with this relation as what is expected.
    #[inline]
    pub fn require<T: Real>(self, value: T, holds: bool) -> Result<T, ParamError<T>> {
        if holds && value.is_finite() { Ok(value) } else { Err(self.error(value)) }
    }

    /// The error of a value that does not fulfil it.
    #[inline]
    #[must_use]
    pub fn error<T: Real>(self, value: T) -> ParamError<T> {
        ParamError { table: self.table, row: self.row, relation: self.number, value }
    }
}

/// Declares a table of parameters.
///
/// ```
/// use clutch_core::params::{Range, Table};
/// clutch_core::params! {
///     /// A switch that pulls at a speed.
///     pub struct PullParams<T> {
///         /// Speed from which it pulls.
///         speed: T = 90.0, "speed_deg_s" "ω_p" DEG_S, Range::at_least(0.0);
///         /// Voltage below that speed.
///         low: T, "low_v" "" V, Range::ANY;
///         /// Voltage above it.
///         high: T, "high_v" "" V, Range::ANY;
///     }
///     relations(p) {
///         /// The voltage rises.
///         RISES: high, "a voltage above low_v" => p.high > p.low;
///     }
/// }
/// let pull = PullParams { speed: 1.5_f32, low: 2.0, high: 1.0 };
/// let error = pull.check_rows().unwrap_err();
/// assert_eq!(error.to_string(), "high_v = 1: expected a voltage above low_v");
/// ```
///
/// `struct Name<T>` is for any scalar, `struct Name<f64>` for double precision, `struct Name<>` has no real
/// number, `struct Name<'a>` borrows a list, `struct Name<'a, f32>` likewise in one scalar; `: Default` says that each row has a default. A row without one must be given. `nested`,
/// `optional` and `flat` tables follow the rows; those of a `flat` one stand among the outer table's own. A
/// relation without a condition is one that constructors ask for, where all that it relates is known.
#[macro_export]
macro_rules! params {
    (
        $(#[doc = $doc:literal])+ $(#[derive($($derive:ident),+)])?
        $vis:vis struct $name:ident<T> $(: $default:ident)? { $($body:tt)* } $($rest:tt)*
    ) => {
        $crate::__params! {
            [$($doc)+] [#[derive(Copy $($(, $derive)+)?)]] [$vis] $name [T = f64] [] [f64] [T: $crate::Real] [T] T
            { $($body)* } $($rest)*
        }
        $crate::__default! { $name [T: $crate::Real] [T] T $($default)? }
        $crate::__cast! { $name { $($body)* } $($rest)* }
    };
    (
        $(#[doc = $doc:literal])+ $(#[derive($($derive:ident),+)])?
        $vis:vis struct $name:ident<f64> $(: $default:ident)? { $($body:tt)* } $($rest:tt)*
    ) => {
        $crate::__params! {
            [$($doc)+] [$(#[derive($($derive),+)])?] [$vis] $name [] [] [] [] [] f64 { $($body)* } $($rest)*
        }
        $crate::__default! { $name [] [] f64 $($default)? }
    };
    (
        $(#[doc = $doc:literal])+ $(#[derive($($derive:ident),+)])?
        $vis:vis struct $name:ident<> $(: $default:ident)? { $($body:tt)* } $($rest:tt)*
    ) => {
        $crate::__params! {
            [$($doc)+] [#[derive(Copy $($(, $derive)+)?)]] [$vis] $name [] [] [] [T: $crate::Real] [] T
            { $($body)* } $($rest)*
        }
        $crate::__default! { $name [] [] f64 $($default)? }
    };
    (
        $(#[doc = $doc:literal])+
        $vis:vis struct $name:ident<$life:lifetime, $t:ident> { $($body:tt)* } $($rest:tt)*
    ) => {
        $crate::__params! {
            [$($doc)+] [#[derive(Copy)]] [$vis] $name [$life] [$life] [$life] [$life] [$life] $t
            { $($body)* } $($rest)*
        }
    };
    (
        $(#[doc = $doc:literal])+
        $vis:vis struct $name:ident<$life:lifetime> { $($body:tt)* } $($rest:tt)*
    ) => {
        $crate::__params! {
            [$($doc)+] [#[derive(Copy)]] [$vis] $name [$life] [$life] [$life] [$life, T: $crate::Real] [$life] T
            { $($body)* } $($rest)*
        }
    };
}

/// The text of a declaration, from the lines of its comment.
#[doc(hidden)]
#[cfg(not(feature = "terse"))]
#[macro_export]
macro_rules! __text {
    ($($line:literal)+) => {
        concat!($($line, "\n"),+).trim_ascii()
    };
}

/// Nothing of it.
#[doc(hidden)]
#[cfg(feature = "terse")]
#[macro_export]
macro_rules! __text {
    ($($line:literal)+) => {
        ""
    };
}

/// `Default` of a table whose rows all have one.
#[doc(hidden)]
#[macro_export]
macro_rules! __default {
    ($name:ident [$($bound:tt)*] [$($arg:tt)*] $t:ident) => {};
    ($name:ident [$($bound:tt)*] [$($arg:tt)*] $t:ident Default) => {
        impl<$($bound)*> Default for $name<$($arg)*> {
            fn default() -> Self {
                <Self as $crate::params::Params<$t>>::blank()
            }
        }
    };
}

/// The same table in another scalar.
#[doc(hidden)]
#[macro_export]
macro_rules! __cast {
    (
        $name:ident
        {$(
            $(#[doc = $row_doc:literal])+
            $field:ident: $ty:ty $(= $default:expr)?, $key:literal $symbol:literal $unit:ident, $range:expr;
        )*}
        $(nested {$($(#[doc = $nested_doc:literal])+ $nested:ident: $nested_ty:ty, $nested_key:literal;)+})?
        $(optional {$($(#[doc = $opt_doc:literal])+ $opt:ident: $opt_ty:ty, $opt_key:literal;)+})?
        $(flat {$($(#[doc = $flat_doc:literal])+ $flat:ident: $flat_ty:ty;)+})?
        $(relations($p:ident) $relations:tt)?
    ) => {
        impl<T: $crate::Real> $name<T> {
            /// The same in another scalar, each real number rounded to the nearest.
            #[must_use]
            pub fn cast<U: $crate::Real>(&self) -> $name<U> {
                $name {
                    $($field: $crate::params::Leaf::<T>::cast::<U>(&self.$field),)*
                    $($($nested: self.$nested.cast(),)+)?
                    $($($opt: self.$opt.as_ref().map(|it| it.cast()),)+)?
                    $($($flat: self.$flat.cast(),)+)?
                }
            }
        }
    };
}

/// The body of [`params!`].
#[doc(hidden)]
#[macro_export]
macro_rules! __params {
    (
        [$($doc:literal)+] [$($derive:tt)*] [$vis:vis] $name:ident
        [$($decl:tt)*] [$($own:tt)*] [$($plain:tt)*] [$($bound:tt)*] [$($arg:tt)*] $t:ident
        {$(
            $(#[doc = $row_doc:literal])+
            $field:ident: $ty:ty $(= $default:expr)?, $key:literal $symbol:literal $unit:ident, $range:expr;
        )*}
        $(nested {$($(#[doc = $nested_doc:literal])+ $nested:ident: $nested_ty:ty, $nested_key:literal;)+})?
        $(optional {$($(#[doc = $opt_doc:literal])+ $opt:ident: $opt_ty:ty, $opt_key:literal;)+})?
        $(flat {$($(#[doc = $flat_doc:literal])+ $flat:ident: $flat_ty:ty;)+})?
        $(relations($p:ident) {$(
            $(#[doc = $rel_doc:literal])+
            $rel:ident: $rel_field:ident, $expected:literal $(=> $holds:expr)?;
        )+})?
    ) => {
        $(#[doc = $doc])+
        #[derive(Clone, Debug, PartialEq)]
        $($derive)*
        $vis struct $name<$($decl)*> {
            $(
                $(#[doc = $row_doc])+
                #[doc = concat!("\n\nKey `", $key, "`; here in SI and radians.")]
                pub $field: $ty,
            )*
            $($($(#[doc = $nested_doc])+ pub $nested: $nested_ty,)+)?
            $($($(#[doc = $opt_doc])+ pub $opt: Option<$opt_ty>,)+)?
            $($($(#[doc = $flat_doc])+ pub $flat: $flat_ty,)+)?
        }

        $crate::__relations! {
            $name [$($own)*] [$($plain)*] $($($(#[doc = $rel_doc])+ $rel $rel_field,)+)?
        }

        impl<$($bound)*> $crate::params::Table<$t> for $name<$($arg)*> {
            const ROWS: &'static [$crate::params::Row] = &[$($crate::params::Row {
                field: stringify!($field),
                key: $key,
                symbol: $symbol,
                unit: $crate::params::$unit,
                kind: <$ty as $crate::params::Leaf<$t>>::KIND,
                range: $range,
                default: concat!($(stringify!($default))?),
                optional: <$ty as $crate::params::Leaf<$t>>::OPTIONAL,
                doc: $crate::__text!($($row_doc)+),
            },)*];
            const RELATIONS: &'static [&'static str] = &[$($(stringify!($rel),)+)?];
            const TABLE: $crate::params::TableInfo = $crate::params::TableInfo {
                name: stringify!($name),
                id: $crate::params::TableInfo::id_of(stringify!($name)),
                doc: $crate::__text!($($doc)+),
                rows: <Self as $crate::params::Table<$t>>::ROWS,
                relations: &[$($($crate::params::RelationInfo {
                    row: $crate::params::TableInfo::row_of(
                        <Self as $crate::params::Table<$t>>::ROWS,
                        stringify!($rel_field),
                    ),
                    expected: $expected,
                },)+)?],
                nested: &[
                    $($($crate::params::Nested {
                        field: stringify!($nested),
                        key: $nested_key,
                        optional: false,
                        doc: $crate::__text!($($nested_doc)+),
                        info: &<$nested_ty as $crate::params::Params<$t>>::INFO,
                    },)+)?
                    $($($crate::params::Nested {
                        field: stringify!($opt),
                        key: $opt_key,
                        optional: true,
                        doc: $crate::__text!($($opt_doc)+),
                        info: &<$opt_ty as $crate::params::Params<$t>>::INFO,
                    },)+)?
                    $($($crate::params::Nested {
                        field: stringify!($flat),
                        key: "",
                        optional: false,
                        doc: $crate::__text!($($flat_doc)+),
                        info: &<$flat_ty as $crate::params::Params<$t>>::INFO,
                    },)+)?
                ],
            };

            fn check_rows(&self) -> Result<(), $crate::ParamError<$t>> {
                $(
                    if let Some(value) = $crate::params::Leaf::<$t>::outside(&self.$field, &{ $range }, &$crate::params::$unit) {
                        return Err($crate::ParamError {
                            table: const { $crate::params::TableRef::of::<$t, Self>() },
                            row: const {
                                $crate::params::TableInfo::row_of(
                                    <Self as $crate::params::Table<$t>>::ROWS,
                                    stringify!($field),
                                )
                            },
                            relation: 0,
                            value,
                        });
                    }
                )*
                $(
                    #[allow(unused_variables, reason = "some relations are asked for elsewhere")]
                    let $p = self;
                    $($(
                        let holds: bool = $holds;
                        if !holds {
                            return Err($name::$rel.error($crate::params::Leaf::<$t>::number(&$p.$rel_field)));
                        }
                    )?)+
                )?
                Ok(())
            }
        }

        impl<$($bound)*> $crate::params::Params<$t> for $name<$($arg)*> {
            const INFO: $crate::params::Info =
                $crate::params::Info::Table(<Self as $crate::params::Table<$t>>::TABLE);

            fn blank() -> Self {
                $name {
                    $($field: $crate::__or_blank!($t $ty, $unit $(, $default)?),)*
                    $($($nested: <$nested_ty as $crate::params::Params<$t>>::blank(),)+)?
                    $($($opt: None,)+)?
                    $($($flat: <$flat_ty as $crate::params::Params<$t>>::blank(),)+)?
                }
            }

            fn edit<E: $crate::params::Editor<$t>>(&mut self, editor: &mut E) {
                editor.table::<Self>(self);
                $(
                    $crate::params::Leaf::<$t>::edit::<Self, E>(
                        &mut self.$field,
                        const {
                            $crate::params::TableInfo::row_of(
                                <Self as $crate::params::Table<$t>>::ROWS,
                                stringify!($field),
                            ) as usize
                        },
                        editor,
                    );
                )*
                $($({
                    let place = const { <Self as $crate::params::Table<$t>>::TABLE.below(stringify!($nested)) };
                    if editor.enter::<Self>(place, true) {
                        $crate::params::Params::<$t>::edit(&mut self.$nested, editor);
                    }
                    editor.leave::<Self>(place);
                })+)?
                $($({
                    let place = const { <Self as $crate::params::Table<$t>>::TABLE.below(stringify!($opt)) };
                    if editor.enter::<Self>(place, self.$opt.is_some()) {
                        let it = self.$opt.get_or_insert_with(<$opt_ty as $crate::params::Params<$t>>::blank);
                        $crate::params::Params::<$t>::edit(it, editor);
                    } else {
                        self.$opt = None;
                    }
                    editor.leave::<Self>(place);
                })+)?
                $($($crate::params::Params::<$t>::edit(&mut self.$flat, editor);)+)?
            }

            fn check(&self) -> Result<(), $crate::ParamError<$t>> {
                $crate::params::Table::<$t>::check_rows(self)?;
                $($($crate::params::Params::<$t>::check(&self.$nested)?;)+)?
                $($(if let Some(it) = &self.$opt {
                    $crate::params::Params::<$t>::check(it)?;
                })+)?
                $($($crate::params::Params::<$t>::check(&self.$flat)?;)+)?
                Ok(())
            }
        }
    };
}

/// The relations of a table as constants.
#[doc(hidden)]
#[macro_export]
macro_rules! __relations {
    ($name:ident [$($own:tt)*] [$($arg:tt)*]) => {};
    (
        $name:ident [$($own:tt)*] [$($arg:tt)*]
        $($(#[doc = $doc:literal])+ $rel:ident $field:ident,)+
    ) => {
        impl<$($own)*> $name<$($arg)*> {
            $(
                $(#[doc = $doc])+
                pub const $rel: $crate::params::Relation = $crate::params::Relation {
                    table: $crate::params::TableRef::of::<f64, Self>(),
                    row: $crate::params::TableInfo::row_of(
                        <Self as $crate::params::Table<f64>>::ROWS,
                        stringify!($field),
                    ),
                    number: 1 + $crate::params::TableInfo::place(
                        <Self as $crate::params::Table<f64>>::RELATIONS,
                        stringify!($rel),
                    ),
                };
            )+
        }
    };
}

/// A row's default, or what stands for none.
#[doc(hidden)]
#[macro_export]
macro_rules! __or_blank {
    ($t:ident $ty:ty, $unit:ident, $default:expr) => {
        <$ty as $crate::params::Leaf<$t>>::of($default, &$crate::params::$unit)
    };
    ($t:ident $ty:ty, $unit:ident) => {
        <$ty as $crate::params::Leaf<$t>>::blank()
    };
}
