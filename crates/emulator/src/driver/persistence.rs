//! Keeps the backing directory (`--drive`) in step with the running controller: a change is persisted before the
//! controller applies it. [`crate::store::backing`] decides what happens when the directory rejects a write, and
//! [`crate::store`] writes the files.

use super::Driver;
use crate::transcript::LinkRecord;
use ts3100_controller::{Accepted, ActionError, Controller, Input, PersistError, Time};

impl Driver {
    /// Persists a change and feeds the result back to the controller at the same virtual time.
    pub(super) fn persist(
        &mut self,
        at: Time,
        name: &str,
        content: Option<&[u8]>,
    ) -> Result<Accepted, ActionError> {
        let answer = match &mut self.backing {
            Some(backing) => backing.persist(at, name, content),
            None => Ok(()),
        };
        if let Err(reason) = &answer {
            let (name, reason) = (name.to_owned(), reason.clone());
            self.transcript
                .link(at, LinkRecord::NotPersisted { name, reason });
        }
        self.controller
            .handle(at, Input::Persisted(answer.map_err(PersistError::Refused)))
    }

    /// Retries the files that could not be saved earlier; called after a change succeeded.
    pub(super) fn retry_unsaved_files(&mut self) {
        if let Some(backing) = &mut self.backing {
            backing.retry_unsaved(&self.controller);
        }
    }

    /// Replaces the files of the backing directory by those of `next`.
    ///
    /// # Errors
    /// Why some of the files were not saved.
    pub(super) fn replace_files(&mut self, next: &Controller) -> Result<(), String> {
        let Some(backing) = &mut self.backing else {
            return Ok(());
        };
        let files_result = backing.replace_files(self.controller.files(), next);
        files_result.map_err(|reason| reason.to_string())
    }

    /// Saves the error history to the backing directory.
    pub(super) fn save_history(&mut self) {
        if let Some(backing) = &mut self.backing {
            backing.save_history(&self.controller);
        }
    }
}
