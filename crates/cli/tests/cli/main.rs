//! The `leadscrew` program as a user meets it: options, outputs, exit status, and every kind of bad
//! input.

mod habits;
mod import;
mod jobs;
mod machine;
mod outputs;
mod paths;
mod program;
mod refusals;
mod schema;
mod serving;
mod times;
