//! Loads and stores of the core's registers.

/// Loads and stores (A5.2.4, A5.3.5 to A5.3.10).
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Memory {
    Load {
        kind: LoadKind,
        rt: u8,
        rn: u8,
        offset: i32,
        mode: AddressMode,
    },
    LoadIndexed {
        kind: LoadKind,
        rt: u8,
        rn: u8,
        rm: u8,
        shift: u8,
    },
    LoadLiteral {
        kind: LoadKind,
        rt: u8,
        address: u32,
    },
    Store {
        width: Width,
        rt: u8,
        rn: u8,
        offset: i32,
        mode: AddressMode,
    },
    StoreIndexed {
        width: Width,
        rt: u8,
        rn: u8,
        rm: u8,
        shift: u8,
    },
    /// LDRD; register 15 as base is the aligned PC.
    LoadDouble {
        rt: u8,
        rt2: u8,
        rn: u8,
        offset: i16,
        mode: AddressMode,
    },
    StoreDouble {
        rt: u8,
        rt2: u8,
        rn: u8,
        offset: i16,
        mode: AddressMode,
    },
    LoadMultiple {
        rn: u8,
        list: u16,
        writeback: bool,
        before: bool,
    },
    StoreMultiple {
        rn: u8,
        list: u16,
        writeback: bool,
        before: bool,
    },
    LoadExclusive {
        width: Width,
        rt: u8,
        rn: u8,
        offset: u16,
    },
    StoreExclusive {
        width: Width,
        rd: u8,
        rt: u8,
        rn: u8,
        offset: u16,
    },
    ClearExclusive,
    /// PLD, PLI: a hint.
    Preload,
}

/// The size of an access.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Width {
    Byte,
    Half,
    Word,
}

/// The effect of a load on the bits above those it read.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum LoadKind {
    Byte,
    Half,
    Word,
    SignedByte,
    SignedHalf,
}

/// The way in which base register and offset make an address (A4.6.1).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum AddressMode {
    /// `[rn, #offset]`
    Offset,
    /// `[rn, #offset]!`
    PreIndexed,
    /// `[rn], #offset`
    PostIndexed,
}
