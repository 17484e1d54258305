//! The outside of the chip, for tests: serial lines, pins, supply and crystal can be seen and
//! changed.
use crate::{
    devices::SerialLine,
    machine::Machine,
    peripheral::{adc, rcc::ResetCause},
    record::Pin,
    world::{Happening, Wire},
};

impl Machine {
    /// Plugs the cable of a serial line into its pins. Bytes move only while these pins have the
    /// port's functions.
    pub fn plug_serial(&mut self, line: SerialLine) {
        self.devices.cables[line.port as usize] = Some((line.output, line.input));
        self.functions_changed(self.cycle);
    }

    /// Sends bytes over a serial line, at the rate that the firmware has set. They follow the bytes
    /// that are still being sent.
    ///
    /// # Panics
    /// When the line's cable is not plugged in ([`Machine::plug_serial`]).
    pub fn uart_send(&mut self, line: SerialLine, bytes: &[u8]) {
        let cable = self.devices.cables[line.port as usize];
        assert_eq!(cable, Some((line.output, line.input)), "no such cable");
        let cycle = self.cycle;
        self.devices.usarts[line.port as usize].send(bytes, cycle);
        self.reschedule();
    }

    /// Returns the rate of a serial line that the firmware has set, baud. The other end always uses
    /// the same rate.
    pub fn uart_baud(&self, line: SerialLine) -> u64 {
        let bit = self.devices.usarts[line.port as usize].bit_cycles();
        u64::from(self.clocks.hclk) / bit.max(1)
    }

    /// Returns the number of bytes that the sender at the other end of a serial line has not sent
    /// yet.
    pub fn uart_unsent(&self, line: SerialLine) -> usize {
        self.devices.usarts[line.port as usize].unsent()
    }

    /// Returns the bytes that have come over a serial line; the caller may take them out.
    pub fn uart_out(&mut self, line: SerialLine) -> &mut Vec<u8> {
        &mut self.devices.usarts[line.port as usize].output
    }

    /// Returns the number of bytes that a serial line has lost because the program had not read the
    /// previous byte.
    pub fn uart_overruns(&self, line: SerialLine) -> u64 {
        self.devices.usarts[line.port as usize].overruns
    }

    /// Plugs the USB cable in or pulls it out. A host at its other end configures the device as an
    /// operating system does. The host forgets bytes that it has not sent yet.
    pub fn usb_plug(&mut self, plugged: bool) {
        let cycle = self.cycle;
        self.devices.usb.host.plug(plugged, cycle);
        self.reschedule();
    }

    /// Returns true if the host has set the device up, so that bytes go both ways.
    pub fn usb_is_up(&self) -> bool {
        self.devices.usb.host.is_talking()
    }

    /// Returns the device's answer to each request of the host, in order, since the cable was
    /// plugged in.
    pub fn usb_answers(&self) -> &[Vec<u8>] {
        &self.devices.usb.host.answers
    }

    /// Returns the rule that the device breaks, if the host has refused it.
    pub fn usb_refusal(&self) -> Option<&'static str> {
        self.devices.usb.host.refusal
    }

    /// Sends bytes over USB, as fast as the device takes them.
    pub fn usb_send(&mut self, bytes: &[u8]) {
        self.devices.usb.host.to_send.extend(bytes);
    }

    /// Sets whether the host's program reads the received bytes; at first it does.
    pub fn usb_read(&mut self, reads: bool) {
        self.devices.usb.host.reads = reads;
    }

    /// Returns the number of bytes that the host has not sent yet.
    pub fn usb_unsent(&self) -> usize {
        self.devices.usb.host.to_send.len()
    }

    /// Returns the bytes that the firmware has sent over USB; the caller may take them out.
    pub fn usb_out(&mut self) -> &mut Vec<u8> {
        &mut self.devices.usb.host.received
    }

    /// Sets an input pin at a cycle. From then on the world drives it.
    pub fn pin_at(&mut self, cycle: u64, pin: Pin, level: bool) {
        self.at(cycle, Happening::Pin { pin, level });
    }

    /// Connects a pin that the chip drives to a pin that it does not drive, from now on. Edges at
    /// `from` come to `to` after `cycles`, which is 0 for a sound wire. A pin that is not driven
    /// counts as low.
    pub fn connect(&mut self, from: Pin, to: Pin, cycles: u64) {
        let level = self.level(from);
        self.world.connect(Wire { from, to, cycles });
        self.pin_at(self.cycle, to, level);
    }

    /// Sets the voltage at a pin of the analog-to-digital converter from now on, as a share of its
    /// reference voltage, 0 to 1.
    ///
    /// # Panics
    /// If the pin has no channel of the converter.
    pub fn analog(&mut self, pin: Pin, share: f64) {
        let channel = adc::channel(pin.port, pin.number);
        let channel = channel.expect("a pin with a channel of ADC1");
        self.devices.adc.set_input(channel, share);
    }

    /// Stops the crystal at a cycle. The clock security system, if it is on, then requests the NMI.
    pub fn crystal_stops_at(&mut self, cycle: u64) {
        self.at(cycle, Happening::CrystalStops);
    }

    /// Sets the supply at a cycle, mV; at power-up it has 3300. Only the voltage detector follows it:
    /// a brown-out's reset is a [`ResetCause`].
    pub fn supply_at(&mut self, cycle: u64, millivolts: u32) {
        self.at(cycle, Happening::Supply { millivolts });
    }

    /// Resets the chip at a cycle. [`ResetCause::PowerOn`] is a power cycle: RAM is lost, and an
    /// operation of the flash under way leaves a mixture of old and new content.
    pub fn reset_at(&mut self, cycle: u64, cause: ResetCause) {
        self.at(cycle, Happening::Reset(cause));
    }

    fn at(&mut self, cycle: u64, happening: Happening) {
        self.world.add(cycle, happening);
        self.reschedule();
    }

    /// Sets the frequency of the watchdog's oscillator, Hz: [`crate::LSI_SLOWEST_HZ`] to
    /// [`crate::LSI_FASTEST_HZ`]. It takes effect at the next feeding, so call it before the
    /// firmware starts the watchdog.
    pub fn set_lsi(&mut self, hz: u32) {
        self.devices.iwdg.set_lsi(hz);
    }

    /// Returns the level of a pin.
    pub fn level(&self, pin: Pin) -> bool {
        self.devices.ports[usize::from(pin.port)].levels >> pin.number & 1 != 0
    }

    /// Sets whether the edges of a pin are recorded; at first all are.
    pub fn watch(&mut self, pin: Pin, watched: bool) {
        let pins = &mut self.watched[usize::from(pin.port)];
        let mask = 1 << pin.number;
        *pins = if watched { *pins | mask } else { *pins & !mask };
    }

    /// Records the matches of a timer's channel from now on: timer 1 to 14, channel 1 to 4.
    ///
    /// # Panics
    /// When there is no such timer.
    pub fn watch_channel(&mut self, timer: u8, channel: u8) {
        self.watched_channels[usize::from(timer) - 1] |= 1 << (channel - 1);
    }
}
