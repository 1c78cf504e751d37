//! The environment variables that `exec` sets for its command, and those of `ctl` and of the clients. They set nothing: a `serve` or
//! `exec` inside the command neither reads them nor warns about them.

use ts3100_control::URL_VARIABLE;
use ts3100_controller::port::Port;

/// The address of the robot.
pub const HOST: &str = "TS3100_HOST";
/// URL of the control interface, which `ctl` reads.
pub const CONTROL_URL: &str = URL_VARIABLE;

/// The robot that `ctl` calls, where several run in one process; `exec` runs one and removes the variable.
pub const ROBOT: &str = "TS3100_ROBOT";

/// Read by the clients of the languages: the program and the image that they start.
const OF_CLIENTS: [&str; 2] = ["TS3100_BINARY", "TS3100_IMAGE"];

/// Address and port of an Ethernet channel, `ADDRESS:PORT`.
pub fn channel(port: Port) -> String {
    format!("TS3100_{}", port.name())
}

/// The port of an Ethernet channel alone.
pub fn channel_port(port: Port) -> String {
    format!("TS3100_{}_PORT", port.name())
}

/// Variable with the place of a serial port: a pseudo terminal, a device, an address.
pub fn serial_line(port: Port) -> String {
    format!("TS3100_SERIAL_{}_LINE", port.name())
}

/// Whether this variable is for others than `serve`.
pub fn is_exported(name: &str) -> bool {
    let is_channel = |port| name == channel(port) || name == channel_port(port);
    [HOST, CONTROL_URL, ROBOT].contains(&name)
        || OF_CLIENTS.contains(&name)
        || Port::ETHERNET.into_iter().any(is_channel)
        || Port::SERIAL.into_iter().any(|port| name == serial_line(port))
}
