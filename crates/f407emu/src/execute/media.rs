//! Bit fields, saturation, bytes and halves.
use super::arithmetic::{half, saturate_signed, saturate_unsigned, shift};
use crate::{
    instruction::{ExtendOp, LaneOp, LaneResult, Media, ReverseOp, NO_OPERAND},
    machine::Machine,
};

impl Machine {
    pub(super) fn execute_media(&mut self, media: Media) {
        match media {
            Media::Insert { rd, rn, lsb, width } => self.insert(rd, rn, lsb, width),
            Media::Extract {
                signed,
                rd,
                rn,
                lsb,
                width,
            } => {
                let value = extract(self.cpu.get(rn), signed, lsb, width);
                self.cpu.set(rd, value);
            }
            Media::Saturate {
                signed,
                bits,
                rd,
                rn,
                shift: kind,
                amount,
            } => {
                let (value, _) = shift(self.cpu.get(rn), kind, u32::from(amount), false);
                let value = self.saturate(i64::from(value as i32), signed, bits);
                self.cpu.set(rd, value);
            }
            Media::SaturateHalves {
                signed,
                bits,
                rd,
                rn,
            } => {
                let value = self.cpu.get(rn);
                let [low, high] =
                    [false, true].map(|top| self.saturate(half(value, top), signed, bits));
                self.cpu.set(rd, low & 0xFFFF | high << 16);
            }
            Media::Pack {
                top_first,
                rd,
                rn,
                rm,
                shift: kind,
                amount,
            } => {
                let (second, _) = shift(self.cpu.get(rm), kind, u32::from(amount), false);
                let first = self.cpu.get(rn);
                let top = if top_first { first } else { second };
                let bottom = if top_first { second } else { first };
                self.cpu.set(rd, top & !0xFFFF | bottom & 0xFFFF);
            }
            other => self.execute_lanes(other),
        }
        self.spend(1);
    }

    /// Operations on bytes and halves, and operations that saturate sums.
    fn execute_lanes(&mut self, media: Media) {
        match media {
            Media::Select { rd, rn, rm } => self.select(rd, rn, rm),
            Media::Extend {
                op,
                signed,
                rd,
                rn,
                rm,
                rotation,
            } => self.extend(op, signed, rd, (rn, rm, rotation)),
            Media::Reverse { op, rd, rm } => self.cpu.set(rd, reverse(op, self.cpu.get(rm))),
            Media::SaturatingAdd {
                double,
                subtract,
                rd,
                rn,
                rm,
            } => self.saturating_add(double, subtract, rd, (rn, rm)),
            Media::Parallel {
                op,
                signed,
                result,
                rd,
                rn,
                rm,
            } => self.parallel(op, signed, result, rd, (rn, rm)),
            Media::Insert { .. }
            | Media::Extract { .. }
            | Media::Saturate { .. }
            | Media::SaturateHalves { .. }
            | Media::Pack { .. } => {}
        }
    }

    fn insert(&mut self, rd: u8, rn: u8, lsb: u8, width: u8) {
        let mask = (u32::MAX >> (32 - width)) << lsb;
        let source = if rn == NO_OPERAND {
            0
        } else {
            self.cpu.get(rn) << lsb
        };
        let value = self.cpu.get(rd) & !mask | source & mask;
        self.cpu.set(rd, value);
    }

    /// Saturates a value, and notes in Q whether that changed it.
    fn saturate(&mut self, value: i64, signed: bool, bits: u8) -> u32 {
        let (value, saturated) = if signed {
            saturate_signed(value, u32::from(bits))
        } else {
            saturate_unsigned(value, u32::from(bits))
        };
        self.cpu.flags.saturated |= saturated;
        value as u32
    }

    fn select(&mut self, rd: u8, rn: u8, rm: u8) {
        let (n, m) = (self.cpu.get(rn), self.cpu.get(rm));
        let mask = (0..4)
            .filter(|byte| self.cpu.ge >> byte & 1 != 0)
            .fold(0, |mask, byte| mask | 0xFFu32 << (8 * byte));
        self.cpu.set(rd, n & mask | m & !mask);
    }

    fn extend(&mut self, op: ExtendOp, signed: bool, rd: u8, operands: (u8, u8, u8)) {
        let (rn, rm, rotation) = operands;
        let value = self.cpu.get(rm).rotate_right(u32::from(rotation));
        let addend = if rn == NO_OPERAND {
            0
        } else {
            self.cpu.get(rn)
        };
        let byte = |value: u32| {
            if signed {
                value as i8 as u32
            } else {
                value & 0xFF
            }
        };
        let sum = match (op, signed) {
            (ExtendOp::Half, true) => addend.wrapping_add(value as i16 as u32),
            (ExtendOp::Half, false) => addend.wrapping_add(value & 0xFFFF),
            (ExtendOp::Byte, _) => addend.wrapping_add(byte(value)),
            (ExtendOp::TwoBytes, _) => {
                let low = addend.wrapping_add(byte(value)) & 0xFFFF;
                let high = (addend >> 16).wrapping_add(byte(value >> 16));
                low | high << 16
            }
        };
        self.cpu.set(rd, sum);
    }

    fn saturating_add(&mut self, double: bool, subtract: bool, rd: u8, (rn, rm): (u8, u8)) {
        let m = i64::from(self.cpu.get(rm) as i32);
        let mut n = i64::from(self.cpu.get(rn) as i32);
        if double {
            n = i64::from(self.saturate(2 * n, true, 32) as i32);
        }
        let sum = if subtract { m - n } else { m + n };
        let value = self.saturate(sum, true, 32);
        self.cpu.set(rd, value);
    }

    /// Lanes side by side. If lanes wrap, GE says which of them carried or had no borrow.
    fn parallel(
        &mut self,
        op: LaneOp,
        signed: bool,
        result: LaneResult,
        rd: u8,
        (rn, rm): (u8, u8),
    ) {
        let (n, m) = (self.cpu.get(rn), self.cpu.get(rm));
        let width = match op {
            LaneOp::Add8 | LaneOp::Subtract8 => 8,
            LaneOp::Add16
            | LaneOp::Subtract16
            | LaneOp::AddSubtractExchanged
            | LaneOp::SubtractAddExchanged => 16,
        };
        let (mut value, mut ge) = (0, 0);
        for index in 0..32 / width {
            let (other, subtract) = partner(op, index);
            let (a, b) = (lane(n, index, width, signed), lane(m, other, width, signed));
            let sum = if subtract { a - b } else { a + b };
            let finished = match (result, signed) {
                (LaneResult::Wrap, _) => sum,
                (LaneResult::Saturate, true) => saturate_signed(sum, width).0,
                (LaneResult::Saturate, false) => saturate_unsigned(sum, width).0,
                (LaneResult::Halve, _) => sum >> 1,
            };
            value |= (finished as u32 & (u32::MAX >> (32 - width))) << (index * width);
            let limit = if signed || subtract { 0 } else { 1 << width };
            if sum >= limit {
                ge |= (u32::MAX >> (32 - width / 8)) << (index * width / 8);
            }
        }
        if result == LaneResult::Wrap {
            self.cpu.ge = ge as u8;
        }
        self.cpu.set(rd, value);
    }
}

/// The lane of the second operand that belongs to a lane of the first, and whether it is
/// subtracted.
fn partner(op: LaneOp, index: u32) -> (u32, bool) {
    match op {
        LaneOp::Add8 | LaneOp::Add16 => (index, false),
        LaneOp::Subtract8 | LaneOp::Subtract16 => (index, true),
        LaneOp::AddSubtractExchanged => (1 - index, index == 0),
        LaneOp::SubtractAddExchanged => (1 - index, index == 1),
    }
}

fn lane(value: u32, index: u32, width: u32, signed: bool) -> i64 {
    let bits = value >> (index * width) & (u32::MAX >> (32 - width));
    match (signed, width) {
        (false, _) => i64::from(bits),
        (true, 8) => i64::from(bits as i8),
        (true, _) => i64::from(bits as i16),
    }
}

fn extract(value: u32, signed: bool, lsb: u8, width: u8) -> u32 {
    let unused = 32 - u32::from(width);
    let moved = (value >> lsb) << unused;
    if signed {
        (moved as i32 >> unused) as u32
    } else {
        moved >> unused
    }
}

fn reverse(op: ReverseOp, value: u32) -> u32 {
    match op {
        ReverseOp::Bytes => value.swap_bytes(),
        ReverseOp::BytesInHalves => value.swap_bytes().rotate_right(16),
        ReverseOp::SignedHalf => (value as u16).swap_bytes() as i16 as u32,
        ReverseOp::Bits => value.reverse_bits(),
        ReverseOp::LeadingZeros => value.leading_zeros(),
    }
}
