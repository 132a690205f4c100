//! The dissertation's enrichment grid in the embedded scenes: bodies that move while a blade passes.

use phyxel::scene::{CutRule, Method, Scene, Target};
use phyxel_scene::EMBEDDED;

use crate::batch::Case;
use crate::error::StudyError;
use crate::matrix::plain;
use crate::row::{Bars, Row};

/// Node counts of every embedded body.
pub const NODES: [u32; 3] = [600, 1_500, 3_000];

/// Every embedded scene that cuts with `cut_rule: Grid()` at each of [`NODES`], and beside it by the default
/// rule. Scenes that differ by nothing but their number of nodes are taken once.
pub fn cases() -> Result<Vec<Case>, StudyError> {
    let mut cases = Vec::new();
    let mut known: Vec<Scene> = Vec::new();
    for embedded in EMBEDDED {
        let mut base = plain(embedded.name)?;
        for body in &mut base.bodies {
            if let Method::Dissertation { .. } = body.method {
                // It has no hourglass stabilization.
                body.material.stabilization = 0.0;
            }
            body.sampling.target = Target::Nodes(NODES[0]);
        }
        let mut alike = base.clone();
        alike.name = String::new();
        alike.description = String::new();
        if base.cuts.is_empty() || base.contact.is_some() || known.contains(&alike) {
            continue;
        }
        known.push(alike);
        for nodes in NODES {
            let grid = CutRule::Grid {
                spacing: None,
                inflate: None,
                cells: None,
            };
            for (rule, name) in [(grid, "grid"), (CutRule::default(), "default")] {
                let mut scene = base.clone();
                for body in &mut scene.bodies {
                    body.sampling.target = Target::Nodes(nodes);
                    body.cut_rule = rule;
                }
                cases.push(Case {
                    name: format!("{} {nodes} {name}", embedded.name),
                    scene,
                });
            }
        }
    }
    Ok(cases)
}

/// What exceeds a limit, in words: a run ends well if it comes to its end with energies accounted for, no
/// node that carries strain turned inside out and a step that lasts. What updates add and release, and how
/// far single nodes go, is not judged: the grid weakens pairs ahead of the blade and lets cut pairs know each
/// other again, and the rows say by how much.
pub fn breaches(rows: &[Row]) -> Vec<String> {
    let bars = Bars {
        released: None,
        added: f64::INFINITY,
        farthest: f64::INFINITY,
        followers: 1.0,
        ..Bars::ordinary()
    };
    Row::all_breaches(rows, |_| bars)
}

/// How many pairs the grids decided, in words, a line a row that has them.
pub(crate) fn decided(rows: &[Row]) -> Vec<String> {
    let of_row = |row: &Row| {
        let (lattices, without) = row.lattices.zip(row.without_lattice)?;
        Some(format!(
            "{}: {lattices} lattices, {} pairs severed, {without} pairs left to Diffraction",
            row.scene, row.severed
        ))
    };
    rows.iter().filter_map(of_row).collect()
}

pub(crate) mod checks {
    use super::*;

    /// A case that the program refuses would be counted as one that does not end.
    pub(crate) fn the_program_takes_every_case() {
        let cases = cases().unwrap();
        for case in &cases {
            let text = phyxel_scene::to_ron(&case.scene);
            let read = phyxel_scene::from_text(&text, &case.name, "", &[]);
            assert!(read.is_ok(), "{}: {:?}", case.name, read.err());
            assert!(!case.scene.cuts.is_empty(), "{}", case.name);
        }
        for name in ["liver 600 grid", "block-1408-dissertation 3000 default"] {
            assert!(cases.iter().any(|case| case.name == name), "{name}");
        }
        assert!(!cases.iter().any(|case| case.name.starts_with("press")));
    }
}
