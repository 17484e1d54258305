//! A machine and its one page without a server between them: frames in, frames out.

use crate::buttons::Buttons;
use crate::desk::Desk;
use crate::frames::{Nonsense, Said, SaidReader};
use crate::glitches::Glitches;
use crate::outlet::Outlet;
use crate::pace::Pace;
use crate::pages::{hello, Errand, PageAction, PageEvent, Pages};
use crate::trail::{Trail, Watcher};
use crate::wires::Wires;
use leadscrew_jobs::Job;
use leadscrew_machine::settings::store::Condition;
use leadscrew_sim::clock::cycles_of_micros;
use leadscrew_sim::flash::Flash;
use leadscrew_sim::link::Rate;
use leadscrew_sim::powered::Supply;
use leadscrew_sim::profile::Profile;
use leadscrew_sim::Fixtures;
use leadscrew_sim::PowerUp;
use std::cell::RefCell;
use std::sync::mpsc::Receiver;
use std::time::Duration;

/// The only page.
const PAGE: u64 = 0;

/// The page's channel to the machine, the only one.
const CHANNEL: usize = 0;

/// Simulated time in which a machine starts and prints its banner, cycles.
const START: u64 = cycles_of_micros(20_000);

/// Simulated time that passes in one call at most, cycles. The page's frames are read between
/// calls.
const SLICE: u64 = cycles_of_micros(25_000);

/// A machine in real time and its page. It lasts as long as the program: its memory is never freed.
pub struct Alone {
    desk: Desk<'static>,
    wires: Wires,
    pages: Pages,
    buttons: Buttons,
    glitches: Glitches,
    /// The machine's flash memory, in which settings survive a reset.
    flash: Flash,
    pace: Pace,
    said: SaidReader,
    frames: Receiver<Vec<u8>>,
}

impl Alone {
    /// Powers up the machine of this file at `now`, the time since any fixed instant. `kept` is the
    /// flash memory of an earlier run ([`Alone::changed_memory`]). The memory is blank if there is
    /// none, or if another version of the program has written it.
    pub fn power_up(file: &Profile, kept: Option<&[u8]>, now: Duration) -> Self {
        let trail = Trail::new(file.tooling());
        let trail: &'static RefCell<Trail> = Box::leak(Box::new(RefCell::new(trail)));
        let watcher = Box::leak(Box::new(Watcher(trail)));
        let supply = Supply {
            first: Some(file.first_settings().leak()),
            ..file.supply(Rate::NeverWaits)
        };
        let machine = Box::leak(file.power_up_for_good(supply, watcher));
        let mut desk = Desk::new(machine, trail, file.motor_count(), file.letters());
        let flash = load(kept, &mut desk);
        let mut wires = Wires::new(1);
        desk.run_until(&mut wires, desk.now() + START);

        let mut pages = Pages::new(Some(CHANNEL), 1, file.switches.normally_closed);
        pages.begin(&hello(file, Some(CHANNEL)));
        let (outlet, frames) = Outlet::new();
        let opened = PageEvent {
            page: PAGE,
            action: PageAction::Opened(outlet),
        };
        pages.handle(opened, &mut desk);
        if pages.agree_who_moves(&[], false) == Some(true) {
            desk.open_line(CHANNEL);
        }
        Self {
            pace: Pace::new(1.0, now, desk.now()),
            desk,
            wires,
            pages,
            buttons: Buttons::default(),
            glitches: Glitches::of(file),
            flash,
            said: SaidReader::default(),
            frames,
        }
    }

    /// Takes bytes of the page's frames; hands each job that is to be analysed to `look`.
    ///
    /// # Errors
    /// [`Nonsense`] at bytes that no page sends.
    pub fn hear(&mut self, bytes: &[u8], mut look: impl FnMut(Job)) -> Result<(), Nonsense> {
        let mut all: Vec<Said> = Vec::new();
        let read = self.said.read(bytes, |said| all.push(said));
        for said in all {
            let event = PageEvent {
                page: PAGE,
                action: PageAction::Said(said),
            };
            match self.pages.handle(event, &mut self.desk) {
                Some(Errand::Send(bytes)) => {
                    self.pages.wire(CHANNEL, false, &bytes);
                    self.wires.push(CHANNEL, &bytes);
                }
                Some(Errand::Press(key)) => self.buttons.press(key, &mut self.desk),
                Some(Errand::Look(job)) => look(job),
                None => {}
            }
        }
        read
    }

    /// Runs the machine up to `now`, or by at most `SLICE` if it is behind.
    pub fn go(&mut self, now: Duration) {
        let desk = &mut self.desk;
        let end = self.pace.due(now).min(desk.now() + SLICE);
        self.glitches.run_until(desk, &mut self.wires, end);
        self.pace.give_up(now, desk.now());
        let bytes = self.wires.written(CHANNEL);
        if !bytes.is_empty() {
            self.pages.wire(CHANNEL, true, &bytes);
        }
        self.buttons.release(desk);
        desk.save(&mut self.flash);
        self.pages.show(desk, now);
    }

    /// Returns the flash memory, if it has changed since the last call.
    pub fn changed_memory(&mut self) -> Option<&[u8]> {
        self.flash.changed().then(|| self.flash.bytes())
    }

    /// Returns the next frame for the page.
    pub fn next_frame(&mut self) -> Option<Vec<u8>> {
        self.frames.try_recv().ok()
    }
}

/// Gives the machine its stored values; returns its flash memory.
fn load(kept: Option<&[u8]>, desk: &mut Desk<'_>) -> Flash {
    let kept = kept.filter(|kept| kept.len() == Flash::SIZE);
    let mut flash = kept.map_or_else(Flash::blank, |kept| Flash::new(kept.to_vec()));
    if desk.load(&mut flash) == Condition::Foreign {
        flash = Flash::blank();
        desk.load(&mut flash);
    }
    flash
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Tag;
    use leadscrew_sim::scene::{Way, MOVE_BYTES};

    /// A frame as the page sends it.
    fn frame(tag: u8, content: &[u8]) -> Vec<u8> {
        let mut frame = vec![tag];
        frame.extend((content.len() as u32).to_le_bytes());
        frame.extend_from_slice(content);
        frame
    }

    fn frames(alone: &mut Alone) -> Vec<Vec<u8>> {
        std::iter::from_fn(|| alone.next_frame()).collect()
    }

    /// Lets `millis` milliseconds pass from `from` on; returns the frames that came.
    fn pass(alone: &mut Alone, from: u64, millis: u64) -> Vec<Vec<u8>> {
        let mut all = Vec::new();
        for now in (from..from + millis).step_by(10) {
            alone.go(Duration::from_millis(now));
            all.extend(frames(alone));
        }
        all
    }

    /// The name of the state in the last state frame.
    fn last_state(frames: &[Vec<u8>]) -> String {
        let mut states = frames.iter().filter(|frame| frame[0] == Tag::State as u8);
        let last = states.next_back().expect("a state");
        let axes = usize::from(last[7]);
        let text = String::from_utf8_lossy(&last[48 + 8 * axes..]).into_owned();
        let end = text.find(['|', '\n']).unwrap();
        text[..end].to_owned()
    }

    #[test]
    fn a_page_is_greeted_has_the_machine_and_moves_it() {
        let mut alone = Alone::power_up(&Profile::default(), None, Duration::ZERO);
        let greeting = frames(&mut alone);
        assert_eq!(greeting[0][0], Tag::Hello as u8);
        let role = greeting.last().unwrap();
        assert!(String::from_utf8_lossy(role).contains("\"controls\":true"));
        assert_eq!(last_state(&pass(&mut alone, 0, 200)), "Idle");

        // 10 mm at 10 mm/s, and ramps of 10 mm/s² at both ends: 2 s.
        let line = frame(1, b"G1X10F600\n");
        assert_eq!(alone.hear(&line, |_| panic!("no job")), Ok(()));
        assert_eq!(last_state(&pass(&mut alone, 200, 1000)), "Run");
        assert_eq!(last_state(&pass(&mut alone, 1200, 1500)), "Idle");
    }

    #[test]
    fn a_job_is_handed_over_with_the_settings_and_the_zero_of_the_machine() {
        let mut alone = Alone::power_up(&Profile::default(), None, Duration::ZERO);
        let lines = frame(1, b"$110=777\nG10L2P1X-7\n");
        alone.hear(&lines, |_| panic!("no job")).unwrap();
        pass(&mut alone, 0, 200);
        let mut jobs = Vec::new();
        let dropped = frame(3, b"{\"name\":\"a.nc\"}\nG0X1\n");
        alone.hear(&dropped, |job| jobs.push(job)).unwrap();
        let [job] = &jobs[..] else { panic!("{jobs:?}") };
        assert_eq!((&job.name[..], &job.text[..]), ("a.nc", &b"G0X1\n"[..]));
        assert!(job.settings.contains("$110=777"), "{}", job.settings);
        assert_eq!(job.origin[0], -7.0);
    }

    /// The settings of a machine that is powered up with this memory.
    fn settings_with(kept: Option<&[u8]>) -> String {
        let alone = Alone::power_up(&Profile::default(), kept, Duration::ZERO);
        alone.desk.settings_text()
    }

    #[test]
    fn a_feed_move_without_power_is_travel_as_soon_as_the_machine_has_a_laser() {
        let mut alone = Alone::power_up(&Profile::default(), None, Duration::ZERO);
        let lines = frame(1, b"G1X1F600\n$32=1\nM4S0\nG1X2\n");
        alone.hear(&lines, |_| panic!("no job")).unwrap();
        pass(&mut alone, 0, 3000);
        let trail = alone.desk.trail();
        let moves = trail.bytes(0, 9);
        let ways: Vec<u8> = moves.chunks(MOVE_BYTES).map(|one| one[16]).collect();
        assert_eq!(ways, [Way::Cut as u8, Way::Travel as u8]);
    }

    #[test]
    fn settings_outlast_the_page_in_the_memory_that_it_keeps() {
        let mut alone = Alone::power_up(&Profile::default(), None, Duration::ZERO);
        pass(&mut alone, 0, 100);
        alone.changed_memory();
        let line = frame(1, b"$110=777\n");
        alone.hear(&line, |_| panic!("no job")).unwrap();
        pass(&mut alone, 100, 200);
        let kept = alone.changed_memory().expect("a change").to_vec();
        assert_eq!(alone.changed_memory(), None);
        assert!(settings_with(Some(&kept)).contains("$110=777"));
        for unusable in [None, Some(&kept[1..]), Some(&[0; Flash::SIZE])] {
            assert!(settings_with(unusable).contains("$110=500"));
        }
    }

    /// The state and the fields of extensions in the last state frame.
    fn shown(frames: &[Vec<u8>]) -> String {
        let mut states = frames.iter().filter(|frame| frame[0] == Tag::State as u8);
        let last = states.next_back().expect("a state");
        let text = String::from_utf8_lossy(&last[48 + 8 * usize::from(last[7])..]).into_owned();
        text.split('\n').next().unwrap().to_owned()
    }

    /// The last report on the wire.
    fn reported(frames: &[Vec<u8>]) -> String {
        let wire = frames
            .iter()
            .filter(|frame| frame[0] == Tag::Wire as u8 && frame[2] == 1);
        let text: Vec<u8> = wire.flat_map(|frame| frame[8..].to_vec()).collect();
        let text = String::from_utf8_lossy(&text).into_owned();
        let begin = text.rfind('<').expect("a report");
        text[begin..].lines().next().unwrap().to_owned()
    }

    const HOMED: &str = "[homing]\non = true\nfeed_mm_min = 200\nseek_mm_min = 600\n\
        [axes.x]\nstart = -90\nlimits = { high = 0 }\n[axes.y]\nstart = -90\nlimits = { high = 0 }\n\
        [axes.z]\nstart = -90\nlimits = { high = 0 }\n";
    const TOOLS: &str = "[tool_change]\n";
    const TOOLS_SHOWN: &str = "[tool_change]\nshown = \"tool\"\n";
    const HEAT: &str =
        "[heaters.nozzle]\nsensor = \"ad595\"\nmost = 270\nextrusion = 50\nhottest = 300\n";

    /// Machine files, what is sent to them, and the state that follows.
    const STATES: [(&str, &str, &str); 20] = [
        ("", "", "Idle"),
        ("", "G1X50F100\n", "Run"),
        ("", "$J=G91X50F100\n", "Jog"),
        ("", "G1X50F100\n|!", "Hold:0"),
        ("", "G1X50F100\n|!|\x18", "Idle"),
        ("", "G1X50F100\n|\x18", "Alarm"),
        ("", "M0\n", "Hold:0"),
        ("", "G4P9\n", "Idle"),
        ("", "$C\n", "Check"),
        ("", "$SLP\n", "Sleep"),
        ("", "G38.2Z-1F600\n", "Alarm"),
        (HOMED, "", "Alarm"),
        (HOMED, "$X\n", "Idle"),
        (HOMED, "$H\n", "Home"),
        (TOOLS, "G1X1F500\n", "Idle"),
        (TOOLS, "M6T2\n", "Hold:0"),
        (TOOLS, "M6T2\n|\x18", "Idle"),
        (TOOLS_SHOWN, "M6T2\n", "Tool"),
        (HEAT, "M104S60\n", "Idle"),
        (HEAT, "M109S60\n", "Run"),
    ];

    #[test]
    fn a_page_is_told_the_state_of_the_wire_whatever_the_machine_is_and_does() {
        for (file, sent, expected) in STATES {
            let file = Profile::parse(std::path::Path::new("test.toml"), file).unwrap();
            let mut alone = Alone::power_up(&file, None, Duration::ZERO);
            let mut now = 0;
            for part in sent.split('|') {
                alone
                    .hear(&frame(1, part.as_bytes()), |_| panic!("no job"))
                    .unwrap();
                pass(&mut alone, now, 1000);
                now += 1000;
            }
            // A state that is the same before and after the report is that of the report. (The
            // temperatures that a warm heater shows may differ.)
            let before = shown(&pass(&mut alone, now, 100));
            alone.hear(&frame(1, b"?"), |_| panic!("no job")).unwrap();
            let after = pass(&mut alone, now + 100, 100);
            let report = reported(&after);
            let (name, own) = match before.split_once('|') {
                Some((name, own)) => (name, own.split(':').next().unwrap()),
                None => (before.as_str(), "MPos"),
            };
            assert_eq!(name, expected, "{sent:?}");
            assert!(
                report.starts_with(&format!("<{name}|")),
                "{sent:?}: {before} {report}"
            );
            assert!(
                report.contains(&format!("|{own}:")),
                "{sent:?}: {before} {report}"
            );
            assert_eq!(shown(&after).split('|').next().unwrap(), name, "{sent:?}");
        }
    }

    #[test]
    fn a_machine_that_is_far_behind_does_not_race() {
        let mut alone = Alone::power_up(&Profile::default(), None, Duration::ZERO);
        let hour = Duration::from_secs(3600);
        alone.go(hour);
        assert!(alone.desk.now().seconds() < 0.1);
        alone.go(hour + Duration::from_millis(10));
        assert!(alone.desk.now().seconds() < 0.1);
    }
}
