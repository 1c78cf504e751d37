//! From the inputs and outputs of a controller to the records of a transcript: what the hub of an emulator writes
//! down. No sockets here, so embedded, stepped and replayed controllers give the same.

use super::{Edge, Ending, Header, Kept, Line, Party, Record, Recorder, RecorderError, What, without_port};
use crate::config::Settings;
use crate::loading::Powered;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;
use ts3100_controller::options::{Config, Dialect};
use ts3100_controller::output::Cut;
use ts3100_controller::{Controller, Deed, Event, Input, Output, Port, Time};
use ts3100_proto::calendar::CalendarTime;

/// Turns inputs and outputs into what happened on the lines.
#[derive(Debug, Clone, Default)]
pub struct Observer {
    /// Ports with a peer: to others nothing is sent, whatever the controller puts out.
    connected: BTreeSet<Port>,
    /// Connections that are being reset on purpose.
    reset: BTreeSet<Port>,
}

impl Observer {
    /// An input of the controller; `by` is who has caused it.
    pub fn input(&mut self, input: &Input, by: Party) -> Option<What> {
        match input {
            // What was not kept is told by whoever was to keep it.
            Input::Tick | Input::Kept(_) => None,
            Input::Line { port, host } => Some(What::Edge(Edge::Settings {
                port: *port,
                host: *host,
            })),
            Input::LineFaults { port, bytes } => Some(What::Edge(Edge::Garbled {
                port: *port,
                bytes: bytes.clone(),
            })),
            Input::LinePurged { port } => Some(What::Edge(Edge::Purged { port: *port })),
            Input::SecondPeer { port, peer, kept } => Some(What::Edge(Edge::Second {
                port: *port,
                peer: without_port(peer),
                kept: *kept,
            })),
            Input::Unread { port } => Some(What::Edge(Edge::Unread { port: *port })),
            Input::Connected { port, peer } => {
                self.connected.insert(*port);
                Some(What::Connected {
                    line: Line::first(*port),
                    peer: without_port(peer),
                })
            }
            Input::Received { port, bytes } => Some(What::FromHost {
                line: Line::first(*port),
                bytes: bytes.clone(),
            }),
            Input::Disconnected { port } => {
                self.connected.remove(port);
                Some(What::Ended {
                    line: Line::first(*port),
                    by,
                    how: match self.reset.remove(port) {
                        true => Ending::Reset,
                        false => Ending::Closed,
                    },
                })
            }
            Input::Panel(panel) => Some(What::Deed(Deed::Panel(panel.clone()))),
            Input::Deed(deed) => Some(What::Deed(deed.clone())),
        }
    }

    /// An output of the controller, if a peer sees it or it says why a peer sees what it sees.
    pub fn output(&mut self, output: &Output) -> Option<What> {
        match output {
            Output::Send { port, bytes } if self.connected.contains(port) => Some(What::FromRobot {
                line: Line::first(*port),
                bytes: bytes.clone(),
            }),
            Output::Cut {
                port,
                how: Cut::Reset,
            } => {
                self.reset.insert(*port);
                None
            }
            Output::Event(Event::Fault {
                id,
                kind,
                port,
                message,
                fired: true,
            }) => {
                let place = port.map(|port| format!("{port}: ")).unwrap_or_default();
                Some(What::Remark(format!("{place}fault {id} {kind}: {message}")))
            }
            _ => None,
        }
    }
}

/// The date and time of a header: that of a fresh controller is not said.
fn shown(calendar: CalendarTime) -> Option<CalendarTime> {
    Some(calendar).filter(|calendar| *calendar != Config::new(Dialect::default()).calendar)
}

/// The transcripts of a running controller.
#[derive(Default)]
pub struct Tape {
    recorder: Recorder,
    /// What the control interface shows.
    kept: Option<Arc<Kept>>,
    observer: Observer,
}

impl Tape {
    /// Begins the transcripts that the settings ask for.
    ///
    /// # Errors
    /// The first file that cannot be written.
    pub fn begin(settings: &Settings, powered: &Powered) -> Result<Tape, RecorderError> {
        let calendar = settings.controller.calendar;
        let header = Header {
            origin: format!("observed, ts3100 serve {}", env!("CARGO_PKG_VERSION")),
            calendar: shown(calendar),
            flags: settings.flags.clone(),
            files: powered.files.clone(),
            select: settings.select.clone(),
        };
        let recorder = Recorder::begin(&settings.transcripts, &header, Duration::ZERO)?;
        let mut tape = Tape {
            recorder,
            kept: settings.control.as_ref().map(|_| Arc::new(Kept::new(header))),
            observer: Observer::default(),
        };
        if powered.restored {
            tape.restored(Time::ZERO, &powered.controller);
        }
        Ok(tape)
    }

    /// The state of this controller is about to take the present one's place.
    pub fn restored(&mut self, at: Time, controller: &Controller) {
        if self.recorder.is_on() {
            let what = What::Edge(Edge::restored(controller));
            self.recorder.record(&Record { at, what });
        }
        if let Some(kept) = &self.kept {
            kept.restored(at, controller);
        }
    }

    /// Everything is about to be as at the start: files go on, what is kept begins anew. `calendar` is the date then,
    /// where it is the wall's.
    pub fn reset(&mut self, at: Time, calendar: Option<CalendarTime>) {
        let what = What::Edge(Edge::Reset { calendar });
        self.recorder.record(&Record { at, what });
        if let Some(kept) = &self.kept {
            kept.begin_anew(calendar);
        }
    }

    /// The edge does something to the controller.
    pub fn edge(&mut self, at: Time, edge: Edge) {
        self.record(at, Some(What::Edge(edge)));
    }

    /// The records that are kept in memory.
    #[must_use]
    pub fn kept(&self) -> Arc<Kept> {
        self.kept.clone().unwrap_or_default()
    }

    fn is_on(&self) -> bool {
        self.recorder.is_on() || self.kept.is_some()
    }

    /// An input is about to be handled.
    pub fn input(&mut self, at: Time, input: &Input, by: Party) {
        if self.is_on() {
            let what = self.observer.input(input, by);
            self.record(at, what);
        }
    }

    /// An output is about to be carried out.
    pub fn output(&mut self, at: Time, output: &Output) {
        if self.is_on() {
            let what = self.observer.output(output);
            self.record(at, what);
        }
    }

    /// All of it leaves the process.
    pub fn flush(&mut self) {
        self.recorder.flush();
    }

    fn record(&mut self, at: Time, what: Option<What>) {
        if let Some(what) = what {
            let record = Record { at, what };
            self.recorder.record(&record);
            if let Some(kept) = &self.kept {
                kept.put(record);
            }
        }
    }
}
