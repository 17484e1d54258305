//! Prints the settings of a new machine with three axes, their units and names.
//!
//! ```text
//! $ cargo run -p leadscrew-settings --example list_settings
//! $0=10 us: Step pulse
//! $1=25 ms: Motor idle delay
//! ...
//! ```

use leadscrew_settings::values::{Key, Settings};

fn main() {
    let settings = Settings::<3>::new(&[]);
    for key in Key::all(3) {
        let row = key.row();
        println!("{} {}: {}", settings.line(key), row.unit, row.name);
    }
}
