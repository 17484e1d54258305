//! Outputs change when their move begins, whatever becomes of the moves around it: rows, joined
//! short moves, corners.

use crate::reference::{to, Rig, RigQueue};
use crate::{Config, Coordinate, CornerRule, Move, MovePower};
use leadscrew_stepper::{OutputChange, Power};
use proptest::prelude::*;
use std::vec::Vec;

/// The place at which an output changes, steps, and its new level.
type Change = ([i32; 2], OutputChange);

/// A program: the way of each move in steps, the output that changes with it, and whether a laser
/// burns in it.
type Program = Vec<([i32; 2], Option<(u8, bool)>, bool)>;

fn program() -> impl Strategy<Value = Program> {
    let way = prop_oneof![
        prop::array::uniform2(-3i32..=3),
        prop::array::uniform2(-400i32..=400),
        Just([2, 0]),
    ];
    let way = way.prop_filter("a way", |way| *way != [0, 0]);
    let change = prop::option::weighted(0.3, (0u8..8, any::<bool>()));
    prop::collection::vec((way, change, any::<bool>()), 1..40)
}

fn moves(program: &Program) -> (Vec<Move<2>>, Vec<Change>) {
    let (mut at, mut changes) = ([0; 2], Vec::new());
    let moves = program.iter().map(|(delta, change, burns)| {
        let outputs = change.map_or(OutputChange::NONE, |(index, on)| {
            OutputChange::of(index, on)
        });
        if !outputs.is_none() {
            changes.push((at, outputs));
        }
        at = [0, 1].map(|axis| at[axis] + delta[axis]);
        let power = match burns {
            true => MovePower::Constant { power: Power::FULL },
            false => MovePower::Off,
        };
        Move {
            target: at.map(|steps| Coordinate::near(steps as f32 * 0.004)),
            power,
            outputs,
            ..to(0.0, 0.0, 60.0)
        }
    });
    (moves.collect(), changes)
}

proptest! {
    #[test]
    fn each_change_comes_once_and_where_its_move_begins(
        program in program(), grbl: bool, hold in 0usize..60,
    ) {
        let (moves, due) = moves(&program);
        let corner_rule = if grbl { CornerRule::Grbl } else { CornerRule::Limits };
        let config = Config { corner_rule, pixels: usize::MAX, ..Config::default() };
        let mut memory = RigQueue::new();
        let mut rig = Rig::new(config, &mut memory);
        for next in &moves {
            rig.planner.push(next).unwrap();
        }
        let (mut found, mut made) = (Vec::new(), 0);
        loop {
            if made == hold {
                rig.segmenter.hold();
            }
            made += 1;
            let position = rig.player.position;
            match rig.step() {
                Some(segment) if segment.outputs.is_none() => {}
                Some(segment) => found.push((position, segment.outputs)),
                None if rig.segmenter.is_held() => rig.segmenter.resume(),
                None => break,
            }
        }
        prop_assert_eq!(found, due);
    }
}
