//! The macro `commands!`: one row a command in, all code that enumerates the commands out.
//!
//! From the rows of `table.rs` it derives [`Command`](super::Command) with its reader and writer, and
//! [`COMMANDS`](super::COMMANDS) for everybody who walks the rows. A new command is one row there and one arm where
//! commands are carried out.

/// Derives the commands from their rows:
///
/// ```text
/// /// Documentation of the variant.
/// Variant(operand: Type) => {
///     letters: "XX", [name: "XX,YY",] form: "XX,<operand>", example: "XX,1",
///     [operands: ["name", "name that repeats ..."],]
///     help: "What it does",
///     source: Manual, sender: Host, answer: Acknowledge, permission: valid(20, "OOOOO", "OOOOO"),
///     parse: function, encode: expression with the operands,
/// }
/// ```
///
/// A command without operands has no form, example, parser and encoder of its own.
macro_rules! commands {
    (@last $default:expr) => { $default };
    (@last $default:expr, $given:expr) => { $given };
    ($(
        $(#[$doc:meta])*
        $variant:ident
        $( ( $( $item:ident : $item_type:ty ),* ) )?
        $( { $( $(#[$field_doc:meta])* $field:ident : $field_type:ty ),* $(,)? } )?
        => {
            letters: $letters:literal,
            $( $( name: $name:literal, )? form: $form:literal, example: $example:literal, )?
            $( operands: [ $( $operand:literal ),* ], )?
            help: $help:literal,
            source: $source:ident, sender: $sender:ident, answer: $answer:ident, permission: $permission:expr,
            $( parse: $parse:expr, encode: $encode:expr, )?
        }
    )*) => {
        /// A command of the host.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Command {
            $(
                $(#[$doc])*
                $variant $( ( $( $item_type ),* ) )? $( { $( $(#[$field_doc])* $field: $field_type ),* } )?,
            )*
        }

        /// All commands: those of Table 5.1 in the order of the manual (CMD-LST-01), then the extensions (decision D0).
        pub const COMMANDS: &[CommandRow] = &[$(
            CommandRow {
                letters: $letters,
                name: commands!(@last $letters $( $( , $name )? )?),
                form: commands!(@last $letters $( , $form )?),
                example: commands!(@last $letters $( , $example )?),
                operands: &[$( $( $operand ),* )?],
                help: $help,
                source: Source::$source,
                sender: Sender::$sender,
                answer: Answer::$answer,
                permission: $permission,
                parse: commands!(@last |operands| operands.none(Command::$variant) $( , $parse )?),
            },
        )*];

        /// The place of each variant in [`COMMANDS`].
        enum Index {
            $( $variant, )*
        }

        impl Command {
            /// Its row in the table of commands.
            pub fn row(&self) -> &'static CommandRow {
                match self {
                    $( Command::$variant { .. } => const { &COMMANDS[Index::$variant as usize] }, )*
                }
            }

            /// The operands in the form that the vendor's client library sends.
            pub(super) fn operands(&self) -> Encoding<'_> {
                match self {
                    $(
                        Command::$variant $( ( $( $item ),* ) )? $( { $( $field ),* } )? => {
                            commands!(@last Encoding::None $( , $encode )?)
                        }
                    )*
                }
            }
        }
    };
}

pub(super) use commands;
