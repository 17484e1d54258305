//! Runs a job more than once, each time with other settings.

use super::import::direct;
use super::input;
use super::told::{progress_bar, teller};
use super::{unusable, Unusable};
use leadscrew_jobs::{Machine, Stream, Streamed};
use leadscrew_sim::link::Rate;
use leadscrew_sim::Observer;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// A job that is run more than once.
pub(super) struct Text {
    pub(super) name: String,
    /// Notes about a file that was imported.
    pub(super) notes: Vec<String>,
    source: Source,
}

/// The source of a job's text, each time.
enum Source {
    /// A file. It is read a second time.
    File(PathBuf),
    /// Input that cannot be read twice, such as a pipe.
    Kept(Vec<u8>),
}

impl Text {
    pub(super) fn of(file: &Path, machine: &Machine) -> Result<Self, Unusable> {
        let job = input::open(file).map_err(unusable)?;
        let (mut job, notes) = direct(job, machine)?;
        let source = if file.is_file() && notes.is_empty() {
            Source::File(file.to_owned())
        } else {
            let mut bytes = Vec::new();
            let read = job.text.read_to_end(&mut bytes);
            read.map_err(|error| unreadable(&job.name, &error))?;
            Source::Kept(bytes)
        };
        Ok(Self {
            name: job.name,
            notes,
            source,
        })
    }

    /// The text from its beginning, and its size if that is known.
    fn open(&self) -> Result<(Option<u64>, Box<dyn BufRead + '_>), Unusable> {
        match &self.source {
            Source::File(file) => {
                let job = input::open(file).map_err(unusable)?;
                Ok((job.size, job.text))
            }
            Source::Kept(bytes) => Ok((Some(bytes.len() as u64), Box::new(&bytes[..]))),
        }
    }
}

fn unreadable(name: &str, error: &io::Error) -> Unusable {
    unusable(format!("{name}: cannot be read: {error}"))
}

/// The options of a run that do not depend on the settings.
#[derive(Clone, Copy)]
pub(super) struct Course {
    pub(super) rate: Rate,
    pub(super) keep_going: bool,
    pub(super) quiet: bool,
    /// True if to keep which line each answer was for.
    pub(super) keep_answers: bool,
    /// True if only times count.
    pub(super) only_times: bool,
}

impl Course {
    /// The same options for times alone, with only errors shown on the terminal.
    pub(super) fn silent(self) -> Self {
        Self {
            quiet: true,
            keep_answers: false,
            only_times: true,
            ..self
        }
    }

    /// Runs the job on `machine` with a feed override of `percent`; `observer` watches.
    pub(super) fn run<O: Observer>(
        &self,
        text: &Text,
        machine: &Machine,
        percent: u8,
        observer: O,
    ) -> Result<Streamed<O>, Unusable> {
        let stream = Stream {
            machine,
            rate: self.rate,
            keep_going: self.keep_going,
            feed_percent: percent,
            keep_answers: self.keep_answers,
            warn: false,
            only_times: self.only_times,
            knows_place: false,
            tell: teller(self.quiet),
        };
        let (size, reader) = text.open()?;
        let bar = progress_bar(self.quiet, size);
        let reader = BufReader::new(bar.wrap_read(reader));
        let done = stream.run(&text.name, reader, observer);
        bar.finish_and_clear();
        done.map_err(|error| unreadable(&text.name, &error))
    }
}
