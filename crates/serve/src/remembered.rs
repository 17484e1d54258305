//! The values that outlive a restart of the machine, and if possible of the program.

use super::note::Note;
use super::state_file::{Fault, Found, StateFile};
use leadscrew_files::Lock;
use leadscrew_machine::settings::store::Condition;
use leadscrew_page::Desk;
use leadscrew_sim::flash::Flash;
use std::time::Duration;

/// The flash memory and its file.
pub(super) struct Remembered {
    flash: Flash,
    /// The stored values were lost, and nothing has been stored since.
    lost: bool,
    place: Place,
    /// The time at which the file is to be written again, because it lacks a change.
    again: Option<Duration>,
}

/// The store of the values.
enum Place {
    /// Nowhere: the caller wants no file.
    Nowhere,
    /// In a file that another program has. Nothing can be stored, so that each change is refused.
    InUse,
    /// In this file. The lock keeps other programs from it. If it could not be made, the file cannot
    /// be written either: the first change reports this.
    Ours(
        StateFile,
        #[expect(dead_code, reason = "held")] Option<Lock>,
    ),
}

/// The time after which a file that cannot be written is tried again.
const RETRY: Duration = Duration::from_secs(1);

impl Remembered {
    /// Reads the file, if there is one; reports unusable parts to `say`.
    pub(super) fn new(file: Option<StateFile>, say: &mut dyn FnMut(&Note<'_>)) -> Self {
        let place = file
            .as_ref()
            .map_or(Place::Nowhere, |file| claim(file, say));
        let image = file.map_or_else(|| Ok(Flash::blank()), |file| read(&file, &place, say));
        Self {
            lost: image.is_err(),
            flash: image.unwrap_or_else(|Lost| Flash::blank()),
            place,
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
                if let Place::Ours(file, _) = &self.place {
                    say(&Note::Damaged(file.copy(Flash::SIZE)));
                }
            }
            Condition::Foreign => {
                self.flash = Flash::blank();
                desk.load(&mut self.flash);
                if let Place::Ours(file, _) = &self.place {
                    say(&Note::SetAside(file.set_aside(Fault::Records)));
                }
            }
        }
    }

    /// Stores a machine's changes, and retries writes that failed before. `now` is the time since
    /// any fixed instant. The line that made a change is answered afterwards.
    pub(super) fn save(&mut self, desk: &mut Desk<'_>, now: Duration) -> Option<Note<'static>> {
        desk.save(&mut self.flash);
        let changed = self.flash.changed();
        let file = match &self.place {
            Place::Nowhere => return None,
            Place::InUse => {
                if changed {
                    desk.not_saved();
                }
                return None;
            }
            Place::Ours(file, _) => file,
        };
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

/// Claims the file.
fn claim(file: &StateFile, say: &mut dyn FnMut(&Note<'_>)) -> Place {
    match file.claim() {
        Ok(None) => {
            say(&Note::StateInUse(file.path().to_owned()));
            Place::InUse
        }
        Ok(claim) => Place::Ours(file.clone(), claim),
        Err(_) => Place::Ours(file.clone(), None),
    }
}

/// There was a file, but its contents cannot be used.
struct Lost;

/// Reads the file. One that cannot be used is renamed, unless another program has it.
fn read(file: &StateFile, place: &Place, say: &mut dyn FnMut(&Note<'_>)) -> Result<Flash, Lost> {
    match (file.load(Flash::SIZE), place) {
        (Ok(Found::Image(image)), _) => return Ok(Flash::new(image)),
        (Ok(Found::Nothing), _) => return Ok(Flash::blank()),
        (Ok(Found::Unusable(fault)), Place::Ours(file, _)) => {
            say(&Note::SetAside(file.set_aside(fault)));
        }
        // That program says it.
        (Ok(Found::Unusable(_)), Place::InUse | Place::Nowhere) => {}
        (Err(error), _) => say(&Note::UnreadState(file.path().to_owned(), error)),
    }
    Err(Lost)
}
