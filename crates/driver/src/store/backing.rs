//! The policy of the backing directory: a change is persisted before the controller applies it, or rejected
//! (`drive.when_full`). Files that could not be saved are remembered and retried after the next successful write.
//! [`Store`] writes the files; the driver calls this module (`driver::persistence`).

use super::{Store, StoreError};
use std::collections::{BTreeMap, BTreeSet};
use tracing::{error, info};
use ts3100_controller::{Controller, Time};

/// What happens to a change that cannot be saved (`drive.when_full`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WhenFull {
    /// The change is rejected; the RAM drive is unchanged.
    #[default]
    Refuse,
    /// The change is made in memory and is lost after a restart.
    Memory,
}

/// State of the backing directory.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BackingStatus {
    /// Writes that failed since the start.
    pub failures: u64,
    /// Error of the last write; `None` if it succeeded.
    pub error: Option<String>,
    /// Names of files whose current content (or removal) is not saved and is lost at a restart.
    pub unsaved: BTreeSet<String>,
}

/// A store with its policy and status.
#[derive(Debug)]
pub struct Backing {
    store: Store,
    when_full: WhenFull,
    status: BackingStatus,
    /// The error that was logged last, to log each once.
    last_logged: Option<String>,
}

impl Backing {
    /// Wraps a store; nothing is unsaved.
    #[must_use]
    pub fn new(store: Store, when_full: WhenFull) -> Backing {
        Backing {
            store,
            when_full,
            status: BackingStatus::default(),
            last_logged: None,
        }
    }

    /// Current status.
    #[must_use]
    pub fn status(&self) -> &BackingStatus {
        &self.status
    }

    /// Saves a change of a file that the controller is about to make; `None` erases the file.
    ///
    /// # Errors
    /// Why the change was not saved and must not be made.
    pub fn persist(&mut self, now: Time, name: &str, content: Option<&[u8]>) -> Result<(), StoreError> {
        let Err(reason) = self.write(name, content) else {
            self.note_saved(name);
            return Ok(());
        };
        self.note_failure(now, name, &reason);
        match self.when_full {
            WhenFull::Refuse => Err(reason),
            WhenFull::Memory => {
                self.status.unsaved.insert(name.to_owned());
                Ok(())
            }
        }
    }

    /// Retries the unsaved files, now that the directory accepts writes again.
    pub fn retry_unsaved(&mut self, controller: &Controller) {
        while self.status.error.is_none()
            && let Some(name) = self.status.unsaved.pop_first()
        {
            if let Err(reason) = self.write(&name, controller.drive().get(&name)) {
                self.note_failure(controller.now(), &name, &reason);
                self.status.unsaved.insert(name);
            }
        }
    }

    /// Replaces the files `before` by those of `next`. Files that cannot be saved are remembered.
    ///
    /// # Errors
    /// Error of the first write that failed.
    pub fn replace_files<'a>(
        &mut self,
        before: impl Iterator<Item = (&'a str, &'a [u8])>,
        next: &Controller,
    ) -> Result<(), StoreError> {
        let mut before: BTreeMap<&str, &[u8]> = before.collect();
        for name in &self.status.unsaved {
            before.remove(name.as_str());
        }
        let lacking = std::mem::take(&mut self.status.unsaved);
        let gone = before.keys().copied().chain(lacking.iter().map(String::as_str));
        let gone: BTreeSet<&str> = gone.filter(|name| !next.drive().contains(name)).collect();
        let changed = next
            .files()
            .filter(|(name, content)| before.get(name) != Some(content));
        let changed = changed.map(|(name, content)| (name, Some(content)));
        let mut result = Ok(());
        // Remove old files last: if a write fails, they are still there.
        for (name, content) in changed.chain(gone.into_iter().map(|name| (name, None))) {
            if result.is_ok() {
                result = self.write(name, content);
            }
            match &result {
                Ok(()) => self.note_saved(name),
                Err(reason) => {
                    self.note_failure(next.now(), name, reason);
                    self.status.unsaved.insert(name.to_owned());
                }
            }
        }
        result
    }

    /// Saves the error history for the next start.
    pub fn save_history(&mut self, controller: &Controller) {
        if let Err(reason) = self.store.save_history(controller.alarms().history()) {
            self.note_failure(controller.now(), "the error history", &reason);
        }
    }

    fn write(&mut self, name: &str, content: Option<&[u8]>) -> Result<(), StoreError> {
        match content {
            Some(content) => self.store.put(name, content),
            None => self.store.remove(name),
        }
    }

    fn note_saved(&mut self, name: &str) {
        self.status.unsaved.remove(name);
        self.last_logged = None;
        if let Some(reason) = self.status.error.take() {
            info!(
                event = "store-recovered",
                reason, "the directory of the RAM drive takes files again"
            );
        }
    }

    fn note_failure(&mut self, now: Time, file: &str, error: &StoreError) {
        let reason = error.to_string();
        self.status.failures = self.status.failures.saturating_add(1);
        // A host that tries again and again, with one file or another, is one line of the log.
        let cause = error.cause();
        if self.last_logged.as_ref() != Some(&cause) {
            let (t, what) = (now.to_string(), self.consequence());
            error!(
                event = "store-failed",
                t, file, reason, "the directory of the RAM drive does not keep {file}: {reason}; {what}"
            );
            self.last_logged = Some(cause);
        }
        self.status.error = Some(reason);
    }

    fn consequence(&self) -> &'static str {
        match self.when_full {
            WhenFull::Refuse => "changes are refused",
            WhenFull::Memory => "changes are in memory alone",
        }
    }
}

#[cfg(test)]
mod tests;
