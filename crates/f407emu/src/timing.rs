//! The constants of the cycle model.
//!
//! What an instruction costs stands where it is carried out: one cycle, loads and stores two but one where they follow
//! each other, divisions two to twelve by the quotient's size, VDIV and VSQRT fourteen, exception entry and exit 12 and 10,
//! a tail chain 6. These are figures of the Cortex-M4 Technical Reference Manual (DDI 0439) as remembered, not looked up.
//! Branch refills, divisions and tables come from an earlier version of this model, whose constants were fitted to 45
//! kernels on a cycle-exact Cortex-M3 without wait states (30 equal, 11 within a cycle for each loop): a fit, not a
//! validation, and not repeated for this code. Exceptions, floats, bus bridges and the flash were not part of it.
//! Nothing has been held against silicon: ±15 % is a judgement.
//!
//! Not modelled: contention of core and DMA on the bus matrix, late arrival of a higher interrupt during entry (it nests).

/// What the cycle model charges, in cycles of HCLK.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// Refill of the pipeline after a direct branch that is taken.
    pub refill: u32,
    /// Refill after the program counter was loaded.
    pub refill_loaded: u32,
    /// Exception entry, from the interrupt to the handler's first instruction.
    pub entry: u32,
    /// Exception return.
    pub exit: u32,
    /// From one handler straight to the next.
    pub tail_chain: u32,
    /// Stacking or restoring the floating-point registers.
    pub float_context: u32,
    /// Clocks of its bus that an access to an APB peripheral takes beyond the core's own cycle.
    pub apb_clocks: u32,
    /// How instructions and constants come out of the flash.
    pub flash: FlashTiming,
    /// Time in which the flash programs a unit of any width, µs: 16 typically, 100 at most (data sheet, table 40).
    pub program_us: u32,
}

/// How the flash's wait states are charged (RM0090 section 3.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashTiming {
    /// None: the lower bound.
    ZeroWait,
    /// With the ART accelerator's caches as the program has filled them.
    Art,
    /// The caches are empty at each exception entry: the upper bound for an interrupt, to be used for budgets.
    ArtCold,
}

impl Default for Timing {
    fn default() -> Self {
        Timing {
            refill: 1,
            refill_loaded: 3,
            entry: 12,
            exit: 10,
            tail_chain: 6,
            float_context: 17,
            apb_clocks: 2,
            flash: FlashTiming::Art,
            program_us: 16,
        }
    }
}
