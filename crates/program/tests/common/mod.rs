//! Runs a program to its end.

use leadscrew_program::{Error, Label, Program, Step, Texts, World};

/// Texts by their names; the first is the program.
pub(crate) struct Files(pub(crate) Vec<(&'static str, String)>);

impl Texts for Files {
    fn text(&self, number: u8) -> &[u8] {
        self.0[usize::from(number)].1.as_bytes()
    }

    fn find(&mut self, label: &Label) -> Option<u8> {
        let name = label.to_string();
        let at = self.0.iter().position(|(file, _)| *file == name)?;
        u8::try_from(at).ok()
    }
}

/// The outcome of a program.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Ran {
    /// Its plain lines.
    pub(crate) lines: Vec<String>,
    /// Its branches: the line, and whether it was taken.
    pub(crate) branches: Vec<(u32, bool)>,
    /// Its fault.
    pub(crate) error: Option<Error>,
}

/// Runs a program in a machine that `world` stands for.
pub(crate) fn run_in(text: &str, world: &dyn World) -> Ran {
    run_files(Files(vec![("", text.to_owned())]), world)
}

/// Runs a program without a machine.
pub(crate) fn run(text: &str) -> Ran {
    run_in(text, &())
}

/// Runs the first of several files.
pub(crate) fn run_files(mut files: Files, world: &dyn World) -> Ran {
    let mut program = Program::<8, 16, 64, 32, 256>::new(100_000);
    let mut ran = Ran::default();
    loop {
        match program.step(&mut files, world) {
            Ok(Step::Line(line)) => ran.lines.push(String::from_utf8_lossy(line).into_owned()),
            Ok(Step::Branch(taken)) => {
                let line = program.line().1;
                ran.branches.push((line, taken));
            }
            Ok(Step::Busy) => {}
            Ok(Step::End) => return ran,
            Err(error) => {
                ran.error = Some(error);
                return ran;
            }
        }
    }
}
