//! The backing directory and the running controller: a change is kept before it happens, what took place otherwise is
//! followed. What became of it is `store::backing`'s to say.

use super::Driver;
use crate::transcript::LinkRecord;
use ts3100_controller::{Controller, Input, Time};

impl Driver {
    /// The controller asks for a change to be kept; it goes on with the answer, at the same moment.
    pub(super) fn persist(&mut self, at: Time, name: &str, content: Option<&[u8]>) {
        let answer = match &mut self.backing {
            Some(backing) => backing.persist(at, name, content),
            None => Ok(()),
        };
        if let Err(reason) = &answer {
            let (name, reason) = (name.to_owned(), reason.clone());
            self.transcript
                .link(at, LinkRecord::NotPersisted { name, reason });
        }
        self.controller.handle(at, Input::Persisted(answer));
    }

    /// A change was kept: what was not may now be.
    pub(super) fn retry_unsaved_files(&mut self) {
        if let Some(backing) = &mut self.backing {
            backing.retry_unsaved(&self.controller);
        }
    }

    /// The backing directory gets the files of `next` in place of those of the present controller.
    ///
    /// # Errors
    /// Why it does not have them all.
    pub(super) fn replace_files(&mut self, next: &Controller) -> Result<(), String> {
        let Some(backing) = &mut self.backing else {
            return Ok(());
        };
        let files_result = backing.replace_files(self.controller.files(), next);
        files_result.map_err(|reason| reason.to_string())
    }

    /// The backing directory has the error history as it now is.
    pub(super) fn save_history(&mut self) {
        if let Some(backing) = &mut self.backing {
            backing.save_history(&self.controller);
        }
    }
}
