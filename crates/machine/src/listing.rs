//! A listing goes out row by row, each row once the board has taken the one before it: `$$`, `$+`,
//! `$ES`, `$#`, `$N`, `$I` and the like. So a report that is asked for goes out between two rows,
//! and does not wait for the rest of the list.

use crate::board::{Board, ChannelId};
use crate::config::{extruder, AxisKind};
use crate::console::Listing;
use crate::extension::Extension;
use crate::machine::Machine;
use crate::protocol::alarm::Alarm;
use crate::protocol::report::{Parameters, StartupLine, VersionLine};
use crate::protocol::status::Status;
use crate::protocol::system_command::{Enumeration, STARTUP_LINES};
use crate::settings::enumeration::{AlarmInfo, ErrorInfo, GroupInfo, SettingInfo};
use crate::settings::group::Group;
use crate::settings::table::Setting;
use crate::settings::values::{Key, SettingLine};
use leadscrew_gcode::Number;
use leadscrew_planner::{Coordinate, Kinematics};

/// True if the build has the lists that Grbl has not.
pub(crate) const LISTINGS: bool = cfg!(feature = "listings");

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Goes on with lists; a list is answered `ok` after its last row. Main loop.
    pub(crate) fn list<B: Board>(&mut self, board: &B) {
        if self.console.lists() {
            for index in 0..self.console.count() {
                self.list_row(ChannelId(index), board);
            }
        }
    }

    /// Sends the next row of the list under way, if there is one and nothing waits before it.
    fn list_row<B: Board>(&mut self, id: ChannelId, board: &B) {
        let Some(channel) = self.console.channel(id) else {
            return;
        };
        let Some(listing) = channel.listing.filter(|_| channel.output_is_empty()) else {
            return;
        };
        let next = self.write_row(id, listing, board);
        if let Some(channel) = self.console.channel(id) {
            channel.listing = next;
        }
    }

    /// Writes a row; returns the row that follows, or `None` after the last.
    fn write_row<B: Board>(
        &mut self,
        id: ChannelId,
        listing: Listing,
        board: &B,
    ) -> Option<Listing> {
        match listing {
            Listing::Settings(row) => {
                if let Some(line) = self.settings.listed(row) {
                    self.console.line(id, line);
                    return Some(Listing::Settings(row + 1));
                }
            }
            Listing::AllSettings(row) if LISTINGS => {
                if let Some(line) = self.any_setting(row) {
                    self.console.line(id, line);
                    return Some(Listing::AllSettings(row + 1));
                }
            }
            Listing::Enumeration(what, row) if LISTINGS => {
                if self.write_item(id, what, row).is_some() {
                    return Some(Listing::Enumeration(what, row + 1));
                }
            }
            Listing::Parameters(row) => {
                let parameters = self.parameters();
                if let Some(line) = parameters.line(row) {
                    self.console.line(id, line);
                    return Some(Listing::Parameters(row + 1));
                }
                if self.write_tool(id, row).is_some() {
                    return Some(Listing::Parameters(row + 1));
                }
            }
            Listing::Startup(index) if index < STARTUP_LINES => {
                let line = self.store.memory.startup(index);
                self.console.line(id, StartupLine { index, line });
                return Some(Listing::Startup(index + 1));
            }
            Listing::Version => {
                let text = self.store.memory.build();
                self.console.line(id, VersionLine { text });
                return Some(Listing::Options);
            }
            Listing::Options => {
                let bytes = self
                    .console
                    .channel(id)
                    .map_or(0, |channel| channel.limit());
                let options = self.options_line(bytes);
                self.console.line(id, options);
                return Some(Listing::LastEnd);
            }
            Listing::LastEnd => {
                if let Some(end) = board.last_end() {
                    self.console.line(id, format_args!("[LAST END:{end}]"));
                    return Some(Listing::Answer);
                }
            }
            Listing::AllSettings(_)
            | Listing::Enumeration(..)
            | Listing::Startup(_)
            | Listing::Answer => {}
        }
        self.console.answer(id, Ok(()));
        None
    }

    /// Writes a row after the parameters, in the form of grblHAL: a tool that has a length.
    fn write_tool(&mut self, id: ChannelId, row: usize) -> Option<()> {
        if !X::IN_USE {
            return None;
        }
        let nth = row.checked_sub(Parameters::<AXES>::lines(
            self.config.dialect.has_linuxcnc(),
        ))?;
        let mut lengths = (1..=u32::from(u8::MAX)).filter_map(|tool| {
            let length = self.extension.tool_length(Some(tool))?;
            (length != Coordinate::ZERO).then_some((tool, length))
        });
        let (tool, length) = lengths.nth(nth)?;
        let length = Number::from_nanos(length.nanos());
        let shown = self.report_units().length(length);
        self.console
            .line(id, format_args!("[T:{tool}|0.000,0.000,{shown}]"));
        Some(())
    }

    /// Writes a row of an enumeration, if there is such a row.
    fn write_item(&mut self, id: ChannelId, what: Enumeration, row: usize) -> Option<()> {
        match what {
            Enumeration::Settings => {
                let info = self.setting_info(row)?;
                self.console.line(id, info);
            }
            Enumeration::Groups => self.console.line(id, GroupInfo(*Group::ALL.get(row)?)),
            Enumeration::Errors => {
                let info = self.error_info(row)?;
                self.console.line(id, info);
            }
            Enumeration::Alarms => {
                let info = self.alarm_info(row)?;
                self.console.line(id, info);
            }
        }
        Some(())
    }

    /// A row of `$EE`: GRBL's errors and ours, then the extension's.
    fn error_info(&self, row: usize) -> Option<ErrorInfo> {
        match Status::ALL.get(row) {
            Some(status) => Some((*status).into()),
            None if X::IN_USE => {
                let own = row.checked_sub(Status::ALL.len())?;
                self.extension.errors().nth(own).map(ErrorInfo::from)
            }
            None => None,
        }
    }

    /// A row of `$EA`: GRBL's alarms and ours, then the extension's.
    fn alarm_info(&self, row: usize) -> Option<AlarmInfo> {
        match Alarm::ALL.get(row) {
            Some(alarm) => Some((*alarm).into()),
            None if X::IN_USE => {
                let own = row.checked_sub(Alarm::ALL.len())?;
                self.extension.alarms().nth(own).map(AlarmInfo::from)
            }
            None => None,
        }
    }

    /// A row of `$+`: of GRBL's settings, then of the extension's.
    fn any_setting(&self, row: usize) -> Option<SettingLine> {
        let own = || self.own_setting(row - Key::count(self.settings.axis_count()));
        self.settings
            .any(row)
            .or_else(|| Some(self.own_line(own()?)))
    }

    /// A row of `$ES`: GRBL's settings, then the extension's.
    fn setting_info(&self, row: usize) -> Option<SettingInfo> {
        let axes = self.settings.axis_count();
        let Some(key) = Key::at(row, axes) else {
            let own = self.own_setting(row - Key::count(axes))?;
            return Some(SettingInfo {
                row: *own,
                axis: None,
                letter: '?',
                least: 0,
            });
        };
        let pulse = key == Key::Machine(Setting::StepPulse);
        let least = match pulse {
            true => self.config.step_timing.shortest_pulse_us,
            false => 0,
        };
        let mut info = SettingInfo::of(key, least);
        if info.axis.is_some() && info.axis == extruder(&self.config.axes) {
            info.letter = 'E';
        }
        let kind = info.axis.and_then(|axis| self.config.axes.get(axis));
        match kind {
            Some(AxisKind::Rotary) => Some(info.of_turns()),
            _ => Some(info),
        }
    }
}
