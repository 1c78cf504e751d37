//! A real serial port, opened with the robot's settings ([U06]); timing and settings are those of the real wire. A port
//! that disappears (an unplugged adapter) is reopened as soon as it is back. `terminal` opens, reads and writes it.

use super::parmrk::{CharacterRun, MarkDecoder};
use super::terminal::Terminal;
use super::{Line, SerialError, io_error};
use std::future::Future;
use std::path::{Path, PathBuf};
use std::pin::Pin;
use std::task::{Context, Poll, Waker, ready};
use std::time::Duration;
use tokio::time::{Sleep, sleep};
use tracing::{info, warn};
use ts3100_controller::{HostEnd, Input, Port};
use ts3100_proto::parameter::SerialSettings;

/// A port that is open or is looked for.
pub(super) struct Device {
    port: Port,
    path: PathBuf,
    settings: SerialSettings,
    /// Pause between two attempts to open it.
    pause: Duration,
    state: State,
}

enum State {
    /// The controller does not know of it yet.
    Opened(Terminal),
    /// The port carries bytes.
    Open(Terminal, MarkDecoder),
    /// The port has to be reopened with other settings, once the controller knows that it is closed.
    Reset,
    /// The port is gone and output is dropped; opening it is retried at this time.
    Lost(Pin<Box<Sleep>>),
}

impl Device {
    /// Opens the port with the robot's settings.
    pub(super) fn open(
        port: Port,
        path: &Path,
        settings: SerialSettings,
        pause: Duration,
    ) -> Result<Device, SerialError> {
        let terminal =
            Terminal::open(port, path, settings).map_err(io_error(port, "open", path.display()))?;
        Ok(Device {
            port,
            path: path.to_path_buf(),
            settings,
            pause,
            state: State::Opened(terminal),
        })
    }

    /// The port is gone: reopening it is retried after a pause.
    fn lose(&mut self, pause: Duration) -> Poll<Vec<Input>> {
        self.state = State::Lost(Box::pin(sleep(pause)));
        Poll::Ready(vec![Input::Disconnected { port: self.port }])
    }
}

impl Line for Device {
    fn poll(&mut self, most: usize, mut context: Option<&mut Context<'_>>) -> Poll<Vec<Input>> {
        let port = self.port;
        loop {
            match &mut self.state {
                State::Open(terminal, decoder) => {
                    let Some(bytes) = ready!(terminal.poll(most, context.as_deref_mut())) else {
                        let place = self.path.display();
                        warn!(
                            port = port.name(),
                            "{port}: {place} is gone; retrying until it is back"
                        );
                        return self.lose(self.pause);
                    };
                    let runs = decoder.push(&bytes).into_iter();
                    let inputs = runs.map(|run| match run {
                        CharacterRun::Good(bytes) => Input::received(port, bytes),
                        CharacterRun::Bad(bytes) => Input::SerialErrors { port, bytes },
                    });
                    return Poll::Ready(inputs.collect());
                }
                State::Reset => return self.lose(Duration::ZERO),
                State::Opened(_) => {}
                State::Lost(wait) => {
                    let context = context.as_deref_mut();
                    ready!(
                        wait.as_mut()
                            .poll(context.unwrap_or(&mut Context::from_waker(Waker::noop())))
                    );
                }
            }
            // `Reset` only holds the place: both outcomes below set the state.
            let opened = match std::mem::replace(&mut self.state, State::Reset) {
                State::Opened(terminal) => Ok(terminal),
                State::Open(..) | State::Reset | State::Lost(_) => {
                    Terminal::open(port, &self.path, self.settings)
                }
            };
            match opened {
                Ok(terminal) => {
                    self.state = State::Open(terminal, MarkDecoder::default());
                    let (peer, host) = (self.path.display().to_string(), HostEnd::Wire);
                    return Poll::Ready(vec![
                        Input::Connected { port, peer },
                        Input::SerialOpened { port, host },
                    ]);
                }
                // Round again, so that the new pause is polled and wakes the loop.
                Err(_) => self.state = State::Lost(Box::pin(sleep(self.pause))),
            }
        }
    }

    fn send(&mut self, bytes: &[u8]) {
        if let State::Opened(terminal) | State::Open(terminal, _) = &mut self.state {
            terminal.send(bytes);
        }
    }

    fn set_robot(&mut self, robot: SerialSettings) {
        if std::mem::replace(&mut self.settings, robot) == robot {
            return;
        }
        if let State::Opened(_) | State::Open(..) = self.state {
            let (port, place) = (self.port, self.path.display());
            info!(
                port = port.name(),
                "{port}: reopening {place} with the settings of [U06]"
            );
            self.state = State::Reset;
        }
    }
}
