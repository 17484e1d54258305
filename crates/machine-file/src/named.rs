//! Settings by their names: the tables of a machine file whose keys stand for `$` numbers.
//!
//! ```text
//!  [laser]
//!  on = true          # $32=1
//!  lead_us = 250      # $703=250
//! ```

use super::value::AxisLetters;
use leadscrew_machine::settings::table::Setting;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

/// A value that a file gives to a setting.
pub(super) trait Value {
    /// The value as the machine stores it, and its place in the text.
    fn given(&self) -> (f64, usize);
}

impl Value for Spanned<f64> {
    fn given(&self) -> (f64, usize) {
        (*self.get_ref(), self.span().start)
    }
}

impl Value for Spanned<bool> {
    fn given(&self) -> (f64, usize) {
        (f64::from(u8::from(*self.get_ref())), self.span().start)
    }
}

/// A setting that a file names: its key, its number, its value and its place in the text.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Named {
    pub(super) key: String,
    pub(super) number: u16,
    pub(super) value: f64,
    pub(super) at: usize,
}

macro_rules! tables {
    ($($(#[$about:meta])* $table:ident $name:literal {
        $($(#[$doc:meta])* $key:ident: $kind:ty as $schema:literal = $setting:ident;)*
        $(+ $(#[$other_doc:meta])* $other:ident: $other_kind:ty;)*
    })*) => {
        $(
            $(#[$about])*
            #[derive(Clone, PartialEq, Debug, Default, Deserialize, JsonSchema)]
            #[serde(deny_unknown_fields, default)]
            pub struct $table {
                $(
                    $(#[$doc])*
                    #[schemars(with = $schema)]
                    pub $key: Option<Spanned<$kind>>,
                )*
                $($(#[$other_doc])* pub $other: $other_kind,)*
            }

            impl $table {
                /// The settings that this table gives.
                pub(super) fn named(&self) -> impl Iterator<Item = Named> {
                    let all = [$((stringify!($key), Setting::$setting, self.$key.as_ref().map(Value::given)),)*];
                    all.into_iter().filter_map(|(key, setting, given)| {
                        let (value, at) = given?;
                        let key = format!(concat!($name, ".{}"), key);
                        Some(Named { key, number: setting.row().number, value, at })
                    })
                }
            }
        )*

        /// All settings that have a name, each with its name.
        #[cfg(test)]
        const NAMED: &[(Setting, &str)] = &[$($((Setting::$setting, concat!($name, ".", stringify!($key))),)*)*];
    };
}

tables! {
    /// Pulses, directions and power of the motors.
    Motors "motors" {
        /// Length of a step pulse, us: `$0`.
        step_pulse_us: f64 as "Option<f64>" = StepPulse;
        /// How long motors stay enabled after motion, ms; 255 for always: `$1`.
        idle_delay_ms: f64 as "Option<f64>" = IdleDelay;
        /// How long before a step its direction pin is set, us: `$709`.
        direction_setup_us: f64 as "Option<f64>" = DirectionSetup;
        /// The enable output is active when high: `$4`.
        enable_inverted: bool as "Option<bool>" = EnableInvert;
    }
    /// Limits of the travel.
    Bounds "bounds" {
        /// Motion beyond the travel is refused: `$20`.
        soft: bool as "Option<bool>" = SoftLimits;
        /// With soft limits, a jog beyond the travel ends there: `$715`.
        jogs_end: bool as "Option<bool>" = JogsEnd;
        /// A limit switch stops motion: `$21`.
        hard: bool as "Option<bool>" = HardLimits;
        /// How long a switch keeps a new level before it counts, us: `$706`.
        filter_us: f64 as "Option<f64>" = SwitchFilter;
        /// The probe input is active when high: `$6`.
        probe_inverted: bool as "Option<bool>" = ProbeInvert;
    }
    /// Corners, arcs, jerk, canned cycles.
    Path "path" {
        /// How far a circle that touches both moves may be from the corner, mm: `$11`.
        junction_deviation_mm: f64 as "Option<f64>" = JunctionDeviation;
        /// How far the chords of an arc may be from the arc, mm: `$12`.
        arc_tolerance_mm: f64 as "Option<f64>" = ArcTolerance;
        /// Corner speeds are computed as in Grbl: `$704`.
        grbl_corners: bool as "Option<bool>" = GrblCorners;
        /// How fast the acceleration may change, mm/s3; 0 for no limit: `$705`.
        jerk_mm_s3: f64 as "Option<f64>" = Jerk;
        /// The frequency of a vibration that motion does not set off, Hz; 0 for none: `$708`.
        resonance_hz: f64 as "Option<f64>" = Resonance;
        /// How much farther from an arc's centre one end may be than the other, mm: `$713`.
        arc_mismatch_mm: f64 as "Option<f64>" = ArcMismatch;
        /// The same as a share of the radius, %: `$714`.
        arc_mismatch_percent: f64 as "Option<f64>" = ArcMismatchShare;
        /// How far G73 goes back after a peck, mm: `$711`.
        peck_clearance_mm: f64 as "Option<f64>" = PeckClearance;
    }
    /// A spindle.
    Spindle "spindle" {
        /// The speed at full output, 1/min: `$30`.
        max_rpm: f64 as "Option<f64>" = MaxSpeed;
        /// The speed at the least output, 1/min: `$31`.
        min_rpm: f64 as "Option<f64>" = MinSpeed;
        /// How long motion waits for the spindle after a hold in which it was stopped, s: `$712`.
        spin_up_s: f64 as "Option<f64>" = SpinUp;
        /// How long the program waits after a spindle starts or is reversed, s: `$716`.
        run_up_s: f64 as "Option<f64>" = SpindleRunUp;
        /// How long it waits besides for each 1000/min by which the speed changes, s: `$717`.
        run_up_s_by_1000_rpm: f64 as "Option<f64>" = SpindleRunUpBySpeed;
        /// How long the program waits after a spindle stops, s: `$718`.
        run_down_s: f64 as "Option<f64>" = SpindleRunDown;
    }
    /// A laser.
    Laser "laser" {
        /// Laser mode: the power changes during motion and is off in rapids: `$32`.
        on: bool as "Option<bool>" = Laser;
        /// The S value of full power: `$30`.
        full_power: f64 as "Option<f64>" = MaxSpeed;
        /// The delay with which the laser switches, us: `$703`.
        lead_us: f64 as "Option<f64>" = LaserLead;
        /// How long a sender may be silent before a laser that is lit at rest is switched off, s:
        /// `$707`.
        dead_man_s: f64 as "Option<f64>" = LaserPatience;
    }
    /// How long what is on at rest stays on without its sender, s; 0 for ever.
    DeadMan "dead_man" {
        /// A spindle whose sender is silent: `$720`.
        spindle_s: f64 as "Option<f64>" = SpindleSilence;
        /// Coolant whose sender is silent: `$721`.
        coolant_s: f64 as "Option<f64>" = CoolantSilence;
        /// Heaters whose sender is silent: `$722`.
        heat_s: f64 as "Option<f64>" = HeatSilence;
        /// Outputs whose sender is silent: `$723`.
        outputs_s: f64 as "Option<f64>" = OutputsSilence;
        /// A laser whose sender sends no G-code: `$724`.
        laser_unfed_s: f64 as "Option<f64>" = LaserUnfed;
        /// A spindle whose sender sends no G-code: `$725`.
        spindle_unfed_s: f64 as "Option<f64>" = SpindleUnfed;
        /// Coolant whose sender sends no G-code: `$726`.
        coolant_unfed_s: f64 as "Option<f64>" = CoolantUnfed;
        /// Heaters whose sender sends no G-code: `$727`.
        heat_unfed_s: f64 as "Option<f64>" = HeatUnfed;
        /// Outputs whose sender sends no G-code: `$728`.
        outputs_unfed_s: f64 as "Option<f64>" = OutputsUnfed;
    }
    /// The reports to a sender.
    Reports "reports" {
        /// Fields of a status report, a mask: `$10`.
        fields: f64 as "Option<f64>" = ReportMask;
        /// Positions and feeds in inches: `$13`.
        inches: bool as "Option<bool>" = Inches;
        /// A message with the reason before each refusal: `$700`.
        faults_in_words: bool as "Option<bool>" = FaultTexts;
    }
    /// How lines become motion.
    Streaming "streaming" {
        /// Motion starts when no line has come for this time, ms: `$701`.
        start_silence_ms: f64 as "Option<f64>" = StartSilence;
        /// How long a sender may stall during motion, s: `$710`.
        stall_reserve_s: f64 as "Option<f64>" = StallReserve;
    }
    /// How home is found.
    Homing "homing" {
        /// Homing is on, and the machine is locked until it is homed: `$22`.
        on: bool as "Option<bool>" = Homing;
        /// Speed that locates a switch, mm/min: `$24`.
        feed_mm_min: f64 as "Option<f64>" = HomingFeed;
        /// Speed that searches for a switch, mm/min: `$25`.
        seek_mm_min: f64 as "Option<f64>" = HomingSeek;
        /// Pause between the phases, ms: `$26`.
        debounce_ms: f64 as "Option<f64>" = HomingDebounce;
        /// How far an axis moves off its switch, mm: `$27`.
        pull_off_mm: f64 as "Option<f64>" = HomingPullOff;
        /// How far the second motor goes on after its switch, mm: `$702`.
        second_motor_offset_mm: f64 as "Option<f64>" = SecondMotorOffset;
        + /// Axes that home together, cycle after cycle; as stock Grbl if it is left out: Z, then X and Y.
        order: Option<Vec<AxisLetters>>;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Masks are made from the keys of each axis. The level of the limit switches is made from the
    /// key for all switches.
    const ELSEWHERE: [Setting; 5] = [
        Setting::StepInvert,
        Setting::DirectionInvert,
        Setting::HomingDirection,
        Setting::OwnHomes,
        Setting::LimitInvert,
    ];

    #[test]
    fn every_setting_has_a_name() {
        for setting in Setting::ALL {
            let named = NAMED.iter().any(|(named, _)| named == setting);
            let number = setting.row().number;
            assert!(named || ELSEWHERE.contains(setting), "${number}");
        }
    }

    #[test]
    fn the_document_has_every_name_with_its_number() {
        let document = include_str!("../../../docs/machine-file.md");
        for (setting, name) in NAMED {
            let row = format!("| `{name}` | `${}` |", setting.row().number);
            assert!(document.contains(&row), "{row}");
        }
    }
}
