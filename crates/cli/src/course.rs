//! A job that is run more than once, each time with other settings.

use super::input::Job;
use super::setting_args::Machine;
use super::stream::{Stream, Streamed};
use super::{unusable, Unusable};
use leadscrew_sim::link::Rate;
use std::io::{Cursor, Read};
use std::sync::Arc;

/// A job in memory, to be run more than once.
pub(super) struct Text {
    pub(super) name: String,
    bytes: Arc<[u8]>,
}

impl Text {
    pub(super) fn read(mut job: Job) -> Result<Self, Unusable> {
        let mut bytes = Vec::new();
        job.text
            .read_to_end(&mut bytes)
            .map_err(|error| unusable(format!("{}: cannot be read: {error}", job.name)))?;
        Ok(Self {
            name: job.name,
            bytes: bytes.into(),
        })
    }

    fn job(&self) -> Job {
        Job {
            name: self.name.clone(),
            size: Some(self.bytes.len() as u64),
            text: Box::new(Cursor::new(Arc::clone(&self.bytes))),
        }
    }
}

/// How the job is run, whatever the settings.
#[derive(Clone, Copy)]
pub(super) struct Course {
    pub(super) rate: Rate,
    pub(super) keep_going: bool,
    pub(super) quiet: bool,
}

impl Course {
    /// The same without a word on the terminal.
    pub(super) fn silent(self) -> Self {
        Self {
            quiet: true,
            ..self
        }
    }

    /// Runs the job with `settings` and all programmed feeds at `percent`.
    pub(super) fn run<O: leadscrew_sim::Observer>(
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
            quiet: self.quiet,
            mute: false,
            feed_percent: percent,
            keep_answers: true,
            warn: false,
        };
        stream.run(text.job(), observer)
    }
}
