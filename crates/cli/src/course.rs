//! Runs a job more than once, each time with other settings.

use super::input::Job;
use super::told::{progress_bar, teller};
use super::{unusable, Unusable};
use leadscrew_jobs::{Machine, Stream, Streamed};
use leadscrew_sim::link::Rate;
use leadscrew_sim::Observer;
use std::io::{BufReader, Read};

/// A job in memory, to be run more than once.
pub(super) struct Text {
    pub(super) name: String,
    bytes: Vec<u8>,
}

impl Text {
    pub(super) fn read(mut job: Job) -> Result<Self, Unusable> {
        let mut bytes = Vec::new();
        job.text
            .read_to_end(&mut bytes)
            .map_err(|error| unusable(format!("{}: cannot be read: {error}", job.name)))?;
        Ok(Self {
            name: job.name,
            bytes,
        })
    }
}

/// The options of a run that do not depend on the settings.
#[derive(Clone, Copy)]
pub(super) struct Course {
    pub(super) rate: Rate,
    pub(super) keep_going: bool,
    pub(super) quiet: bool,
}

impl Course {
    /// The same options, with only errors shown on the terminal.
    pub(super) fn silent(self) -> Self {
        Self {
            quiet: true,
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
            keep_answers: true,
            warn: false,
            tell: teller(self.quiet),
        };
        let bar = progress_bar(self.quiet, Some(text.bytes.len() as u64));
        let done = stream.run(
            &text.name,
            BufReader::new(bar.wrap_read(&text.bytes[..])),
            observer,
        );
        bar.finish_and_clear();
        done.map_err(|error| unusable(format!("{}: cannot be read: {error}", text.name)))
    }
}
