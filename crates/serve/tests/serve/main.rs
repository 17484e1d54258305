//! Tests of `serve` with clients in real time.

mod client;
mod jobs;
mod manners;
mod profiles;
mod served;
mod state_file;
mod strangers;
