//! Writes transcripts to files during a run. After [`Recorder::flush`] all records have left the process, so that a killed
//! process leaves a complete transcript. An error of the disk ends the transcript, never the run.

use super::{Format, Header, Record, TranscriptFile, Writer};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tracing::error;
use ts3100_driver::files::{self, PathError, cannot};

/// Largest transcript that is written, in bytes; it ends there.
pub const MAX_BYTES: u64 = 4 * 1024 * 1024 * 1024;

struct Output {
    path: PathBuf,
    file: Box<dyn Write + Send>,
    writer: Box<dyn Writer>,
    /// Records since the last flush.
    unflushed: Vec<u8>,
    written: u64,
}

impl Output {
    fn begin(
        path: &Path,
        file: io::Result<impl Write + Send + 'static>,
        writer: Box<dyn Writer>,
        header: &Header,
    ) -> Result<Output, PathError> {
        let begun = file.and_then(|file| {
            let mut output = Output {
                path: path.to_path_buf(),
                file: Box::new(file),
                writer,
                unflushed: Vec::new(),
                written: 0,
            };
            output.writer.header(header, &mut output.unflushed);
            output.flush()?;
            Ok(output)
        });
        begun.map_err(cannot("write the transcript", path))
    }

    fn record(&mut self, record: &Record) {
        self.writer.record(record, &mut self.unflushed);
    }

    fn flush(&mut self) -> io::Result<()> {
        let length = self.unflushed.len() as u64;
        if self.written + length > MAX_BYTES {
            return Err(io::Error::other(format!(
                "it has reached the limit of {MAX_BYTES} bytes"
            )));
        }
        let done = self
            .file
            .write_all(&self.unflushed)
            .and_then(|()| self.file.flush());
        self.unflushed.clear();
        self.written += length;
        done
    }
}

/// The files of the transcripts of one run.
#[derive(Default)]
pub struct Recorder {
    outputs: Vec<Output>,
}

impl Recorder {
    /// Begins a transcript in each of these files; existing ones are replaced. `base` is the time of the first moment
    /// since 1970 in a capture.
    ///
    /// # Errors
    /// The first file that cannot be written.
    pub fn create(
        targets: &[TranscriptFile],
        header: &Header,
        base: Duration,
    ) -> Result<Recorder, PathError> {
        let begin = |target: &TranscriptFile| {
            let (path, writer) = (&target.path, target.format.writer(base));
            Output::begin(path, files::create(path), writer, header)
        };
        let outputs = targets.iter().map(begin).collect::<Result<_, _>>()?;
        Ok(Recorder { outputs })
    }

    /// A transcript as text on stdout.
    ///
    /// # Errors
    /// stdout cannot be written.
    pub fn on_stdout(header: &Header) -> Result<Recorder, PathError> {
        let writer = Format::Text.writer(Duration::ZERO);
        let output = Output::begin(Path::new("stdout"), Ok(io::stdout()), writer, header)?;
        Ok(Recorder {
            outputs: vec![output],
        })
    }

    /// Whether anything is written at all.
    pub fn is_on(&self) -> bool {
        !self.outputs.is_empty()
    }

    /// Takes a record; it is in the files after [`Recorder::flush`].
    pub fn record(&mut self, record: &Record) {
        self.outputs.iter_mut().for_each(|output| output.record(record));
    }

    /// Writes the collected records. A file that cannot be written is given up with a line in the log.
    pub fn flush(&mut self) {
        self.outputs.retain_mut(|output| {
            if output.unflushed.is_empty() {
                return true;
            }
            let done = output.flush();
            if let Err(reason) = &done {
                let path = output.path.display().to_string();
                error!(
                    event = "transcript-ended",
                    path, "the transcript {path} ends here: {reason}"
                );
            }
            done.is_ok()
        });
    }
}
