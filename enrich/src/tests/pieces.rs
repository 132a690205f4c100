//! Pieces of cut graphs.

use testkit::cloud::Random;

use crate::{Rows, connected_pieces, is_parted};

fn below(random: &mut Random, count: usize) -> usize {
    (random.bits() % count as u64) as usize
}

/// A random symmetric graph.
fn graph(random: &mut Random, nodes: usize, links: usize) -> Rows {
    let end = |random: &mut Random| below(random, nodes) as u32;
    let links = (0..links).map(|_| [end(random), end(random)]);
    Rows::from_edges(nodes, links.filter(|[i, j]| i != j)).unwrap()
}

#[test]
fn a_piece_is_parted_when_the_pieces_become_more() {
    let mut random = Random::new(5);
    let (mut parted, mut whole) = (0, 0);
    for _ in 0..200 {
        let nodes = 2 + below(&mut random, 60);
        let rows = graph(&mut random, nodes, nodes + nodes / 2);
        let (offsets, indices) = (rows.offsets(), rows.indices());
        let mut factors = vec![1.0; indices.len()];
        let mut before = connected_pieces(offsets, indices, &factors);
        while factors.iter().any(|factor| *factor > 0.0) {
            let mut touched = Vec::new();
            for i in 0..nodes {
                for p in offsets[i] as usize..offsets[i + 1] as usize {
                    let j = indices[p] as usize;
                    if i < j && factors[p] > 0.0 && below(&mut random, 12) == 0 {
                        let row = offsets[j] as usize..offsets[j + 1] as usize;
                        let back = row.start + indices[row].partition_point(|k| *k < i as u32);
                        factors[p] = 0.0;
                        factors[back] = 0.0;
                        touched.extend([i as u32, j as u32]);
                    }
                }
            }
            let after = connected_pieces(offsets, indices, &factors);
            let more = after.sizes.len() > before.sizes.len();
            let found = is_parted(offsets, indices, &factors, &touched, &before.piece);
            assert_eq!(found, more, "{} nodes, touched {touched:?}", nodes);
            *(if more { &mut parted } else { &mut whole }) += 1;
            before = after;
        }
    }
    let many = parted > 300 && whole > 300;
    assert!(many, "{parted} parted, {whole} whole");
}
