//! The macro `error_text!`: the messages of an error, and the errors that become it by `?`.
//!
//! Instead of a derive: the crates of the controller build without a procedural macro and its parser.

/// Implements `Display`, `core::error::Error` and `From` for an error:
///
/// ```
/// #[derive(Debug)]
/// enum ReadError {
///     Empty,
///     TooLong { length: usize, limit: usize },
///     Number(core::num::ParseIntError),
/// }
/// ts3100_proto::error_text! {
///     ReadError: Number from core::num::ParseIntError;
///     Self::Empty => "expected a number, found nothing";
///     Self::TooLong { length, limit } => "expected at most {limit} digits, found {length}";
///     Self::Number(error) => "{error}";
/// }
/// let read = |text: &str| -> Result<u8, ReadError> { Ok(text.parse()?) };
/// assert_eq!(read("x").unwrap_err().to_string(), "invalid digit found in string");
/// ```
#[macro_export]
macro_rules! error_text {
    (
        $error:ty $(: $($variant:ident from $inner:ty),+)?;
        $( $pattern:pat => $text:literal $(, $argument:expr)*; )+
    ) => {
        impl ::core::fmt::Display for $error {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                match self {
                    $( $pattern => ::core::write!(f, $text $(, $argument)*), )+
                }
            }
        }

        impl ::core::error::Error for $error {}

        $($(
            impl From<$inner> for $error {
                fn from(error: $inner) -> $error {
                    <$error>::$variant(error)
                }
            }
        )+)?
    };
}
