//! The loads that heat, turn or burn, and when each goes off although no line says so: the one
//! table.
//!
//! | | laser | spindle | coolant | heaters, fan | outputs (M62, M64) |
//! |---|---|---|---|---|---|
//! | 0x18, the reset button, `$RST=`, the end of `$C` | off | off | off | off | as at power-up |
//! | an alarm that ends motion | off | off | off | off | as at power-up |
//! | another alarm | off | on, as in Grbl | on, as in Grbl | off | as at power-up |
//! | `$SLP` | off | off | off | off | off, but for those that stay |
//! | the door | dark | off, until `~` | off, until `~` | on | off, but for those that stay, until `~` |
//! | `!`, M0 | dark | on | on | on | as for the door |
//! | an M code that is put aside (M6) | dark | off, until `~` | off, until `~` | on | as for the door |
//! | M2, M30 | off | off | off | off | as at power-up |
//! | the sender is silent, or sends no G-code, for a time ([`Load::limits`]) | dark | off | off | off | off |
//! | the sender is gone | M5 after its lines | silent | silent | silent | silent |
//!
//! The last two rows are [`Machine`](crate::machine::Machine)'s watch over its sender. Time counts while what is on is left to itself: motion
//! rests, and no wait of a line is under way that ends by itself. Heaters count in a dwell, too.
//!
//! A spindle, coolant or outputs leave the machine in a hold: what a program needs is back with `~`,
//! and nothing is cut without it. Heaters that go off in a hold, at the door or in a tool change are
//! on again with the first `~`; the hold ends with a `~` once they are warm. In an alarm and in
//! check mode nothing goes on, so everything is off for good.

use crate::board::{Duration, Instant};
use crate::settings::table::Setting;
use crate::settings::values::Settings;

/// Something that heats, turns or burns.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Load {
    /// A laser that is lit at rest.
    Laser,
    /// A spindle that turns.
    Spindle,
    /// Coolant valves.
    Coolant,
    /// Heaters of an extension.
    Heat,
    /// Outputs of an extension that are off at power-up and on now.
    Outputs,
}

impl Load {
    /// All of them: `ALL[x as usize] == x`.
    pub const ALL: [Self; 5] = [
        Self::Laser,
        Self::Spindle,
        Self::Coolant,
        Self::Heat,
        Self::Outputs,
    ];

    /// Returns its name in messages, and the settings that say how many seconds it stays on:
    /// without a byte of its sender, and without a line of G-code.
    pub const fn limits(self) -> (&'static str, Setting, Setting) {
        match self {
            Self::Laser => ("Laser", Setting::LaserPatience, Setting::LaserUnfed),
            Self::Spindle => ("Spindle", Setting::SpindleSilence, Setting::SpindleUnfed),
            Self::Coolant => ("Coolant", Setting::CoolantSilence, Setting::CoolantUnfed),
            Self::Heat => ("Heaters", Setting::HeatSilence, Setting::HeatUnfed),
            Self::Outputs => ("Outputs", Setting::OutputsSilence, Setting::OutputsUnfed),
        }
    }
}

/// The times at which the sender was heard last, since a load is left to itself.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Watch {
    /// The last instant at which the sender was heard, or the load was not left to itself.
    heard: Instant,
    /// As [`Watch::heard`], for a line of G-code.
    fed: Instant,
}

/// The time that a load stays on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Limits {
    silent: Duration,
    /// `None`: for as long as the sender is heard.
    unfed: Option<Duration>,
}

/// The reason why a load goes off.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Why {
    Silent,
    Unfed,
}

impl Watch {
    /// Returns when the load goes off if nothing comes until then, and why.
    fn end(&self, limits: Limits) -> (Instant, Why) {
        let silent = (self.heard + limits.silent, Why::Silent);
        let unfed = limits.unfed.map(|unfed| (self.fed + unfed, Why::Unfed));
        match unfed {
            Some(unfed) if unfed.0 < silent.0 => unfed,
            Some(_) | None => silent,
        }
    }
}

/// The watches over all loads.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Guard {
    /// `None` while nothing that is on is left to itself; in it, `None` for a load that is off.
    watches: Option<[Option<Watch>; Load::ALL.len()]>,
    /// A line of G-code has come since the last look.
    pub(crate) fed: bool,
    /// The owner of the job has gone away, and nobody has sent G-code since.
    pub(crate) is_gone: bool,
    /// A laser has gone dark, until its program cuts again.
    pub(crate) is_dark: bool,
}

impl Guard {
    /// Notes that nothing that is on is left to itself: all loads have their whole time again.
    pub(crate) fn rest(&mut self) {
        self.watches = None;
    }

    /// Looks at a load: `limits`: how long it may stay on, if it is on and left to itself; `heard`:
    /// a byte of its sender has come since the last look. Returns the reason, once, when the load
    /// is to go off.
    pub(crate) fn watch(
        &mut self,
        load: Load,
        limits: Option<Limits>,
        heard: bool,
        now: Instant,
    ) -> Option<Why> {
        let fed = self.fed;
        let watches = self.watches.get_or_insert_default();
        let place = watches.get_mut(load as usize)?;
        let Some(limits) = limits else {
            *place = None;
            return None;
        };
        let watch = place.get_or_insert(Watch {
            heard: now,
            fed: now,
        });
        if heard {
            watch.heard = now;
        }
        if fed {
            watch.fed = now;
        }
        let (end, why) = watch.end(limits);
        if now < end {
            return None;
        }
        *place = None;
        Some(why)
    }

    /// Returns when a load of `kind` goes off if nothing is heard until then.
    pub(crate) fn end<const AXES: usize>(
        &self,
        kind: impl Fn(Load) -> bool,
        settings: &Settings<AXES>,
    ) -> Option<Instant> {
        let all = Load::ALL.iter().zip(self.watches.as_ref()?);
        let watched = all.filter_map(|(load, watch)| Some((*load, watch.as_ref()?)));
        watched
            .filter(|(load, _)| kind(*load))
            .filter_map(|(load, watch)| Some(watch.end(Limits::of(load, settings)?).0))
            .min()
    }
}

impl Limits {
    /// Those of a load; `None` if it stays on without its sender.
    pub(crate) fn of<const AXES: usize>(load: Load, settings: &Settings<AXES>) -> Option<Self> {
        let (_, silence, unfed) = load.limits();
        Some(Self {
            silent: seconds(settings, silence)?,
            unfed: seconds(settings, unfed),
        })
    }
}

/// The time of a setting in seconds, rounded up to a microsecond; `None` for 0.
fn seconds<const AXES: usize>(settings: &Settings<AXES>, setting: Setting) -> Option<Duration> {
    let micros = settings
        .value(setting)
        .nanos()
        .unsigned_abs()
        .div_ceil(1_000);
    (micros > 0).then(|| Duration::from_ticks(micros))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits {
        silent: Duration::from_ticks(100),
        unfed: None,
    };

    /// Returns when a load goes off, and why. `looks`: instants of a look, each with whether its
    /// sender was heard.
    fn end(limits: Option<Limits>, looks: &[(u64, bool)]) -> Option<(u64, Why)> {
        let mut guard = Guard::default();
        looks.iter().find_map(|(at, heard)| {
            let why = guard.watch(Load::Heat, limits, *heard, Instant::from_ticks(*at))?;
            Some((*at, why))
        })
    }

    #[test]
    fn a_silent_sender_s_load_goes_off_once_the_time_is_over() {
        let looks = [(0, true), (99, false), (100, false), (101, false)];
        assert_eq!(end(Some(LIMITS), &looks), Some((100, Why::Silent)));
        assert_eq!(end(None, &looks), None);
    }

    #[test]
    fn each_byte_begins_the_time_anew() {
        let looks = [(0, true), (99, true), (198, false), (199, false)];
        assert_eq!(end(Some(LIMITS), &looks), Some((199, Why::Silent)));
    }

    #[test]
    fn bytes_that_are_no_g_code_end_with_the_longer_time() {
        let limits = Limits {
            unfed: Some(Duration::from_ticks(250)),
            ..LIMITS
        };
        let looks: std::vec::Vec<_> = (0..30).map(|turn| (turn * 20, true)).collect();
        assert_eq!(end(Some(limits), &looks), Some((260, Why::Unfed)));
        assert_eq!(end(Some(LIMITS), &looks), None);
    }

    #[test]
    fn a_load_that_was_off_meanwhile_has_all_its_time() {
        let mut guard = Guard::default();
        let mut look =
            |limits, at| guard.watch(Load::Laser, limits, false, Instant::from_ticks(at));
        let looks = [
            look(Some(LIMITS), 0),
            look(None, 99),
            look(Some(LIMITS), 150),
            look(Some(LIMITS), 249),
            look(Some(LIMITS), 250),
        ];
        assert_eq!(looks, [None, None, None, None, Some(Why::Silent)]);
    }

    #[test]
    fn a_load_that_was_not_left_to_itself_meanwhile_has_all_its_time() {
        let mut guard = Guard::default();
        let look = |guard: &mut Guard, at| {
            guard.watch(Load::Coolant, Some(LIMITS), false, Instant::from_ticks(at))
        };
        assert_eq!(look(&mut guard, 0), None);
        guard.rest();
        assert_eq!(
            [150, 249, 250].map(|at| look(&mut guard, at)),
            [None, None, Some(Why::Silent)]
        );
    }

    #[test]
    fn a_load_s_place_is_its_number_and_its_settings_are_its_own() {
        let mut settings = std::vec::Vec::new();
        for (place, load) in Load::ALL.iter().enumerate() {
            assert_eq!(*load as usize, place);
            let (_, silence, unfed) = load.limits();
            settings.extend([silence.row().number, unfed.row().number]);
        }
        settings.sort_unstable();
        settings.dedup();
        assert_eq!(settings.len(), 2 * Load::ALL.len());
    }
}
