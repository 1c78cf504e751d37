//! The program `ts3100` as the suites start it: cargo builds the binaries of a package for the tests of that package alone.

fn main() -> std::process::ExitCode {
    ts3100_emulator::cli::main()
}
