//! `$` lines.
//!
//! Faults are looked for in Grbl's order, so that a sender gets the error number that it expects.
//! For `$`, `$$`, `$G`, `$C` and `$X` the spelling is checked first, then whether the machine may
//! carry the command out now. For all others the order is the reverse.

use super::realtime::LETTER;
use super::status::Status;
use leadscrew_gcode::{leading_number, Number};
use leadscrew_interpreter::Fault;

/// The first number of a setting that is not one of GRBL's.
pub const OWN: u16 = 256;

/// The number of startup lines that can be stored: `$N0` and `$N1`.
pub const STARTUP_LINES: u8 = 2;

/// The longest startup line and build information, in characters.
pub const MAX_STORED_TEXT: usize = 80;

/// A command that began with `$`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SystemCommand<'a> {
    /// `$`: list the commands.
    Help,
    /// `$$`: list the settings.
    ShowSettings,
    /// `$+`: list the settings that `$$` leaves out, too.
    ShowAllSettings,
    /// `$n`: show a setting that `$$` leaves out. Grbl knows no `$n`: with the number of one of
    /// Grbl's settings it stays an error.
    ShowSetting(u16),
    /// `$ES` and the like: list settings, groups, errors or alarms, as grblHAL does.
    Enumerate(Enumeration),
    /// `$SED=n`: describe a setting.
    Describe(u16),
    /// `$#`: show offsets and the probed position.
    ShowParameters,
    /// `$G`: show the modal state.
    ShowModes,
    /// `$I`: show version and options.
    ShowBuild,
    /// `$I=`: store a text that `$I` shows.
    StoreBuild(&'a [u8]),
    /// `$N`: show the startup lines.
    ShowStartup,
    /// `$Nx=`: check and store a startup line, empty to delete it.
    StoreStartup {
        /// The number of the line, 0 or 1.
        index: u8,
        /// The line, filtered.
        line: &'a [u8],
    },
    /// `$C`: check mode on or off.
    Check,
    /// `$X`: unlock.
    Unlock,
    /// `$H`: home all axes, or `$HX` one.
    Home(Homing),
    /// `$J=`: jog; the text after the `=`.
    Jog(&'a [u8]),
    /// `$SLP`: sleep.
    Sleep,
    /// `$RST=`: go back to the defaults.
    Restore(Restore),
    /// `$n=v`: change a setting.
    Set {
        /// Number of the setting, cut to a whole one.
        number: u16,
        /// Its new value.
        value: Number,
    },
}

/// The subject of a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Enumeration {
    /// `$ES`.
    Settings,
    /// `$EG`: groups of settings.
    Groups,
    /// `$EE`.
    Errors,
    /// `$EA`.
    Alarms,
}

/// The axes to home.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Homing {
    /// All, in the machine's order.
    All,
    /// One, counted from 0 for X.
    Axis(u8),
}

/// The values that go back to their defaults.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Restore {
    /// `$`: the settings.
    Settings,
    /// `#`: G54 to G59, G28 and G30.
    Parameters,
    /// `*`: both, startup lines and build information.
    All,
}

/// The activity of the machine, as far as `$` commands care.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Activity {
    /// At rest, ready.
    Idle,
    /// Locked.
    Alarm,
    /// Jogging.
    Jog,
    /// In check mode.
    Check,
    /// Anything else: running, held, homing.
    Busy,
}

/// The facts that decide whether a command is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Circumstances {
    /// The activity of the machine.
    pub activity: Activity,
    /// True if homing is switched on, `$22`.
    pub homing: bool,
    /// True if the machine was built to home single axes.
    pub single_axis_homing: bool,
}

/// The fault of a line, and the rest of the line from the fault on. The length of the rest gives
/// the column.
type Refused<'a> = (Status, &'a [u8]);

impl<'a> SystemCommand<'a> {
    /// Returns true if the operator may give this command while a program's line is put aside (a
    /// tool change).
    pub fn serves_operator(&self) -> bool {
        match self {
            Self::Home(_) | Self::Jog(_) | Self::Unlock => true,
            Self::Help
            | Self::ShowSettings
            | Self::ShowAllSettings
            | Self::ShowSetting(_)
            | Self::Enumerate(_)
            | Self::Describe(_)
            | Self::ShowParameters
            | Self::ShowModes
            | Self::ShowBuild
            | Self::ShowStartup => true,
            Self::StoreBuild(_)
            | Self::StoreStartup { .. }
            | Self::Sleep
            | Self::Restore(_)
            | Self::Set { .. }
            | Self::Check => false,
        }
    }

    /// Returns true if the command is refused as soon as a move is planned, even before the move
    /// begins. A setting on the job's own line waits for the end of motion instead.
    pub fn needs_rest(&self) -> bool {
        match self {
            Self::StoreBuild(_)
            | Self::StoreStartup { .. }
            | Self::Home(_)
            | Self::Jog(_)
            | Self::Sleep
            | Self::Set { .. }
            | Self::Restore(_) => true,
            Self::Help
            | Self::ShowSettings
            | Self::ShowAllSettings
            | Self::ShowSetting(_)
            | Self::Enumerate(_)
            | Self::Describe(_)
            | Self::ShowParameters
            | Self::ShowModes
            | Self::ShowBuild
            | Self::ShowStartup
            | Self::Check
            | Self::Unlock => false,
        }
    }

    /// Reads a filtered line that begins with `$`.
    ///
    /// # Errors
    ///
    /// The error that Grbl gives, with one exception: `$Nx=` for a startup line that does not exist
    /// is [`Status::InvalidStatement`]. The column is 0 if the line is right and the machine may
    /// not carry it out now.
    pub fn parse(line: &'a [u8], now: &Circumstances) -> Result<Self, Fault> {
        Self::read(line, now).map_err(|(status, left)| Fault {
            status,
            column: line.len().saturating_sub(left.len()),
        })
    }

    fn read(line: &'a [u8], now: &Circumstances) -> Result<Self, Refused<'a>> {
        let require = |allowed: bool| match allowed {
            true => Ok(()),
            false => Err((Status::NotIdle, line)),
        };
        match line {
            [] | [b'$'] => Ok(Self::Help),
            [_, b'$', rest @ ..] => {
                let command = alone(rest, Self::ShowSettings)?;
                require(now.activity != Activity::Busy).map(|()| command)
            }
            [_, b'G', rest @ ..] => alone(rest, Self::ShowModes),
            [_, b'X', rest @ ..] => alone(rest, Self::Unlock),
            [_, b'C', rest @ ..] => {
                let command = alone(rest, Self::Check)?;
                require(matches!(now.activity, Activity::Idle | Activity::Check)).map(|()| command)
            }
            [_, b'J', rest @ ..] => {
                require(matches!(now.activity, Activity::Idle | Activity::Jog))?;
                after(b"=", rest).map(Self::Jog)
            }
            [_, b'N', rest @ ..] if !rest.is_empty() => {
                require(now.activity == Activity::Idle)?;
                startup(rest)
            }
            [_, rest @ ..] => {
                if let Some(question) = question(rest) {
                    return require(now.activity != Activity::Busy).map(|()| question);
                }
                require(matches!(now.activity, Activity::Idle | Activity::Alarm))?;
                Self::at_rest(rest, now)
            }
        }
    }

    /// Reads one of the commands that want the machine at rest, without its `$`.
    fn at_rest(text: &'a [u8], now: &Circumstances) -> Result<Self, Refused<'a>> {
        match text {
            [b'#', rest @ ..] => alone(rest, Self::ShowParameters),
            [b'H', rest @ ..] => homing(text, rest, now),
            [b'I'] => Ok(Self::ShowBuild),
            [b'I', rest @ ..] => storable(after(b"=", rest)?).map(Self::StoreBuild),
            [b'N'] => Ok(Self::ShowStartup),
            [b'S', ..] => alone(after(b"SLP", text)?, Self::Sleep),
            [b'R', ..] => restore(after(b"RST=", text)?),
            _ => setting(text),
        }
    }

    /// Finds the place in `line` of a fault that the command had when it was carried out. `line` is
    /// the line that the command was read from. The place is in its G-code, at the value of a
    /// setting, or at the number of a setting that does not exist.
    pub fn locate(&self, fault: Fault, line: &[u8]) -> Fault {
        let begins = match self {
            Self::Jog(gcode) | Self::StoreStartup { line: gcode, .. } => {
                line.len().saturating_sub(gcode.len())
            }
            Self::Set { .. } if fault.status == Status::InvalidStatement => 1,
            Self::Set { .. } => {
                let equals = line.iter().position(|byte| *byte == b'=');
                equals.map_or(0, |equals| equals + 1)
            }
            Self::Help
            | Self::ShowSettings
            | Self::ShowAllSettings
            | Self::ShowSetting(_)
            | Self::Enumerate(_)
            | Self::Describe(_)
            | Self::ShowParameters
            | Self::ShowModes
            | Self::ShowBuild
            | Self::ShowStartup
            | Self::StoreBuild(_)
            | Self::Check
            | Self::Unlock
            | Self::Home(_)
            | Self::Sleep
            | Self::Restore(_) => 0,
        };
        fault.after(begins)
    }
}

/// Reads the commands that ask for settings, errors and alarms beyond `$$`, without the `$`. Grbl
/// knows none of them.
fn question(text: &[u8]) -> Option<SystemCommand<'static>> {
    Some(match text {
        b"+" => SystemCommand::ShowAllSettings,
        b"ES" => SystemCommand::Enumerate(Enumeration::Settings),
        b"EG" => SystemCommand::Enumerate(Enumeration::Groups),
        b"EE" => SystemCommand::Enumerate(Enumeration::Errors),
        b"EA" => SystemCommand::Enumerate(Enumeration::Alarms),
        [b'S', b'E', b'D', b'=', number @ ..] => SystemCommand::Describe(whole(number)?),
        number => SystemCommand::ShowSetting(whole(number).filter(|number| *number >= OWN)?),
    })
}

/// Reads digits and nothing else.
fn whole(text: &[u8]) -> Option<u16> {
    let digits = text.iter().all(u8::is_ascii_digit);
    let text = core::str::from_utf8(text).ok().filter(|_| digits)?;
    text.parse().ok()
}

/// Returns `command` if nothing follows it.
fn alone<'a>(rest: &'a [u8], command: SystemCommand<'a>) -> Result<SystemCommand<'a>, Refused<'a>> {
    if rest.is_empty() {
        Ok(command)
    } else {
        Err((Status::InvalidStatement, rest))
    }
}

/// Returns the text after a spelling; the fault is at the first character that differs.
fn after<'a>(spelling: &[u8], text: &'a [u8]) -> Result<&'a [u8], Refused<'a>> {
    let alike = spelling.iter().zip(text).take_while(|(a, b)| a == b);
    let (_, rest) = text.split_at_checked(alike.count()).unwrap_or((text, &[]));
    text.strip_prefix(spelling)
        .ok_or((Status::InvalidStatement, rest))
}

/// Returns a text that can be stored: it has room, and no [`LETTER`].
fn storable(text: &[u8]) -> Result<&[u8], Refused<'_>> {
    if let Some(at) = text.iter().position(|byte| *byte == LETTER) {
        return Err((Status::InvalidStatement, text.get(at..).unwrap_or_default()));
    }
    match text.split_at_checked(MAX_STORED_TEXT) {
        Some((_, too_much)) if !too_much.is_empty() => Err((Status::StoredLineTooLong, too_much)),
        Some(_) | None => Ok(text),
    }
}

/// Reads the text after the `H` of `command`.
fn homing<'a>(
    command: &'a [u8],
    axes: &'a [u8],
    now: &Circumstances,
) -> Result<SystemCommand<'a>, Refused<'a>> {
    if !now.homing {
        return Err((Status::HomingDisabled, command));
    }
    let axis = match axes {
        [] => return Ok(SystemCommand::Home(Homing::All)),
        [axis @ b'X'..=b'Z'] if now.single_axis_homing => axis - b'X',
        [b'X'..=b'Z', rest @ ..] if now.single_axis_homing => {
            return Err((Status::InvalidStatement, rest))
        }
        _ => return Err((Status::InvalidStatement, axes)),
    };
    Ok(SystemCommand::Home(Homing::Axis(axis)))
}

/// Reads the text after `$RST=`.
fn restore(what: &[u8]) -> Result<SystemCommand<'_>, Refused<'_>> {
    let (which, rest) = match what {
        [b'$', rest @ ..] => (Restore::Settings, rest),
        [b'#', rest @ ..] => (Restore::Parameters, rest),
        [b'*', rest @ ..] => (Restore::All, rest),
        _ => return Err((Status::InvalidStatement, what)),
    };
    alone(rest, SystemCommand::Restore(which))
}

/// Reads `x=line`.
fn startup(text: &[u8]) -> Result<SystemCommand<'_>, Refused<'_>> {
    let (index, line) = assignment(text)?;
    let index = u8::try_from(index)
        .ok()
        .filter(|index| *index < STARTUP_LINES);
    let index = index.ok_or((Status::InvalidStatement, text))?;
    storable(line).map(|line| SystemCommand::StoreStartup { index, line })
}

/// Reads `n=v`.
fn setting(text: &[u8]) -> Result<SystemCommand<'_>, Refused<'_>> {
    let (number, assigned) = assignment(text)?;
    let (value, rest) = number_of(assigned)?;
    let number = u16::try_from(number).map_err(|_| (Status::InvalidStatement, text))?;
    alone(rest, SystemCommand::Set { number, value })
}

/// Reads a number, cut to a whole one, and the `=` after it; returns the rest of the text, too.
fn assignment(text: &[u8]) -> Result<(i64, &[u8]), Refused<'_>> {
    let (number, rest) = number_of(text)?;
    Ok((number.trunc(), after(b"=", rest)?))
}

/// Reads the number that a text begins with; returns the rest of the text, too.
fn number_of(text: &[u8]) -> Result<(Number, &[u8]), Refused<'_>> {
    leading_number(text).map_err(|_| (Status::BadNumber, text))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const IDLE: Circumstances = Circumstances {
        activity: Activity::Idle,
        homing: false,
        single_axis_homing: false,
    };

    /// Parses a line; of a fault, answers the status alone.
    fn parse<'a>(line: &'a str, now: &Circumstances) -> Result<SystemCommand<'a>, Status> {
        SystemCommand::parse(line.as_bytes(), now).map_err(|fault| fault.status)
    }

    fn idle(line: &str) -> Result<SystemCommand<'_>, Status> {
        parse(line, &IDLE)
    }

    #[test]
    fn every_command_is_recognised() {
        use SystemCommand::*;
        let cases = [
            ("$", Help),
            ("$$", ShowSettings),
            ("$+", ShowAllSettings),
            ("$703", ShowSetting(703)),
            ("$00703", ShowSetting(703)),
            ("$ES", Enumerate(Enumeration::Settings)),
            ("$EG", Enumerate(Enumeration::Groups)),
            ("$EE", Enumerate(Enumeration::Errors)),
            ("$EA", Enumerate(Enumeration::Alarms)),
            ("$SED=0", Describe(0)),
            ("$SED=703", Describe(703)),
            ("$#", ShowParameters),
            ("$G", ShowModes),
            ("$I", ShowBuild),
            ("$I=ABC", StoreBuild(b"ABC")),
            ("$I=", StoreBuild(b"")),
            ("$N", ShowStartup),
            (
                "$N0=G21",
                StoreStartup {
                    index: 0,
                    line: b"G21",
                },
            ),
            (
                "$N1=",
                StoreStartup {
                    index: 1,
                    line: b"",
                },
            ),
            (
                "$N0=$H",
                StoreStartup {
                    index: 0,
                    line: b"$H",
                },
            ),
            ("$C", Check),
            ("$X", Unlock),
            ("$J=X1F100", Jog(b"X1F100")),
            ("$J=", Jog(b"")),
            ("$SLP", Sleep),
            ("$RST=$", Restore(super::Restore::Settings)),
            ("$RST=#", Restore(super::Restore::Parameters)),
            ("$RST=*", Restore(super::Restore::All)),
        ];
        for (line, command) in cases {
            assert_eq!(idle(line), Ok(command), "{line}");
        }
    }

    #[test]
    fn setting_numbers_are_cut_and_values_exact() {
        let cases = [
            ("$1=30", 1, 30_000_000_000),
            ("$1.5=30", 1, 30_000_000_000),
            ("$0.9=1", 0, 1_000_000_000),
            ("$+1=1", 1, 1_000_000_000),
            ("$010=1", 10, 1_000_000_000),
            ("$11=.5", 11, 500_000_000),
            ("$11=5.", 11, 5_000_000_000),
            ("$11=+5", 11, 5_000_000_000),
            ("$11=-0", 11, 0),
            ("$1=-1", 1, -1_000_000_000),
            ("$100=0.123456789", 100, 123_456_789),
            ("$300=1", 300, 1_000_000_000),
        ];
        for (line, number, nanos) in cases {
            let value = Number::from_nanos(nanos);
            assert_eq!(
                idle(line),
                Ok(SystemCommand::Set { number, value }),
                "{line}"
            );
        }
    }

    /// Lines of the recorded conversation `dollar_invalid`, and of others like it.
    #[test]
    fn a_line_without_the_number_that_it_needs_is_error_2() {
        let lines = [
            "$A", "$E", "$EX", "$ESX", "$++", "$+A", "$Q=1", "$NX", "$N=G20", "$=", "$=1", "$-",
            "$.", "$1=", "$1=X", "$11=--5", "$11=+-5", "$11=.", "$11=-",
        ];
        for line in lines {
            assert_eq!(idle(line), Err(Status::BadNumber), "{line}");
        }
    }

    /// The same, with blanks between the lines.
    #[test]
    fn a_line_of_another_spelling_is_error_3() {
        let lines = "
            $$$ $GG $G1 $C1 $X1 $XX $#1 $I1 $IX $N2 $N1 $N0 $S $SL $SLP1 $SLPX $SE $SED $SED=
            $SED=X $SED=1.5 $SED=-1 $SED=65536 $255 $703.5 $+703 $65536 $R $RS $RST $RST= $RST=A
            $RST=$$ $RST=1 $RST$ $J $JX1F1 $1 $1=1X $1=1=1 $X=1 $1X=1 $11=1.2.3 $11=1E2 $11=1,5
            $65536=1 $-1=1 $99999999999=1"
            .split_whitespace();
        for line in lines {
            assert_eq!(idle(line), Err(Status::InvalidStatement), "{line}");
        }
    }

    #[test]
    fn the_fault_stands_at_the_first_character_that_is_wrong() {
        let cases = [
            ("$A", 1),
            ("$$$", 2),
            ("$GG", 2),
            ("$X=1", 2),
            ("$J", 2),
            ("$JX1F1", 2),
            ("$SLX", 3),
            ("$SLP1", 4),
            ("$RST", 4),
            ("$RST=A", 5),
            ("$RST=$$", 6),
            ("$I1", 2),
            ("$N2=G21", 2),
            ("$N0", 3),
            ("$H", 1),
            ("$1", 2),
            ("$1=", 3),
            ("$11=--5", 4),
            ("$1=1X", 4),
            ("$11=1.2.3", 7),
            ("$65536=1", 1),
        ];
        for (line, column) in cases {
            match SystemCommand::parse(line.as_bytes(), &IDLE) {
                Err(fault) => assert_eq!(fault.column, column, "{line}"),
                Ok(command) => panic!("{line}: {command:?}"),
            }
        }
        let long = std::format!("$I={}", "A".repeat(MAX_STORED_TEXT + 2));
        let fault = SystemCommand::parse(long.as_bytes(), &IDLE).unwrap_err();
        assert_eq!(fault.column, 3 + MAX_STORED_TEXT);
        let busy = Circumstances {
            activity: Activity::Busy,
            ..IDLE
        };
        let fault = SystemCommand::parse(b"$1=5", &busy).unwrap_err();
        assert_eq!((fault.status, fault.column), (Status::NotIdle, 0));
    }

    #[test]
    fn startup_lines_that_do_not_exist_are_refused() {
        for line in ["$N2=G21", "$N9=G21", "$N-1=G21", "$N256=G21"] {
            assert_eq!(idle(line), Err(Status::InvalidStatement), "{line}");
        }
    }

    #[test]
    fn a_text_too_long_to_store_is_refused() {
        let fits = std::format!("$I={}", "A".repeat(MAX_STORED_TEXT));
        assert!(idle(&fits).is_ok());
        assert_eq!(idle(&(fits + "A")), Err(Status::StoredLineTooLong));
        let line = std::format!("$N0={}", "A".repeat(MAX_STORED_TEXT + 1));
        assert_eq!(idle(&line), Err(Status::StoredLineTooLong));
    }

    #[test]
    fn a_number_of_a_setting_beyond_all_numbers_is_none() {
        assert_eq!(idle("$99999999999=1"), Err(Status::InvalidStatement));
        assert_eq!(idle("$N99999999999=G21"), Err(Status::InvalidStatement));
    }

    #[test]
    fn each_state_takes_the_commands_that_grbl_takes() {
        use Activity::*;
        let everywhere = [Idle, Alarm, Jog, Check, Busy].as_slice();
        let at_rest = [Idle, Alarm].as_slice();
        let cases = [
            ("$", everywhere),
            ("$G", everywhere),
            ("$X", everywhere),
            ("$$", [Idle, Alarm, Jog, Check].as_slice()),
            ("$C", [Idle, Check].as_slice()),
            ("$J=X1F1", [Idle, Jog].as_slice()),
            ("$#", at_rest),
            ("$I", at_rest),
            ("$I=X", at_rest),
            ("$N", at_rest),
            ("$1=25", at_rest),
            ("$RST=$", at_rest),
            ("$SLP", at_rest),
            ("$H", at_rest),
            ("$N0=", [Idle].as_slice()),
        ];
        for (line, taken) in cases {
            for &activity in everywhere {
                let now = Circumstances {
                    activity,
                    homing: true,
                    ..IDLE
                };
                let found = parse(line, &now);
                let expected = taken.contains(&activity);
                assert_eq!(
                    found != Err(Status::NotIdle),
                    expected,
                    "{line} {activity:?}"
                );
                assert_eq!(found.is_ok(), expected, "{line} {activity:?}");
            }
        }
    }

    #[test]
    fn the_state_counts_before_the_spelling_but_for_the_short_commands() {
        let parse = |line: &'static str, activity| parse(line, &Circumstances { activity, ..IDLE });
        assert_eq!(parse("$SLPX", Activity::Busy), Err(Status::NotIdle));
        assert_eq!(
            parse("$SLPX", Activity::Alarm),
            Err(Status::InvalidStatement)
        );
        assert_eq!(parse("$H", Activity::Busy), Err(Status::NotIdle));
        assert_eq!(parse("$$$", Activity::Busy), Err(Status::InvalidStatement));
        assert_eq!(parse("$CX", Activity::Alarm), Err(Status::InvalidStatement));
    }

    #[test]
    fn homing_follows_the_setting_and_the_option() {
        let parse = |line: &'static str, homing, single_axis_homing| {
            let now = Circumstances {
                homing,
                single_axis_homing,
                ..IDLE
            };
            parse(line, &now)
        };
        for line in ["$H", "$HX", "$H1", "$HXY"] {
            assert_eq!(
                parse(line, false, true),
                Err(Status::HomingDisabled),
                "{line}"
            );
        }
        assert_eq!(
            parse("$H", true, false),
            Ok(SystemCommand::Home(Homing::All))
        );
        for line in ["$HX", "$HA", "$H1", "$HXY"] {
            assert_eq!(
                parse(line, true, false),
                Err(Status::InvalidStatement),
                "{line}"
            );
        }
        assert_eq!(
            parse("$HZ", true, true),
            Ok(SystemCommand::Home(Homing::Axis(2)))
        );
        for line in ["$HA", "$HXY", "$HW", "$H["] {
            assert_eq!(
                parse(line, true, true),
                Err(Status::InvalidStatement),
                "{line}"
            );
        }
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(mut line in prop::collection::vec(any::<u8>(), 0..100)) {
            let _ = SystemCommand::parse(&line, &IDLE);
            line.insert(0, b'$');
            let _ = SystemCommand::parse(&line, &IDLE);
        }

        #[test]
        fn no_likely_line_makes_it_panic(line in r"\$[$#GINCXHJSLPRTF=*.+\-0-9]{0,20}") {
            let _ = idle(&line);
        }
    }
}
