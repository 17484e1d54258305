//! A second opinion: the unmodified ELF in QEMU's STM32F405, `cargo fw-test qemu`.
//!
//! ```text
//!  QEMU:        core, FPU, NVIC, flash, SRAM, CCM, USART1, registers of RCC and of TIM2 and TIM5
//!  Stand-in:    whatever QEMU lacks, played from outside while the program waits
//!  this file:   a sender at the serial line, and the simulator's steps
//! ```
//!
//! QEMU's core was written by others from Arm's manuals. The emulator in `crates/f407emu` and QEMU
//! share only the program: an instruction or an interrupt that both get wrong must be wrong twice
//! in the same way.
mod process;
mod stand_in;

use crate::{
    bench::{ensure, fail, is_answer, Failure, BANNER},
    compare,
    desk::{self, Planned},
    firmware::Build,
    steps::{net, Step},
};
use leadscrew_sim::Rate;
use stand_in::{StandIn, Turn};

/// The move in the first lines that a new user sends to a board.
const MOVE: &str = "G91\nG1X0.1F600\n";
/// The same move less one of the 250 steps in a millimetre: the comparison must tell it from
/// [`MOVE`].
const SHORTER: &str = "G91\nG1X0.096F600\n";
/// Three motors, an arc, a reversal.
const JOB: &str = "G91\nG1X0.4Y-0.2Z0.1F300\nG2X0.2Y0.2I0.2J0F400\nG1X-0.3Y0.1\nG0Z-0.1\n";

/// The most turns of its main loop that the program may make until an answer.
const ANSWER_TURNS: usize = 20_000;
/// The most turns that a job may take.
const JOB_TURNS: usize = 400_000;
/// Time passes in pieces of this length when nothing else happens, µs.
const PIECE_US: u32 = 1_000;

/// Runs the check on a board behind a bootloader. Returns the sentence for the report.
pub(crate) fn check(build: &Build) -> Result<String, Failure> {
    let mut sender = Sender::connect(build)?;
    sender.ask("?", |text| {
        text.starts_with("<Idle|") && text.ends_with(">\r\n")
    })?;
    sender.ask("$X\n", |text| text == "ok\r\n")?;
    let settings = sender.ask("$$\n", |text| text.ends_with("ok\r\n"))?;
    ensure(settings.contains("$100=250.000\r\n"), || {
        format!("the settings are {settings:?}")
    })?;

    let steps = sender.run(MOVE)?;
    compare::to_the_tick(&steps, &plan(MOVE)?)?;
    ensure(
        compare::to_the_tick(&steps, &plan(SHORTER)?).is_err(),
        || "a step too many is not found".into(),
    )?;

    let version = sender.board.version().to_owned();
    drop(sender);

    // On a board of its own: the fraction of a count that a motion leaves goes into the next
    // motion.
    let taken = Sender::connect(build)?.run(JOB)?;
    compare::to_the_tick(&taken, &plan(JOB)?)?;
    Ok(format!(
        "{version}: answers ?, $X and $$; a move to {:?}, a job of {} step events to {:?}, each interval to the tick",
        net::<3>(&steps),
        taken.len(),
        net::<3>(&taken)
    ))
}

/// The simulator's steps for a job.
fn plan(job: &str) -> Result<Vec<Planned>, Failure> {
    desk::plan("", job, Rate::NeverWaits)
}

/// The sender at the serial line.
struct Sender {
    board: StandIn,
    /// The text received since the last question.
    heard: String,
}

impl Sender {
    /// Switches a board on and hears its banner.
    fn connect(build: &Build) -> Result<Self, Failure> {
        let mut sender = Sender {
            board: StandIn::power_up(build)?,
            heard: String::new(),
        };
        sender.hear(|text| text.contains(BANNER))?;
        Ok(sender)
    }

    /// Lets the program work until `done` holds for the text received, and answers that text. Time
    /// stands still.
    fn hear(&mut self, done: impl Fn(&str) -> bool) -> Result<String, Failure> {
        for _ in 0..ANSWER_TURNS {
            self.board.turn()?;
            self.heard += &self.board.heard()?;
            if done(&self.heard) {
                return Ok(std::mem::take(&mut self.heard));
            }
        }
        fail(format!("heard only {:?}", self.heard))
    }

    /// Sends text, and waits for an answer as [`Self::hear`] does.
    fn ask(&mut self, text: &str, done: impl Fn(&str) -> bool) -> Result<String, Failure> {
        self.board.send(text)?;
        self.hear(done)
    }

    /// Sends a job at once, so that all of it is there before the first step, and waits for rest.
    /// Returns its steps.
    fn run(&mut self, job: &str) -> Result<Vec<Step>, Failure> {
        let lines = job.lines().count();
        let answers = self.ask(job, |text| {
            text.lines().filter(|line| is_answer(line)).count() == lines
        })?;
        ensure(!answers.contains("error"), || format!("{job}: {answers:?}"))?;
        for _ in 0..JOB_TURNS {
            if self.board.turn()? != Turn::Idle {
                continue;
            }
            self.board.let_pass(PIECE_US)?;
            // QEMU's TIM5 does not wake the core; a question does.
            let state = self.ask("?", |text| text.ends_with(">\r\n"))?;
            if state.starts_with("<Idle|") {
                return Ok(self.board.take_steps());
            }
        }
        fail("the job does not end")
    }
}
