//! Where one who is not the driver asks for snapshots: the embedding API, the control interface. The driver does what is
//! asked between two inputs.

use super::{FileError, NamedError, ParseError};
use tokio::sync::{mpsc, oneshot};
use ts3100_controller::Controller;

/// Orders that may wait for the driver.
pub const REQUEST_QUEUE: usize = 16;

/// Why a snapshot was not taken or restored.
#[derive(Debug, thiserror::Error)]
pub enum SnapshotRequestError {
    /// The snapshot is in its place, but the backing directory has not all of its files.
    #[error("the snapshot is restored, but its files are not all kept: {0}")]
    Drive(String),
    /// Its name.
    #[error(transparent)]
    Named(#[from] NamedError),
    /// Its text.
    #[error(transparent)]
    Parse(#[from] ParseError),
    /// Its file.
    #[error(transparent)]
    File(#[from] FileError),
    /// The ports it asks for cannot be opened.
    #[error("the snapshot is restored, but no port is open: {0}")]
    Channels(String),
    /// The emulator takes no more orders.
    #[error("the emulator takes no more orders: too many are waiting, or it has ended")]
    Busy,
}

/// What is to be done.
#[derive(Debug)]
pub enum SnapshotTask {
    /// The present state is kept under this name.
    Save(String),
    /// The state of this name becomes the present one.
    Restore(String),
    /// This one does.
    Replace(Box<Controller>),
    /// The state of this name is forgotten.
    Remove(String),
    /// The names are told.
    List,
    /// The present state is told.
    Get,
    /// The state of this name is told.
    GetNamed(String),
}

/// What came of it.
#[derive(Debug)]
pub enum SnapshotReply {
    /// Nothing to tell.
    Done,
    /// The names, each with the virtual time of its snapshot in microseconds.
    Names(Vec<(String, u64)>),
    /// The state that was asked for.
    State(Box<Controller>),
}

/// A task, and who waits for it.
#[derive(Debug)]
pub struct SnapshotRequest {
    /// What.
    pub task: SnapshotTask,
    /// Told what came of it.
    pub done: oneshot::Sender<Result<SnapshotReply, SnapshotRequestError>>,
}

/// The desk; clones are the same.
#[derive(Debug, Clone)]
pub struct SnapshotHandle(mpsc::Sender<SnapshotRequest>);

impl SnapshotHandle {
    /// A desk and the driver's side of it.
    #[must_use]
    pub fn channel() -> (SnapshotHandle, mpsc::Receiver<SnapshotRequest>) {
        let (sender, receiver) = mpsc::channel(REQUEST_QUEUE);
        (SnapshotHandle(sender), receiver)
    }

    fn send(
        &self,
        task: SnapshotTask,
    ) -> Result<oneshot::Receiver<Result<SnapshotReply, SnapshotRequestError>>, SnapshotRequestError> {
        let (done, is_done) = oneshot::channel();
        self.0
            .try_send(SnapshotRequest { task, done })
            .map_err(|_| SnapshotRequestError::Busy)?;
        Ok(is_done)
    }

    /// Has something done and waits for it, in a task of a runtime.
    ///
    /// # Errors
    /// [`SnapshotRequestError`].
    pub async fn request(&self, task: SnapshotTask) -> Result<SnapshotReply, SnapshotRequestError> {
        self.send(task)?.await.map_err(|_| SnapshotRequestError::Busy)?
    }

    /// Has something done and waits for it, in a thread outside of every runtime.
    ///
    /// # Errors
    /// [`SnapshotRequestError`].
    pub fn request_blocking(&self, task: SnapshotTask) -> Result<SnapshotReply, SnapshotRequestError> {
        self.send(task)?
            .blocking_recv()
            .map_err(|_| SnapshotRequestError::Busy)?
    }
}
