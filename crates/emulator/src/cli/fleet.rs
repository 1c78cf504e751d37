//! Many robots in one process: starts them, finds them for the control interface, and ends them.
//!
//! Up to [`OWN_SOCKETS`] robots start together, each with sockets of its own. More of them, each at an address of its
//! own, share their listening sockets, and a robot starts at its first connection or call: an unused one costs nothing.
//! The configuration is [`crate::config::fleet`]; robots joined by wires are one [`ts3100_driver::world::World`], and
//! each other robot is a world of its own.

use super::ending::Ending;
use crate::config::fleet::FleetConfig;
use crate::config::{Ports, Settings};
use crate::launch::{Launched, Surroundings};
use crate::ready::Only;
use anyhow::Context as _;
use std::collections::{BTreeMap, BTreeSet};
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tracing::{Span, error};
use ts3100_control::DriverHandle;
use ts3100_control::robots::{CannotStart, RobotInfo, Robots, Wires};
use ts3100_controller::{Controller, Port};
use ts3100_driver::driver::Driver;
use ts3100_driver::driver::request::Requests;
use ts3100_driver::driver::self_check::connectable;
use ts3100_driver::snapshot;
use ts3100_driver::tcp::SharedPorts;
use ts3100_driver::world::{Wire, WireEnd};

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
    /// The example programs are on its RAM drive.
    has_examples: bool,
}

/// Results of robots whose task has ended: number, final state and exit code of each, or the file that cannot be
/// written.
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
            check_addresses((0..count).filter_map(|index| config.network(index).listen))?;
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
            snapshot::read_named(path, &names)?;
        }
        let fleet = Arc::new(Fleet {
            surroundings: Surroundings {
                shared: shared.clone(),
                robots: count,
            },
            slots: std::iter::repeat_with(OnceLock::new).take(count).collect(),
            tasks: Mutex::default(),
            stop: watch::Sender::new(false),
            only: (count == 1).then(|| config.name(0)),
            config,
        });
        fleet.start_wired()?;
        if starts_all {
            for index in 0..count {
                match fleet.start_index(index) {
                    Some(Err(reason)) if fleet.config.is_list() => {
                        anyhow::bail!("{}: {reason}", fleet.config.name(index))
                    }
                    Some(Err(reason)) => anyhow::bail!("{reason}"),
                    Some(Ok(_)) | None => {}
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
            let started = self
                .start_world(&[index])
                .map_err(|error| CannotStart(format!("{error:#}")))?;
            started
                .into_iter()
                .next()
                .ok_or_else(|| CannotStart(String::new()))
        }))
    }

    /// Starts the robots that wires join: they are one world.
    fn start_wired(&self) -> anyhow::Result<()> {
        let ends = self.config.wires.iter().flat_map(|wire| [&wire.from, &wire.to]);
        let group: BTreeSet<usize> = ends.filter_map(WireEnd::robot).collect();
        if group.is_empty() {
            return Ok(());
        }
        let group: Vec<usize> = group.into_iter().collect();
        for (index, running) in group.iter().zip(self.start_world(&group)?) {
            if let Some(slot) = self.slots.get(*index) {
                // It is empty: nothing has started yet.
                let _ = slot.set(Ok(running));
            }
        }
        Ok(())
    }

    /// Starts the robots of one world, by their places in the configuration.
    fn start_world(&self, group: &[usize]) -> anyhow::Result<Vec<Running>> {
        let first = group.first().copied().unwrap_or_default();
        let Settings { time, time_gap, .. } = *self.config.settings(first)?;
        let (mut driver, requests) = Driver::new(time, time_gap);
        let (mut started, mut endings) = (Vec::new(), Vec::new());
        for &index in group {
            let launched = self.launch(index, &mut driver, &requests);
            let (ending, running) = match group.len() {
                1 => launched?,
                _ => launched.with_context(|| self.config.name(index))?,
            };
            endings.push((index, ending));
            started.push(running);
        }
        // None of the wires ends at a robot that is a world of its own.
        let place = |end: &WireEnd| {
            Some(match end {
                WireEnd::Line { robot, line } => WireEnd::Line {
                    robot: group.iter().position(|index| index == robot)?,
                    line: *line,
                },
                WireEnd::Outside(name) => WireEnd::Outside(name.clone()),
            })
        };
        let wires = self.config.wires.iter().filter_map(|wire| {
            Some(Wire {
                from: place(&wire.from)?,
                to: place(&wire.to)?,
                name: wire.name.clone(),
            })
        });
        driver.join(wires.collect());
        let stopped = self.stopped();
        let spans: Vec<Span> = group.iter().map(|index| self.config.span(*index)).collect();
        self.spawn(async move {
            let controllers = driver.run(stopped).await;
            let ended = endings.into_iter().zip(spans).zip(controllers);
            let ended = ended.map(|(((index, ending), span), controller)| {
                let code = span.in_scope(|| ending.finish(&controller));
                (index, controller, code)
            });
            ended.collect()
        });
        Ok(started)
    }

    /// Opens the ports of a robot.
    fn launch(
        &self,
        index: usize,
        driver: &mut Driver,
        requests: &Requests,
    ) -> anyhow::Result<(Ending, Running)> {
        let settings = self.config.settings(index)?;
        let span = self.config.span(index);
        let _named = span.enter();
        Ending::check(settings)?;
        let launched = Launched::add(driver, requests, settings, &self.surroundings, span.clone())?;
        let ending = Ending::begin(driver, &launched, settings);
        let running = Running {
            handle: launched.handle(),
            info: launched.info(driver, self.config.name(index), settings),
            has_examples: launched.has_examples,
        };
        Ok((ending, running))
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
            let ended = match task.await.context("the task of a robot panicked") {
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
            let written = snapshot::write(path, snapshot::States::Named(&states));
            worst = worst.and_then(|worst| written.map(|()| worst).map_err(Into::into));
        }
        worst
    }

    /// The seed of the legal variation, if there is one.
    pub fn vary(&self) -> Option<u64> {
        self.config.settings(0).ok()?.controller.vary
    }

    /// The robot that is not one of a list.
    pub fn only_one(&self) -> Option<Only<'_>> {
        let settings = self.config.only()?;
        let running = self.slots.first()?.get()?.as_ref().ok()?;
        Some(Only {
            settings,
            has_examples: running.has_examples,
        })
    }

    /// Description of each robot.
    pub fn infos(&self) -> impl Iterator<Item = RobotInfo> {
        (0..self.slots.len()).map(|index| self.info_of(index))
    }

    fn info_of(&self, index: usize) -> RobotInfo {
        if let Some(Ok(running)) = self.slots.get(index).and_then(OnceLock::get) {
            return running.info.clone();
        }
        let network = self.config.network(index);
        let listen = connectable(network.listen.unwrap_or(Settings::LISTEN));
        let offset = match network.tcp_ports() {
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

    fn wires(&self) -> Option<Wires> {
        let joined = self.config.wires.iter().flat_map(|wire| [&wire.from, &wire.to]);
        let first = joined.filter_map(WireEnd::robot).next()?;
        let name = |end: &WireEnd, side: &str| match end {
            WireEnd::Line { robot, line } => format!("{}.{side}.{line}", self.config.name(*robot)),
            WireEnd::Outside(name) => format!("outside.{name}"),
        };
        let wires = self.config.wires.iter();
        let ends = wires.map(|wire| (name(&wire.from, "dout"), name(&wire.to, "din")));
        Some(Wires {
            ends: ends.collect(),
            handle: self.running(&self.config.name(first))?,
        })
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
    if robots <= 1 {
        return Ok(());
    }
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
