//! A command between its text and its answer. It may wait in `persistence` until the file that it changes is stored.

use crate::finding::Rule;
use crate::port::Port;
use bytes::Bytes;
use ts3100_proto::command::Command;
use ts3100_proto::permission::Permission;
use ts3100_proto::status::MasterMode;

/// A command on its way to its answer. Mode and permission are those of its arrival: the command itself may change the mode.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AskedCommand {
    pub(crate) port: Port,
    pub(crate) message: Bytes,
    pub(crate) command: Command,
    pub(crate) mode: MasterMode,
    /// Its cell of the permission tables; none: they do not have it.
    pub(crate) permission: Option<Permission>,
    /// The rule that it breaks by being obeyed.
    pub(crate) risk: Option<(&'static Rule, &'static str)>,
}
