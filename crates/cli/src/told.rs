//! The lines on the terminal while a job runs: its errors as they come, and its progress.

use super::said::aside;
use indicatif::{ProgressBar, ProgressStyle};
use leadscrew_jobs::News;
use std::io::{self, IsTerminal};

/// The function that prints a job's news; if `quiet`, it prints only errors.
pub(super) fn teller(quiet: bool) -> fn(&News<'_>) {
    match quiet {
        true => tell_errors,
        false => tell,
    }
}

fn tell_errors(news: &News<'_>) {
    if let News::Complaint(complaint) = news {
        aside(complaint);
    }
}

fn tell(news: &News<'_>) {
    match news {
        News::Complaint(_) => tell_errors(news),
        News::Unlocked => aside("leadscrew: homing is on ($22=1): unlocked by $X, not homed; the job starts at machine position 0"),
        News::FurtherErrors => aside("leadscrew: further errors are counted, not shown"),
    }
}

/// A progress bar with the time left; hidden if there is no terminal.
pub(super) fn progress_bar(quiet: bool, size: Option<u64>) -> ProgressBar {
    if quiet || !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = match size {
        Some(size) => ProgressBar::new(size),
        None => ProgressBar::new_spinner(),
    };
    let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {eta} left");
    match style {
        Ok(style) if size.is_some() => bar.with_style(style),
        Ok(_) | Err(_) => bar,
    }
}
