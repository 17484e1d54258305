//! Instructions of the floating-point unit. Registers are numbers of single-precision registers, 0
//! to 31.

/// Single precision (A6.4 to A6.7).
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Float {
    Binary {
        op: FloatOp,
        sd: u8,
        sn: u8,
        sm: u8,
    },
    /// VMLA to VFNMS: `±sd ± sn × sm`.
    MultiplyAdd {
        fused: bool,
        negate_product: bool,
        negate_addend: bool,
        sd: u8,
        sn: u8,
        sm: u8,
    },
    Unary {
        op: FloatUnary,
        sd: u8,
        sm: u8,
    },
    Constant {
        sd: u8,
        bits: u32,
    },
    Compare {
        sd: u8,
        sm: u8,
    },
    CompareZero {
        sd: u8,
    },
    ToInteger {
        signed: bool,
        toward_zero: bool,
        sd: u8,
        sm: u8,
    },
    FromInteger {
        signed: bool,
        sd: u8,
        sm: u8,
    },
    ToFixed {
        signed: bool,
        bits: u8,
        fraction: i8,
        sd: u8,
    },
    FromFixed {
        signed: bool,
        bits: u8,
        fraction: i8,
        sd: u8,
    },
    /// VLDR, VSTR; `count` is 2 for a double register.
    Memory {
        direction: Direction,
        sd: u8,
        count: u8,
        rn: u8,
        offset: i16,
    },
    /// VLDM, VSTM.
    Multiple {
        direction: Direction,
        sd: u8,
        count: u8,
        rn: u8,
        writeback: bool,
        before: bool,
    },
    FromCore {
        sn: u8,
        rt: u8,
    },
    ToCore {
        sn: u8,
        rt: u8,
    },
    FromCorePair {
        sm: u8,
        rt: u8,
        rt2: u8,
    },
    ToCorePair {
        sm: u8,
        rt: u8,
        rt2: u8,
    },
    /// VMRS; register 15 stands for the core's condition flags.
    ReadStatus {
        rt: u8,
    },
    WriteStatus {
        rt: u8,
    },
}

/// Operations on two numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum FloatOp {
    Add,
    Subtract,
    Multiply,
    NegatedMultiply,
    Divide,
}

/// Operations on one number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum FloatUnary {
    Move,
    Absolute,
    Negate,
    SquareRoot,
}

/// Between registers and memory.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Direction {
    Load,
    Store,
}
