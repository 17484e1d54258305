//! Lists that go out row by row, each once the board has taken the one before it: `$$`, `$#`. So a report that is asked
//! for goes out between two rows, and does not wait for the rest of the list.

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

impl<K, const AXES: usize, const MOTORS: usize, const MOVES: usize>
    Machine<'_, K, AXES, MOTORS, MOVES>
where
    K: Kinematics<AXES, MOTORS> + Clone,
{
    /// Goes on with lists; a list is answered `ok` after its last row. Main loop.
    pub(crate) fn list(&mut self) {
        for index in 0..self.console.count() {
            self.list_row(ChannelId(index));
        }
    }

    /// Sends the next row of the list under way, if there is one and nothing waits before it.
    fn list_row(&mut self, id: ChannelId) {
        let Some(channel) = self.console.channel(id) else {
            return;
        };
        let Some(listing) = channel.listing.filter(|_| channel.output_is_empty()) else {
            return;
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
    }
}
