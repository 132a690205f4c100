//! A message of each kind, byte for byte: checked here, and by `tests/golden.mjs` with the page's own code.
//!
//! With `PHYXEL_GOLDEN=write` the files of the server's messages are written again, which is right only
//! where fields were appended.

use std::path::{Path, PathBuf};
use std::process::Command;

use glam::{DMat3, DQuat, DVec2, DVec3, Vec3};
use testkit::cloud::Random;

use crate::incoming::{Hand, HandPhase, Incoming, decode};
use crate::outgoing::{
    BodyState, ClipOf, ForceSample, GRIP, StateMessage, Surfel, ToolState, encode_clips,
    encode_force, encode_nodes, encode_skin, encode_state, put_surfel,
};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden")
}

fn skin() -> Vec<u8> {
    let mut numbers = Vec::new();
    for k in 0..2_u32 {
        let x = f64::from(k);
        put_surfel(
            &mut numbers,
            &Surfel {
                position: DVec3::new(x, 0.25, -0.5),
                radius: 0.125,
                normal: DVec3::new(0.0, 0.6, 0.8),
                material: 1,
                shape: DVec3::new(1.0, 2.0, 3.0),
                color: Vec3::new(0.5, 0.25, 0.125),
                nodes: &[k, k + 1],
                weights: &[0.75, 0.25],
                slopes: &[[1.5, -1.5], [-1.5, 1.5]],
            },
        );
    }
    encode_skin(3, 1, 7, 2, &numbers)
}

fn clips() -> Vec<u8> {
    let clips = [
        ClipOf {
            surfel: 4,
            anchor: DVec2::new(0.5, 0.25),
            edges: &[(DVec2::Y, 0.75)],
            walls: &[
                [DVec2::new(1.0, 2.0), DVec2::new(3.0, 4.0)],
                [DVec2::new(5.0, 6.0), DVec2::new(7.0, 8.0)],
            ],
        },
        ClipOf {
            surfel: 5,
            anchor: DVec2::ZERO,
            edges: &[],
            walls: &[],
        },
    ];
    encode_clips(3, 1, &clips)
}

/// A state, with values of quantities (bits) that are asked for.
fn state(values: u32) -> Vec<u8> {
    let asked = usize::from(values != 0);
    let tools = [ToolState {
        position: DVec3::new(0.5, 1.5, 2.5),
        rotation: DQuat::from_xyzw(0.0, 0.0, 0.6, 0.8),
        force: DVec3::new(1.0, 2.0, 3.0),
        torque: DVec3::new(4.0, 5.0, 6.0),
        penetration: 0.0625,
    }];
    let still = DMat3::IDENTITY;
    let mut turned = still;
    (turned.x_axis.y, turned.z_axis.z) = (0.25, 1.5);
    let state = StateMessage {
        number: 17,
        step: 5_000_000_000,
        time: 1.25,
        step_size: 0.001,
        seen: [1, 2, 3, 4, 5, 6, 7, 8],
        energies: [0.5, 0.25, -0.125],
        grip: DVec3::new(0.5, 0.0, -0.5),
        tools: &tools,
        blade: &[DVec3::new(0.0, 0.5, 1.0), DVec3::new(1.0, 1.5, 2.0)],
        values,
        bodies: &[
            BodyState {
                positions: &[DVec3::new(0.5, 0.25, 0.125)],
                gradients: &[turned],
                values: &[1500.0, 250.0][..2 * asked],
            },
            BodyState {
                positions: &[DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)],
                gradients: &[still, still],
                values: &[1.0, 2.0, 3.0, 4.0][..4 * asked],
            },
        ],
    };
    encode_state(3, &state)
}

fn outgoing() -> [(&'static str, Vec<u8>); 6] {
    let samples = [0.5, 0.75].map(|time| ForceSample {
        time,
        force: DVec3::new(time, 0.0, -time),
        penetration: 0.125,
    });
    let nodes = [DVec3::new(0.5, 1.0, 1.5), DVec3::new(2.0, 2.5, 3.0)];
    [
        ("nodes", encode_nodes(3, 1, &nodes)),
        ("skin", skin()),
        ("clips", clips()),
        ("state", state(0)),
        ("state-values", state(3)),
        ("force", encode_force(3, GRIP, &samples)),
    ]
}

#[test]
fn messages_to_clients_are_as_they_were() {
    for (name, bytes) in outgoing() {
        let file = folder().join(format!("{name}.bin"));
        if std::env::var_os("PHYXEL_GOLDEN").is_some_and(|value| value == "write") {
            std::fs::write(&file, &bytes).expect("the folder is there");
        }
        let golden = std::fs::read(&file).expect("the golden file is there");
        assert_eq!(bytes, golden, "{name}");
    }
}

fn incoming(name: &str) -> Option<Incoming> {
    let file = folder().join(format!("{name}.bin"));
    decode(&std::fs::read(file).expect("the golden file is there"))
}

#[test]
fn messages_from_clients_are_understood() {
    let hand = |name| match incoming(name) {
        Some(Incoming::Hand(sequence, hand)) => (sequence, hand),
        other => unreachable!("{name}: {other:?}"),
    };
    assert_eq!(incoming("ack"), Some(Incoming::Ack(17)));
    let pose = Hand::Pose {
        tool: 2,
        phase: HandPhase::Begin,
        position: DVec3::new(0.5, -0.25, 0.125),
        rotation: DQuat::from_xyzw(0.0, 0.0, 1.0, 0.0),
    };
    assert_eq!(hand("pose"), (5, pose));
    let edge = Hand::Edge {
        phase: HandPhase::Move,
        points: vec![
            DVec3::new(0.0, 0.5, 1.0),
            DVec3::new(1.5, 2.0, 2.5),
            DVec3::new(3.0, 3.5, 4.0),
        ],
    };
    assert_eq!(hand("edge"), (6, edge));
    let end = Hand::Edge {
        phase: HandPhase::End,
        points: Vec::new(),
    };
    assert_eq!(hand("edge-end"), (7, end));
    let grip = Hand::Grip {
        phase: HandPhase::Begin,
        position: DVec3::new(0.5, 1.0, 1.5),
        radius: 0.25,
    };
    assert_eq!(hand("grip"), (8, grip));
    let mesh = Incoming::Mesh {
        total: 5,
        offset: 2,
        extension: "obj".to_owned(),
        piece: vec![1, 2, 3],
    };
    assert_eq!(incoming("mesh"), Some(mesh));
}

#[test]
fn the_page_reads_and_writes_the_same_bytes() {
    let script = folder().join("../golden.mjs");
    let result = Command::new("node").arg(script).output();
    let Ok(output) = result else {
        eprintln!("no node here: the page's decoder was not checked");
        return;
    };
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
}

#[test]
fn mutated_messages_are_read_or_left_aside() {
    let names = ["ack", "pose", "edge", "edge-end", "grip", "mesh"];
    let all =
        names.map(|name| std::fs::read(folder().join(format!("{name}.bin"))).expect("golden"));
    let (mut random, mut read) = (Random::new(1), 0);
    for _ in 0..20_000 {
        let mut bytes = all[random.below(all.len())].clone();
        for _ in 0..=random.below(4) {
            match random.below(4) {
                0 => bytes.truncate(random.below(bytes.len() + 1)),
                1 => bytes.extend((0..random.below(40)).map(|k| k.to_le_bytes()[0])),
                _ if !bytes.is_empty() => {
                    let at = random.below(bytes.len());
                    bytes[at] = random.bits().to_le_bytes()[0];
                }
                _ => {}
            }
        }
        let Some(message) = decode(&bytes) else {
            continue;
        };
        read += 1;
        let places = match message {
            Incoming::Hand(_, Hand::Pose { position, .. } | Hand::Grip { position, .. }) => {
                vec![position]
            }
            Incoming::Hand(_, Hand::Edge { points, phase }) => {
                assert!(points.len() != 1 && (points.len() > 1 || phase == HandPhase::End));
                points
            }
            Incoming::Mesh {
                total,
                offset,
                piece,
                extension,
            } => {
                assert!(offset + piece.len() <= total && total <= crate::MAX_MESH);
                assert!(extension.bytes().all(|b| b.is_ascii_lowercase()));
                Vec::new()
            }
            Incoming::Ack(_) => Vec::new(),
        };
        let near = |x: &DVec3| x.is_finite() && x.abs().max_element() <= 100.0;
        assert!(places.iter().all(near), "{places:?}");
    }
    assert!(read > 1_000, "only {read} were read");
}
