//! The types of instructions: one for each family. [`crate::decode`] makes them, and `execute`
//! carries them out.
//!
//! The families follow the instruction set of the ARMv7-M Architecture Reference Manual (DDI 0403),
//! chapters A5 to A7. Registers are their numbers: 0 to 15 in the core, 0 to 31 (`s0` to `s31`) in
//! the floating-point unit.

mod float;
mod memory;

pub(crate) use float::{Direction, Float, FloatOp, FloatUnary};
pub(crate) use memory::{AddressMode, LoadKind, Memory, Width};

/// The destination of a comparison: no register.
pub(crate) const NO_REGISTER: u8 = 16;
/// In some encodings register 15 stands for "no operand".
pub(crate) const NO_OPERAND: u8 = 15;

/// One instruction.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Instruction {
    Data(Data),
    Multiply(Multiply),
    Media(Media),
    Memory(Memory),
    Branch(Branch),
    System(System),
    Float(Float),
    /// Permanently undefined, or not an instruction of this core.
    Undefined,
}

/// Says whether an instruction sets the condition flags.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum SetFlags {
    No,
    Yes,
    /// In 16-bit encodings: only outside IT blocks.
    OutsideIt,
}

/// Arithmetic and logic on registers and constants (A5.2.1, A5.3.1, A5.3.3, A5.3.11).
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Data {
    Immediate {
        op: DataOp,
        flags: SetFlags,
        rd: u8,
        rn: u8,
        value: u32,
        /// The carry that a rotated constant produces; `None` if the carry flag stays.
        carry: Option<bool>,
    },
    Register {
        op: DataOp,
        flags: SetFlags,
        rd: u8,
        rn: u8,
        rm: u8,
        shift: Shift,
        amount: u8,
    },
    /// A shift by the low byte of a register.
    Shift {
        shift: Shift,
        flags: SetFlags,
        rd: u8,
        rn: u8,
        rm: u8,
    },
    /// MOVW: sets the lower 16 bits, and clears the others.
    MoveBottom { rd: u8, value: u16 },
    /// MOVT: sets the upper half only.
    MoveTop { rd: u8, value: u16 },
}

/// The operation of a [`Data`] instruction. A comparison has [`NO_REGISTER`] as destination.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum DataOp {
    And,
    Bic,
    Orr,
    Orn,
    Eor,
    Mov,
    Mvn,
    Add,
    Adc,
    Sub,
    Sbc,
    Rsb,
}

/// The kinds of shift (A7.4.2).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Shift {
    Left,
    Right,
    ArithmeticRight,
    Rotate,
    /// RRX: one bit to the right, through the carry flag.
    RotateWithCarry,
}

/// Products and quotients (A5.3.16, A5.3.17).
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Multiply {
    /// A 32-bit result; `ra` is the accumulator, or [`NO_OPERAND`].
    Short {
        op: ShortOp,
        flags: SetFlags,
        rd: u8,
        rn: u8,
        rm: u8,
        ra: u8,
    },
    /// A 64-bit result.
    Long {
        op: LongOp,
        low: u8,
        high: u8,
        rn: u8,
        rm: u8,
    },
    Divide {
        signed: bool,
        rd: u8,
        rn: u8,
        rm: u8,
    },
}

/// Products of 32 bits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum ShortOp {
    /// MUL, MLA.
    Add,
    /// MLS.
    Subtract,
    /// SMULxy, SMLAxy.
    Halves { n_top: bool, m_top: bool },
    /// SMULWy, SMLAWy.
    WordByHalf { m_top: bool },
    /// SMUAD, SMLAD, SMUSD, SMLSD.
    Dual { subtract: bool, exchange: bool },
    /// SMMUL, SMMLA, SMMLS.
    Top { subtract: bool, round: bool },
    /// USAD8, USADA8.
    AbsoluteDifferences,
}

/// Products of 64 bits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum LongOp {
    /// UMULL, UMLAL.
    Unsigned { accumulate: bool },
    /// SMULL, SMLAL.
    Signed { accumulate: bool },
    /// UMAAL.
    UnsignedPlusBoth,
    /// SMLALxy.
    Halves { n_top: bool, m_top: bool },
    /// SMLALD, SMLSLD.
    Dual { subtract: bool, exchange: bool },
}

/// Bit fields, saturation, bytes and halves (A5.3.3, A5.3.12 to A5.3.15).
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Media {
    /// BFI, or BFC if `rn` is [`NO_OPERAND`].
    Insert {
        rd: u8,
        rn: u8,
        lsb: u8,
        width: u8,
    },
    /// UBFX, SBFX.
    Extract {
        signed: bool,
        rd: u8,
        rn: u8,
        lsb: u8,
        width: u8,
    },
    /// SSAT, USAT.
    Saturate {
        signed: bool,
        bits: u8,
        rd: u8,
        rn: u8,
        shift: Shift,
        amount: u8,
    },
    /// SSAT16, USAT16.
    SaturateHalves {
        signed: bool,
        bits: u8,
        rd: u8,
        rn: u8,
    },
    /// PKHBT, PKHTB.
    Pack {
        top_first: bool,
        rd: u8,
        rn: u8,
        rm: u8,
        shift: Shift,
        amount: u8,
    },
    /// SEL.
    Select {
        rd: u8,
        rn: u8,
        rm: u8,
    },
    /// SXTB to UXTAB16; `rn` is added unless it is [`NO_OPERAND`].
    Extend {
        op: ExtendOp,
        signed: bool,
        rd: u8,
        rn: u8,
        rm: u8,
        rotation: u8,
    },
    Reverse {
        op: ReverseOp,
        rd: u8,
        rm: u8,
    },
    /// QADD, QDADD, QSUB, QDSUB.
    SaturatingAdd {
        double: bool,
        subtract: bool,
        rd: u8,
        rn: u8,
        rm: u8,
    },
    /// SADD8 to UHSUB16.
    Parallel {
        op: LaneOp,
        signed: bool,
        result: LaneResult,
        rd: u8,
        rn: u8,
        rm: u8,
    },
}

/// The part of the register that an extension takes out.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum ExtendOp {
    Half,
    TwoBytes,
    Byte,
}

/// Operations on the order of bits and bytes, and CLZ.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum ReverseOp {
    Bytes,
    BytesInHalves,
    SignedHalf,
    Bits,
    LeadingZeros,
}

/// Parallel additions and subtractions.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum LaneOp {
    Add8,
    Add16,
    /// ASX: the halves of the second operand are exchanged; the lower is subtracted, the upper
    /// added.
    AddSubtractExchanged,
    Subtract8,
    Subtract16,
    /// SAX: the halves of the second operand are exchanged; the lower is added, the upper
    /// subtracted.
    SubtractAddExchanged,
}

/// The result of a lane that overflows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum LaneResult {
    /// Wraps, and sets the GE flags.
    Wrap,
    Saturate,
    Halve,
}

/// Changes of the program flow, and the conditions on them (A5.2.6, A5.3.4).
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Branch {
    /// B; condition 14 is "always".
    Direct { condition: u8, target: u32 },
    /// BL.
    Link { target: u32 },
    /// BX.
    Exchange { rm: u8 },
    /// BLX.
    LinkExchange { rm: u8 },
    /// CBZ, CBNZ.
    Compare { nonzero: bool, rn: u8, target: u32 },
    /// TBB, TBH.
    Table { width: Width, rn: u8, rm: u8 },
    /// IT, with its condition and mask.
    IfThen { state: u8 },
}

/// Hints, barriers, exceptions and special registers (A5.2.5, A5.3.4).
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum System {
    Nop,
    WaitForInterrupt,
    WaitForEvent,
    SendEvent,
    /// DMB, DSB.
    DataBarrier,
    /// ISB.
    InstructionBarrier,
    Breakpoint,
    SupervisorCall,
    /// CPS.
    ChangeState {
        disable: bool,
        primask: bool,
        faultmask: bool,
    },
    /// MRS.
    ReadSpecial {
        rd: u8,
        register: u8,
    },
    /// MSR.
    WriteSpecial {
        rn: u8,
        register: u8,
        mask: u8,
    },
}
