//! The settings in force.

use super::table::{AxisSetting, Kind, Row, Setting};
use core::fmt;
use heapless::Vec;
use leadscrew_gcode::Number;
use leadscrew_interpreter::axes::WITHOUT_EXTRUDER;
use leadscrew_protocol::decimal::Decimal;
use leadscrew_protocol::status::Status;

/// The board's bounds on step pulse and step rate. A setting beyond them cannot work, whatever the
/// other settings are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StepLimits {
    /// The shortest pulse, µs.
    pub shortest_pulse_us: u8,
    /// The highest step rate, with the shortest pulse, steps/s.
    pub highest_rate: u32,
}

/// Settings that the machine has once.
const SCALARS: usize = Setting::ALL.len();
/// Settings that each axis has.
const GROUPS: usize = AxisSetting::ALL.len();
const ZERO: Number = Number::from_int(0);

/// A setting's number and its value, to be stored and loaded. Its layout is C's: the value is at
/// byte 8, in units of 10⁻⁹. A board may have entries in its flash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Entry {
    /// The number after the `$`.
    pub number: u16,
    /// Its value.
    pub value: Number,
}

/// The changes of one `$n=v`, in the order in which they must be stored: at most two settings.
pub type Changes = Vec<Entry, 2>;

/// One setting of one machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Key {
    /// A setting of the machine.
    Machine(Setting),
    /// A setting of an axis, counted from 0.
    Axis(AxisSetting, usize),
}

impl Key {
    /// Returns how many settings a machine with `axes` axes has: at most [`MAX_AXES`].
    pub const fn count(axes: usize) -> usize {
        SCALARS + GROUPS * axes
    }

    /// Returns all settings of a machine with `axes` axes.
    pub fn all(axes: usize) -> impl Iterator<Item = Self> {
        (0..).map_while(move |place| Self::at(place, axes))
    }

    /// Returns the setting at a place in [`Key::all`], from 0; `None` beyond the last.
    pub fn at(place: usize, axes: usize) -> Option<Self> {
        let Some(place) = place.checked_sub(SCALARS) else {
            return Setting::ALL.get(place).copied().map(Self::Machine);
        };
        let group = AxisSetting::ALL.get(place.checked_div(axes)?)?;
        Some(Self::Axis(*group, place % axes))
    }

    /// Returns the setting's place in [`Key::all`].
    pub fn place(self, axes: usize) -> usize {
        match self {
            Self::Machine(setting) => setting as usize,
            Self::Axis(setting, axis) => SCALARS + setting as usize * axes + axis,
        }
    }

    /// Finds the setting of a number on a machine with `axes` axes.
    pub fn from_number(number: u16, axes: usize) -> Option<Self> {
        let machine = Setting::ALL
            .iter()
            .find(|setting| setting.row().number == number);
        if let Some(setting) = machine {
            return Some(Self::Machine(*setting));
        }
        AxisSetting::ALL.iter().find_map(|setting| {
            let axis = usize::from(number.checked_sub(setting.row().number)?);
            (axis < axes).then_some(Self::Axis(*setting, axis))
        })
    }

    /// Returns the setting's number.
    pub fn number(self) -> u16 {
        match self {
            Self::Machine(setting) => setting.row().number,
            Self::Axis(setting, axis) => setting.row().number + axis as u16, // fewer than 10 axes
        }
    }

    /// Returns the row of the table.
    pub fn row(self) -> Row {
        match self {
            Self::Machine(setting) => setting.row(),
            Self::Axis(setting, _) => setting.row(),
        }
    }

    fn is_signed(self) -> bool {
        matches!(self.row().kind, Kind::Signed { .. })
    }
}

/// The most axes that a machine can have: settings of an axis are ten numbers apart.
pub const MAX_AXES: usize = 9;

/// The settings of a machine with at most [`MAX_AXES`] axes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings<const AXES: usize> {
    scalars: [Number; SCALARS],
    axes: [[Number; AXES]; GROUPS],
    /// The number of axes that the machine has.
    count: usize,
    /// This machine's defaults that differ from the table's.
    defaults: &'static [Entry],
}

impl<const AXES: usize> Default for Settings<AXES> {
    fn default() -> Self {
        Self::new(&[])
    }
}

impl<const AXES: usize> Settings<AXES> {
    /// Makes the settings of a new machine: the table's defaults, or the machine's own if
    /// `defaults` has one.
    pub fn new(defaults: &'static [Entry]) -> Self {
        Self::of_axes(AXES, defaults)
    }

    /// As [`Settings::new`], for a machine that has only the first `count` axes, at most `AXES`.
    pub fn of_axes(count: usize, defaults: &'static [Entry]) -> Self {
        let mut settings = Self {
            scalars: [ZERO; SCALARS],
            axes: [[ZERO; AXES]; GROUPS],
            count: count.min(AXES),
            defaults,
        };
        settings.restore_defaults();
        settings
    }

    /// Goes back to the defaults: `$RST=$`.
    pub fn restore_defaults(&mut self) {
        for key in Key::all(AXES) {
            self.put(key, key.row().default);
        }
        for entry in self.defaults {
            self.load(*entry);
        }
    }

    /// Returns a setting of the machine, exactly.
    pub fn value(&self, setting: Setting) -> Number {
        self.scalars.get(setting as usize).copied().unwrap_or(ZERO)
    }

    /// Returns a whole setting, or the whole part of another.
    pub fn whole(&self, setting: Setting) -> u32 {
        u32::try_from(self.value(setting).trunc()).unwrap_or(0)
    }

    /// Returns a mask.
    pub fn mask(&self, setting: Setting) -> u8 {
        u8::try_from(self.value(setting).trunc()).unwrap_or(u8::MAX)
    }

    /// Returns whether a switch is on.
    pub fn is_on(&self, setting: Setting) -> bool {
        self.value(setting) != ZERO
    }

    /// Returns a setting of all axes, exactly.
    pub fn axes(&self, setting: AxisSetting) -> [Number; AXES] {
        self.axes
            .get(setting as usize)
            .copied()
            .unwrap_or([ZERO; AXES])
    }

    /// Changes a setting: `$n=v`. Returns the changes to store, in that order: a power loss in
    /// between then leaves no forbidden combination behind.
    ///
    /// `limits`: the board's step limits.
    ///
    /// # Errors
    ///
    /// The first of: negative value, no such setting, out of range, step pulse too short, soft
    /// limits without homing, step rate too high. Nothing is changed then.
    pub fn set(&mut self, entry: Entry, limits: StepLimits) -> Result<Changes, Status> {
        let key = self.key(entry.number);
        if entry.value < ZERO && !key.is_some_and(Key::is_signed) {
            return Err(Status::NegativeValue);
        }
        let key = key.ok_or(Status::InvalidStatement)?;
        let value = fitted(key.row().kind, entry.value)?;
        self.check(key, value, limits)?;
        let mut changes = Changes::new();
        let homing_off = key == Key::Machine(Setting::Homing) && value == ZERO;
        if homing_off && self.is_on(Setting::SoftLimits) {
            self.change(Key::Machine(Setting::SoftLimits), ZERO, &mut changes);
        }
        self.change(key, value, &mut changes);
        Ok(changes)
    }

    /// Takes a stored value, which was accepted once: the board's step limits are not checked
    /// again. Returns `false` if there is no such setting, or if the value is out of range.
    pub fn load(&mut self, entry: Entry) -> bool {
        let Some(key) = self.key(entry.number) else {
            return false;
        };
        match fitted(key.row().kind, entry.value) {
            Ok(value) if value >= ZERO || key.is_signed() => {
                self.put(key, value);
                true
            }
            Ok(_) | Err(_) => false,
        }
    }

    /// Returns the rows of `$$`, from 0, by rising number; `None` beyond the last.
    pub fn listed(&self, index: usize) -> Option<SettingLine> {
        self.keys()
            .filter(|key| key.row().listed)
            .nth(index)
            .map(|key| self.line(key))
    }

    /// Returns all rows, from 0, the machine's before the axes'; `None` beyond the last.
    pub fn any(&self, index: usize) -> Option<SettingLine> {
        Key::at(index, self.axis_count()).map(|key| self.line(key))
    }

    /// Returns all settings of this machine.
    pub fn keys(&self) -> impl Iterator<Item = Key> + use<AXES> {
        Key::all(self.axis_count())
    }

    /// Finds the setting of a number.
    pub fn key(&self, number: u16) -> Option<Key> {
        Key::from_number(number, self.axis_count())
    }

    /// Returns how many axes there are.
    pub fn axis_count(&self) -> usize {
        if AXES <= WITHOUT_EXTRUDER {
            return AXES;
        }
        self.count
    }

    fn check(&self, key: Key, value: Number, limits: StepLimits) -> Result<(), Status> {
        let rate = i64::from(limits.highest_rate) * ONE;
        let pulse = Number::from_int(limits.shortest_pulse_us.into());
        match key {
            Key::Machine(Setting::StepPulse) if value < pulse => Err(Status::StepPulseTooShort),
            Key::Machine(Setting::SoftLimits) if value != ZERO && !self.is_on(Setting::Homing) => {
                Err(Status::SoftLimitsNeedHoming)
            }
            // 0 is for ever; a time that prints as 0 would be restored as that.
            Key::Machine(Setting::LaserPatience) if value != ZERO && value < MILLI => {
                Err(Status::OutOfRange)
            }
            // Each is checked by itself: steps/mm for an axis at 1 mm/s, a rate for an axis with 1
            // step/mm.
            Key::Axis(AxisSetting::StepsPerMm, _) if value.nanos() > rate => {
                Err(Status::StepRateTooHigh)
            }
            Key::Axis(AxisSetting::MaxRate, _) if value.nanos() / 60 > rate => {
                Err(Status::StepRateTooHigh)
            }
            Key::Machine(_) | Key::Axis(_, _) => Ok(()),
        }
    }

    fn change(&mut self, key: Key, value: Number, changes: &mut Changes) {
        self.put(key, value);
        let number = key.number();
        let _full = changes.push(Entry { number, value }); // two at most
    }

    /// Returns the value of any setting, exactly.
    pub fn get(&self, key: Key) -> Number {
        match key {
            Key::Machine(setting) => self.value(setting),
            Key::Axis(setting, axis) => self.axes(setting).get(axis).copied().unwrap_or(ZERO),
        }
    }

    fn put(&mut self, key: Key, value: Number) {
        let place = match key {
            Key::Machine(setting) => self.scalars.get_mut(setting as usize),
            Key::Axis(setting, axis) => {
                let group = self.axes.get_mut(setting as usize);
                group.and_then(|group| group.get_mut(axis))
            }
        };
        if let Some(place) = place {
            *place = value;
        }
    }

    /// Returns a setting as `$$` prints it.
    pub fn line(&self, key: Key) -> SettingLine {
        SettingLine::new(key.number(), key.row().kind, self.get(key))
    }
}

impl SettingLine {
    /// Makes the row of a setting of this kind.
    pub fn new(number: u16, kind: Kind, value: Number) -> Self {
        let value = match kind {
            Kind::Decimal { places: 3, .. } | Kind::Signed { .. } => Decimal::millimetres(value),
            Kind::Decimal { .. }
            | Kind::AxisMask
            | Kind::Bits(_)
            | Kind::Switch
            | Kind::Whole { .. } => Decimal::whole(value),
        };
        Self { number, value }
    }
}

/// One, in 10⁻⁹.
const ONE: i64 = 1_000_000_000;
/// The least time that `$$` does not print as 0.
const MILLI: Number = Number::from_nanos(ONE / 1_000);

/// Returns the value as a setting of this kind keeps it.
///
/// # Errors
///
/// The value is negative and the kind is not signed, or it is out of range.
pub fn checked(kind: Kind, value: Number) -> Result<Number, Status> {
    if value < ZERO && !matches!(kind, Kind::Signed { .. }) {
        return Err(Status::NegativeValue);
    }
    fitted(kind, value)
}

fn fitted(kind: Kind, value: Number) -> Result<Number, Status> {
    let whole = |max: u32| match u32::try_from(value.trunc()) {
        Ok(whole) if whole <= max => Ok(Number::from_nanos(i64::from(whole) * ONE)),
        Ok(_) | Err(_) => Err(Status::OutOfRange),
    };
    match kind {
        Kind::AxisMask | Kind::Bits(_) => whole(255),
        Kind::Switch => whole(255).map(|value| Number::from_int(i32::from(value != ZERO))),
        Kind::Whole { max } => whole(max),
        Kind::Decimal { zero: false, .. } if value == ZERO => Err(Status::OutOfRange),
        // A number that is too large to be read becomes the largest one.
        Kind::Decimal { .. } if value == Number::MAX => Err(Status::OutOfRange),
        Kind::Decimal { .. } => Ok(value),
        Kind::Signed { most } => {
            let fits = value.nanos().unsigned_abs() <= u64::from(most) * ONE as u64;
            fits.then_some(value).ok_or(Status::OutOfRange)
        }
    }
}

/// A row of `$$`, displayed without its line end in at most 20 characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SettingLine {
    number: u16,
    value: Decimal,
}

impl fmt::Display for SettingLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "${}={}", self.number, self.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::string::{String, ToString};
    use std::vec;

    /// The limits of a replayed Grbl.
    const LIMITS: StepLimits = StepLimits {
        shortest_pulse_us: 3,
        highest_rate: 500_000,
    };

    fn number(text: &str) -> Number {
        leadscrew_gcode::leading_number(text.as_bytes()).unwrap().0
    }

    fn set(settings: &mut Settings<3>, line: &str) -> Result<Changes, Status> {
        let (n, value) = line.split_once('=').unwrap();
        let entry = Entry {
            number: n.parse().unwrap(),
            value: number(value),
        };
        settings.set(entry, LIMITS)
    }

    fn rows(settings: &Settings<3>) -> std::vec::Vec<String> {
        (0..)
            .map_while(|index| settings.listed(index))
            .map(|line| line.to_string())
            .collect()
    }

    fn ours(settings: &Settings<3>, setting: Setting) -> String {
        settings.line(Key::Machine(setting)).to_string()
    }

    /// The value of `n` in `$$` after the lines.
    fn shown(lines: &[&str], n: &str) -> String {
        let mut settings = Settings::<3>::default();
        for line in lines {
            set(&mut settings, line).unwrap();
        }
        let prefix = std::format!("${n}=");
        let row = rows(&settings)
            .into_iter()
            .find(|row| row.starts_with(&prefix))
            .unwrap();
        row[prefix.len()..].to_string()
    }

    #[test]
    fn a_new_machine_prints_grbl_s_34_rows() {
        let grbl = "$0=10 $1=25 $2=0 $3=0 $4=0 $5=0 $6=0 $10=1 $11=0.010 $12=0.002 $13=0 $20=0 $21=0 $22=0 $23=0 $24=25.000 \
                    $25=500.000 $26=250 $27=1.000 $30=1000 $31=0 $32=0 $100=250.000 $101=250.000 $102=250.000 $110=500.000 \
                    $111=500.000 $112=500.000 $120=10.000 $121=10.000 $122=10.000 $130=200.000 $131=200.000 $132=200.000";
        let expected: vec::Vec<&str> = grbl.split_whitespace().collect();
        assert_eq!(expected.len(), 34);
        assert_eq!(rows(&Settings::default()), expected);
    }

    #[test]
    fn values_are_kept_exactly_and_printed_as_grbl_prints_them() {
        let cases = [
            ("0", "3.1", "3"),
            ("1", "1.9", "1"),
            ("2", "255", "255"),
            ("10", "255", "255"),
            ("13", "2", "1"),
            ("5", "0.5", "0"),
            ("26", "65535", "65535"),
            ("30", "24000.5", "24001"),
            ("11", "0.123456789", "0.123"),
            ("100", "123.4565", "123.457"),
            ("101", "0.0005", "0.001"),
            ("110", "1234567.891", "1234567.891"),
            ("120", "12.3456", "12.346"),
            ("132", "214748.3647", "214748.365"),
        ];
        for (n, value, printed) in cases {
            assert_eq!(
                shown(&[&std::format!("{n}={value}")], n),
                printed,
                "${n}={value}"
            );
        }
        let mut settings = Settings::<3>::default();
        set(&mut settings, "101=0.123456789").unwrap();
        assert_eq!(
            settings.axes(AxisSetting::StepsPerMm)[1],
            number("0.123456789")
        );
    }

    #[test]
    fn what_does_not_fit_is_refused_and_changes_nothing() {
        use Status::*;
        let cases = [
            ("1=-1", NegativeValue),
            ("999=-1", NegativeValue),
            ("7=1", InvalidStatement),
            ("33=1", InvalidStatement),
            ("103=1", InvalidStatement),
            ("133=1", InvalidStatement),
            ("256=1", InvalidStatement),
            ("65535=1", InvalidStatement),
            ("0=256", OutOfRange),
            ("0=1000", OutOfRange),
            ("1=256", OutOfRange),
            ("10=256", OutOfRange),
            ("13=256", OutOfRange),
            ("26=65536", OutOfRange),
            ("1=99999999999", OutOfRange),
            ("1=-99999999999", NegativeValue),
            ("100=0", OutOfRange),
            ("111=0", OutOfRange),
            ("122=0", OutOfRange),
            ("12=0", OutOfRange),
            ("0=2.9", StepPulseTooShort),
            ("0=0", StepPulseTooShort),
            ("20=1", SoftLimitsNeedHoming),
            ("100=500000.001", StepRateTooHigh),
            ("112=30000000.1", StepRateTooHigh),
        ];
        for (line, status) in cases {
            let mut settings = Settings::<3>::default();
            assert_eq!(set(&mut settings, line), Err(status), "{line}");
            assert_eq!(settings, Settings::default(), "{line}");
        }
    }

    #[test]
    fn zero_is_fine_where_grbl_can_live_with_it() {
        for line in [
            "11=0", "24=0", "25=0", "27=0", "30=0", "130=0", "1=0", "26=0",
        ] {
            assert!(set(&mut Settings::default(), line).is_ok(), "{line}");
        }
    }

    #[test]
    fn every_step_rate_that_one_value_alone_allows_is_accepted() {
        for line in ["100=500000", "110=30000000", "111=16777216"] {
            assert!(set(&mut Settings::default(), line).is_ok(), "{line}");
        }
    }

    #[test]
    fn switching_homing_off_switches_soft_limits_off() {
        let mut settings = Settings::<3>::default();
        set(&mut settings, "22=1").unwrap();
        set(&mut settings, "20=1").unwrap();
        let changes = set(&mut settings, "22=0").unwrap();
        let off = |number| Entry {
            number,
            value: ZERO,
        };
        assert_eq!(changes, [off(20), off(22)]); // in this order: never soft limits without homing
        assert!(!settings.is_on(Setting::SoftLimits));
    }

    #[test]
    fn our_own_settings_can_be_set_and_are_not_in_the_list() {
        let mut settings = Settings::<3>::default();
        set(&mut settings, "700=1").unwrap();
        assert!(settings.is_on(Setting::FaultTexts));
        assert_eq!(rows(&settings).len(), 34);
        assert_eq!(ours(&settings, Setting::FaultTexts), "$700=1");
    }

    #[test]
    fn all_rows_are_the_listed_ones_and_ours() {
        let settings = Settings::<3>::default();
        let all: Vec<String, 100> = (0..)
            .map_while(|index| settings.any(index))
            .map(|line| line.to_string())
            .collect();
        let own = Key::all(3).filter(|key| !key.row().listed).count();
        assert_eq!(all.len(), 34 + own);
        assert!(rows(&settings).iter().all(|row| all.contains(row)));
    }

    #[test]
    fn the_second_motor_s_offset_alone_may_be_negative() {
        let mut settings = Settings::<3>::default();
        set(&mut settings, "702=-0.25").unwrap();
        assert_eq!(ours(&settings, Setting::SecondMotorOffset), "$702=-0.250");
        let stored = Entry {
            number: 702,
            value: number("-25"),
        };
        assert!(settings.load(stored));
        for line in ["702=25.001", "702=-25.001"] {
            assert_eq!(set(&mut settings, line), Err(Status::OutOfRange), "{line}");
        }
        assert_eq!(settings.value(Setting::SecondMotorOffset), number("-25"));
    }

    #[test]
    fn a_laser_s_lead_is_a_millisecond_at_most() {
        let mut settings = Settings::<3>::default();
        assert_eq!(settings.whole(Setting::LaserLead), 0);
        set(&mut settings, "703=137").unwrap();
        assert_eq!(ours(&settings, Setting::LaserLead), "$703=137");
        assert_eq!(set(&mut settings, "703=1001"), Err(Status::OutOfRange));
        assert_eq!(settings.whole(Setting::LaserLead), 137);
    }

    #[test]
    fn a_machine_brings_its_own_defaults() {
        const DEFAULTS: &[Entry] = &[
            Entry {
                number: 701,
                value: ZERO,
            },
            Entry {
                number: 101,
                value: Number::from_int(80),
            },
        ];
        let mut settings = Settings::<3>::new(DEFAULTS);
        set(&mut settings, "101=5").unwrap();
        set(&mut settings, "100=5").unwrap();
        settings.restore_defaults();
        assert_eq!(
            settings.axes(AxisSetting::StepsPerMm),
            [250, 80, 250].map(Number::from_int)
        );
        assert_eq!(settings.whole(Setting::StartSilence), 0);
    }

    #[test]
    fn stored_values_that_make_no_sense_are_refused() {
        let mut settings = Settings::<3>::default();
        for (number, value) in [
            (100, ZERO),
            (999, ZERO),
            (0, Number::from_int(300)),
            (130, Number::from_int(-1)),
        ] {
            assert!(!settings.load(Entry { number, value }), "${number}");
            assert_eq!(settings, Settings::default());
        }
        assert!(settings.load(Entry {
            number: 102,
            value: Number::from_int(7)
        }));
        assert_eq!(
            settings.axes(AxisSetting::StepsPerMm)[2],
            Number::from_int(7)
        );
    }

    #[test]
    fn other_counts_of_axes_have_other_rows() {
        assert_eq!(
            Key::all(6).filter(|key| key.row().listed).count(),
            22 + 4 * 6
        );
        assert_eq!(
            Key::from_number(105, 6),
            Some(Key::Axis(AxisSetting::StepsPerMm, 5))
        );
        assert_eq!(Key::from_number(105, 3), None);
    }

    proptest! {
        #[test]
        fn every_listed_row_can_be_sent_back(number in 0..1000_u16, nanos in 0..i64::MAX, shift in 0..63_u32) {
            let mut settings = Settings::<3>::default();
            let entry = Entry { number, value: Number::from_nanos(nanos >> shift) };
            if settings.set(entry, LIMITS).is_ok() {
                let printed = rows(&settings);
                for row in printed.iter().filter(|row| !row.ends_with("=0.000")) {
                    set(&mut settings, &row[1..]).unwrap();
                }
                prop_assert_eq!(printed, rows(&settings));
            }
        }

        #[test]
        fn nonsense_changes_nothing_and_each_setting_can_be_read_and_stored(
            number in prop_oneof![0..1000_u16, any::<u16>()],
            nanos in any::<i64>(),
            shift in 0..63_u32,
            count in prop_oneof![0..10_usize, any::<usize>()],
            shortest_pulse_us in any::<u8>(),
            highest_rate in any::<u32>(),
        ) {
            let mut settings = Settings::<6>::of_axes(count, &[]);
            let before = settings.clone();
            let entry = Entry { number, value: Number::from_nanos(nanos >> shift) };
            match settings.set(entry, StepLimits { shortest_pulse_us, highest_rate }) {
                Err(_) => prop_assert_eq!(&settings, &before),
                Ok(changes) => {
                    let mut again = before;
                    prop_assert!(changes.iter().all(|entry| again.load(*entry)));
                    prop_assert_eq!(&settings, &again);
                }
            }
            let keys: vec::Vec<Key> = settings.keys().collect();
            prop_assert!(keys.iter().all(|key| !settings.line(*key).to_string().is_empty()));
        }

        #[test]
        fn keys_and_numbers_are_each_other_s_inverse(number in any::<u16>()) {
            if let Some(key) = Key::from_number(number, 9) {
                prop_assert_eq!(key.number(), number);
            }
        }
    }
}
