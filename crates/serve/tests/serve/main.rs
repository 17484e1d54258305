//! Clients of `serve` in real time.

mod client;
mod jobs;
mod manners;
mod profiles;
mod served;
mod state_file;
mod strangers;
