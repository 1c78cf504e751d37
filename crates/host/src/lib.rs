//! The host's side of the TS3100 simple protocol: what a program does that commands the robot controller.
//!
//! [`Client`] is for most programs. It sends a command over TCP or a serial line and returns the reply:
//!
//! ```
//! use std::time::Duration;
//! use ts3100_host::{Client, Options, Response, TcpTransport};
//! use ts3100_proto::command::Command;
//! # use std::io::{Read as _, Write as _};
//! # let listener = std::net::TcpListener::bind("127.0.0.1:0")?;
//! # let address = listener.local_addr()?;
//! # let robot = std::thread::spawn(move || -> std::io::Result<()> {
//! #     let (mut stream, _) = listener.accept()?;
//! #     stream.read_exact(&mut [0; 5])?;
//! #     stream.write_all(b"\x02OK\r\x03")?;
//! #     stream.read_exact(&mut [0; 5])?;
//! #     stream.write_all(b"\x02FL,DEMO 24\r\x1a\x03")?;
//! #     stream.read_exact(&mut [0; 5])
//! # });
//!
//! let transport = TcpTransport::connect(address, Duration::from_secs(5))?;
//! let mut robot_client = Client::new(transport, Options::with_stx());
//! assert_eq!(robot_client.request(&Command::So)?, Response::Ok);
//! let Response::Content(directory) = robot_client.request(&Command::Ca)? else {
//!     return Err("the controller refused CA".into());
//! };
//! assert_eq!(directory, b"DEMO 24\r");
//! # robot.join().expect("the thread of the example")?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Conversation`] is for programs with their own sockets, runtime or clock. It is a value without I/O: you give it
//! the received bytes and the time, and it gives you bytes to send, events and a deadline:
//!
//! ```
//! use std::time::Duration;
//! use ts3100_host::{Conversation, Event, Options, Response};
//! use ts3100_proto::command::Command;
//!
//! let mut conversation = Conversation::new(Options::with_stx());
//! let now = Duration::ZERO;
//! conversation.request(&Command::Su);
//! assert_eq!(conversation.poll_transmit(now).as_deref(), Some(b"\x02SU\r\x03".as_slice()));
//!
//! let now = Duration::from_millis(8);
//! conversation.receive(now, b"\x02FL,MODE:CYCLE\x1a\x03");
//! // The acknowledgement waits for the pause that the manual asks for.
//! assert_eq!(conversation.poll_transmit(now), None);
//! let now = conversation.deadline().expect("the end of the pause");
//! assert_eq!(conversation.poll_transmit(now).as_deref(), Some(b"\x02OK\r\x03".as_slice()));
//! assert_eq!(conversation.poll_event(), Some(Event::Response(Response::Content(b"MODE:CYCLE".to_vec()))));
//! ```
//!
//! `ts3100-proto` has the commands and decodes the contents of replies. Start reading at [`conversation`].

// A new variant of an enum of ours is met at every place that tells them apart.
#![cfg_attr(not(test), warn(clippy::wildcard_enum_match_arm))]

pub mod client;
pub mod conversation;
mod expected;
pub mod transport;

pub use client::{Client, ClientError};
pub use conversation::{Conversation, Event, ExchangeError, Options, Response};
pub use expected::Expected;
pub use transport::{SerialTransport, TcpTransport, Transport};
