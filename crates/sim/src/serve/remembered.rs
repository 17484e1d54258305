//! What outlives a restart of the machine, and where it can, of the program.

use super::desk::Desk;
use super::note::Note;
use super::state_file::{Fault, Found, StateFile};
use crate::flash::Flash;
use leadscrew_machine::settings::store::Condition;
use std::fs::File;
use std::io;

/// The flash memory and its file.
pub(super) struct Remembered {
    flash: Flash,
    file: Option<StateFile>,
    /// Keeps other programs from the file.
    _claim: Option<File>,
    /// Whether it has been said that the file cannot be written.
    told: bool,
}

impl Remembered {
    /// Reads the file, if there is to be one; tells `say` what could not be used.
    pub(super) fn new(file: Option<StateFile>, say: &mut dyn FnMut(&Note<'_>)) -> Self {
        let flash = file
            .as_ref()
            .map_or_else(Flash::blank, |file| read(file, say));
        let (file, claim) = claim(file, say);
        Self {
            flash,
            file,
            _claim: claim,
            told: false,
        }
    }

    /// Gives a machine what is stored. What another version has stored is put aside.
    pub(super) fn load(&mut self, desk: &mut dyn Desk, say: &mut dyn FnMut(&Note<'_>)) {
        match desk.load(&mut self.flash) {
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

    /// Stores what a machine has changed.
    pub(super) fn save(&mut self, desk: &mut dyn Desk) -> Option<Note<'static>> {
        desk.save(&mut self.flash);
        let (image, file) = (self.flash.changed()?, self.file.as_ref()?);
        match file.save(image) {
            Ok(()) => {
                self.told = false;
                None
            }
            Err(error) => {
                let first = !std::mem::replace(&mut self.told, true);
                first.then(|| Note::NoState(file.path().to_owned(), error))
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
        // Where nothing can be claimed, nothing can be written: the first change says so.
        Err(_) => (Some(file), None),
    }
}

fn read(file: &StateFile, say: &mut dyn FnMut(&Note<'_>)) -> Flash {
    let unreadable = |error: io::Error| Note::UnreadState(file.path().to_owned(), error);
    match file.load(Flash::SIZE) {
        Ok(Found::Image(image)) => return Flash::new(image),
        Ok(Found::Nothing) => {}
        Ok(Found::Unusable(aside)) => say(&Note::SetAside(aside)),
        Err(error) => say(&unreadable(error)),
    }
    Flash::blank()
}
