//! Writes the page of a machine as one file that contains the simulator. `cargo xtask page` builds
//! the module and calls this program.
//!
//! ```sh
//! standalone MODULE.wasm PAGE.html [MACHINE.toml]
//! ```

use flate2::{write::GzEncoder, Compression};
use leadscrew_page::Standalone;
use leadscrew_sim::profile::Profile;
use std::env;
use std::error::Error;
use std::fs;
use std::io::Write;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = env::args().skip(1).collect();
    let (module, page, machine) = match &args[..] {
        [module, page] => (module, page, None),
        [module, page, machine] => (module, page, Some(Path::new(machine))),
        _ => return Err("expected MODULE.wasm PAGE.html [MACHINE.toml]".into()),
    };
    let machine = machine.map_or(Ok(String::new()), |file| {
        // A mistake in the machine file is reported here, and not by the page.
        Profile::load(file)?;
        fs::read_to_string(file).map_err(Box::<dyn Error>::from)
    })?;
    let module = fs::read(module).map_err(|error| format!("{module}: {error}"))?;
    let mut packed = GzEncoder::new(Vec::new(), Compression::best());
    packed.write_all(&module)?;
    let simulator = packed.finish()?;
    let document = Standalone {
        simulator: &simulator,
        machine: &machine,
    }
    .document();
    fs::write(page, &document).map_err(|error| format!("{page}: {error}"))?;
    println!(
        "{page}: {} bytes; the simulator {} bytes, packed {}",
        document.len(),
        module.len(),
        simulator.len()
    );
    Ok(())
}
