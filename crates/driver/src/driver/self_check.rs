//! Self-check at the start: sends SU to IP0 over a real connection and waits for the answer, before the emulator reports
//! that it is ready. Faults are disarmed for the check. Afterwards the controller is restored, and no subscriber sees
//! the exchange.

use super::{Driver, FIRST, OpenError};
use crate::seat::Seat;
use crate::socket;
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::time::Duration;
use tokio::io::Interest;
use tokio::net::TcpStream;
use ts3100_controller::port::Port;
use ts3100_proto::text::{Checksum, ETX, Framing, encode_text};

/// Timeout of the whole exchange.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(10);
/// Most bytes that are read; the answer to SU is shorter.
const MAX_ANSWER: usize = 1_024;

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
    /// Runs the loop until SU is answered on IP0 of the first robot. Does nothing if IP0 is not a server channel.
    ///
    /// # Errors
    /// SU was not answered, or the ports could not be opened again afterwards.
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
    let text = encode_text(b"SU\r", Framing::Stx, checksum);
    socket::write_all(&stream, &text).await?;
    let mut answer = Vec::new();
    let mut piece = [0; MAX_ANSWER];
    while !answer.contains(&ETX) && answer.len() < MAX_ANSWER {
        socket::ready(&stream, Interest::READABLE).await?;
        match stream.try_read(&mut piece) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => answer.extend(piece.iter().take(count)),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::io::AsyncReadExt as _;
    use tokio::net::TcpListener;

    #[tokio::test]
    async fn a_robot_that_hangs_up_without_an_answer_fails_the_check() {
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
