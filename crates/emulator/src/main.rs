//! The binary `ts3100`; everything is in the library.

fn main() -> std::process::ExitCode {
    ts3100_emulator::cli::main()
}
