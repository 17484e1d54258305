//! The square root of the processor's FPU, if it has one.
//!
//! A Cortex-M4F computes the root of an `f32` in one instruction of 14 cycles (Arm DDI 0439, table
//! 7-1). `core` does not offer this instruction, and `libm` computes the root in 58 instructions.
//! Planning a line takes three to five roots. IEEE 754 requires the correctly rounded root, so both
//! ways give the same bits.
//!
//! This is a crate of its own, so that the libraries that use it can forbid unsafe code.
#![no_std]
#![deny(unsafe_code)]

/// Returns the correctly rounded square root; NaN for numbers below 0.
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    root(x)
}

// This ABI passes floats in the FPU's registers, so it is used only if there is an FPU. Every
// such FPU has the instruction (VFPv2 and later).
#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
#[allow(unsafe_code)]
#[inline(always)]
fn root(x: f32) -> f32 {
    let root: u32;
    // SAFETY: the code reads one register, and writes one register and the FPU's register that it
    // names. (Values are passed in integer registers, because the compiler does not count the FPU's
    // registers among those that this target has.)
    unsafe {
        core::arch::asm!(
            "vmov s0, {bits}",
            "vsqrt.f32 s0, s0",
            "vmov {bits}, s0",
            bits = inlateout(reg) x.to_bits() => root,
            out("s0") _,
            options(pure, nomem, nostack, preserves_flags)
        );
    }
    f32::from_bits(root)
}

#[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
#[inline(always)]
fn root(x: f32) -> f32 {
    libm::sqrtf(x)
}

#[cfg(test)]
mod tests {
    use super::sqrt;

    #[test]
    fn roots_are_rounded_correctly() {
        let mut bits = 1u32;
        while let Some(next) = bits.checked_add(12_345) {
            let x = f32::from_bits(bits);
            if x.is_finite() && x > 0.0 {
                // The root computed in f64 and rounded to f32 is the correctly rounded one, since
                // 53 bits are more than 2·24 + 2.
                let exact = libm::sqrt(f64::from(x)) as f32;
                assert_eq!(sqrt(x).to_bits(), exact.to_bits(), "{x}");
            }
            bits = next;
        }
    }

    #[test]
    fn there_is_none_of_less_than_nothing() {
        assert!(sqrt(-1.0).is_nan());
        assert_eq!(sqrt(0.0), 0.0);
    }
}

/// The examples of the package's README, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
