//! What a controller sends in several texts, and the files and programs of the survey on it.

use super::{FILE, ProbeError, Session};
use std::time::Duration;
use ts3100_host::Response;
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::text::Text;

/// A program that was started is at its first statement by then.
const BEGUN: Duration = Duration::from_millis(150);
/// Longest run of a program of the survey.
const LONGEST_RUN: Duration = Duration::from_secs(8);

impl Session<'_> {
    /// The content of a file or status; `None` for NG.
    ///
    /// # Errors
    /// The reply is neither.
    pub fn content(&mut self, command: &str) -> Result<Option<Vec<u8>>, ProbeError> {
        let first = self.request(command)?;
        if first.data.as_ref() == b"NG\r" {
            return Ok(None);
        }
        self.rest_of_content(command, first).map(Some)
    }

    /// The content of a file or status.
    ///
    /// # Errors
    /// NG is a refusal.
    pub fn file(&mut self, command: &str) -> Result<Vec<u8>, ProbeError> {
        let content = self.content(command)?;
        content.ok_or_else(|| ProbeError::Refused(format!("{command} got NG")))
    }

    /// The content of a file whose first text has come.
    ///
    /// # Errors
    /// The texts are not those of a file.
    pub fn rest_of_content(&mut self, command: &str, first: Text) -> Result<Vec<u8>, ProbeError> {
        self.client.conversation_mut().continue_file(first);
        match self.response(command)? {
            Response::Content(content) => Ok(content),
            Response::Ok | Response::Ng => Err(ProbeError::Refused(format!("{command} got NG"))),
        }
    }

    /// Stores a file of the survey.
    ///
    /// # Errors
    /// NG is a refusal.
    pub fn store(&mut self, content: &str) -> Result<(), ProbeError> {
        match self.try_to_store(content.as_bytes())? {
            true => Ok(()),
            false => Err(ProbeError::Refused("the file was refused".to_owned())),
        }
    }

    /// Whether the controller stores this content as the survey's file.
    ///
    /// # Errors
    /// DL itself got NG, or anything else came.
    pub fn try_to_store(&mut self, content: &[u8]) -> Result<bool, ProbeError> {
        self.command(&format!("DL,{FILE}"))?;
        self.execution = None;
        self.client.conversation_mut().send_file(content);
        Ok(self.response("a text of a file")? == Response::Ok)
    }

    /// Stores and selects a program.
    ///
    /// # Errors
    /// NG is a refusal.
    pub fn select(&mut self, source: &str) -> Result<(), ProbeError> {
        self.store(source)?;
        self.command(&format!("SL,{FILE}"))
    }

    /// Starts the selected program.
    ///
    /// # Errors
    /// NG is a refusal.
    pub fn start(&mut self) -> Result<(), ProbeError> {
        match self.is_accepted("RN")? {
            true => Ok(()),
            false => Err(ProbeError::Refused(
                "RN got NG: turn servo power on, key in EXT, no alarm, and survey again".to_owned(),
            )),
        }
    }

    /// Starts the selected program and waits until it has begun.
    ///
    /// # Errors
    /// NG is a refusal.
    pub fn begin(&mut self) -> Result<(), ProbeError> {
        self.start()?;
        self.wait(BEGUN)
    }

    /// Asks for SU, with the usual pause before each, until the program has stopped. Returns how, or `None` when it runs longer than `limit`.
    ///
    /// # Errors
    /// SU is not answered.
    pub fn until_stopped(&mut self, limit: Duration) -> Result<Option<ExecutionStatus>, ProbeError> {
        let end = self.now() + limit;
        loop {
            let execution = self.status()?.execution;
            if execution != ExecutionStatus::Running {
                return Ok(Some(execution));
            }
            if self.now() >= end {
                return Ok(None);
            }
        }
    }

    /// Runs a program to its end. Returns whether it came to its end; an alarm stops it before. A program that does not end
    /// is stopped.
    ///
    /// # Errors
    /// It is refused.
    pub fn try_run(&mut self, source: &str) -> Result<bool, ProbeError> {
        self.select(source)?;
        self.start()?;
        Ok(self.finish()? == Some(ExecutionStatus::Reset))
    }

    /// Runs a program that has no reason to stop before its end.
    ///
    /// # Errors
    /// It is refused, or it stopped.
    pub fn run(&mut self, source: &str) -> Result<(), ProbeError> {
        match self.try_run(source)? {
            true => Ok(()),
            false => Err(stopped_midway()),
        }
    }

    /// The program has been started and waits.
    ///
    /// # Errors
    /// It stopped.
    pub fn expect_running(&mut self) -> Result<(), ProbeError> {
        match self.status()?.execution {
            ExecutionStatus::Running => Ok(()),
            ExecutionStatus::Reset | ExecutionStatus::Retry | ExecutionStatus::Continue => {
                Err(stopped_midway())
            }
        }
    }

    /// Waits for the end of the program that runs, and stops it if there is none.
    ///
    /// # Errors
    /// The reply is not an answer.
    pub fn finish(&mut self) -> Result<Option<ExecutionStatus>, ProbeError> {
        let ended = self.until_stopped(LONGEST_RUN)?;
        if ended.is_none() {
            self.command("SP")?;
            self.until_stopped(LONGEST_RUN)?;
        }
        Ok(ended)
    }

    /// The value of a variable of the selected file, as MR writes it.
    ///
    /// # Errors
    /// MR is refused.
    pub fn variable(&mut self, name: &str, kind: u8) -> Result<String, ProbeError> {
        let command = format!("MR,{name} {kind}");
        let execution = self.execution;
        let content = self.content(&command)?;
        // To read a value changes nothing.
        self.execution = execution;
        let content = content.ok_or_else(|| ProbeError::Refused(format!("{command} got NG")))?;
        Ok(String::from_utf8_lossy(&content).trim().to_owned())
    }
}

fn stopped_midway() -> ProbeError {
    ProbeError::Unexpected("the program of the survey stopped, and nothing in it says why".to_owned())
}
