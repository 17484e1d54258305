//! Acceptance tests: send bytes, watch pins.
