//! A serial line as a TCP port with one client at a time: raw bytes, for which no settings are known, or an RFC 2217 access
//! server, whose client reports its settings. The RFC 2217 protocol itself is in `rfc2217`.

use super::rfc2217::{Event, Server};
use super::task::{DriverGone, SerialTask, TaskCommand, WriteBuffer};
use super::{SerialError, SerialEvent, io_error};
use crate::socket;
use crate::tcp;
use crate::tcp::SecondConnection;
use std::collections::VecDeque;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::{Instant, sleep_until};
use tracing::{debug, info, warn};
use ts3100_controller::Port;

/// Pause after an accept that failed.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// How long a newcomer waits before it is refused: the close of a host that is back at once may be on its way still,
/// behind the new connection.
const CLOSE_GRACE: Duration = Duration::from_millis(50);
/// Newcomers that may wait so.
const MAX_WAITING_CONNECTIONS: usize = 4;

/// A connection and where it comes from.
type NewConnection = (TcpStream, SocketAddr);

/// What is spoken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TcpMode {
    /// The bytes alone.
    Raw,
    /// Telnet with COM-PORT-OPTION.
    Rfc2217,
}

/// A listening socket and its address; port 0 asks for a free one.
pub(super) fn bind(port: Port, address: SocketAddr) -> Result<(TcpListener, SocketAddr), SerialError> {
    tcp::open(address).map_err(io_error(port, "listen on", address))
}

/// A client and what is said to it.
struct Client {
    stream: TcpStream,
    peer: SocketAddr,
    server: Option<Server>,
    write_buffer: WriteBuffer,
    /// Off the line, while the client takes none.
    unsent: WriteBuffer,
    suspended: bool,
}

/// Serves one client after the other until the driver is gone.
pub(super) async fn serve(
    listener: TcpListener,
    kind: TcpMode,
    mut task: SerialTask,
    second: SecondConnection,
) {
    let mut waiting = VecDeque::new();
    loop {
        let accepted = match waiting.pop_front() {
            Some(client) => Ok(client),
            None => wait_for_client(&listener, &mut task).await,
        };
        let Ok((stream, peer)) = accepted else { return };
        tcp::prepare(task.port, &stream);
        let mut client = Client {
            stream,
            peer,
            server: (kind == TcpMode::Rfc2217).then(|| Server::new(task.settings)),
            write_buffer: WriteBuffer::default(),
            unsent: WriteBuffer::default(),
            suspended: false,
        };
        let peer = peer.to_string();
        if task.send_event(SerialEvent::Opened { peer }).await.is_err() {
            return;
        }
        if client
            .carry(&listener, &mut task, second, &mut waiting)
            .await
            .is_err()
        {
            return;
        }
        if task.send_event(SerialEvent::Closed).await.is_err() {
            return;
        }
    }
}

async fn wait_for_client(listener: &TcpListener, task: &mut SerialTask) -> Result<NewConnection, DriverGone> {
    loop {
        tokio::select! {
            command = task.commands.recv() => match command.ok_or(DriverGone)? {
                // Nobody is connected to hear it.
                TaskCommand::Send(_) => {}
                TaskCommand::Settings(robot) => task.settings = robot,
            },
            accepted = accept(task.port, listener) => return Ok(accepted),
        }
    }
}

async fn accept(port: Port, listener: &TcpListener) -> NewConnection {
    loop {
        match listener.accept().await {
            Ok(accepted) => return accepted,
            Err(error) => {
                warn!(
                    port = port.name(),
                    "{port}: a connection was not accepted: {error}"
                );
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
}

impl Client {
    /// Carries bytes until the client is gone, or another one takes its place.
    async fn carry(
        &mut self,
        listener: &TcpListener,
        task: &mut SerialTask,
        second: SecondConnection,
        waiting: &mut VecDeque<NewConnection>,
    ) -> Result<(), DriverGone> {
        let port = task.port;
        let mut grace = Instant::now() + CLOSE_GRACE;
        loop {
            self.flush();
            let credit = Arc::clone(&task.credit);
            tokio::select! {
                command = task.commands.recv() => match command.ok_or(DriverGone)? {
                    TaskCommand::Send(bytes) => self.unsent.push(port, &bytes),
                    TaskCommand::Settings(robot) => {
                        task.settings = robot;
                        if let Some(server) = &mut self.server {
                            server.set_robot(robot);
                        }
                    }
                },
                ready = socket::writable(&self.stream), if !self.write_buffer.is_empty() => {
                    if ready.is_err() || !self.write(port) {
                        return Ok(());
                    }
                },
                (ready, most) = readable(&self.stream, &credit), if !self.write_buffer.is_full() => {
                    let mut buffer = vec![0; most];
                    match ready.and_then(|()| self.stream.try_read(&mut buffer)) {
                        Ok(0) => return Ok(()),
                        Ok(count) => {
                            buffer.truncate(count);
                            self.received(task, buffer).await?;
                        }
                        Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                        Err(error) => {
                            debug!(port = port.name(), "{port}: reading ended: {error}");
                            return Ok(());
                        }
                    }
                },
                (stream, peer) = accept(port, listener) => {
                    if second == SecondConnection::Replace {
                        info!(port = port.name(), "{port}: {} replaced by {peer}", self.peer);
                        *waiting = VecDeque::from([(stream, peer)]);
                        return Ok(());
                    }
                    if waiting.is_empty() {
                        grace = Instant::now() + CLOSE_GRACE;
                    }
                    waiting.push_back((stream, peer));
                    if waiting.len() > MAX_WAITING_CONNECTIONS {
                        self.refuse(port, waiting);
                    }
                },
                () = sleep_until(grace), if !waiting.is_empty() => {
                    // One that has closed is read to its end first, however long the line takes for it.
                    if !tcp::has_closed(&self.stream) {
                        self.refuse(port, waiting);
                    }
                    grace = Instant::now() + CLOSE_GRACE;
                },
            }
        }
    }

    fn refuse(&self, port: Port, waiting: &mut VecDeque<NewConnection>) {
        for (stream, peer) in waiting.drain(..) {
            info!(
                port = port.name(),
                "{port}: {peer} refused, {} is connected (channel.second=refuse)", self.peer
            );
            drop(stream);
        }
    }

    /// What comes off the line, and what the access server has to say, in this order.
    fn flush(&mut self) {
        if !self.suspended && !self.unsent.is_empty() && !self.write_buffer.is_full() {
            let bytes = self.unsent.take();
            match &mut self.server {
                Some(server) => server.send(&bytes),
                None => self.write_buffer.append(&bytes),
            }
        }
        if let Some(server) = &mut self.server {
            let bytes = server.take_output();
            self.write_buffer.append(&bytes);
        }
    }

    fn write(&mut self, port: Port) -> bool {
        match self.stream.try_write(self.write_buffer.as_slice()) {
            Ok(count) => {
                self.write_buffer.consume(port, count);
                true
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => true,
            Err(error) => {
                debug!(port = port.name(), "{port}: writing ended: {error}");
                false
            }
        }
    }

    async fn received(&mut self, task: &SerialTask, bytes: Vec<u8>) -> Result<(), DriverGone> {
        let Some(server) = &mut self.server else {
            return task.send_received(bytes).await;
        };
        for event in server.receive(&bytes) {
            match event {
                Event::Data(bytes) => task.send_received(bytes).await?,
                Event::Settings(settings) => task.send_host_settings(settings).await?,
                Event::PurgeToRobot => task.send_event(SerialEvent::Purged).await?,
                Event::PurgeToClient => self.unsent.clear(),
                Event::Break => task.send_event(SerialEvent::Faults(vec![0])).await?,
                Event::Suspended(suspended) => self.suspended = suspended,
            }
        }
        Ok(())
    }
}

/// Ready to be read, and how much of it.
async fn readable(stream: &TcpStream, credit: &Semaphore) -> (io::Result<()>, usize) {
    let most = SerialTask::readable_bytes(credit).await;
    (socket::readable(stream).await, most)
}
