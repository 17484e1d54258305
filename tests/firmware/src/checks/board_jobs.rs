//! The work that every board does: it engraves a row, and stops for a reset in motion.
use crate::{
    bench::{cycles, ensure, Bench, Failure},
    firmware::Build,
    pins::CPU_HZ,
    steps::Step,
    stream::Stream,
};

/// Settings that make the machine the same on each board: profiles differ in theirs.
const SETTINGS: &str =
    "$22=0\n$X\n$0=5\n$4=0\n$30=1000\n$31=0\n$32=1\n$100=250\n$110=1200\n$120=4000\n$701=500\n";

/// Powers of a row's pixels, thousandths of full power: any two neighbours differ.
const ROW: [u64; 12] = [1000, 200, 800, 0, 500, 1000, 0, 100, 900, 300, 600, 50];
/// A pixel of 2 mm takes 0.2 s at 600 mm/min, which is ten periods of the slowest power, 50 Hz.
/// `STEPS`: the steps of the row.
const PIXEL: &str = "X2";
const STEPS: usize = ROW.len() * 500;

/// Engraves a row of pixels under M3, under which power does not follow the speed. Each pixel must
/// have its duty, within a level, for its own time.
pub(super) fn ensure_engraves(build: &Build, (hz, levels): (u64, u64)) -> Result<(), Failure> {
    let mut bench = Bench::boot(build)?;
    bench.commands(SETTINGS)?;
    let pixels = ROW.map(|power| format!("{PIXEL}S{power}\n")).concat();
    let program = format!("G21G91M3S0\nG1F600\n{pixels}M5\n");
    let (begun, before) = (bench.machine.duties().len(), bench.pins.steps.len());
    bench.stream(&Stream::new(&program))?;
    let steps = &bench.pins.steps[before..];
    ensure(steps.len() == STEPS, || format!("{} steps", steps.len()))?;
    let duties = bench.machine.duties()[begun..].iter();
    let of_power = duties.filter(|duty| duty.pin == build.wiring.power);
    let changes: Vec<(u64, u64)> = of_power.map(|duty| (duty.cycle, duty.high)).collect();
    let period = CPU_HZ / hz;
    for (pixel, power) in ROW.into_iter().enumerate() {
        // In the middle of the pixel, a change of duty has had its period.
        let middle = steps[pixel * 500 + 250].edge();
        let high = changes.iter().rfind(|(cycle, _)| *cycle <= middle);
        let high = high.map_or(0, |(_, high)| *high);
        let off = high.abs_diff(period * power / 1000);
        ensure(off <= period / levels, || {
            format!("pixel {pixel} of S{power}: high for {high} of {period} cycles")
        })?;
    }
    Ok(())
}

/// The time after the byte at which the last step may still come, s.
const STOPS_WITHIN: f64 = 0.001;

/// Sends 0x18 in motion: no step follows, power is off, the machine is locked. Unlocked, it moves
/// again.
pub(super) fn ensure_stops(build: &Build) -> Result<(), Failure> {
    let mut bench = Bench::boot(build)?;
    bench.commands(SETTINGS)?;
    bench.commands("$701=0\nG91M3S1000\nG1X100F1200\n")?;
    bench.run_for(0.5)?;
    ensure(bench.machine.level(build.wiring.power), || {
        "no power".into()
    })?;
    bench.send("\x18");
    // A byte takes 87 µs at 115200 baud.
    let latest = bench.machine.cycle() + cycles(STOPS_WITHIN);
    bench.hear_until(1.0, |line| line.starts_with("ALARM:3"))?;
    bench.run_for(0.1)?;
    let last = bench.pins.steps.last().map_or(0, Step::edge);
    ensure(last > 0 && last <= latest, || {
        format!(
            "the last step comes {} cycles late",
            last.saturating_sub(latest)
        )
    })?;
    ensure(!bench.machine.level(build.wiring.power), || {
        "power is on".into()
    })?;
    bench.hear_banner()?;
    let before = bench.pins.steps.len();
    bench.commands("$X\nG91G1X1F600\nG4P0\n")?;
    let after = bench.pins.steps.len() - before;
    ensure(after == 250, || format!("{after} steps after the reset"))
}
