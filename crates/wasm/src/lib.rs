//! The machine of a page without a server, as a WebAssembly module. Its caller passes bytes in with
//! five functions, and gets bytes from the module through `tell`.
//!
//! ```text
//!   room(length) -> address      room for the bytes of the next call; the caller writes them there
//!   machine(kept)                takes a machine file from there, its last `kept` bytes the memory that was kept
//!   hear()                       takes frames of the page from there
//!   go(ms)                       lets the machine reach this time of the caller's clock, ms; powers it up at first
//!   look()                       looks at a job from there, that another instance has told of, to its end
//!
//!   tell(address, length)        what the module asks its caller for: takes a frame, until it returns
//! ```
//!
//! The page gets the same frames as from `leadscrew serve`. Three further frames are for the
//! caller: `LOOK`, `FAILED` and `KEEP`.
#![cfg(target_arch = "wasm32")]

use leadscrew_jobs::{Finding, Job, Workshop};
use leadscrew_page::{finding_frame, Alone};
use leadscrew_sim::profile::Profile;
use std::cell::RefCell;
use std::path::Path;
use std::time::Duration;

/// The first byte of a frame that holds a job, for [`look`] of another instance.
const LOOK: u8 = 128;

/// The first byte of a frame that holds an error text; after it the module cannot be used any more.
const FAILED: u8 = 129;

/// The first byte of a frame that holds the machine's memory with its settings. The caller keeps it
/// for [`machine`] of a later instance.
const KEEP: u8 = 130;

#[link(wasm_import_module = "page")]
extern "C" {
    fn tell(address: *const u8, length: usize);
}

/// Passes a frame to the caller.
fn send(frame: &[u8]) {
    // SAFETY: `address` and `length` are the frame's. The caller reads these bytes before `tell`
    // returns.
    unsafe { tell(frame.as_ptr(), frame.len()) }
}

fn fail(words: &str) {
    send(&[&[FAILED], words.as_bytes()].concat());
}

/// The module's only state. The module has one thread.
#[derive(Default)]
struct Module {
    input: Vec<u8>,
    file: Profile,
    kept: Option<Vec<u8>>,
    alone: Option<Alone>,
}

thread_local! {
    static MODULE: RefCell<Module> = RefCell::default();
}

fn with<T>(work: impl FnOnce(&mut Module) -> T) -> T {
    MODULE.with_borrow_mut(work)
}

/// Makes room for `length` bytes; returns its address.
#[no_mangle]
pub extern "C" fn room(length: usize) -> *mut u8 {
    with(|module| {
        module.input = vec![0; length];
        module.input.as_mut_ptr()
    })
}

/// Takes a machine file, before any other call but [`room`]. After the file come `kept` bytes of
/// the machine's memory; 0 if there is none.
#[no_mangle]
pub extern "C" fn machine(kept: usize) {
    std::panic::set_hook(Box::new(|info| fail(&info.to_string())));
    with(|module| {
        let end = module.input.len().saturating_sub(kept);
        module.kept = (kept > 0).then(|| module.input.split_off(end));
        let text = String::from_utf8_lossy(&module.input);
        match Profile::parse(Path::new("machine"), &text) {
            Ok(file) => module.file = file,
            Err(wrong) => fail(&wrong.to_string()),
        }
    });
}

/// Takes frames of the page.
#[no_mangle]
pub extern "C" fn hear() {
    with(|module| {
        let Some(alone) = &mut module.alone else {
            return;
        };
        let input = std::mem::take(&mut module.input);
        if alone
            .hear(&input, |job| send(&[&[LOOK], &job.packed()[..]].concat()))
            .is_err()
        {
            fail("bytes that no page sends");
        }
    });
}

/// Runs the machine up to the time `ms` of the caller's clock.
#[no_mangle]
pub extern "C" fn go(ms: f64) {
    let now = Duration::try_from_secs_f64(ms / 1000.0).unwrap_or_default();
    with(|module| {
        let (file, kept) = (&module.file, module.kept.as_deref());
        let alone = module
            .alone
            .get_or_insert_with(|| Alone::power_up(file, kept, now));
        alone.go(now);
        if let Some(memory) = alone.changed_memory() {
            send(&[&[KEEP], memory].concat());
        }
        while let Some(frame) = alone.next_frame() {
            send(&frame);
        }
    });
}

/// Analyses a job to its end.
#[no_mangle]
pub extern "C" fn look() {
    let (input, file) = with(|module| (std::mem::take(&mut module.input), module.file.clone()));
    match Job::unpacked(&input) {
        Some(job) => {
            let mut tell = |finding: Finding| send(&finding_frame(&finding));
            // To end this early, the caller ends the worker.
            Workshop::new(&file).look(&job, &|| true, &mut tell);
        }
        None => fail("no job"),
    }
}
