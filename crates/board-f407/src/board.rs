//! The board under the machine: slow pins and serial output.
use crate::{clock, profile, pwm, restart::LastEnd, serial, step_port, switches};
use core::fmt::{self, Write};
use leadscrew_f407_usb as usb;
use leadscrew_machine::board::{
    Board, ChannelId, CoolantOutput, Duration, Instant, PortConfig, SpindleOutput, Switches,
};
use leadscrew_stepper::Power;
use stm32f4::stm32f407::Interrupt;

#[cfg(record)]
use crate::record_flash;
#[cfg(record)]
use leadscrew_machine::protocol::status::Status;
#[cfg(record)]
use leadscrew_record::Incoming;

/// The time for the answer to `$DFU` to go out: 100 bytes at 9600 baud, 104 ms.
const GOODBYE: Duration = Duration::from_ticks(110_000);

/// The main loop's end of the board.
pub(crate) struct F407 {
    serial: serial::Writer,
    usb: usb::Writer,
    /// The level of the enable pins at which the motors are off: `$4`.
    motors_off: bool,
    power: pwm::Channel,
    /// The reason why the machine must not move, if there is a reason. Then no pin is driven but
    /// the serial line's and those that have their safe levels.
    locked: Option<&'static str>,
    /// The time at which the loader is to start, if it is.
    loader: Option<Instant>,
    /// The part of a new record that has come over a line.
    #[cfg(record)]
    incoming: Incoming,
}

impl F407 {
    /// Makes the board's end, which sends bytes through `serial` and through `usb`.
    pub(crate) fn new(serial: serial::Writer, usb: usb::Writer) -> Self {
        Self {
            serial,
            usb,
            motors_off: true,
            power: pwm::Channel::new(),
            locked: None,
            loader: None,
            #[cfg(record)]
            incoming: Incoming::new(),
        }
    }

    /// Keeps the machine from moving, if `why` has a reason.
    pub(crate) fn lock(&mut self, why: Option<&'static str>) {
        self.locked = why;
    }

    /// Returns true if the loader is to start now. Main loop.
    pub(crate) fn wants_loader(&self, now: Instant) -> bool {
        self.loader.is_some_and(|due| due <= now)
    }
}

impl F407 {
    /// Sends the operator a message, before the machine's first message. Start-up.
    pub(crate) fn say(&mut self, text: Option<impl fmt::Display>) {
        if let Some(text) = text {
            // It never fails: what finds no room is lost.
            let _ = write!(Said(self), "[MSG:{text}]\r\n");
        }
    }
}

/// Both ends of a message.
struct Said<'a>(&'a mut F407);

impl fmt::Write for Said<'_> {
    fn write_str(&mut self, part: &str) -> fmt::Result {
        self.0.serial.say(part.as_bytes());
        self.0.write(ChannelId(1), part.as_bytes());
        Ok(())
    }
}

impl Board for F407 {
    fn start_stepping(&mut self, now: Instant) -> Instant {
        rtic::pend(step_port::PULSE_END_INTERRUPT);
        let passed = clock::count().wrapping_sub(now.ticks() as u32);
        now + Duration::from_ticks(passed.into())
    }

    fn write(&mut self, channel: ChannelId, bytes: &[u8]) -> usize {
        match channel {
            ChannelId(0) => self.serial.write(bytes),
            ChannelId(1) => {
                let taken = self.usb.write(bytes);
                rtic::pend(Interrupt::OTG_FS);
                taken
            }
            ChannelId(_) => bytes.len(),
        }
    }

    fn switches(&self) -> Switches {
        switches::switches()
    }

    fn enable_motors(&mut self, on: bool) {
        if self.locked.is_some() {
            return;
        }
        for pin in profile::enables() {
            pin.make_output(on != self.motors_off);
        }
        #[cfg(windings)]
        step_port::energise(on);
    }

    fn set_spindle(&mut self, output: SpindleOutput) {
        let (on, reverse) = match output {
            SpindleOutput::Off => (false, false),
            SpindleOutput::Clockwise => (true, false),
            SpindleOutput::CounterClockwise => (true, true),
        };
        let [forward, backward] = profile::spindle();
        if let Some(pin) = backward {
            pin.switch(reverse);
        }
        if let Some(pin) = forward {
            pin.switch(on);
        }
    }

    fn set_power(&mut self, power: Power) {
        self.power.set(power);
    }

    fn set_coolant(&mut self, output: CoolantOutput) {
        let [flood, mist] = profile::coolant();
        for (pin, on) in [(flood, output.flood), (mist, output.mist)] {
            if let Some(pin) = pin {
                pin.switch(on);
            }
        }
    }

    #[cfg(record)]
    const TAKES_RECORD: bool = true;

    #[cfg(record)]
    fn take_record(&mut self, part: &[u8]) -> (Result<(), Status>, Option<&'static str>) {
        if !part.is_empty() {
            let taken = self.incoming.take(part);
            return (taken.map_err(|_| Status::BadNumber), None);
        }
        match record_flash::keep(&self.incoming) {
            Ok(text) => (Ok(()), Some(text)),
            Err(text) => (Err(Status::StoreUnreadable), Some(text)),
        }
    }

    const HAS_LOADER: bool = true;

    fn start_loader(&mut self, now: Instant) {
        self.loader = Some(now + GOODBYE);
    }

    fn locked(&self) -> Option<&'static str> {
        self.locked
    }

    fn last_end(&self) -> Option<&dyn fmt::Display> {
        LastEnd::known().map(|end| end as &dyn fmt::Display)
    }

    fn configure(&mut self, port: &PortConfig) {
        if self.locked.is_some() {
            return;
        }
        self.motors_off = !port.enable_invert;
        switches::set_filter(port.filter_us);
        step_port::configure(port);
    }
}
