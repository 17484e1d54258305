//! Lists that go out row by row as the output has room: `$$`, `$#`.

use crate::board::ChannelId;
use crate::machine::Machine;
use leadscrew_planner::Kinematics;

/// A list under way on one channel, with the row that is next.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) enum Listing {
    /// `$$`.
    Settings(usize),
    /// `$#`.
    Parameters(usize),
}

/// Rows sent in one poll: bounds its time.
const ROWS_A_POLL: usize = 4;

impl<K, const AXES: usize, const MOTORS: usize, const MOVES: usize>
    Machine<'_, K, AXES, MOTORS, MOVES>
where
    K: Kinematics<AXES, MOTORS> + Clone,
{
    /// Goes on with lists; a list is answered `ok` after its last row. Main loop.
    pub(crate) fn list(&mut self) {
        for index in 0..self.console.count() {
            let id = ChannelId(index);
            for _ in 0..ROWS_A_POLL {
                if !self.list_row(id) {
                    break;
                }
            }
        }
    }

    /// Sends the next row of the list under way; whether there was one, and room for it.
    fn list_row(&mut self, id: ChannelId) -> bool {
        let Some(channel) = self.console.channel(id) else {
            return false;
        };
        let Some(listing) = channel.listing.filter(|_| channel.has_room()) else {
            return false;
        };
        let next = match listing {
            Listing::Settings(row) => self.settings.listed(row).map(|line| {
                self.console.line(id, line);
                Listing::Settings(row + 1)
            }),
            Listing::Parameters(row) => {
                let parameters = self.parameters();
                parameters.line(row).map(|line| {
                    self.console.line(id, line);
                    Listing::Parameters(row + 1)
                })
            }
        };
        if let Some(channel) = self.console.channel(id) {
            channel.listing = next;
        }
        if next.is_none() {
            self.console.answer(id, Ok(()));
        }
        true
    }
}
