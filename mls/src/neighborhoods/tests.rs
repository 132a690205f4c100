use super::*;
use proptest::prelude::*;

fn graph() -> impl Strategy<Value = Neighborhoods> {
    (1_usize..30)
        .prop_flat_map(|n| {
            let entry = (0..n, 0..n);
            (Just(n), proptest::collection::vec(entry, 0..120))
        })
        .prop_map(|(n, entries)| {
            let mut rows = vec![Vec::new(); n];
            for (i, j) in entries {
                if i != j {
                    rows[i].push(to_u32(j));
                }
            }
            Neighborhoods::from_unsorted(rows).unwrap()
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn symmetrized_is_the_union_and_reverse_pairs_point_back(graph in graph()) {
        let symmetric = graph.symmetrized().unwrap();
        let n = graph.node_count();
        for i in 0..n {
            prop_assert!(symmetric.row(i).windows(2).all(|pair| pair[0] < pair[1]));
            for j in 0..n {
                let either = graph.find_pair(i, to_u32(j)).is_some() || graph.find_pair(j, to_u32(i)).is_some();
                prop_assert_eq!(symmetric.find_pair(i, to_u32(j)).is_some(), either);
            }
        }
        let reverse = symmetric.reverse_pairs().unwrap();
        for i in 0..n {
            for (pair, j) in symmetric.entries(i) {
                let back = reverse[pair] as usize;
                prop_assert!(symmetric.pairs(j).contains(&back));
                prop_assert_eq!(symmetric.indices()[back] as usize, i);
                prop_assert_eq!(reverse[back] as usize, pair);
            }
        }
        let chosen: Vec<u32> = (0..to_u32(n)).filter(|node| node % 3 == 0).collect();
        let wide = symmetric.with_second_ring(&chosen).unwrap();
        prop_assert!(wide.reverse_pairs().is_ok());
        for i in 0..n {
            for j in (0..n).filter(|&j| j != i) {
                let far = (0..n).any(|k| {
                    symmetric.find_pair(i, to_u32(k)).is_some() && symmetric.find_pair(k, to_u32(j)).is_some()
                });
                let expected = symmetric.find_pair(i, to_u32(j)).is_some() || (far && (i % 3 == 0 || j % 3 == 0));
                prop_assert_eq!(wide.find_pair(i, to_u32(j)).is_some(), expected);
            }
        }
        prop_assert_eq!(symmetric.symmetrized().unwrap(), symmetric.clone());
        prop_assert_eq!(graph.reverse_pairs().is_ok(), graph == symmetric);
    }
}

#[test]
fn refuses_what_is_not_a_graph() {
    let from = |offsets: &[u32], indices: &[u32]| {
        Neighborhoods::from_graph(offsets.to_vec(), indices.to_vec()).unwrap_err()
    };
    assert_eq!(from(&[], &[]), GraphError::Empty);
    for (offsets, indices, position, value) in [
        (&[1, 1][..], &[0][..], 0, 1),
        (&[0, 2, 1], &[1], 2, 1),
        (&[0, 1, 1], &[1, 0], 2, 1),
    ] {
        let expected = GraphError::Offsets { position, value };
        assert_eq!(from(offsets, indices), expected);
    }
    let (node, neighbor, count) = (0, 7, 2);
    let expected = GraphError::OutOfRange {
        node,
        neighbor,
        count,
    };
    assert_eq!(from(&[0, 1, 1], &[7]), expected);
    assert_eq!(from(&[0, 1, 1], &[0]), GraphError::SelfLoop { node: 0 });
}

#[test]
fn graphs_and_edges_are_taken_as_meshes_give_them() {
    let graph = Neighborhoods::from_graph(vec![0, 3, 3, 4], vec![2, 1, 2, 1]).unwrap();
    assert_eq!(graph.offsets(), [0, 2, 2, 3]);
    assert_eq!(graph.indices(), [1, 2, 1]);
    let edges = Neighborhoods::from_edges(4, [[2, 0], [0, 2], [0, 1], [1, 2]]).unwrap();
    assert_eq!(edges.offsets(), [0, 2, 4, 6, 6]);
    assert_eq!(edges.indices(), [1, 2, 0, 2, 0, 1]);
    assert_eq!(edges, edges.symmetrized().unwrap());
    let lost = GraphError::OutOfRange {
        node: 0,
        neighbor: 3,
        count: 2,
    };
    assert_eq!(Neighborhoods::from_edges(2, [[0, 3]]), Err(lost));
    let own = Err(GraphError::SelfLoop { node: 1 });
    assert_eq!(Neighborhoods::from_edges(2, [[1, 1]]), own);
    let low = Neighborhoods::from_edges(2, [[7, 0]]);
    assert!(matches!(low, Err(GraphError::OutOfRange { count: 2, .. })));
}

#[test]
fn asymmetry_is_named() {
    let graph = Neighborhoods::from_graph(vec![0, 1, 2, 3], vec![1, 0, 1]).unwrap();
    let (node, neighbor) = (2, 1);
    let expected = GraphError::NotSymmetric { node, neighbor };
    assert_eq!(graph.reverse_pairs(), Err(expected));
}
