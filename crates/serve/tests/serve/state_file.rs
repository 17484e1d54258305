//! The values that a machine remembers from one server to the next.

use crate::client::PATIENCE;
use crate::served::Served;
use std::time::{Duration, Instant};

/// The message to every client until the machine is unlocked with `$X`.
const LOST: &str = "[MSG:Stored values lost, defaults in force: check them, then $X]";

#[test]
fn what_was_stored_survives_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("router.state");
    {
        let served = Served::remembering(&file);
        assert_eq!(served.said, [""; 0]);
        let mut client = served.connect();
        assert_eq!(client.setting("$110").as_deref(), Some("$110=6000.000"));
        for line in ["$110=4321.5", "$N0=G20", "G10 L2 P2 X5.25"] {
            assert_eq!(client.say(line), [""; 0]);
        }
    }
    let served = Served::remembering(&file);
    assert_eq!(served.said, [""; 0]);
    let mut client = served.connect();
    assert_eq!(client.setting("$110").as_deref(), Some("$110=4321.500"));
    assert_eq!(client.setting("$111").as_deref(), Some("$111=6000.000"));
    assert_eq!(client.say("$N"), ["$N0=G20", "$N1="]);
    assert_eq!(client.say("$#")[1], "[G55:5.250,0.000,0.000]");
}

#[test]
fn a_setting_that_cannot_be_stored_is_refused_and_stored_as_soon_as_it_can_be() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("machines");
    let file = place.join("router.state");
    {
        let served = Served::remembering(&file);
        let mut client = served.connect();
        assert_eq!(client.say("$110=1000"), [""; 0]);
        // The place of the file's folder is taken by a file, so that nothing can be written there.
        std::fs::remove_dir_all(&place).unwrap();
        std::fs::write(&place, "").unwrap();
        for line in ["$110=2000\n", "G10L2P1X5\n"] {
            client.send(line.as_bytes());
            assert_eq!(client.hear(PATIENCE).as_deref(), Some("error:7"), "{line}");
        }
        // A line that changes nothing is not refused, and neither does a retry refuse one.
        std::thread::sleep(Duration::from_millis(1500));
        assert_eq!(client.say("G4P0"), [""; 0]);
        std::fs::remove_file(&place).unwrap();
        let until = Instant::now() + PATIENCE;
        while !file.exists() {
            assert!(Instant::now() < until, "it is not tried again");
            std::thread::sleep(Duration::from_millis(20));
        }
        assert_eq!(client.say("$111=3000"), [""; 0]);
    }
    let served = Served::remembering(&file);
    let mut client = served.connect();
    assert_eq!(client.setting("$110").as_deref(), Some("$110=2000.000"));
    assert_eq!(client.setting("$111").as_deref(), Some("$111=3000.000"));
    assert_eq!(client.say("$#")[0], "[G54:5.000,0.000,0.000]");
}

#[test]
fn a_state_file_belongs_to_one_program_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("router.state");
    {
        let first = Served::remembering(&file);
        let second = Served::remembering(&file);
        assert!(second.said[0].contains("in use"), "{:?}", second.said);
        let mut client = second.connect();
        // What cannot be kept is refused, whatever kind of value it is; other lines are not.
        for line in ["$110=1\n", "G10L2P1X5\n", "$N0=G20\n"] {
            client.send(line.as_bytes());
            assert_eq!(client.hear(PATIENCE).as_deref(), Some("error:7"), "{line}");
        }
        assert_eq!(client.say("G4P0"), [""; 0]);
        assert_eq!(first.connect().say("$111=4321"), [""; 0]);
    }
    let third = Served::remembering(&file);
    assert_eq!(third.said, [""; 0]);
    let mut client = third.connect();
    assert_eq!(client.setting("$110").as_deref(), Some("$110=6000.000"));
    assert_eq!(client.setting("$111").as_deref(), Some("$111=4321.000"));
}

#[test]
fn a_state_file_that_cannot_be_used_is_kept_aside_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("router.state");
    Served::remembering(&file).connect().say("$110=4321.5");
    let sound = std::fs::read(&file).unwrap();
    let mut other_version = sound.clone();
    other_version[15] += 1;
    let half = sound[..sound.len() / 2].to_vec();
    let long = [&sound[..], b"more"].concat();
    let table: [(&[u8], &str); 3] = [
        (&half, "is cut short"),
        (&other_version, "has version 2, not 1"),
        (&long, "has more than"),
    ];
    for (count, (bytes, fault)) in (1..).zip(table) {
        std::fs::write(&file, bytes).unwrap();
        let served = Served::remembering(&file);
        let [said] = &served.said[..] else {
            panic!("{:?}", served.said)
        };
        let kept = folder.path().join(format!("router.state.kept-{count}"));
        assert!(said.contains(fault), "{said}");
        let told = format!("kept as {}, defaults loaded", kept.display());
        assert!(said.ends_with(&told), "{said}");
        assert_eq!(std::fs::read(kept).unwrap(), bytes);
        let mut client = served.connect();
        client.expect(LOST);
        client.wait_for("Alarm");
        assert_eq!(client.setting("$110").as_deref(), Some("$110=6000.000"));
    }
}

/// A program's private file stays private, and a link stays a link.
#[cfg(unix)]
#[test]
fn a_state_file_behind_a_link_is_replaced_at_its_place_with_its_mode() {
    use std::os::unix::fs::{symlink, PermissionsExt};
    let folder = tempfile::tempdir().unwrap();
    let [real, link] = ["real", "link"].map(|name| folder.path().join(name));
    Served::remembering(&real).connect().say("$110=4321.5");
    std::fs::set_permissions(&real, PermissionsExt::from_mode(0o600)).unwrap();
    symlink("real", &link).unwrap();
    assert_eq!(
        Served::remembering(&link).connect().say("$111=4000"),
        [""; 0]
    );
    assert!(link.is_symlink());
    let there = std::fs::symlink_metadata(&real).unwrap();
    assert!(there.is_file());
    assert_eq!(there.permissions().mode() & 0o777, 0o600);
    let served = Served::remembering(&real);
    let mut client = served.connect();
    assert_eq!(client.setting("$110").as_deref(), Some("$110=4321.500"));
    assert_eq!(client.setting("$111").as_deref(), Some("$111=4000.000"));
}

#[test]
fn settings_whose_record_is_damaged_are_said_to_be_lost() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("router.state");
    Served::remembering(&file).connect().say("$110=4321.5");
    let mut damaged = std::fs::read(&file).unwrap();
    let last = damaged.iter().rposition(|&byte| byte != 0xFF).unwrap();
    damaged[last] ^= 1;
    std::fs::write(&file, &damaged).unwrap();
    let served = Served::remembering(&file);
    let kept = folder.path().join("router.state.kept-1");
    let told = format!("the file as it was is kept as {}", kept.display());
    assert_eq!(served.said.len(), 1, "{:?}", served.said);
    assert!(served.said[0].ends_with(&told), "{:?}", served.said);
    assert_eq!(std::fs::read(kept).unwrap(), damaged);
    let mut client = served.connect();
    client.expect(LOST);
    client.wait_for("Alarm");
    client.send(b"G0X1\n");
    client.expect(LOST);
    client.expect("error:9");
    drop(client);
    let mut client = served.connect();
    client.send(b"?");
    client.expect(LOST);
    client.send(b"\x18");
    for line in [
        "error:7",
        "Grbl 1.1h ['$' for help]",
        "[MSG:'$H'|'$X' to unlock]",
        LOST,
    ] {
        client.expect(line);
    }
    client.wait_for("Alarm");
    assert_eq!(client.setting("$110").as_deref(), Some("$110=6000.000"));
    assert_eq!(client.say("$X"), ["[MSG:Caution: Unlocked]"]);
    drop(client);
    let mut client = served.connect();
    assert_eq!(client.say("$110=4321.5"), [""; 0]);
    assert_eq!(client.say("G0X1"), [""; 0]);
    drop(served);
    assert_eq!(Served::remembering(&file).said, [""; 0]);
}
