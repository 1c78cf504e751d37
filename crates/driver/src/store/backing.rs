//! The policy of the backing directory: a change is persisted before the controller applies it, or rejected
//! (`drive.when_full`). Files that could not be saved are remembered and retried after the next successful write.
//! [`Store`] writes the files, in a thread of its own where a host waits for the answer: the loop of the driver
//! continues.

use super::{Store, StoreError};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tracing::{error, info};
use ts3100_controller::{Bytes, Controller, Time};

/// Handling of a change that cannot be saved (`drive.when_full`).
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
    store: Arc<Mutex<Store>>,
    when_full: WhenFull,
    status: BackingStatus,
    /// The error that was logged last, to log each once.
    last_logged: Option<String>,
}

impl Backing {
    /// Wraps a store; nothing is unsaved.
    pub fn new(store: Store, when_full: WhenFull) -> Backing {
        Backing {
            store: Arc::new(Mutex::new(store)),
            when_full,
            status: BackingStatus::default(),
            last_logged: None,
        }
    }

    /// The store, for a test that lets a write wait.
    #[cfg(test)]
    pub(crate) fn store(&self) -> Arc<Mutex<Store>> {
        Arc::clone(&self.store)
    }

    /// Current status.
    pub fn status(&self) -> &BackingStatus {
        &self.status
    }

    /// The write that saves a change of a file which the controller is about to make; `None` erases the file. To be
    /// called where it may block; its result goes to [`Backing::finish`].
    pub fn change(
        &self,
        name: String,
        content: Option<Bytes>,
    ) -> impl FnOnce() -> Result<(), StoreError> + Send + use<> {
        let store = Arc::clone(&self.store);
        move || write(&store, &name, content.as_deref())
    }

    /// The write that saves the error history for the next start, as [`Backing::change`]; its result goes to
    /// [`Backing::finish_history`].
    pub fn history(&self, controller: &Controller) -> impl FnOnce() -> Result<(), StoreError> + Send + use<> {
        let store = Arc::clone(&self.store);
        let history = controller.alarms().history().cloned().collect();
        move || lock(&store).save_history(history)
    }

    /// Notes the result of a change.
    ///
    /// # Errors
    /// Why the change was not saved and must not be made.
    pub fn finish(
        &mut self,
        now: Time,
        name: &str,
        written: Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let Err(reason) = written else {
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

    /// Notes whether the error history was saved.
    pub fn finish_history(&mut self, now: Time, written: Result<(), StoreError>) {
        if let Err(reason) = written {
            self.note_failure(now, "the error history", &reason);
        }
    }

    /// Retries the unsaved files, now that the directory accepts writes again.
    pub fn retry_unsaved(&mut self, controller: &Controller) {
        while self.status.error.is_none()
            && let Some(name) = self.status.unsaved.pop_first()
        {
            if let Err(reason) = write(&self.store, &name, controller.drive().get(&name)) {
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
        // The directory has another content of these, or none: they are written or removed in any case.
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
        // Remove old files last: if a write fails, they are still there. After the first failure nothing more is tried.
        for (name, content) in changed.chain(gone.into_iter().map(|name| (name, None))) {
            if result.is_ok() {
                result = write(&self.store, name, content);
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

    fn note_saved(&mut self, name: &str) {
        self.status.unsaved.remove(name);
        self.last_logged = None;
        if let Some(reason) = self.status.error.take() {
            info!(
                event = "store-recovered",
                reason, "the directory of the RAM drive accepts files again"
            );
        }
    }

    fn note_failure(&mut self, now: Time, file: &str, error: &StoreError) {
        let reason = error.to_string();
        self.status.failures = self.status.failures.saturating_add(1);
        // A host that tries again and again, with one file or another, is one line of the log.
        let cause = error.cause();
        if self.last_logged.as_ref() != Some(&cause) {
            let t = now.to_string();
            let what = match self.when_full {
                WhenFull::Refuse => "changes are refused",
                WhenFull::Memory => "changes are kept in memory only",
            };
            error!(
                event = "store-failed",
                t, file, reason, "cannot write {file} to the directory of the RAM drive: {reason}; {what}"
            );
            self.last_logged = Some(cause);
        }
        self.status.error = Some(reason);
    }
}

/// The store. Only this task has it: nothing is served during a write.
fn lock(store: &Mutex<Store>) -> MutexGuard<'_, Store> {
    store.lock().unwrap_or_else(PoisonError::into_inner)
}

fn write(store: &Mutex<Store>, name: &str, content: Option<&[u8]>) -> Result<(), StoreError> {
    match content {
        Some(content) => lock(store).put(name, content),
        None => lock(store).remove(name),
    }
}

#[cfg(test)]
mod tests;
