//! The binary `ts3100`. It only calls the library.
//!
//! Go to [`ts3100_emulator::cli`] for the subcommands and to `driver` for the loop that serves the ports.

fn main() -> std::process::ExitCode {
    ts3100_emulator::cli::main()
}
