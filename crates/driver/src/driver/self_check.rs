//! Self-check at the start: sends SU to IP0 over a real connection and waits for the reply, before the emulator reports
//! that it is ready. Faults are disarmed for the check. Afterwards the controller is restored, and no subscriber sees
//! the exchange.

use super::{Driver, FIRST, OpenError};
use crate::seat::Seat;
use crate::socket;
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::time::{Duration, Instant};
use tokio::io::Interest;
use tokio::net::TcpStream;
use ts3100_controller::port::Port;
use ts3100_host::{Conversation, Event, Expected, Options};
use ts3100_proto::command::Command;
use ts3100_proto::text::Checksum;

/// Timeout of the whole exchange.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(10);
/// Bytes read at once; the reply to SU is shorter.
const READ_BUFFER: usize = 1_024;

/// An address to connect to a server that listens on `listen`: the loopback address if it listens on all
/// interfaces.
#[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
pub fn connectable(listen: IpAddr) -> IpAddr {
    match listen {
        IpAddr::V4(Ipv4Addr::UNSPECIFIED) => IpAddr::V4(Ipv4Addr::LOCALHOST),
        IpAddr::V6(Ipv6Addr::UNSPECIFIED) => IpAddr::V6(Ipv6Addr::LOCALHOST),
        address => address,
    }
}

impl Driver {
    /// Runs the loop until the first robot replies to SU on IP0. Does nothing if IP0 is not a server channel.
    ///
    /// # Errors
    /// There is no reply to SU, or the ports could not be opened again afterwards.
    pub async fn self_check(&mut self, listen: IpAddr) -> Result<(), OpenError> {
        let Some(number) = self.ports(FIRST).get(&Port::Ip0) else {
            return Ok(());
        };
        let address = SocketAddr::new(connectable(listen), *number);
        self.finish_writes().await;
        let robot = &mut self.world[FIRST];
        let unbroken = robot.seat.controller.without_faults();
        // The seat of the check has no subscribers.
        let before = std::mem::replace(&mut robot.seat, Seat::new(unbroken));
        let checksum = before.controller.config().options.text.checksum;
        let mut result = Err(io::Error::from(io::ErrorKind::TimedOut));
        self.serve(async {
            if let Ok(answered) = tokio::time::timeout(ANSWER_TIMEOUT, exchange_su(address, checksum)).await {
                result = answered;
            }
        })
        .await;
        self.finish_writes().await;
        let now = self.clock.now();
        let robot = &mut self.world[FIRST];
        robot.edge.channels.close();
        robot.seat = before;
        // The time that the check has taken is not time of the robot.
        robot.set_time(now, robot.seat.controller.now());
        robot.edge.channels.open(robot.seat.controller.network())?;
        self.note_effects();
        result.map_err(OpenError::SelfCheck)
    }
}

async fn exchange_su(address: SocketAddr, checksum: Checksum) -> io::Result<()> {
    let stream = TcpStream::connect(address).await?;
    let mut host = Conversation::new(Options {
        checksum,
        ..Options::with_stx()
    });
    // One text is enough: any reply shows that the robot is served.
    host.send(&Command::Su.encode(), Expected::Text);
    let start = Instant::now();
    let mut piece = [0; READ_BUFFER];
    loop {
        if let Some(bytes) = host.poll_transmit(start.elapsed()) {
            socket::write_all(&stream, &bytes).await?;
        }
        match host.poll_event() {
            Some(Event::Text(_)) => return Ok(()),
            Some(Event::Failed(error)) => return Err(io::Error::other(error)),
            Some(Event::Response(_) | Event::Bytes(_) | Event::Stopped | Event::Skipped { .. }) => continue,
            None => {}
        }
        socket::ready(&stream, Interest::READABLE).await?;
        match stream.try_read(&mut piece) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => host.receive(start.elapsed(), piece.get(..count).unwrap_or_default()),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::io::AsyncReadExt as _;
    use tokio::net::TcpListener;

    #[tokio::test]
    async fn a_robot_that_hangs_up_without_a_reply_fails_the_check() {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
        let address = listener.local_addr().unwrap();
        let robot = async {
            let (mut stream, _) = listener.accept().await.unwrap();
            stream.read_exact(&mut [0; 5]).await.unwrap();
        };
        let (checked, ()) = tokio::join!(exchange_su(address, Checksum::None), robot);
        assert_eq!(checked.unwrap_err().kind(), io::ErrorKind::UnexpectedEof);
    }
}
