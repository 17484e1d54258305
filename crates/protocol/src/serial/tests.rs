use super::*;
use crate::realtime::{Byte, Sorter};
use proptest::prelude::*;
use std::vec::Vec;

fn receive(receiver: &mut Receiver<'_>, bytes: &[u8]) {
    for byte in bytes {
        receiver.receive(*byte);
    }
}

/// The bytes that may be taken at once.
fn ready(inbox: &mut Inbox<'_>) -> Vec<u8> {
    (0..inbox.ready()).map_while(|_| inbox.take()).collect()
}

fn read(inbox: &mut Inbox<'_>) -> Vec<u8> {
    let mut bytes = Vec::new();
    while inbox.has_bytes() {
        bytes.extend(ready(inbox));
    }
    bytes
}

#[test]
fn realtime_bytes_are_picked_out_of_a_line() {
    let mut queue = SerialQueue::<64>::new();
    let (mut receiver, mut inbox) = queue.split();
    receive(&mut receiver, b"G1?X1\xc2\x91\n");
    assert_eq!(inbox.next_realtime().unwrap().realtime, Realtime::Report);
    let step = Realtime::Feed(super::super::realtime::OverrideStep::CoarseUp);
    assert_eq!(inbox.next_realtime().unwrap().realtime, step);
    assert_eq!(inbox.next_realtime(), None);
    assert_eq!(read(&mut inbox), b"G1X1\n");
}

#[test]
fn no_byte_overtakes_a_realtime_command() {
    let mut queue = SerialQueue::<64>::new();
    let (mut receiver, mut inbox) = queue.split();
    receive(&mut receiver, b"ab!cd");
    assert_eq!(read(&mut inbox), b"ab");
    assert_eq!(inbox.next_realtime().unwrap().realtime, Realtime::Hold);
    assert_eq!(read(&mut inbox), b"cd");
}

#[test]
fn a_reset_drops_what_came_before_it_and_keeps_what_came_after() {
    let mut queue = SerialQueue::<64>::new();
    let (mut receiver, mut inbox) = queue.split();
    receive(&mut receiver, b"G0X1\nG0\x18$G\n");
    assert_eq!(inbox.take(), Some(b'G'));
    let reset = inbox.next_realtime().unwrap();
    inbox.drop_before(reset.mark);
    assert_eq!(read(&mut inbox), b"$G\n");
    inbox.drop_before(reset.mark); // passed: nothing happens
    receive(&mut receiver, b"x");
    assert_eq!(read(&mut inbox), b"x");
}

#[test]
fn a_report_asked_for_after_a_reset_comes_after_it() {
    let mut queue = SerialQueue::<64>::new();
    let (mut receiver, mut inbox) = queue.split();
    receive(&mut receiver, b"!\x18?");
    let order: Vec<_> = core::iter::from_fn(|| inbox.next_realtime())
        .map(|request| request.realtime)
        .collect();
    assert_eq!(order, [Realtime::Hold, Realtime::Reset, Realtime::Report]);
}

#[test]
fn what_comes_after_the_other_end_has_gone_waits_until_that_is_dealt_with() {
    let mut queue = SerialQueue::<64>::new();
    let (mut receiver, mut inbox) = queue.split();
    receive(&mut receiver, b"G1X");
    receiver.close();
    receive(&mut receiver, b"$G\n");
    assert_eq!(ready(&mut inbox), b"G1X");
    let mark = inbox.closed().unwrap();
    assert_eq!(inbox.ahead_of(mark), 0);
    inbox.forget_close();
    assert_eq!((inbox.closed(), read(&mut inbox)), (None, b"$G\n".to_vec()));
}

#[test]
fn a_letter_that_a_sender_has_begun_ends_with_its_sender() {
    let mut queue = SerialQueue::<64>::new();
    let (mut receiver, mut inbox) = queue.split();
    receive(&mut receiver, b"G1X\xc3");
    receiver.close();
    receive(&mut receiver, b"\x84");
    assert_eq!(inbox.next_realtime().unwrap().realtime, Realtime::Door);
}

#[test]
fn bytes_beyond_the_limit_are_lost_and_counted() {
    let mut queue = SerialQueue::<1025>::with_limit(128);
    let (mut receiver, mut inbox) = queue.split();
    receive(&mut receiver, &[b'x'; 130]);
    assert_eq!(
        (inbox.free(), inbox.limit(), inbox.lost_bytes()),
        (0, 128, 2)
    );
    assert_eq!(read(&mut inbox).len(), 128);
    assert_eq!(inbox.free(), 128);
}

#[test]
fn the_default_channel_takes_1024_bytes() {
    let mut queue = SerialQueue::<DEFAULT_RX>::new();
    let (mut receiver, inbox) = queue.split();
    assert_eq!(inbox.free(), 1024);
    receive(&mut receiver, &[b'x'; 1024]);
    assert_eq!((inbox.free(), inbox.lost_bytes()), (0, 0));
}

#[test]
fn a_limit_beyond_the_room_is_the_room() {
    let mut queue = SerialQueue::<16>::with_limit(1000);
    let (_, inbox) = queue.split();
    assert_eq!(inbox.free(), 15);
}

#[test]
fn with_a_full_queue_a_reset_a_report_and_the_newest_mark_survive() {
    let mut queue = SerialQueue::<64>::new();
    let (mut receiver, mut inbox) = queue.split();
    receive(&mut receiver, &[0x91; 100]);
    receive(&mut receiver, b"?");
    receive(&mut receiver, b"a\x18b\x18c");
    let requests: Vec<_> = core::iter::from_fn(|| inbox.next_realtime()).collect();
    assert_eq!(requests.len(), DEFAULT_REALTIME - 2 + 2);
    let reset = requests[DEFAULT_REALTIME - 2];
    assert_eq!(reset.realtime, Realtime::Reset);
    assert_eq!(requests.last().unwrap().realtime, Realtime::Report);
    inbox.drop_before(reset.mark);
    assert_eq!(read(&mut inbox), b"c");
}

/// The commands that come out behind a full queue.
fn behind_a_full_queue(bytes: &[u8]) -> Vec<Realtime> {
    let mut queue = SerialQueue::<64>::new();
    let (mut receiver, mut inbox) = queue.split();
    receive(&mut receiver, &[0x91; DEFAULT_REALTIME]);
    receive(&mut receiver, bytes);
    let requests = core::iter::from_fn(|| inbox.next_realtime());
    requests
        .skip(DEFAULT_REALTIME - 2)
        .map(|request| request.realtime)
        .collect()
}

#[test]
fn with_a_full_queue_a_hold_a_resume_a_door_and_a_jog_cancel_survive_in_their_order() {
    use Realtime::{Door, Hold, JogCancel, Report, Reset, Resume};
    let cases: [(&[u8], &[Realtime]); 7] = [
        (b"!", &[Hold]),
        (b"!~", &[Hold, Resume]),
        (b"~!~!", &[Resume, Hold]),
        (b"\x84~?", &[Door, Resume, Report]),
        (b"\x85!\x85", &[Hold, JogCancel]),
        (b"!\x18", &[Reset]),
        (b"\x18!", &[Reset, Hold]),
    ];
    for (bytes, expected) in cases {
        assert_eq!(behind_a_full_queue(bytes), expected, "{bytes:x?}");
    }
}

#[test]
fn what_comes_behind_a_late_command_stays_behind_it() {
    let mut queue = SerialQueue::<256>::new();
    let (mut receiver, mut inbox) = queue.split();
    receive(&mut receiver, &[0x91; 100]);
    receive(&mut receiver, b"!");
    while inbox.requests.ready() {
        inbox.next_realtime();
    }
    // There is room in the queue again, and the hold waits still.
    receive(&mut receiver, b"a~b\x85c");
    assert!(!inbox.has_bytes() && inbox.has_requests());
    let requests: Vec<_> = core::iter::from_fn(|| inbox.next_realtime()).collect();
    let order: Vec<_> = requests.iter().map(|request| request.realtime).collect();
    assert_eq!(
        order,
        [Realtime::Hold, Realtime::Resume, Realtime::JogCancel]
    );
    inbox.drop_before(requests[2].mark);
    assert_eq!(read(&mut inbox), b"c");
}

#[test]
fn marks_survive_the_wrap_of_their_counter() {
    let mut queue = SerialQueue::<16>::new();
    let (mut receiver, mut inbox) = queue.split();
    receiver.received = u32::MAX - 1;
    inbox.taken = u32::MAX - 1;
    receive(&mut receiver, b"abc\x18d");
    let reset = inbox.next_realtime().unwrap();
    inbox.drop_before(reset.mark);
    assert_eq!(read(&mut inbox), b"d");
}

proptest! {
    #[test]
    fn ordinary_bytes_arrive_in_order_and_all_others_vanish(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let mut queue = SerialQueue::<256>::new();
        let (mut receiver, mut inbox) = queue.split();
        receive(&mut receiver, &bytes);
        let mut seen = Vec::new();
        loop {
            seen.extend(read(&mut inbox));
            if inbox.next_realtime().is_none() {
                break;
            }
        }
        let mut sorter = Sorter::new();
        let sorted = bytes.into_iter().map(|byte| sorter.sort(byte));
        let expected: Vec<u8> = sorted
            .filter_map(|byte| match byte {
                Byte::Ordinary(byte) => Some(byte),
                Byte::Realtime(_) | Byte::Unknown => None,
            })
            .collect();
        prop_assert_eq!(seen, expected);
    }
}
