//! `ts3100 tap`: turns the flags into routes and runs a [`Tap`] until a signal.
//!
//! The relay between hosts and the real controller, and the recording, are in [`ts3100_recording::tap`].

use super::serve::stop_signal;
use crate::config::args::{self, FIRST_PORT, LogFormat, PortSource, seconds};
use crate::embed::single_threaded;
use crate::log;
use crate::ready;
use anyhow::{Context as _, anyhow, bail};
use clap::Args;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, ToSocketAddrs};
use std::num::NonZeroU16;
use std::str::FromStr;
use std::time::Duration;
use tracing::info;
use ts3100_controller::Port;
use ts3100_proto::words::UnexpectedWord;
use ts3100_recording::tap::{Route, Tap, TapSettings};
use ts3100_recording::transcript::TranscriptFile;

/// Record the traffic between hosts and a real controller.
///
/// Connect your host to the tap instead of the controller. The tap connects to the controller, passes on every byte, and
/// records both directions with their times. It sends nothing itself, and closes and resets connections as the two sides
/// do. `ts3100 diff` compares the recording with the emulator.
///
/// Exit codes: 0 ended by a signal; 2 cannot start.
#[derive(Debug, Args)]
pub(super) struct TapArgs {
    /// The real controller: NAME or NAME:PORT, where PORT is that of IP0 [default port: 1000]; the other channels follow
    #[arg(value_name = "REAL_ADDR")]
    real: String,
    /// Write the recording: .txt, .jsonl, or .pcapng for Wireshark (repeatable) [default: text on stdout]
    #[arg(long, value_name = "FILE", action = clap::ArgAction::Append)]
    transcript: Vec<TranscriptFile>,
    /// Listen on this address or host name of this computer, for example localhost
    #[arg(long, value_name = "ADDR", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST), value_parser = args::listen_address)]
    listen: IpAddr,
    /// Add N to 1000-1003 for the ports of the tap
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = args::whole(0, u16::MAX))]
    port_offset: u16,
    /// Ports of the tap: 1000-1003 plus the offset, or free ones chosen by the system
    #[arg(long, value_name = "WORD", default_value = "parameter")]
    ports: PortSource,
    /// Channels to record; ip1=2001 if the controller uses another port for IP1
    #[arg(
        long,
        value_name = "CHANNEL[=PORT]",
        value_delimiter = ',',
        default_value = "ip0,ip1,ip2,ip3"
    )]
    channels: Vec<ChannelArg>,
    /// Longest wait for a connection to the controller
    #[arg(long, value_name = "TIME", default_value = "10s", value_parser = seconds("1us", "1440min"))]
    connect_timeout: Duration,
    /// Print one line of JSON on stdout when every port accepts connections; needs --transcript
    #[arg(long, requires = "transcript")]
    ready_json: bool,
    /// Log every byte
    #[arg(long, short, action = clap::ArgAction::Count)]
    verbose: u8,
    /// Format of the log on stderr
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    log_format: LogFormat,
}

/// A channel and its port at the real controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ChannelArg {
    port: Port,
    offset: u16,
    /// If it was given.
    real_port: Option<NonZeroU16>,
}

impl FromStr for ChannelArg {
    type Err = UnexpectedWord;

    fn from_str(word: &str) -> Result<ChannelArg, UnexpectedWord> {
        let (name, number) = word
            .split_once('=')
            .map_or((word, None), |(name, number)| (name, Some(number)));
        let channels = (0_u16..).zip(Port::ETHERNET);
        let mut known = channels.filter(|(_, port)| port.name().eq_ignore_ascii_case(name));
        let (offset, port) = known
            .next()
            .ok_or_else(|| UnexpectedWord::new("ip0, ip1, ip2 or ip3", name))?;
        let wrong = |number| move |_| UnexpectedWord::new("a port from 1 to 65535", number);
        let real_port = number.map(|number| number.parse().map_err(wrong(number)));
        Ok(ChannelArg {
            port,
            offset,
            real_port: real_port.transpose()?,
        })
    }
}

/// Address of the real controller and port of its IP0.
pub(super) fn real_address(text: &str) -> anyhow::Result<SocketAddr> {
    let has_port = text.contains(':') && text.parse::<IpAddr>().is_err();
    let found = if has_port {
        text.to_socket_addrs()
    } else {
        (text, FIRST_PORT).to_socket_addrs()
    };
    found
        .with_context(|| format!("{text}: expected NAME, ADDRESS, NAME:PORT or ADDRESS:PORT"))?
        .next()
        .ok_or_else(|| anyhow!("{text}: no address found"))
}

fn settings(args: &TapArgs) -> anyhow::Result<TapSettings> {
    let real = real_address(&args.real)?;
    let mut routes: Vec<Route> = Vec::new();
    for channel in &args.channels {
        let own = match args.ports {
            PortSource::Auto => 0,
            PortSource::Parameter => (FIRST_PORT + channel.offset)
                .checked_add(args.port_offset)
                .ok_or_else(|| anyhow!("--port-offset {}: the ports exceed 65535", args.port_offset))?,
        };
        if routes.iter().any(|route| route.port == channel.port) {
            bail!("--channels: {} is given twice", channel.port);
        }
        let next = || real.port().checked_add(channel.offset);
        let port = channel.real_port.map(NonZeroU16::get).or_else(next);
        let port =
            port.with_context(|| format!("{}: the port of {} exceeds 65535", args.real, channel.port))?;
        let route = Route {
            port: channel.port,
            listen: SocketAddr::new(args.listen, own),
            controller: SocketAddr::new(real.ip(), port),
        };
        if own != 0 && route.listen == route.controller {
            bail!(
                "{}: the tap would dial itself at {}; give --port-offset or --listen",
                channel.port,
                route.controller
            );
        }
        routes.push(route);
    }
    Ok(TapSettings {
        routes,
        transcripts: args.transcript.clone(),
        connect_timeout: args.connect_timeout,
    })
}

/// Runs until a signal.
pub(super) fn run(args: &TapArgs) -> anyhow::Result<u8> {
    log::start(args.verbose, args.log_format);
    let settings = settings(args)?;
    single_threaded()?.block_on(async {
        // Before the ready line: a signal that follows it must not find the default action.
        let stop = stop_signal().context("cannot listen for signals")?;
        let tap = Tap::open(&settings)?;
        for route in &settings.routes {
            let port = tap.ports().get(&route.port).copied().unwrap_or_default();
            info!(
                "{}: {}:{port} leads to {}",
                route.port,
                route.listen.ip(),
                route.controller
            );
        }
        if args.ready_json {
            let line = ready::ports_line(tap.ports());
            ready::print_line(&line).context("cannot write to stdout")?;
        }
        tap.run(stop).await;
        info!("ended");
        Ok(0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct TapCommandLine {
        #[command(flatten)]
        args: TapArgs,
    }

    fn routes(words: &str) -> Result<Vec<(Port, u16, u16)>, String> {
        let words = ["tap", "--transcript", "x.txt"]
            .into_iter()
            .chain(words.split_whitespace());
        let line = TapCommandLine::try_parse_from(words).map_err(|error| error.to_string())?;
        let settings = settings(&line.args).map_err(|error| error.to_string())?;
        let route = |route: &Route| (route.port, route.listen.port(), route.controller.port());
        Ok(settings.routes.iter().map(route).collect())
    }

    #[test]
    fn all_channels_at_the_ports_of_the_controller_are_tapped_unless_said_otherwise() {
        assert_eq!(
            routes("192.0.2.1").unwrap(),
            [
                (Port::Ip0, 1_000, 1_000),
                (Port::Ip1, 1_001, 1_001),
                (Port::Ip2, 1_002, 1_002),
                (Port::Ip3, 1_003, 1_003),
            ]
        );
        assert_eq!(
            routes("127.0.0.1 --port-offset 10000 --channels ip1,IP0=4000").unwrap(),
            [(Port::Ip1, 11_001, 1_001), (Port::Ip0, 11_000, 4_000)]
        );
        assert_eq!(
            routes("127.0.0.1 --ports auto --channels ip3").unwrap(),
            [(Port::Ip3, 0, 1_003)]
        );
    }

    #[test]
    fn what_cannot_be_tapped_is_refused() {
        for (words, expected) in [
            ("127.0.0.1", "dial itself"),
            ("192.0.2.1 --channels ip4", "ip0, ip1, ip2 or ip3"),
            ("192.0.2.1 --channels ip0=0", "a port from 1"),
            ("192.0.2.1 --channels ip0,ip0=5", "twice"),
            ("192.0.2.1 --port-offset 65000", "exceed"),
            (
                "192.0.2.1 --connect-timeout 0",
                "a duration from 1 microsecond to 24 h",
            ),
            ("192.0.2.1:x", "NAME:PORT"),
            ("192.0.2.1:65535", "exceeds"),
        ] {
            let error = routes(words).unwrap_err();
            assert!(error.contains(expected), "{words}: {error}");
        }
    }
}
