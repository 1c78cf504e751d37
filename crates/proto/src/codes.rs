//! The macro `codes!`: an enum whose values each have one code, on the wire or in a file.
//!
//! A row says a value and its code once. The enum, the list of its values and the ways to the code and back are derived
//! from the rows.

/// Derives an enum with codes, or with words, from its rows:
///
/// ```text
/// /// Documentation of the enum.
/// pub enum Name {
///     /// Documentation of the value.
///     Value = 1,
/// }
/// /// Documentation of the function from value to code.
/// fn code -> u8;
/// /// Documentation of the function from code to value, if there is one.
/// fn from_code;
/// impl Word;
/// ```
///
/// The last line is for an enum whose codes are its words, see [`Word`](crate::words::Word).
#[macro_export]
macro_rules! codes {
    (
        $(#[$attribute:meta])*
        pub enum $name:ident {
            $( $(#[$value_attribute:meta])* $value:ident = $code:literal, )*
        }
        $(#[$to_doc:meta])*
        fn $to:ident -> $type:ty;
        $( $(#[$from_doc:meta])* fn $from:ident; )?
        $( impl $word:ident; )?
    ) => {
        $(#[$attribute])*
        pub enum $name {
            $( $(#[$value_attribute])* $value, )*
        }

        impl $name {
            /// All values in their order.
            pub const ALL: [$name; [$( $code ),*].len()] = [$( $name::$value ),*];

            $(#[$to_doc])*
            #[must_use]
            pub const fn $to(self) -> $type {
                match self {
                    $( $name::$value => $code, )*
                }
            }

            $(
                $(#[$from_doc])*
                pub fn $from(code: $type) -> Option<$name> {
                    $name::ALL.into_iter().find(|value| value.$to() == code)
                }
            )?
        }

        $(
            impl $crate::words::$word for $name {
                const ALL: &'static [$name] = &$name::ALL;

                fn word(self) -> &'static str {
                    self.$to()
                }
            }
        )?
    };
}

pub(crate) use codes;
