//! Turns inputs and outputs of a controller into records and passes them to the files and to the buffer in memory. It uses
//! no sockets, so embedded, stepped and replayed controllers give the same transcript.

use super::{
    EndReason, Header, LinkRecord, PeerId, Record, RecordKind, Recorder, Side, TranscriptBuffer,
    TranscriptFile, without_port,
};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;
use ts3100_controller::output::DisconnectMode;
use ts3100_controller::{Config, Controller, Dialect, Event, Input, Output, Port, Time};
use ts3100_driver::files::PathError;
use ts3100_driver::seat::{Notice, Subscriber};
use ts3100_proto::calendar::CalendarTime;

/// Turns inputs and outputs into records.
#[derive(Debug, Clone, Default)]
pub struct Observer {
    /// Ports with a peer; output to other ports is not recorded, because it has no receiver, and input of other ports
    /// is injected.
    connected: BTreeSet<Port>,
    /// Connections that a fault is resetting.
    reset: BTreeSet<Port>,
}

impl Observer {
    /// The record of an input; `by` is the side that caused it.
    pub fn input(&mut self, input: &Input, by: Side) -> Option<RecordKind> {
        Some(match input.clone() {
            // The driver records a failed save itself, and a recording of one robot has no wires.
            Input::Tick | Input::Persisted(_) | Input::WireLoop { .. } => return None,
            Input::SerialOpened { port, host } => RecordKind::Link(LinkRecord::Settings { port, host }),
            Input::SerialErrors { port, bytes } => RecordKind::Link(LinkRecord::SerialErrors { port, bytes }),
            Input::SerialPurged { port } => RecordKind::Link(LinkRecord::Purged { port }),
            Input::SecondPeer { port, peer, kept } => RecordKind::Link(LinkRecord::SecondPeer {
                port,
                peer: without_port(&peer),
                replaces: kept,
            }),
            Input::Backlogged { port } => RecordKind::Link(LinkRecord::Backlogged { port }),
            Input::Connected { port, peer } => {
                self.connected.insert(port);
                RecordKind::Connected {
                    line: PeerId::first(port),
                    peer: without_port(&peer),
                }
            }
            Input::Received { port, bytes } if !self.connected.contains(&port) => {
                RecordKind::Link(LinkRecord::Injected { port, bytes })
            }
            Input::Received { port, bytes } => RecordKind::FromHost {
                line: PeerId::first(port),
                bytes,
            },
            Input::Disconnected { port } => {
                self.connected.remove(&port);
                RecordKind::Ended {
                    line: PeerId::first(port),
                    by,
                    how: match self.reset.remove(&port) {
                        true => EndReason::Reset,
                        false => EndReason::Closed,
                    },
                }
            }
            Input::Action { action, .. } => RecordKind::Action(action),
        })
    }

    /// The record of an output that a peer sees, or that explains what a peer sees (a fault).
    pub fn output(&mut self, output: &Output) -> Option<RecordKind> {
        if let Output::Send { port, bytes } = output {
            let (line, bytes) = (PeerId::first(*port), bytes.clone());
            return self
                .connected
                .contains(port)
                .then_some(RecordKind::FromRobot { line, bytes });
        }
        if let Output::Disconnect { port, how } = output
            && *how == DisconnectMode::Reset
        {
            self.reset.insert(*port);
        }
        let Output::Event(Event::Fault {
            id,
            kind,
            port,
            message,
            fired: true,
        }) = output
        else {
            return None;
        };
        let place = port.map(|port| format!("{port}: ")).unwrap_or_default();
        Some(RecordKind::Remark(format!("{place}fault {id} {kind}: {message}")))
    }
}

/// The calendar for a header; `None` for the default of a new controller.
pub fn calendar_if_set(calendar: CalendarTime) -> Option<CalendarTime> {
    Some(calendar).filter(|calendar| *calendar != Config::new(Dialect::default()).calendar)
}

/// The transcripts of a running controller.
#[derive(Default)]
pub struct TranscriptSink {
    recorder: Recorder,
    /// Buffer for the control interface.
    buffer: Option<Arc<TranscriptBuffer>>,
    observer: Observer,
    /// Findings about the host's timing are not reported.
    is_untimed: bool,
    /// The controller started from a snapshot or with an error history, so a reset needs its full state.
    restored: bool,
}

impl TranscriptSink {
    /// Creates the transcripts of a run, and the one in memory, of `buffered` records. A controller that the header alone does
    /// not reproduce, because it was restored, is in them whole.
    ///
    /// # Errors
    /// The first file that cannot be written.
    pub fn create(
        header: Header,
        files: &[TranscriptFile],
        buffered: Option<usize>,
        restored: Option<&Controller>,
    ) -> Result<TranscriptSink, PathError> {
        let mut sink = TranscriptSink {
            recorder: Recorder::create(files, &header, Duration::ZERO)?,
            buffer: buffered.map(|most| Arc::new(TranscriptBuffer::new(header, most))),
            observer: Observer::default(),
            is_untimed: false,
            restored: restored.is_some(),
        };
        if let Some(controller) = restored {
            sink.restored(Time::ZERO, controller);
        }
        Ok(sink)
    }

    /// Records that this controller replaces the current one.
    fn restored(&mut self, at: Time, controller: &Controller) {
        self.restored_in_files(at, controller);
        if let Some(buffer) = &self.buffer {
            buffer.restored(at, controller);
        }
    }

    fn restored_in_files(&mut self, at: Time, controller: &Controller) {
        if self.recorder.is_on() {
            let kind = RecordKind::Link(LinkRecord::from_restored(controller));
            self.recorder.record(&Record { at, kind });
        }
    }

    /// Lets the records in memory from here on begin with this controller, if they need one: the oldest are discarded up to
    /// such a beginning.
    fn begin_piece(&mut self, controller: &Controller) {
        if let Some(buffer) = &self.buffer
            && buffer.needs_beginning()
        {
            buffer.begin(self.observer.connected.clone(), self.is_untimed, controller);
        }
    }

    /// Handles a reset to the initial state: files continue, the records in memory begin again. `calendar` is the new
    /// date if it follows wall-clock time.
    fn reset(&mut self, at: Time, controller: &Controller, calendar: Option<CalendarTime>) {
        if self.restored {
            self.restored_in_files(at, controller);
        } else {
            let kind = RecordKind::Link(LinkRecord::Reset { calendar });
            self.recorder.record(&Record { at, kind });
        }
        if let Some(buffer) = &self.buffer {
            buffer.restart(calendar);
            if self.restored {
                buffer.restored(Time::ZERO, controller);
            }
            if self.is_untimed {
                // The record that said so is gone.
                buffer.push(Record::untimed(controller.now()));
            }
        }
    }

    /// The buffer in memory.
    pub fn buffer(&self) -> Arc<TranscriptBuffer> {
        self.buffer.clone().unwrap_or_default()
    }

    fn record(&mut self, at: Time, observe: impl FnOnce(&mut Observer) -> Option<RecordKind>) {
        let is_on = self.recorder.is_on() || self.buffer.is_some();
        if is_on && let Some(kind) = observe(&mut self.observer) {
            let record = Record { at, kind };
            self.recorder.record(&record);
            if let Some(buffer) = &self.buffer {
                buffer.push(record);
            }
        }
    }
}

impl Subscriber for TranscriptSink {
    fn input(&mut self, at: Time, input: &Input, by: Side) {
        self.record(at, |observer| observer.input(input, by));
    }

    fn output(&mut self, at: Time, output: &Output) {
        self.record(at, |observer| observer.output(output));
    }

    fn notice(&mut self, at: Time, notice: Notice<'_>) {
        let link = match notice {
            Notice::Restored(controller) => return self.restored(at, controller),
            Notice::Reset { controller, calendar } => return self.reset(at, controller, calendar),
            Notice::Dropped(port) => LinkRecord::Dropped { port },
            Notice::TimedFindings(on) => {
                self.is_untimed = !on;
                LinkRecord::TimedFindings { on }
            }
            Notice::NotPersisted { name, reason } => LinkRecord::NotPersisted {
                name: name.to_owned(),
                reason: reason.to_owned(),
            },
        };
        self.record(at, |_| Some(RecordKind::Link(link)));
    }

    fn all_settled(&mut self, controller: &Controller) {
        self.begin_piece(controller);
    }

    fn flush(&mut self) {
        self.recorder.flush();
    }
}
