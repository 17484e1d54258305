//! The jobs supplied with the machines, as a whole: runs each command of a machine's README that
//! makes a job, then compares the job at the pins with the simulator's.
use super::{
    machines::{
        boot_engraver, boot_printer, boot_prototyper, home, plan, profile, run, Carriage, PRINTER,
        PROTOTYPER, UNLOCKED, ZERO,
    },
    Figures,
};
use crate::{
    bench::{ensure, Bench, Failure},
    compare,
    desk::{self, Planned},
    firmware::{Build, Firmware},
    job::{self, Job},
    steps::Step,
};
use std::{fs, path::Path, process::Command};

/// A machine, and how it is prepared for its jobs.
struct Owner {
    number: &'static str,
    boot: fn(&Build) -> Result<Bench, Failure>,
    /// The carriages that home; none if the machine does not home.
    carriages: &'static [Carriage],
    /// Lines before the job.
    settings: &'static str,
    /// The number of motors whose steps are compared with the plan: on machine 003 switches end the
    /// motion of Z.
    motors: usize,
}

const OWNERS: [Owner; 4] = [
    Owner {
        number: "001",
        boot: boot_prototyper,
        carriages: &PROTOTYPER,
        settings: ZERO,
        motors: 4,
    },
    Owner {
        number: "002",
        boot: Bench::boot,
        carriages: &[],
        settings: UNLOCKED,
        motors: 4,
    },
    Owner {
        number: "003",
        boot: boot_engraver,
        carriages: &[],
        settings: "",
        motors: 2,
    },
    Owner {
        number: "004",
        boot: boot_printer,
        carriages: &PRINTER,
        settings: "",
        motors: 4,
    },
];

/// The program that imports jobs.
const DESK: &str = "target/debug/leadscrew";

/// Makes the jobs of a machine as its README says, in a copy of its folder. Returns the jobs.
fn made(number: &str) -> Result<Vec<Job>, Failure> {
    let examples = job::repository().join("examples");
    let work = job::repository().join("target/tmp/supplied");
    let folder = work.join("machines").join(number);
    copy(&examples.join("sources"), &work.join("sources"))?;
    copy(&examples.join("machines").join(number), &folder)?;
    let page = fs::read_to_string(folder.join("README.md"))?;
    let commands = page
        .lines()
        .filter_map(|line| line.strip_prefix("leadscrew import "));
    commands.map(|command| import(&folder, command)).collect()
}

fn copy(from: &Path, to: &Path) -> Result<(), Failure> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let file = entry?.path();
        fs::copy(&file, to.join(file.file_name().unwrap_or_default()))?;
    }
    Ok(())
}

/// Runs `leadscrew import`. Returns the job that it writes.
fn import(folder: &Path, command: &str) -> Result<Job, Failure> {
    let line = format!(
        "{} import {command}",
        job::repository().canonicalize()?.join(DESK).display()
    );
    let made = Command::new("sh")
        .args(["-c", &line])
        .current_dir(folder)
        .output()?;
    let wrong = || Failure(format!("{line}: {}", String::from_utf8_lossy(&made.stderr)));
    let (_, name) = command.rsplit_once("-o ").ok_or_else(wrong)?;
    ensure(made.status.success(), || wrong().0)?;
    let text = fs::read_to_string(folder.join(name)).or_else(|_| {
        // `--tools files` writes one job for each bit.
        fs::read_to_string(folder.join(name.replace(".nc", "-T1.nc")))
    })?;
    Ok(Job::new(name, "", &text))
}

impl Owner {
    /// Runs a job to its end on a board that was just switched on.
    fn work(&self, build: &Build, job: &Job) -> Result<String, Failure> {
        let mut bench = (self.boot)(build)?;
        let job = Job::new(&job.name, self.settings, homed(&job.program));
        let planned = match self.carriages {
            [] => desk::plan_machine(&profile(self.number)?, self.settings, &job.program)?,
            carriages => {
                home(&mut bench, carriages)?;
                plan(self.number, &job)?
            }
        };
        let steps = run(&mut bench, &job)?;
        self.same_ways(&steps, &planned)?;
        Ok(format!("{} step events", steps.len()))
    }

    fn same_ways(&self, steps: &[Step], planned: &[Planned]) -> Result<(), Failure> {
        let (ways, planned) = (compare::ways(steps), compare::planned_ways(planned));
        let motors = ..self.motors;
        ensure(ways[motors] == planned[motors] && !steps.is_empty(), || {
            format!("the motors go {ways:?}; planned {planned:?}")
        })
    }
}

/// The lines of a job after its homing, which the caller has done.
fn homed(program: &str) -> &str {
    program.split_once("$H\n").map_or(program, |(_, rest)| rest)
}

pub(crate) fn supplied_jobs(firmware: &Firmware) -> Result<Figures, Failure> {
    let built = Command::new("cargo")
        .args(["build", "--quiet", "-p", "leadscrew-cli"])
        .status()?;
    ensure(built.success(), || "leadscrew does not build".into())?;
    let mut figures = Figures::default();
    for owner in &OWNERS {
        let number: usize = owner.number.parse()?;
        for job in made(owner.number)? {
            let name = format!("{} {}", owner.number, job.name);
            let done = owner.work(firmware.build(&format!("machine-file-{number:03}"))?, &job);
            figures.add(
                &name,
                done.map_err(|Failure(words)| Failure(format!("{name}: {words}")))?,
            );
        }
    }
    Ok(figures)
}
