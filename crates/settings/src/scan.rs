//! Reads a store back, whatever state a power loss left it in.

use super::flash::{Area, SettingsStore};
use super::record::{
    AreaHeader, Payload, RecordHeader, AREA_HEADER, COMMIT, MAX_PAYLOAD, MAX_RECORDS, OVERHEAD,
    RECORD_HEADER,
};
use heapless::Vec;

/// The most keys that a store can hold: the keys of the largest machine, and some that only another
/// version knows.
const MAX_KEYS: usize = MAX_RECORDS + 32;

/// The newest record of each key.
pub(super) type Index = Vec<Place, MAX_KEYS>;

/// The place of a key's newest record, in 4 bytes: a machine has some 180 of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) code: u16,
    /// The record's distance from the beginning of the area, in units of 4 bytes.
    words: u16,
}

impl Place {
    /// The record begins at `offset`, a multiple of 4 that is less than [`LARGEST`].
    pub(super) fn new(code: u16, offset: usize) -> Self {
        let words = (offset / 4) as u16; // fits, as `size` is no more than `LARGEST`
        Self { code, words }
    }

    pub(super) fn offset(self) -> usize {
        usize::from(self.words) * 4
    }
}

/// No more of an area is used, in bytes: see [`Place`].
const LARGEST: usize = 1 << 18;

/// Returns how much of an area is used, in bytes.
pub(super) fn size<S: SettingsStore>(flash: &S) -> usize {
    flash.size().min(LARGEST)
}

/// The end of the records of an area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tail {
    /// The last record is whole.
    Clean,
    /// The writing of the last record was cut short.
    CutShort,
    /// A record, at the end or before, is damaged.
    Damaged,
}

/// The condition of an area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AreaState {
    /// Its commit record is there.
    Committed { sequence: u32 },
    /// Erased, or never written.
    Erased,
    /// Erased as a whole: only its header is there, which is written after an erase.
    Prepared { sequence: u32 },
    /// Its writing was not finished: the other area stands.
    Unfinished,
    /// It is damaged, and may have been committed before.
    Damaged,
    /// Another version wrote it.
    Foreign,
}

/// All that can be read of an area.
#[derive(Debug)]
pub(super) struct Scan {
    pub(super) area: AreaState,
    pub(super) tail: Tail,
    /// The place of the next record; the size of the area if a record is bad.
    pub(super) end: usize,
    pub(super) index: Index,
}

impl Scan {
    fn empty(area: AreaState) -> Self {
        Self {
            area,
            tail: Tail::Clean,
            end: AREA_HEADER,
            index: Index::new(),
        }
    }

    pub(super) fn sequence(&self) -> Option<u32> {
        match self.area {
            AreaState::Committed { sequence } => Some(sequence),
            AreaState::Erased
            | AreaState::Prepared { .. }
            | AreaState::Unfinished
            | AreaState::Damaged
            | AreaState::Foreign => None,
        }
    }

    /// Takes in the record at `self.end`.
    fn step<S: SettingsStore>(
        &mut self,
        flash: &mut S,
        area: Area,
        header: RecordHeader,
        sequence: u32,
    ) -> Result<(), S::Error> {
        let place = Place::new(header.code, self.end);
        self.end += header.size();
        if read_payload(flash, area, place)?.is_none() {
            self.spoil(flash, area, self.end - 1)?;
        } else if header.code == COMMIT {
            self.area = AreaState::Committed { sequence };
        } else if !note(&mut self.index, place, header.length) {
            self.tail = Tail::Damaged;
        }
        Ok(())
    }

    /// Notes a bad record. It was cut short if nothing was written from `from` on.
    fn spoil<S: SettingsStore>(
        &mut self,
        flash: &mut S,
        area: Area,
        from: usize,
    ) -> Result<(), S::Error> {
        let cut = is_erased(flash, area, from)?;
        self.tail = match self.tail {
            Tail::Damaged => Tail::Damaged,
            Tail::Clean | Tail::CutShort if cut => Tail::CutShort,
            Tail::Clean | Tail::CutShort => Tail::Damaged,
        };
        Ok(())
    }
}

/// Reads an area from its header to its last record.
pub(super) fn scan<S: SettingsStore>(flash: &mut S, area: Area) -> Result<Scan, S::Error> {
    let mut header = [0; AREA_HEADER];
    flash.read(area, 0, &mut header)?;
    let sequence = match AreaHeader::read(&header) {
        AreaHeader::Valid { sequence } => sequence,
        AreaHeader::Foreign => return Ok(Scan::empty(AreaState::Foreign)),
        AreaHeader::Invalid if !is_erased(flash, area, AREA_HEADER)? => {
            return Ok(Scan::empty(AreaState::Damaged))
        }
        AreaHeader::Invalid if header == [0xff; AREA_HEADER] => {
            return Ok(Scan::empty(AreaState::Erased))
        }
        AreaHeader::Invalid => return Ok(Scan::empty(AreaState::Unfinished)),
    };
    let mut scan = Scan::empty(AreaState::Unfinished);
    while scan.end + OVERHEAD <= size(flash) {
        let mut bytes = [0; RECORD_HEADER];
        flash.read(area, scan.end, &mut bytes)?;
        match RecordHeader::read(bytes) {
            Some(header) if scan.end + header.size() <= size(flash) => {
                scan.step(flash, area, header, sequence)?
            }
            Some(_) | None => {
                let behind = scan.end + RECORD_HEADER;
                let is_end = bytes == [0xff; RECORD_HEADER] && is_erased(flash, area, behind)?;
                if !is_end {
                    scan.spoil(flash, area, behind)?;
                }
                break;
            }
        }
    }
    if (scan.area, scan.tail) == (AreaState::Unfinished, Tail::Damaged) {
        scan.area = AreaState::Damaged; // its commit record may be the damaged one
    }
    if (scan.end, scan.tail) == (AREA_HEADER, Tail::Clean) {
        scan.area = AreaState::Prepared { sequence };
    }
    if scan.tail != Tail::Clean {
        scan.end = size(flash); // nothing may be appended behind a bad record
    }
    Ok(scan)
}

/// Reads the payload of a record; `None` if it is damaged.
pub(super) fn read_payload<S: SettingsStore>(
    flash: &mut S,
    area: Area,
    place: Place,
) -> Result<Option<Payload>, S::Error> {
    let mut header = [0; RECORD_HEADER];
    flash.read(area, place.offset(), &mut header)?;
    let header = RecordHeader::read(header).filter(|header| header.code == place.code);
    let Some(header) = header else {
        return Ok(None);
    };
    let mut buffer = [0; MAX_PAYLOAD + 4];
    let Some(body) = buffer.get_mut(..header.size() - RECORD_HEADER) else {
        return Ok(None);
    };
    flash.read(area, place.offset() + RECORD_HEADER, body)?;
    let payload = header.payload(body);
    Ok(payload.and_then(|payload| Payload::from_slice(payload).ok()))
}

/// Returns whether nothing was written from `offset` to the end of the area.
fn is_erased<S: SettingsStore>(flash: &mut S, area: Area, offset: usize) -> Result<bool, S::Error> {
    let mut buffer = [0; 32];
    for start in (offset..size(flash)).step_by(buffer.len()) {
        let length = buffer.len().min(size(flash) - start);
        let Some(chunk) = buffer.get_mut(..length) else {
            return Ok(false);
        };
        flash.read(area, start, chunk)?;
        if chunk.iter().any(|byte| *byte != 0xff) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Notes where the newest record of a key is; a record without payload (`length` is 0) removes the
/// key. Returns whether there was room.
pub(super) fn note(index: &mut Index, place: Place, length: u8) -> bool {
    index.retain(|old| old.code != place.code);
    length == 0 || index.push(place).is_ok()
}
