use proptest::prelude::*;

use super::*;
use crate::{CutSettings, Cuts, FactorSettings, PairFactors};

/// What a graph must be, asked by another method: a matrix of who names whom.
fn sound(nodes: usize, offsets: &[u32], indices: &[u32]) -> bool {
    let whole = offsets.len() == nodes + 1
        && offsets[0] == 0
        && offsets[nodes] as usize == indices.len()
        && offsets.windows(2).all(|w| w[0] <= w[1]);
    if !whole {
        return false;
    }
    let mut named = vec![vec![0; nodes]; nodes];
    for node in 0..nodes {
        let row = &indices[offsets[node] as usize..offsets[node + 1] as usize];
        if !row.is_sorted() || row.iter().any(|&j| j as usize >= nodes) {
            return false;
        }
        row.iter().for_each(|&j| named[node][j as usize] += 1);
    }
    (0..nodes).all(|i| (0..nodes).all(|j| named[i][j] <= 1 && named[i][j] == named[j][i]))
        && (0..nodes).all(|i| named[i][i] == 0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Any numbers are a graph or an error, never a panic; and a graph only if they are valid.
    #[test]
    fn only_sound_rows_are_a_graph(
        nodes in 0_usize..4,
        offsets in proptest::collection::vec(0_u32..8, 0..6),
        indices in proptest::collection::vec(0_u32..5, 0..8),
    ) {
        let x = vec![DVec3::ZERO; nodes];
        prop_assert_eq!(Graph::new(&x, &offsets, &indices).is_ok(), sound(nodes, &offsets, &indices));
    }

    /// Edges make a graph that names exactly them, both ways.
    #[test]
    fn edges_make_the_graph_that_names_them(
        nodes in 2_usize..9, asked in proptest::collection::vec((0_u32..9, 0_u32..9), 0..40),
    ) {
        let count = u32::try_from(nodes).unwrap();
        let edges: Vec<[u32; 2]> =
            asked.iter().map(|&(a, b)| [a % count, b % count]).filter(|[a, b]| a != b).collect();
        let rows = Rows::from_edges(nodes, edges.iter().copied()).unwrap();
        prop_assert!(sound(nodes, rows.offsets(), rows.indices()));
        let x = vec![DVec3::ZERO; nodes];
        let graph = rows.graph(&x).unwrap();
        for i in 0..count {
            for j in 0..count {
                let named = graph.row(i as usize).contains(&j);
                prop_assert_eq!(named, edges.contains(&[i, j]) || edges.contains(&[j, i]));
            }
        }
    }
}

#[test]
fn each_fault_is_named() {
    let x = [DVec3::ZERO, DVec3::X];
    let error = |offsets: &[u32], indices: &[u32]| Graph::new(&x, offsets, indices).unwrap_err();
    let offset = |position, value| GraphError::Offset { position, value };
    let row = |node, neighbor| GraphError::Row { node, neighbor };
    let count = GraphError::OffsetCount { found: 2, nodes: 2 };
    assert_eq!(error(&[0, 1], &[1]), count);
    assert_eq!(error(&[0, 1, 9], &[1, 0]), offset(2, 9));
    assert_eq!(error(&[1, 1, 2], &[1, 0]), offset(0, 1));
    assert_eq!(error(&[0, 1, 2], &[0, 0]), row(0, 0));
    let (node, neighbor) = (0, 1);
    let one_way = GraphError::OneWay { node, neighbor };
    assert_eq!(error(&[0, 1, 1], &[1]), one_way);
    let lost = [DVec3::ZERO, DVec3::NAN];
    let refused = Graph::new(&lost, &[0, 1, 2], &[1, 0]).unwrap_err();
    assert_eq!(refused, GraphError::NotFinite { node: 1 });
    assert_eq!(Rows::from_edges(2, [[0, 2]]).unwrap_err(), row(0, 2));
    // An edge joins two nodes.
    assert!(Rows::from_edges(1, [[0, 0]]).is_err());
    assert_eq!(Rows::from_edges(0, []).unwrap().offsets(), [0]);
}

/// The pairs that a cut crosses are those below 1, each once, with their factor.
#[test]
fn crossed_pairs_are_those_below_one() {
    let mut x = Vec::new();
    let mut edges = Vec::new();
    for i in 0..6_u32 {
        for j in 0..6_u32 {
            x.push(DVec3::new(f64::from(i), f64::from(j), 0.0));
            let node = 6 * i + j;
            edges.extend((i > 0).then(|| [node, node - 6]));
            edges.extend((j > 0).then(|| [node - 1, node]));
            edges.extend((i > 0 && j > 0).then(|| [node, node - 7]));
        }
    }
    let rows = Rows::from_edges(x.len(), edges).unwrap();
    let graph = rows.graph(&x).unwrap();
    let mut factors = PairFactors::new(&graph, &FactorSettings::default());
    assert_eq!(factors.crossed(&graph).count(), 0);
    let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
    let blade = |y: f64| [-2.0, 2.0].map(|z| DVec3::new(2.4, y, z));
    let stroke = cuts.start(&blade(-1.0)).unwrap();
    let new = cuts.append(stroke, &blade(3.3)).unwrap();
    factors.update(&graph, &cuts, new, &|_| true);
    let mut expected = Vec::new();
    for i in 0..36_u32 {
        for pair in graph.pairs(i as usize) {
            let j = graph.indices[pair];
            let factor = factors.factor(pair);
            if i < j && factor < 1.0 {
                expected.push((i, j, factor));
            }
        }
    }
    assert!(expected.len() == factors.crossed_count() && expected.len() > 6);
    assert_eq!(factors.crossed(&graph).collect::<Vec<_>>(), expected);
}
