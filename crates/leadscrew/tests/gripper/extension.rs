use leadscrew::embedded_hal::digital::{InputPin, OutputPin};
use leadscrew::extension::{Call, Cx, Event, Extension, MCode, Step};
use leadscrew::{AlarmCode, Duration, Instant, State};

pub(crate) struct Gripper<O, I> {
    pub(crate) valve: O,
    pub(crate) sensor: I,
    /// When M10 gives up.
    pub(crate) until: Option<Instant>,
}

const TIME_OUT: Duration = Duration::from_ticks(1_000_000); // µs
const LOOK_AGAIN: Duration = Duration::from_ticks(5_000);

impl<O: OutputPin, I: InputPin, const AXES: usize> Extension<AXES> for Gripper<O, I> {
    fn m_code(&self, number: u8) -> Option<MCode> {
        matches!(number, 10 | 11).then_some(MCode::PLAIN)
    }

    fn perform(&mut self, call: &Call, cx: &mut Cx<'_, AXES>) -> Step<AXES> {
        if !cx.at_rest {
            return Step::Rest; // ask again once the motion before has ended
        }
        let closes = call.code == 10;
        let until = *self.until.get_or_insert(cx.now + TIME_OUT);
        // A pin that fails is a gripper that does not hold.
        let works = self.valve.set_state(closes.into()).is_ok();
        if works && (!closes || self.sensor.is_low().unwrap_or(false)) {
            self.until = None;
            return Step::Done;
        }
        if works && cx.now < until {
            return Step::Wait(Some(cx.now + LOOK_AGAIN));
        }
        self.until = None;
        cx.message(format_args!(
            "The gripper does not close: look at its air, then $X"
        ));
        cx.alarm(AlarmCode::AbortedMotion);
        Step::Done
    }

    fn event(&mut self, event: Event) {
        if let Event::Enters(State::Alarm(_)) | Event::Reset = event {
            self.until = None; // the line under way is over
        }
    }
}
