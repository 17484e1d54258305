//! Jogs: `$J=` and words.

use super::check::{Check, Plan, Purpose};
use super::command::{Feed, Jog, Spindle, Travel};
use super::context::Context;
use super::fault::Fault;
use super::interpreter::spindle;
use super::modal_state::{FeedMode, ModalState, Motion, Units};
use super::setup::Interpreter;
use super::words::Block;

impl<const AXES: usize> Interpreter<AXES> {
    /// Reads a jog: the line after `$J=`. `None` if it has no axis words and hence moves
    /// nothing.
    ///
    /// Changes nothing, as it takes more than a line to accept a jog: the caller looks at the soft
    /// limits, and then moves the position to the target with [`Self::set_position`].
    ///
    /// # Errors
    ///
    /// As [`Self::interpret`]; [`InvalidJog`](crate::Status::InvalidJog) for
    /// words that would change the modal state.
    pub fn jog(
        &self,
        line: &[u8],
        context: &Context<'_, AXES>,
    ) -> Result<Option<Jog<AXES>>, Fault> {
        let modal = ModalState {
            motion: Motion::Feed,
            feed_mode: FeedMode::PerMinute,
            ..self.modal
        };
        let mut block = Block::new(&modal);
        block.read(line, context, &self.modal)?;
        let mut plan = Plan::new(&self.position);
        Check::new(self, &block, context, Purpose::Jog)
            .plan(&mut plan)
            .map_err(|refusal| refusal.locate(line))?;
        let travel = Travel {
            target: plan.target,
            feed: Feed::PerMinute(match block.modal.units {
                Units::Millimetres => plan.feed,
                Units::Inches => self.rate_in_inches(&plan, context),
            }),
            spindle: Spindle {
                cutting: true, // a laser is lit as in G1, whatever the motion mode
                ..spindle(&self.modal)
            },
            line_number: plan.line_number,
        };
        Ok((block.axis_mask != 0).then_some(Jog { travel }))
    }
}
