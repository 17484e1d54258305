//! The values that outlive a restart of the machine, and where possible of the program.

use super::note::Note;
use super::state_file::{Fault, Found, StateFile};
use leadscrew_machine::settings::store::Condition;
use leadscrew_page::Desk;
use leadscrew_sim::flash::Flash;
use std::fs::File;
use std::io;
use std::time::Duration;

/// The flash memory and its file.
pub(super) struct Remembered {
    flash: Flash,
    /// The stored values were lost, and nothing has been stored since.
    lost: bool,
    file: Option<StateFile>,
    /// The lock that keeps other programs from the file.
    _claim: Option<File>,
    /// The time at which the file is to be written again, because it lacks a change.
    again: Option<Duration>,
}

/// How often a file that cannot be written is tried again.
const RETRY: Duration = Duration::from_secs(1);

impl Remembered {
    /// Reads the file, if there is one; reports unusable parts to `say`.
    pub(super) fn new(file: Option<StateFile>, say: &mut dyn FnMut(&Note<'_>)) -> Self {
        let image = file
            .as_ref()
            .map_or_else(|| Ok(Flash::blank()), |file| read(file, say));
        let (file, claim) = claim(file, say);
        Self {
            lost: image.is_err(),
            flash: image.unwrap_or_else(|Lost| Flash::blank()),
            file,
            _claim: claim,
            again: None,
        }
    }

    /// Gives a machine the stored values. A file with records of another version is set aside.
    pub(super) fn load(&mut self, desk: &mut Desk<'_>, say: &mut dyn FnMut(&Note<'_>)) {
        let condition = desk.load(&mut self.flash);
        self.lost |= condition == Condition::Foreign;
        if self.lost {
            desk.distrust_settings();
        }
        match condition {
            Condition::Sound | Condition::Blank => {}
            Condition::CutShort => say(&Note::LastChangeLost),
            Condition::Damaged => {
                if let Some(file) = &self.file {
                    say(&Note::Damaged(file.copy()));
                }
            }
            Condition::Foreign => {
                self.flash = Flash::blank();
                desk.load(&mut self.flash);
                if let Some(file) = &self.file {
                    say(&Note::SetAside(file.set_aside(Fault::Records)));
                }
            }
        }
    }

    /// Stores a machine's changes, and retries writes that failed before. `now` is the time since
    /// any fixed instant. The line that made a change is answered afterwards.
    pub(super) fn save(&mut self, desk: &mut Desk<'_>, now: Duration) -> Option<Note<'static>> {
        desk.save(&mut self.flash);
        let file = self.file.as_ref()?;
        let changed = self.flash.changed();
        self.lost &= !changed;
        let again = self.again.is_some_and(|again| again <= now);
        if !changed && !again {
            return None;
        }
        let path = || file.path().to_owned();
        match file.save(self.flash.bytes()) {
            Ok(()) => self.again.take().map(|_| Note::StateAgain(path())),
            Err(error) => {
                if changed {
                    desk.not_saved();
                }
                let first = self.again.replace(now + RETRY).is_none();
                first.then(|| Note::NoState(path(), error))
            }
        }
    }
}

/// The file, if this program may write it.
fn claim(
    file: Option<StateFile>,
    say: &mut dyn FnMut(&Note<'_>),
) -> (Option<StateFile>, Option<File>) {
    let Some(file) = file else {
        return (None, None);
    };
    match file.claim() {
        Ok(None) => {
            say(&Note::StateInUse(file.path().to_owned()));
            (None, None)
        }
        Ok(claim) => (Some(file), claim),
        // If the lock cannot be made, the file cannot be written either: the first change reports
        // this.
        Err(_) => (Some(file), None),
    }
}

/// There was a file, but its contents cannot be used.
struct Lost;

fn read(file: &StateFile, say: &mut dyn FnMut(&Note<'_>)) -> Result<Flash, Lost> {
    let unreadable = |error: io::Error| Note::UnreadState(file.path().to_owned(), error);
    match file.load(Flash::SIZE) {
        Ok(Found::Image(image)) => return Ok(Flash::new(image)),
        Ok(Found::Nothing) => return Ok(Flash::blank()),
        Ok(Found::Unusable(aside)) => say(&Note::SetAside(aside)),
        Err(error) => say(&unreadable(error)),
    }
    Err(Lost)
}
