//! What the fuzz targets share: [`Choices`] reads the fuzzer's bytes as decisions, [`Robot`] is a controller and its peers
//! under virtual time.
//!
//! The properties that must hold are in the files of the targets.

use std::time::Duration;
use ts3100_controller::options::Config;
use ts3100_controller::{
    Bytes, ControlRight, Controller, Dialect, Input, KeySwitch, Output, PanelAction, PersistError, Port, Time,
};
use ts3100_driver::seat::{Effects, Seat, Side};
use ts3100_proto::text::MAX_TEXT;

/// Deadlines the controller may want served within one step of time before it is considered hung.
const MAX_DEADLINES: u32 = 200_000;
/// Most milliseconds that pass in the events of an input: a program without an end costs in proportion.
const MAX_PASSED: u64 = 60_000;
/// Most bytes that may come out of one input: more counts as unbounded growth.
const MAX_OUT: usize = 16 * 1024 * 1024;

/// Bytes read from the front as choices; zeros when they are used up.
pub struct Choices<'a>(pub &'a [u8]);

impl<'a> Choices<'a> {
    /// Whether all bytes are used up.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// One byte.
    pub fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else {
            return 0;
        };
        self.0 = rest;
        *first
    }

    /// Two bytes.
    pub fn word(&mut self) -> u16 {
        u16::from_be_bytes([self.byte(), self.byte()])
    }

    /// A chunk of bytes: its length, then as many.
    pub fn chunk(&mut self) -> &'a [u8] {
        let length = usize::from(self.byte()).min(self.0.len());
        let (chunk, rest) = self.0.split_at(length);
        self.0 = rest;
        chunk
    }
}

/// The text before the first zero byte, and the bytes after it.
#[must_use]
pub fn text_and_choices(data: &[u8]) -> (String, Choices<'_>) {
    let at = data.iter().position(|byte| *byte == 0).unwrap_or(data.len());
    let (text, rest) = data.split_at(at);
    (
        String::from_utf8_lossy(text).into_owned(),
        Choices(rest.get(1..).unwrap_or_default()),
    )
}

/// A controller, its clock and its peers.
pub struct Robot {
    /// The controller, to which nobody listens.
    pub seat: Seat,
    now: Time,
    /// Milliseconds that may still pass in [`Robot::act`].
    left: u64,
    peers: Peers,
}

/// The surroundings of the controller.
#[derive(Default)]
struct Peers {
    /// Sent on IP0 during one input.
    sent: Vec<u8>,
    /// Bytes that came out of one input or deadline.
    size: usize,
    /// Deadlines served during one input.
    deadlines: u32,
    /// File changes that the controller has asked to persist so far.
    persist_requests: u32,
}

const PORTS: [Port; 6] = [Port::Host, Port::Ip0, Port::Com1, Port::Ip1, Port::Ip2, Port::Ip3];

impl Robot {
    /// A controller with a host on IP0 and peers on the channels, servo power on.
    ///
    /// # Panics
    /// Never: an empty drive is always taken.
    #[must_use]
    pub fn new(field: bool) -> Robot {
        let dialect = if field { Dialect::Field } else { Dialect::Manual };
        let controller = Controller::new(Config::new(dialect), Vec::new()).expect("an empty drive is taken");
        let mut robot = Robot::resumed(controller);
        for port in PORTS {
            robot.feed(Input::Connected {
                port,
                peer: String::from("fuzz"),
            });
        }
        robot.feed(Input::by_hand(PanelAction::Servo(true)));
        robot
    }

    /// A controller that continues from its state.
    #[must_use]
    pub fn resumed(controller: Controller) -> Robot {
        let now = controller.now();
        let mut robot = Robot {
            seat: Seat::new(controller),
            now,
            left: MAX_PASSED,
            peers: Peers::default(),
        };
        robot.seat.controller.persist_outside(true);
        robot
    }

    /// Feeds one input; every deadline before it is served at its own time.
    ///
    /// # Panics
    /// As [`Robot::feed_and_collect`] does.
    pub fn feed(&mut self, input: Input) {
        self.feed_and_collect(input);
    }

    /// As [`Robot::feed`]; returns the bytes sent on IP0.
    ///
    /// # Panics
    /// When more comes out than any input can ask for, and when the controller makes no progress.
    pub fn feed_and_collect(&mut self, input: Input) -> Vec<u8> {
        (self.peers.size, self.peers.deadlines) = (0, 0);
        // A refused action is one of the events.
        let _refused = self.seat.feed(self.now, input, Side::Host, &mut self.peers);
        std::mem::take(&mut self.peers.sent)
    }

    /// Sends a command on IP0 and returns the data section of the answer.
    ///
    /// # Panics
    /// When the answer is not exactly one text of at most 255 bytes.
    pub fn ask(&mut self, command: &str) -> Vec<u8> {
        let bytes = [b"\x02", command.as_bytes(), b"\r\x03"].concat();
        let port = Port::Ip0;
        let answer = self.feed_and_collect(Input::received(port, bytes));
        let data = answer
            .strip_prefix(b"\x02")
            .and_then(|rest| rest.strip_suffix(b"\x03"));
        let data = data.filter(|data| answer.len() <= MAX_TEXT && !data.contains(&0x03));
        data.unwrap_or_else(|| panic!("{command}: one text expected, {} found", answer.escape_ascii()))
            .to_vec()
    }

    /// The file that answers a command; acknowledges every text with OK.
    ///
    /// # Panics
    /// When the answer is not a file.
    pub fn file(&mut self, command: &str) -> Vec<u8> {
        let first = self.ask(command);
        let mut content = first.strip_prefix(b"FL,").map(<[u8]>::to_vec).unwrap_or_else(|| {
            panic!("{command}: FL expected, {} found", first.escape_ascii());
        });
        while content.last() != Some(&0x1A) {
            assert!(content.len() < MAX_OUT, "{command}: a file without an end");
            content.extend(self.ask("OK"));
        }
        content.pop();
        content
    }

    /// Disconnects the host on IP0 and connects another.
    pub fn new_host(&mut self) {
        let port = Port::Ip0;
        self.feed(Input::Disconnected { port });
        let peer = String::from("fresh");
        self.feed(Input::Connected { port, peer });
    }

    /// Advances the virtual time by `millis`.
    ///
    /// # Panics
    /// As [`Robot::feed_and_collect`] does.
    pub fn advance(&mut self, millis: u64) {
        self.now = self.now + Duration::from_millis(millis);
        self.feed(Input::Tick);
    }

    /// As [`Robot::advance`], as long as [`MAX_PASSED`] allows.
    fn pass(&mut self, millis: u64) {
        let millis = millis.min(self.left);
        self.left -= millis;
        self.advance(millis);
    }

    /// Feeds one event that the bytes choose.
    pub fn act(&mut self, choices: &mut Choices<'_>) {
        let choice = choices.byte();
        let port = PORTS[usize::from(choice >> 5) % PORTS.len()];
        let on = choice & 0x80 != 0;
        match choice % 24 {
            0..=8 => {
                let bytes = choices.chunk().to_vec();
                self.feed(Input::received(port, bytes));
            }
            9 | 10 => {
                let text = [b"\x02", choices.chunk(), b"\r\x03"].concat();
                self.feed(Input::received(port, text));
            }
            11 => {
                let text = b"\x02OK\r\x03".to_vec();
                self.feed(Input::received(port, text));
            }
            12 => self.pass(u64::from(choices.byte())),
            13 => self.pass(u64::from(choices.word())),
            14 => self.feed(Input::Disconnected { port }),
            15 => self.feed(Input::Connected {
                port,
                peer: String::from("again"),
            }),
            16 => self.feed(Input::by_hand(PanelAction::Start)),
            17 => self.feed(Input::by_hand(PanelAction::Stop)),
            18 => self.feed(Input::by_hand(PanelAction::PressFeedHold)),
            19 => {
                let line = choices.word() % 300;
                self.feed(Input::by_hand(PanelAction::InputLine { line, on }));
            }
            20 => {
                let keys = String::from_utf8_lossy(choices.chunk()).into_owned();
                self.feed(Input::by_hand(PanelAction::Keys(keys)));
            }
            21 => {
                let key = [KeySwitch::Ext, KeySwitch::Internal, KeySwitch::Teaching];
                let right = [ControlRight::Ether, ControlRight::Sig, ControlRight::Rs232c];
                let which = usize::from(choices.byte());
                self.feed(Input::by_hand(PanelAction::Key(key[which % 3])));
                self.feed(Input::by_hand(PanelAction::ControlRight(right[which / 3 % 3])));
            }
            22 => self.feed(Input::by_hand(match choices.byte() % 5 {
                0 => PanelAction::EmergencyStop(on),
                1 => PanelAction::SafetySwitch(on),
                2 => PanelAction::AlarmReset,
                3 => PanelAction::MachineLock(on),
                _ => PanelAction::Battery(on),
            })),
            _ => self.feed(Input::by_hand(match choices.byte() % 8 {
                0 => PanelAction::PowerCycle,
                _ => PanelAction::Servo(!on),
            })),
        }
    }
}

impl Effects for Peers {
    /// Every third request to persist a file fails, so that the targets cover a full disk.
    fn persist(
        &mut self,
        _at: Time,
        _name: &str,
        _content: Option<Bytes>,
    ) -> Option<Result<(), PersistError>> {
        self.persist_requests = self.persist_requests.wrapping_add(1);
        Some(if self.persist_requests.is_multiple_of(3) {
            Err(PersistError::Refused(String::from("full")))
        } else {
            Ok(())
        })
    }

    fn perform(&mut self, _at: Time, output: Output, _controller: &Controller) -> Vec<Input> {
        self.size += match output {
            Output::Send { port, bytes } => {
                if port == Port::Ip0 {
                    self.sent.extend_from_slice(&bytes);
                }
                bytes.len()
            }
            Output::Stored { content, .. } => content.len(),
            _ => 64,
        };
        assert!(self.size < MAX_OUT, "{} bytes came of one input", self.size);
        Vec::new()
    }

    fn is_late(&mut self, reached: Time) -> bool {
        self.size = 0;
        self.deadlines += 1;
        let hangs = self.deadlines >= MAX_DEADLINES;
        assert!(
            !hangs,
            "{MAX_DEADLINES} deadlines before {reached}: the controller makes no progress"
        );
        false
    }
}
