//! The self-test's image: the instants of edges at the board's own pins, for `cargo hil`
//! (docs/hil.md).
//!
//! A wire leads from an output to a pin of TIM2, whose counter makes the ticks of motion as well. A
//! channel keeps the count of each edge (input capture, RM0090 section 18.3.5). DMA takes the count
//! to memory without the core, until the wire's part of the memory is full. Two wires can be
//! captured at a time, but not channels 2 and 4 together: the stream of channel 2 takes the
//! requests of channel 4 as well.
//!
//! ```text
//!   M120 P5        at rest: captures wires 0 and 2 (P has a bit for each wire)
//!   M121 P0 L20    at rest: edges of wire 0, from edge 20 on: [EDGES:0,20,1000,0,1:0001a2b3...]
//!                  wire 0; first edge 20; 1000 edges in all; 0: none lost; 1: high before edge 0
//!   M122           the count now: [COUNT:0001a2b3]
//! ```
use crate::{
    gpio::{Pin, Pull},
    profile::{AXES, CAPTURES},
    registers::{self, capture_dma, tick_timer, Word},
    step_port::keep_captures,
};
use core::{
    fmt,
    sync::atomic::{AtomicU32, Ordering::Relaxed},
};
use heapless::Vec;
use leadscrew_gcode::{Letter, Number};
use leadscrew_machine::{
    extension::{Call, Cx, Extension, MCode, Step, LONGEST_TEXT},
    protocol::status::Status,
};
use stm32f4::stm32f407::dma2;

/// The number of edges that there is room for. They are in SRAM, since DMA does not reach the core
/// coupled memory.
const ROOM: usize = 14_000;
static EDGES: [AtomicU32; ROOM] = [const { AtomicU32::new(0) }; ROOM];

/// The most wires that are captured at a time.
const AT_ONCE: usize = 2;
/// Function of TIM2 in the data sheet's table 9.
const FUNCTION: u8 = 1;
/// The channel on which the streams of DMA1 take the requests of TIM2 (RM0090 table 43).
const DMA_CHANNEL: u8 = 3;
/// The most edges in one answer to `M121`.
const PER_LINE: usize = 20;
/// The longest answer: `[EDGES:0,13999,14000,0,0:`, eight digits an edge, and `]`.
const _: () = assert!(25 + 8 * PER_LINE + 1 <= LONGEST_TEXT);

/// The input pin at the end of a wire.
pub(crate) struct Input {
    pub(crate) pin: Pin,
    /// The channel of TIM2, 2 to 4.
    pub(crate) channel: u8,
}

impl Input {
    /// Its place in tables of channels, 0 to 3.
    fn index(&self) -> usize {
        usize::from(self.channel - 1)
    }

    /// The number of the stream that takes its channel's edges (RM0090 table 43).
    fn stream_number(&self) -> usize {
        match self.channel {
            2 => 6,
            3 => 1,
            _ => 7,
        }
    }

    /// All streams that take its channel's requests, one bit for each stream.
    fn hearers(&self) -> u8 {
        let others = if self.channel == 4 { 1 << 6 } else { 0 };
        1 << self.stream_number() | others
    }

    fn stream(&self) -> &'static dma2::ST {
        capture_dma().st(self.stream_number())
    }

    /// Returns how many more edges its stream takes.
    fn room(&self) -> usize {
        usize::from(self.stream().ndtr().read().ndt().bits())
    }

    /// Takes rising and falling edges to `memory` from now on. Returns the level before the first
    /// edge.
    fn begin(&self, memory: &'static [AtomicU32]) -> bool {
        loop {
            let level = self.pin.is_high();
            self.take_edges(memory);
            // An edge in these few cycles may be captured or not. In either case the capture begins
            // again.
            if self.pin.is_high() == level && self.room() == memory.len() {
                return level;
            }
            self.end();
        }
    }

    /// Takes no more edges, and leaves no request pending.
    fn end(&self) {
        let stream = self.stream();
        tick_timer()
            .ccer()
            .change(|bits| bits & !(0b1011 << (4 * self.index())));
        stream.cr().reset();
        while stream.cr().read().en().is_enabled() {}
        // Reading clears the flag of the capture.
        tick_timer().ccr(self.index()).read();
    }

    fn take_edges(&self, memory: &'static [AtomicU32]) {
        let stream = self.stream();
        // A stream starts only with its flags cleared (RM0090 section 10.3.17): five bits of six in
        // the low or the high register (sections 10.5.3 and 10.5.4).
        match self.stream_number() {
            1 => capture_dma().lifcr().put(0x3D << 6),
            6 => capture_dma().hifcr().put(0x3D << 16),
            _ => capture_dma().hifcr().put(0x3D << 22),
        }
        registers::aim(stream, tick_timer().ccr(self.index()), memory);
        stream.cr().write(|w| {
            w.chsel().set(DMA_CHANNEL).pl().very_high();
            w.psize().bits32().msize().bits32().minc().incremented();
            w.en().enabled()
        });
        // CCxE, CCxP and CCxNP: both edges (section 18.4.9).
        tick_timer()
            .ccer()
            .change(|bits| bits | 0b1011 << (4 * self.index()));
    }
}

/// The edges of a wire.
struct Part {
    /// Its number in [`CAPTURES`].
    wire: usize,
    memory: &'static [AtomicU32],
    /// The level before the first edge.
    level: bool,
}

impl Part {
    fn input(&self) -> &'static Input {
        &CAPTURES[self.wire]
    }

    /// The edges so far.
    fn edges(&self) -> &'static [AtomicU32] {
        let taken = self.memory.len().saturating_sub(self.input().room());
        self.memory.get(..taken).unwrap_or_default()
    }

    /// The edges from `first` on, as an answer to `M121`.
    fn told(&self, first: usize) -> Told<'_> {
        Told { part: self, first }
    }

    /// Returns true if an edge was lost: it came before DMA had taken the one before, or found the
    /// memory full.
    fn has_lost(&self) -> bool {
        let flags = tick_timer().sr().read();
        flags.ccof(self.input().index() as u8).bit_is_set()
    }
}

/// The M codes of the self-test.
pub(crate) struct Capture {
    parts: Vec<Part, AT_ONCE>,
}

impl Capture {
    /// Makes inputs of the pins at the wires' ends, and sets the channels to capture. Once.
    pub(crate) fn new() -> Self {
        for input in &CAPTURES {
            input.pin.make_input(Pull::Down);
        }
        tick_timer().ccmr1_input().write(|w| w.cc2s().ti2());
        tick_timer()
            .ccmr2_input()
            .write(|w| w.cc3s().ti3().cc4s().ti4());
        Capture { parts: Vec::new() }
    }

    /// Captures these wires from now on (`wires` has a bit for each), and forgets all edges before.
    /// At rest, when no tick writes DIER.
    fn begin(&mut self, wires: usize) {
        self.end();
        let chosen = (0..CAPTURES.len()).filter(|wire| wires >> wire & 1 != 0);
        let length = ROOM / chosen.clone().count().max(1);
        for (wire, memory) in chosen.zip(EDGES.chunks(length)) {
            let input = &CAPTURES[wire];
            input.pin.make_alternate(FUNCTION, Pull::Down);
            let level = input.begin(memory);
            let _ = self.parts.push(Part {
                wire,
                memory,
                level,
            });
        }
    }

    /// Stops all captures, and leaves no request pending.
    fn end(&mut self) {
        let timer = tick_timer();
        timer.dier().reset();
        for input in &CAPTURES {
            input.end();
            input.pin.make_input(Pull::Down);
        }
        timer.sr().write(|w| {
            w.cc2of().clear_bit().cc3of().clear_bit();
            w.cc4of().clear_bit()
        });
        timer.dier().write(|w| keep_captures(w));
        self.parts.clear();
    }

    fn part(&self, wire: usize) -> Option<&Part> {
        self.parts.iter().find(|part| part.wire == wire)
    }
}

/// The value of a word; an error unless it is whole and from 0 to `most`.
fn whole(call: &Call, letter: Letter, most: usize) -> Result<usize, Status> {
    let value = call.words.get(letter).ok_or(Status::MissingWord)?;
    if value.nanos() % 1_000_000_000 != 0 {
        return Err(Status::NotWhole);
    }
    let value = usize::try_from(value.trunc()).map_err(|_| Status::OutOfRange)?;
    (value <= most).then_some(value).ok_or(Status::OutOfRange)
}

/// The wires of `M120`, a bit each; an error if one stream would take the requests of two of
/// them.
fn wires(call: &Call) -> Result<usize, Status> {
    let wires = whole(call, Letter::P, (1 << CAPTURES.len()) - 1)?;
    let mut taken = 0;
    for (wire, input) in CAPTURES.iter().enumerate() {
        if wires >> wire & 1 != 0 {
            if taken & input.hearers() != 0 {
                return Err(Status::OutOfRange);
            }
            taken |= input.hearers();
        }
    }
    Ok(wires)
}

/// Edges as the answer to `M121`.
struct Told<'a> {
    part: &'a Part,
    /// The number of the first edge.
    first: usize,
}

impl fmt::Display for Told<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Told { part, first } = self;
        let edges = part.edges();
        let (wire, all) = (part.wire, edges.len());
        let (lost, level) = (u8::from(part.has_lost()), u8::from(part.level));
        write!(f, "[EDGES:{wire},{first},{all},{lost},{level}:")?;
        for count in edges.iter().skip(*first).take(PER_LINE) {
            write!(f, "{:08x}", count.load(Relaxed))?;
        }
        f.write_str("]")
    }
}

impl Extension<AXES> for Capture {
    fn m_code(&self, number: u8) -> Option<MCode> {
        match number {
            120 => Some(MCode::with(&[Letter::P])),
            121 => Some(MCode::with(&[Letter::P, Letter::L])),
            122 => Some(MCode::PLAIN),
            _ => None,
        }
    }

    fn check(&self, call: &Call) -> Result<(), Status> {
        match call.code {
            120 => wires(call).map(|_| ()),
            121 => {
                let wire = whole(call, Letter::P, CAPTURES.len() - 1)?;
                whole(call, Letter::L, ROOM)?;
                self.part(wire).map(|_| ()).ok_or(Status::OutOfRange)
            }
            _ => Ok(()),
        }
    }

    fn perform(&mut self, call: &Call, cx: &mut Cx<'_, AXES>) -> Step<AXES> {
        let word = |letter| {
            call.words
                .get(letter)
                .map_or(0, |value: Number| value.trunc()) as usize
        };
        match call.code {
            // M120 needs the timer without ticks. M121 takes longer than motion should wait.
            120 | 121 if !cx.at_rest => return Step::Rest,
            120 => self.begin(word(Letter::P)),
            121 => {
                if let Some(part) = self.part(word(Letter::P)) {
                    cx.line(format_args!("{}", part.told(word(Letter::L))));
                }
            }
            _ => {
                let count = tick_timer().cnt().read().bits();
                cx.line(format_args!("[COUNT:{count:08x}]"));
            }
        }
        Step::Done
    }
}
