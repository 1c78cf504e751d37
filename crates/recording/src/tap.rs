//! A tap between hosts and a real controller: it listens where hosts expect the controller, dials the real one for each
//! host, and forwards bytes both ways unchanged while it records them with their times. It sends nothing of its own.
//!
//! `relay` carries one connection; the transcript formats are in [`crate::transcript`]. `ts3100 diff` replays the result.

mod relay;

use crate::transcript::{
    EndReason, Header, MAX_PEERS, PeerId, Record, RecordKind, Recorder, Side, TAPPED, TranscriptFile,
    without_port,
};
use std::collections::{BTreeMap, BTreeSet};
use std::future::Future;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use tokio::net::{TcpListener, TcpStream};
use tracing::{debug, info, warn};
use ts3100_controller::{Port, Time};
use ts3100_driver::clock::system_calendar;
use ts3100_driver::files::PathError;
use ts3100_driver::tcp::{ChannelError, bind};
use ts3100_proto::escape::Escaped;

/// Most hosts at once on one channel; the controller may serve fewer.
pub const MAX_HOSTS: usize = 16;
/// Pause after an accept that failed, so that the log stays readable.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// A channel to tap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Route {
    /// Channel.
    pub port: Port,
    /// Address that hosts connect to; port 0 selects a free port.
    pub listen: SocketAddr,
    /// Address of the real controller.
    pub controller: SocketAddr,
}

/// Settings of a tap.
#[derive(Debug, Clone)]
pub struct TapSettings {
    /// Channels to tap.
    pub routes: Vec<Route>,
    /// Transcript files; if empty, text on stdout.
    pub transcripts: Vec<TranscriptFile>,
    /// Timeout of a connection to the real controller.
    pub connect_timeout: Duration,
}

/// Why a tap cannot start.
#[derive(Debug, thiserror::Error)]
pub enum TapError {
    /// A port cannot be opened.
    #[error(transparent)]
    Channel(#[from] ChannelError),
    /// A transcript cannot be created.
    #[error(transparent)]
    Recorder(#[from] PathError),
}

/// A tap with open ports.
pub struct Tap {
    listeners: Vec<(Route, TcpListener)>,
    ports: BTreeMap<Port, u16>,
    log: TapLog,
    connect_timeout: Duration,
}

impl Tap {
    /// Binds all ports and creates the transcripts.
    ///
    /// # Errors
    /// See [`TapError`]; nothing is left open.
    pub fn open(settings: &TapSettings) -> Result<Tap, TapError> {
        let mut listeners = Vec::new();
        let mut ports = BTreeMap::new();
        for route in &settings.routes {
            let (listener, port) = bind(route.port, route.listen)?;
            ports.insert(route.port, port);
            listeners.push((*route, listener));
        }
        let routes = settings.routes.iter();
        let controllers: BTreeSet<IpAddr> = routes.map(|route| route.controller.ip()).collect();
        let controllers: Vec<String> = controllers.iter().map(ToString::to_string).collect();
        let header = Header {
            origin: format!(
                "{TAPPED}{} in front of {}",
                env!("CARGO_PKG_VERSION"),
                controllers.join(" ")
            ),
            calendar: Some(system_calendar()),
            ..Header::default()
        };
        let base = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let recorder = if settings.transcripts.is_empty() {
            Recorder::on_stdout(&header)?
        } else {
            Recorder::create(&settings.transcripts, &header, base)?
        };
        Ok(Tap {
            listeners,
            ports,
            log: TapLog(Arc::new(Mutex::new(TapState {
                recorder,
                started: Instant::now(),
                last: Time::ZERO,
                peers: BTreeSet::new(),
            }))),
            connect_timeout: settings.connect_timeout,
        })
    }

    /// TCP port of each tapped channel.
    pub fn ports(&self) -> &BTreeMap<Port, u16> {
        &self.ports
    }

    /// Forwards until `stop` completes, then closes every connection.
    pub async fn run(self, stop: impl Future<Output = ()>) {
        let mut tasks = Vec::new();
        for (route, listener) in self.listeners {
            let accepting = accept(route, listener, self.log.clone(), self.connect_timeout);
            tasks.push(tokio::spawn(accepting));
        }
        stop.await;
        for task in tasks {
            task.abort();
        }
    }
}

async fn accept(route: Route, listener: TcpListener, log: TapLog, connect_timeout: Duration) {
    let port = route.port;
    let mut hosts = tokio::task::JoinSet::new();
    loop {
        // Remove finished tasks.
        while hosts.try_join_next().is_some() {}
        let (stream, peer) = match listener.accept().await {
            Ok(accepted) => accepted,
            Err(error) => {
                warn!(port = port.name(), "{port}: cannot accept a connection: {error}");
                tokio::time::sleep(ACCEPT_PAUSE).await;
                continue;
            }
        };
        let room = hosts.len() < MAX_HOSTS;
        let Some(line) = room.then(|| log.add_peer(port)).flatten() else {
            warn!(
                port = port.name(),
                "{port}: refused {peer}: {MAX_HOSTS} hosts are connected already"
            );
            relay::reset(&stream);
            continue;
        };
        hosts.spawn(carry(route, line, (stream, peer), log.clone(), connect_timeout));
    }
}

/// Serves one host until its connection ends.
async fn carry(
    route: Route,
    line: PeerId,
    (host, peer): (TcpStream, SocketAddr),
    log: TapLog,
    limit: Duration,
) {
    let controller = route.controller;
    info!(event = "tap-connect", %line, "{line}: {peer} connected, dialling {controller}");
    log.record(RecordKind::Connected {
        line,
        peer: without_port(&peer.to_string()),
    });
    match tokio::time::timeout(limit, TcpStream::connect(controller)).await {
        Ok(Ok(robot)) => relay::relay(line, &host, &robot, &log).await,
        failed => {
            let reason = match failed {
                Ok(Err(error)) => error.to_string(),
                _ => format!("no answer within {limit:?}"),
            };
            warn!(event = "tap-refused", %line, "{line}: cannot reach {controller}: {reason}; resetting {peer}");
            log.ended(line, Side::Robot, EndReason::Refused);
            relay::reset(&host);
        }
    }
    log.remove_peer(line);
}

/// The transcripts of a tap and its connected hosts, shared by all tasks.
#[derive(Clone)]
struct TapLog(Arc<Mutex<TapState>>);

struct TapState {
    recorder: Recorder,
    started: Instant,
    /// Time of the last record; record times never decrease.
    last: Time,
    peers: BTreeSet<PeerId>,
}

impl TapLog {
    /// A panic in another task cannot leave the state inconsistent, so a poisoned lock is usable.
    fn state(&self) -> MutexGuard<'_, TapState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Registers a host under the lowest free number of the channel.
    fn add_peer(&self, port: Port) -> Option<PeerId> {
        let mut state = self.state();
        let line = (1..=MAX_PEERS)
            .map(|peer| PeerId { port, peer })
            .find(|line| !state.peers.contains(line))?;
        state.peers.insert(line);
        Some(line)
    }

    fn remove_peer(&self, line: PeerId) {
        self.state().peers.remove(&line);
    }

    fn ended(&self, line: PeerId, by: Side, how: EndReason) {
        self.record(RecordKind::Ended { line, by, how });
    }

    /// Writes a record; it is in the file when this returns.
    fn record(&self, what: RecordKind) {
        if let RecordKind::FromHost { line, bytes } = &what {
            debug!(event = "tap", %line, "{line} < {}", Escaped::for_reading(bytes));
        } else if let RecordKind::FromRobot { line, bytes } = &what {
            debug!(event = "tap", %line, "{line} > {}", Escaped::for_reading(bytes));
        }
        let mut state = self.state();
        let micros = u64::try_from(state.started.elapsed().as_micros()).unwrap_or(u64::MAX);
        let at = Time::from_micros(micros).max(state.last);
        state.last = at;
        state.recorder.record(&Record { at, kind: what });
        state.recorder.flush();
    }
}

#[cfg(test)]
mod tests;
