//! Many robots in one process: starts them, finds them for the control interface, and ends them.
//!
//! Up to [`OWN_SOCKETS`] robots start together, each with sockets of its own. More of them, each at an address of its
//! own, share their listening sockets, and a robot starts at its first connection or call: what nobody uses costs
//! nothing. The configuration is [`crate::config::fleet`]; robots joined by wires are driven by
//! [`ts3100_driver::driver::wired`].

use super::ending::Ending;
use crate::config::fleet::FleetConfig;
use crate::config::{Ports, Settings};
use crate::launch::{Launched, Surroundings};
use anyhow::Context as _;
use std::collections::{BTreeMap, BTreeSet};
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tracing::{Instrument as _, Span, error, error_span};
use ts3100_control::DriverHandle;
use ts3100_control::robots::{CannotStart, RobotInfo, Robots, WireInfo};
use ts3100_controller::{Controller, Port};
use ts3100_driver::driver::self_check::connectable;
use ts3100_driver::driver::wired::{Wire, WireEnd, WireHandle, Wired};
use ts3100_driver::snapshot;
use ts3100_driver::tcp::SharedPorts;

/// Most robots with listening sockets of their own, if each is at an address of its own.
pub const OWN_SOCKETS: usize = 256;
/// The ports of a controller as delivered (ETH-05).
const DELIVERED_PORTS: [u16; 4] = [1_000, 1_001, 1_002, 1_003];
/// Files that the process needs besides those of its robots.
#[cfg(unix)]
const OTHER_FILES: u64 = 128;

/// A robot that has started.
struct Running {
    handle: Option<DriverHandle>,
    info: RobotInfo,
}

/// What is left of robots when their task ends: number, final state and exit code of each, or what cannot be written.
type Ended = Vec<(usize, Controller, anyhow::Result<u8>)>;

/// The robots of this process.
pub struct Fleet {
    config: FleetConfig,
    surroundings: Surroundings,
    /// The name of the only robot.
    only: Option<String>,
    /// Why one could not start is remembered: it would be the same the next time.
    slots: Vec<OnceLock<Result<Running, CannotStart>>>,
    tasks: Mutex<Vec<JoinHandle<Ended>>>,
    wires: OnceLock<WireHandle>,
    stop: watch::Sender<bool>,
}

impl Fleet {
    /// Opens what all share, and starts the robots that are to run from the beginning; to be called in a runtime.
    ///
    /// # Errors
    /// A robot that cannot start, or sockets that cannot be opened.
    pub fn open(config: FleetConfig) -> anyhow::Result<Arc<Fleet>> {
        let count = config.count();
        let first = config.settings(0).with_context(|| config.name(0))?;
        if config.has_own_addresses() {
            check_addresses((0..count).filter_map(|index| config.args(index).network.listen))?;
        }
        let shared = match first.ports {
            Ports::Offset(offset) if config.has_own_addresses() && count > OWN_SOCKETS => {
                let numbers = DELIVERED_PORTS.map(|port| port.saturating_add(offset));
                Some(SharedPorts::open(
                    first.listen,
                    Port::ETHERNET.into_iter().zip(numbers),
                )?)
            }
            Ports::Offset(_) | Ports::Auto => None,
        };
        let works_alone = first.scenario.is_some() || !first.serial.is_empty();
        let starts_all = shared.is_none() || works_alone;
        raise_file_limit(if starts_all { count } else { 0 }, first.ports)?;
        if let Some(path) = config.restored_for_all() {
            let names: Vec<String> = (0..count).map(|index| config.name(index)).collect();
            snapshot::cell::read(path, &names)?;
        }
        let fleet = Arc::new(Fleet {
            surroundings: Surroundings {
                shared: shared.clone(),
                robots: count,
            },
            slots: std::iter::repeat_with(OnceLock::new).take(count).collect(),
            tasks: Mutex::default(),
            wires: OnceLock::new(),
            stop: watch::Sender::new(false),
            only: (count == 1).then(|| config.name(0)),
            config,
        });
        fleet.start_wired()?;
        if starts_all {
            for index in 0..count {
                if let Some(Err(reason)) = fleet.start_index(index) {
                    anyhow::bail!("{}: {reason}", fleet.config.name(index));
                }
            }
        }
        if let Some(shared) = shared {
            let fleet = Arc::downgrade(&fleet);
            tokio::spawn(shared.serve(move |address| {
                if let Some(fleet) = fleet.upgrade() {
                    fleet.start_at(address);
                }
            }));
        }
        Ok(fleet)
    }

    /// Starts the robot of an address, if there is one.
    fn start_at(&self, address: IpAddr) {
        if let Some(index) = self.config.index_at(address)
            && let Some(Err(reason)) = self.start_index(index)
        {
            error!("{}: {reason}", self.config.name(index));
        }
    }

    fn start_index(&self, index: usize) -> Option<&Result<Running, CannotStart>> {
        let slot = self.slots.get(index)?;
        Some(slot.get_or_init(|| {
            self.start_alone(index)
                .map_err(|error| CannotStart(format!("{error:#}")))
        }))
    }

    /// Starts a robot without wires.
    fn start_alone(&self, index: usize) -> anyhow::Result<Running> {
        let (launched, ending, running) = self.launch(index)?;
        let stopped = self.stopped();
        let run = async move {
            let controller = launched.driver.run(stopped).await;
            let code = ending.finish(&controller);
            vec![(index, controller, code)]
        };
        self.spawn(run.instrument(self.span(index)));
        Ok(running)
    }

    /// Names the robot in the lines of the log.
    fn span(&self, index: usize) -> Span {
        let name = self.config.name(index);
        error_span!("robot", robot = %name)
    }

    /// Starts the robots that wires join.
    fn start_wired(&self) -> anyhow::Result<()> {
        let ends = self.config.wires.iter().flat_map(|wire| [&wire.from, &wire.to]);
        let numbers: BTreeSet<usize> = ends.filter_map(WireEnd::robot).collect();
        if numbers.is_empty() {
            return Ok(());
        }
        let mut places = BTreeMap::new();
        let (mut drivers, mut endings) = (Vec::new(), Vec::new());
        for index in numbers {
            let launched = self.launch(index).with_context(|| self.config.name(index));
            let (launched, ending, running) = launched?;
            places.insert(index, drivers.len());
            drivers.push((launched.driver, self.span(index)));
            endings.push((index, ending));
            if let Some(slot) = self.slots.get(index) {
                // It is empty: nothing has started yet.
                let _ = slot.set(Ok(running));
            }
        }
        let place = |end: &WireEnd| match end {
            WireEnd::Line { robot, line } => WireEnd::Line {
                robot: places.get(robot).copied().unwrap_or_default(),
                line: *line,
            },
            WireEnd::Outside(name) => WireEnd::Outside(name.clone()),
        };
        let wires = self.config.wires.iter().map(|wire| Wire {
            from: place(&wire.from),
            to: place(&wire.to),
        });
        let (wired, handle) = Wired::new(drivers, wires.collect());
        // It is empty: this is called once.
        let _ = self.wires.set(handle);
        let stopped = self.stopped();
        self.spawn(async move {
            let controllers = wired.run(stopped).await;
            let mut ended = Vec::new();
            for ((index, ending), controller) in endings.into_iter().zip(controllers) {
                let code = ending.finish(&controller);
                ended.push((index, controller, code));
            }
            ended
        });
        Ok(())
    }

    /// Opens the ports of a robot.
    fn launch(&self, index: usize) -> anyhow::Result<(Launched, Ending, Running)> {
        let span = self.span(index);
        let _named = span.enter();
        let settings = self.config.settings(index)?;
        Ending::check(&settings)?;
        let mut launched = Launched::open(&settings, &self.surroundings)?;
        let ending = Ending::begin(&mut launched, &settings);
        let running = Running {
            handle: launched.handle(),
            info: launched.info(self.config.name(index), &settings),
        };
        Ok((launched, ending, running))
    }

    /// Completes when the robots are to end.
    fn stopped(&self) -> impl Future<Output = ()> + Send + use<> {
        let mut stop = self.stop.subscribe();
        async move {
            // An error means that nobody can end it any more.
            let _ = stop.wait_for(|stop| *stop).await;
        }
    }

    fn spawn(&self, run: impl Future<Output = Ended> + Send + 'static) {
        let mut tasks = self.tasks.lock().unwrap_or_else(PoisonError::into_inner);
        tasks.push(tokio::spawn(run));
    }

    /// Ends all robots and writes what was asked for; the worst exit code.
    ///
    /// # Errors
    /// The first that cannot be written; the others are written.
    pub async fn end(&self) -> anyhow::Result<u8> {
        self.stop.send_replace(true);
        let tasks = std::mem::take(&mut *self.tasks.lock().unwrap_or_else(PoisonError::into_inner));
        let (mut worst, mut states) = (Ok(0), BTreeMap::new());
        for task in tasks {
            let ended = match task.await.context("a robot has ended by a panic") {
                Ok(ended) => ended,
                Err(error) => {
                    worst = worst.and(Err(error));
                    continue;
                }
            };
            for (index, controller, code) in ended {
                worst = worst.and_then(|worst: u8| Ok(worst.max(code?)));
                if self.config.snapshot_of_all().is_some() {
                    states.insert(index, controller);
                }
            }
        }
        if let Some(path) = self.config.snapshot_of_all() {
            let states = states.into_iter();
            let states: Vec<_> = states
                .map(|(index, state)| (self.config.name(index), state))
                .collect();
            let written = snapshot::cell::write(path, &states);
            worst = worst.and_then(|worst| written.map(|()| worst).map_err(Into::into));
        }
        worst
    }

    /// The seed of the legal variation, if there is one.
    pub fn vary(&self) -> Option<u64> {
        let settings = Settings::from_args(&self.config.args(0)).ok()?;
        settings.controller.vary
    }

    /// What is known of each robot.
    pub fn infos(&self) -> impl Iterator<Item = RobotInfo> {
        (0..self.slots.len()).map(|index| self.info_of(index))
    }

    fn info_of(&self, index: usize) -> RobotInfo {
        if let Some(Ok(running)) = self.slots.get(index).and_then(OnceLock::get) {
            return running.info.clone();
        }
        let args = self.config.args(index);
        let listen = connectable(args.network.listen.unwrap_or(Settings::LISTEN));
        let offset = match args.tcp_ports() {
            Ports::Offset(offset) => offset,
            Ports::Auto => 0,
        };
        let addresses = DELIVERED_PORTS.map(|port| SocketAddr::new(listen, port.saturating_add(offset)));
        let names = Port::ETHERNET.map(|port| port.name().to_ascii_lowercase());
        RobotInfo {
            name: self.config.name(index),
            ports: names.into_iter().zip(addresses).collect(),
            serial: BTreeMap::new(),
            started: false,
        }
    }
}

impl Robots for Fleet {
    fn names(&self) -> Vec<String> {
        (0..self.slots.len())
            .map(|index| self.config.name(index))
            .collect()
    }

    fn only(&self) -> Option<&str> {
        self.only.as_deref()
    }

    fn info(&self, name: &str) -> Option<RobotInfo> {
        Some(self.info_of(self.config.index(name)?))
    }

    fn start(&self, name: &str) -> Option<Result<DriverHandle, CannotStart>> {
        let started = self.start_index(self.config.index(name)?)?.as_ref();
        let handle = |running: &Running| running.handle.clone().ok_or_else(|| CannotStart(String::new()));
        Some(started.map_err(Clone::clone).and_then(handle))
    }

    fn running(&self, name: &str) -> Option<DriverHandle> {
        let slot = self.slots.get(self.config.index(name)?)?;
        slot.get()?.as_ref().ok()?.handle.clone()
    }

    fn wires(&self) -> Option<Vec<WireInfo>> {
        let levels = self.wires.get()?.levels();
        let name = |end: &WireEnd, side: &str| match end {
            WireEnd::Line { robot, line } => format!("{}.{side}.{line}", self.config.name(*robot)),
            WireEnd::Outside(name) => format!("outside.{name}"),
        };
        let wires = self.config.wires.iter().zip(levels);
        let wires = wires.map(|(wire, on)| WireInfo {
            from: name(&wire.from, "dout"),
            to: name(&wire.to, "din"),
            on,
        });
        Some(wires.collect())
    }

    fn wire_handle(&self) -> Option<&WireHandle> {
        self.wires.get()
    }
}

/// Most addresses that a message names.
const MAX_NAMED: usize = 1_000;

/// Says which addresses the machine does not have, and how it gets them. Linux has all of 127.0.0.0/8.
fn check_addresses(addresses: impl Iterator<Item = IpAddr>) -> anyhow::Result<()> {
    let is_there = |address: &IpAddr| {
        cfg!(target_os = "linux") && address.is_ipv4() && address.is_loopback()
            || std::net::TcpListener::bind((*address, 0)).is_ok()
    };
    let missing: Vec<IpAddr> = addresses
        .filter(|address| !is_there(address))
        .take(MAX_NAMED)
        .collect();
    let Some(first) = missing.first() else {
        return Ok(());
    };
    let add = |address: &IpAddr| match (cfg!(target_os = "macos"), address.is_loopback()) {
        (true, true) => format!("\n  sudo ifconfig lo0 alias {address}"),
        (true, false) => format!("\n  sudo ifconfig en0 alias {address}"),
        (false, _) => format!("\n  sudo ip address add {address} dev eth0"),
    };
    let others = match missing.len() - 1 {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    anyhow::bail!(
        "{first} is not an address of this computer{others}. Add what is missing, or use --port-step 10 or --ports auto:{}",
        missing.iter().map(add).collect::<String>()
    )
}

/// Lets the process open the files that this many robots need, if the system allows.
#[cfg(unix)]
fn raise_file_limit(robots: usize, ports: Ports) -> anyhow::Result<()> {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    // With free ports another socket reserves each of them.
    let each = if ports == Ports::Auto { 8 } else { 4 };
    let needed = OTHER_FILES + robots as u64 * each;
    let limit = getrlimit(Resource::Nofile);
    let Some(now) = limit.current else {
        return Ok(());
    };
    let most = limit.maximum.unwrap_or(u64::MAX);
    if needed > most {
        anyhow::bail!(
            "{robots} robots need {needed} open files, and this process may have {most}.\n\
             Raise the limit (`ulimit -Hn`, LimitNOFILE=, --ulimit nofile=), or give each robot an address of its own \
             (--robots without --ports auto and --port-step): then they share their sockets"
        );
    }
    // As many as allowed: each connection is a file too.
    let raised = Rlimit {
        current: limit.maximum,
        maximum: limit.maximum,
    };
    if now < most {
        // Otherwise the limit stays as it is, and the socket that is one too many says so.
        let _ = setrlimit(Resource::Nofile, raised);
    }
    Ok(())
}

#[cfg(not(unix))]
fn raise_file_limit(_robots: usize, _ports: Ports) -> anyhow::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_that_are_missing_are_counted() {
        let said = |addresses: &[&str]| {
            let addresses = addresses.iter().map(|address| address.parse().unwrap());
            check_addresses(addresses).map_err(|error| error.to_string())
        };
        assert_eq!(said(&["127.0.0.1"]), Ok(()));
        let one = said(&["203.0.113.7"]).unwrap_err();
        assert!(
            one.starts_with("203.0.113.7 is not an address of this computer. Add"),
            "{one}"
        );
        let two = said(&["203.0.113.7", "127.0.0.1", "203.0.113.8"]).unwrap_err();
        assert!(two.contains("of this computer, and 1 more. Add"), "{two}");
    }
}
