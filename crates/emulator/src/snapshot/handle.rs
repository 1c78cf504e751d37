//! What may be asked of the driver about snapshots; it serves such a request between two inputs (`driver::snapshots`).

use super::{FileError, NamedError, ParseError};
use tokio::sync::oneshot;
use ts3100_controller::Controller;

/// Why a snapshot request failed.
#[derive(Debug, thiserror::Error)]
pub enum SnapshotRequestError {
    /// The snapshot is restored, but the backing directory lacks some of its files.
    #[error("the snapshot is restored, but its files are not all kept: {0}")]
    Drive(String),
    /// The name is invalid, unknown, or one too many.
    #[error(transparent)]
    Named(#[from] NamedError),
    /// The text is not a valid snapshot.
    #[error(transparent)]
    Parse(#[from] ParseError),
    /// The file cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The snapshot is restored, but its ports cannot be opened.
    #[error("the snapshot is restored, but no port is open: {0}")]
    Channels(String),
    /// The queue is full, or the emulator has ended.
    #[error("the emulator takes no more orders: too many are waiting, or it has ended")]
    Busy,
}

/// An operation on snapshots.
#[derive(Debug)]
pub enum SnapshotTask {
    /// Save the current state under this name.
    Save(String),
    /// Restore the snapshot with this name.
    Restore(String),
    /// Replace the current state by this one.
    Replace(Box<Controller>),
    /// Remove the snapshot with this name.
    Remove(String),
    /// List the named snapshots.
    List,
    /// Return the current state.
    Get,
    /// Return the snapshot with this name.
    GetNamed(String),
}

/// Reply to a request.
#[derive(Debug)]
pub enum SnapshotReply {
    /// Done; no data.
    Done,
    /// The names, each with the virtual time of its snapshot in microseconds.
    Names(Vec<(String, u64)>),
    /// The requested state.
    State(Box<Controller>),
}

/// An operation and the channel for its reply.
#[derive(Debug)]
pub struct SnapshotRequest {
    /// The operation.
    pub task: SnapshotTask,
    /// Receives the reply.
    pub done: oneshot::Sender<Result<SnapshotReply, SnapshotRequestError>>,
}
