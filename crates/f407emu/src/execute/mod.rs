//! Carries out instructions: one file for each family (DDI 0403, chapter A7).
//!
//! Each instruction charges its own cycles, see [`crate::timing`]. A [`Trap`] leaves registers and
//! memory as they were, except for the words that an instruction on several words has already
//! moved.
mod arithmetic;
mod branch;
mod data;
mod fetch;
mod float;
mod float_memory;
mod media;
mod memory;
mod multiply;
mod system;

use crate::{instruction::Instruction, machine::Machine, trap::Trap};

impl Machine {
    /// Carries out an instruction.
    #[inline(always)]
    pub(crate) fn execute(&mut self, instruction: Instruction) -> Result<(), Trap> {
        match instruction {
            Instruction::Data(data) => self.execute_data(data),
            Instruction::Memory(memory) => return self.execute_memory(memory),
            Instruction::Branch(branch) => return self.execute_branch(branch),
            Instruction::Multiply(multiply) => return self.execute_multiply(multiply),
            Instruction::Media(media) => self.execute_media(media),
            Instruction::System(system) => return self.execute_system(system),
            Instruction::Float(float) => return self.execute_float(float),
            Instruction::Undefined => return Err(Trap::Undefined),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
