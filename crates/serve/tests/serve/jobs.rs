//! Jobs streamed by character counting over TCP and a pty, with polls in between.

use crate::client::Client;
use crate::served::{Served, FAST};
use leadscrew_serve::LineSpec;
use std::path::Path;

fn example(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    std::fs::read_to_string(folder.join(name)).unwrap()
}

#[test]
fn a_job_streamed_over_tcp_ends_where_it_should() {
    let served = Served::tcp(FAST, 20.0);
    let mut client = served.connect();
    client.send(b"\x18");
    client.expect("Grbl 1.1h ['$' for help]");
    client.stream(&example("heart.nc"));
    client.send(b"G90 G0 X12.5 Y-3.2 Z1\n");
    client.expect("ok");
    let report = client.wait_for("Idle");
    assert!(report.contains("|MPos:12.500,-3.200,1.000|"), "{report}");
    let running = client
        .reports
        .iter()
        .filter(|report| report.starts_with("<Run|"));
    assert!(running.count() > 5, "{:?}", client.reports);
}

#[cfg(unix)]
#[test]
fn a_job_streamed_over_a_pty_ends_where_it_should() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("ttyGRBL");
    let spec = LineSpec::Pty {
        link: link.clone(),
        reset_on_open: true,
    };
    let _served = Served::new(FAST, vec![spec], 20.0);
    let port = || {
        std::fs::OpenOptions::new()
            .read(true)
            .write(true)
            .open(&link)
            .unwrap()
    };
    let (from, to) = (port(), port());
    let mut client = Client::new(from, to);
    client.expect("Grbl 1.1h ['$' for help]");
    client.stream(&example("pocket.nc"));
    client.send(b"G90 G0 X0 Y0 Z0\n");
    client.expect("ok");
    let report = client.wait_for("Idle");
    assert!(report.contains("|MPos:0.000,0.000,0.000|"), "{report}");
}
