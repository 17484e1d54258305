//! The first seam: G-code programs in, canonical commands out, compared with golden files.
//!
//! Each `golden/NAME.nc` prints as `golden/NAME.commands`. After a change that is meant, `BLESS=1
//! cargo test -p leadscrew-machine --test all commands` writes them anew; the difference is then in
//! the diff to be reviewed.

#[path = "../examples/print_commands.rs"]
#[allow(dead_code, reason = "the example's main")]
mod print_commands;

use print_commands::print_commands;
use std::fs;
use std::path::{Path, PathBuf};

fn programs() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let mut programs: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|name| name == "nc"))
        .collect();
    programs.sort();
    programs
}

#[test]
fn programs_become_the_commands_on_record() {
    let programs = programs();
    assert!(!programs.is_empty());
    for program in programs {
        let printed = print_commands(&fs::read(&program).unwrap());
        let golden = program.with_extension("commands");
        if std::env::var_os("BLESS").is_some() {
            fs::write(&golden, &printed).unwrap();
        }
        let expected = fs::read_to_string(&golden).unwrap_or_default();
        assert!(
            printed == expected,
            "{} is not what {} holds:\n{printed}",
            program.display(),
            golden.display()
        );
    }
}
