use super::*;
use crate::{NearestSettings, k_nearest, kernel, mean_neighbor_distance};
use glam::DMat3;
use testkit::assert_matches;
use testkit::cloud;
use testkit::derivative::directional_error;
use testkit::tol::{assert_below, assert_within};

/// The five deformations of the reference cases on the unit cube: position and gradient.
type Motion = (&'static str, fn(DVec3) -> DVec3);

const MOTIONS: [Motion; 5] = [
    ("rotation 40 degrees and shift", |x| {
        DMat3::from_rotation_z(40.0_f64.to_radians()) * x + DVec3::new(2.0, 0.0, 0.0)
    }),
    ("shear", |x| DVec3::new(x.x + 0.5 * x.y, x.y, x.z)),
    ("bend", |x| {
        let r = 0.7;
        let angle = (x.z - 0.5) / r;
        DVec3::new(
            r - (r - (x.x - 0.5)) * angle.cos(),
            x.y,
            (r - (x.x - 0.5)) * angle.sin(),
        )
    }),
    ("twist", |x| {
        let turn = DMat3::from_rotation_z(2.1 * x.z);
        turn * (x - DVec3::new(0.5, 0.5, 0.0))
    }),
    ("uneven stretch", |x| {
        DVec3::new(
            x.x + 0.3 * x.x * x.x,
            x.y * (1.0 - 0.2 * x.x),
            x.z + 0.1 * (3.0 * x.z).sin(),
        )
    }),
];

fn gradient(motion: fn(DVec3) -> DVec3, x: DVec3) -> DMat3 {
    let h = 1e-6;
    let along = |d: DVec3| (motion(x + d * h) - motion(x - d * h)) / (2.0 * h);
    DMat3::from_cols(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
}

struct Body {
    points: Vec<DVec3>,
    spacing: f64,
    map: MaterialMap,
    graph: Neighborhoods,
}

fn body() -> Body {
    let n = 12;
    let spacing = 1.0 / n as f64;
    let offset = DVec3::splat(0.5 * spacing);
    let points: Vec<DVec3> = cloud::lattice([n; 3], spacing, 0.25, 2)
        .iter()
        .map(|&x| x + offset)
        .collect();
    let settings = NearestSettings {
        nearest: 16,
        scale: 1.5,
        limit: None,
    };
    let graph = k_nearest(&points, &settings)
        .unwrap()
        .neighborhoods
        .symmetrized()
        .unwrap();
    let radii: Vec<f64> = mean_neighbor_distance(&points, &graph)
        .iter()
        .map(|d| 1.7 * d)
        .collect();
    let map = MaterialMap::new(&points, &radii, &graph).unwrap();
    Body {
        points,
        spacing,
        map,
        graph,
    }
}

/// The nodes under a motion, and its gradients there.
fn moved_by(body: &Body, motion: fn(DVec3) -> DVec3) -> (Vec<DVec3>, Vec<DMat3>) {
    let of = body.points.iter();
    let moved = of.clone().map(|&x| motion(x)).collect();
    (moved, of.map(|&x| gradient(motion, x)).collect())
}

/// Everything is seen.
fn anywhere(_: u32, _: DVec3) -> bool {
    true
}

/// Where the map takes a material point (m).
fn forward(frame: &MapFrame<'_>, start: u32, material: DVec3, nodes: &[u32]) -> DVec3 {
    let way = material - frame.map.rest_positions[start as usize];
    frame.positions[start as usize] + frame.forward(start, way, nodes).unwrap().way
}

/// Every material point is found again, from the world point that eq. (61) itself gives.
#[test]
fn preimage_inverts_every_deformation() {
    let body = body();
    let mut random = cloud::Random::new(5);
    for (name, motion) in MOTIONS {
        let (moved, gradients) = moved_by(&body, motion);
        let frame = body.map.frame(&moved, &gradients).unwrap();
        for _ in 0..200 {
            let material = DVec3::splat(0.5) + random.vector(0.46);
            let start = frame.nearest_node(motion(material), 1.0).unwrap();
            let nodes = frame.connected(material, 0.0, start);
            let world = forward(&frame, start, material, &nodes);
            let found = frame.preimage(world, &anywhere).unwrap();
            let error = (found.position - material).length() / body.spacing;
            assert_below(name, error, 1e-10);
            // And the reconstruction is the motion itself up to the order of the approximation.
            let off = (world - motion(material)).length() / body.spacing;
            assert_below(name, off, 0.2);
        }
    }
}

/// Tissue is found wherever the body lies: 1e5 times its size away positions are known to a millionth of a spacing.
#[test]
fn far_from_the_origin_tissue_is_found() {
    let here = body();
    let far = DVec3::new(1e5, -7e4, 4e4);
    let points: Vec<DVec3> = here.points.iter().map(|&x| x + far).collect();
    let map = MaterialMap::new(&points, &here.map.support_radii, &here.graph).unwrap();
    for (name, motion) in MOTIONS {
        let (moved, gradients) = moved_by(&here, motion);
        let moved: Vec<DVec3> = moved.iter().map(|&x| x + far).collect();
        let frame = map.frame(&moved, &gradients).unwrap();
        let mut random = cloud::Random::new(5);
        for _ in 0..200 {
            let world = far + motion(DVec3::splat(0.5) + random.vector(0.46));
            let found = frame.preimage(world, &anywhere);
            let found = found.unwrap_or_else(|| panic!("{name}: no tissue at {world}"));
            let nodes = frame.connected(found.position, 0.0, found.start_node);
            let back = forward(&frame, found.start_node, found.position, &nodes);
            assert_below(name, back.distance(world) / here.spacing, 1e-6);
        }
    }
}

/// What the dissertation's own inverses cost: eq. (62), `X = (Σ w F)⁻¹ Σ w (x − u + ∇u X_i)`, solves
/// eq. (61) once with weights at the world point instead of the unknown X. It finds no node once the body
/// has moved off; with weights about the present positions it is a first guess. Eq. (63) averages u with
/// weights that grow with the distance.
#[test]
fn one_shot_inverses_of_the_dissertation_are_spacings_off() {
    let body = body();
    let largest_error = |motion: fn(DVec3) -> DVec3, back: &dyn Fn(DVec3) -> DVec3| {
        let mut random = cloud::Random::new(5);
        let errors = (0..200).map(|_| {
            let material = DVec3::splat(0.5) + random.vector(0.46);
            (back(motion(material)) - material).length() / body.spacing
        });
        errors.fold(0.0, f64::max)
    };
    let mut costs = Vec::new();
    for (_, motion) in MOTIONS {
        let (moved, gradients) = moved_by(&body, motion);
        let one_shot = |centres: &[DVec3], world: DVec3| {
            let (mut matrix, mut right) = (DMat3::ZERO, DVec3::ZERO);
            for (i, &centre) in centres.iter().enumerate() {
                let radius = body.map.support_radii[i];
                let w = kernel((world - centre).length() / radius);
                let back = (gradients[i] - DMat3::IDENTITY) * body.points[i];
                matrix += gradients[i] * w;
                right += (world - moved[i] + body.points[i] + back) * w;
            }
            matrix.inverse() * right
        };
        let averaged = |world: DVec3| {
            let mut near: Vec<(f64, usize)> = (0..moved.len())
                .map(|i| ((world - moved[i]).length(), i))
                .collect();
            near.sort_by(|a, b| a.0.total_cmp(&b.0));
            near.truncate(16);
            let shift = |(w, i): &(f64, usize)| (moved[*i] - body.points[*i]) * *w;
            let total: f64 = near.iter().map(|(w, _)| w).sum();
            world - near.iter().map(shift).sum::<DVec3>() / total
        };
        costs.push([
            largest_error(motion, &|world| one_shot(&body.points, world)),
            largest_error(motion, &|world| one_shot(&moved, world)),
            largest_error(motion, &averaged),
        ]);
    }
    if testkit::tol::print_residuals() {
        println!("{costs:.3?}");
    }
    for (cost, (name, _)) in costs.iter().zip(MOTIONS) {
        assert!(cost[2] > 0.1, "{name}: eq. (63) is off by {cost:?}");
        assert!(cost[1] < 1.0, "{name}: a first guess, {cost:?}");
    }
}

/// The map of the body with the pairs severed that `apart` says.
fn cut_map(body: &Body, apart: impl Fn(DVec3, DVec3) -> bool) -> MaterialMap {
    let (points, graph) = (&body.points, &body.graph);
    let pairs = (0..points.len()).flat_map(|i| graph.row(i).iter().map(move |&j| (i, j as usize)));
    let severed: Vec<bool> = pairs.map(|(i, j)| apart(points[i], points[j])).collect();
    let all: Vec<u32> = (0..u32::try_from(points.len()).unwrap()).collect();
    let mut map = body.map.clone();
    map.update_rows(|pair| f64::from(!severed[pair]), &all);
    map
}

#[test]
fn jacobian_is_the_derivative_of_the_forward_map() {
    let body = body();
    let motion = MOTIONS[3].1;
    let (moved, gradients) = moved_by(&body, motion);
    let frame = body.map.frame(&moved, &gradients).unwrap();
    let x = DVec3::new(0.41, 0.53, 0.47);
    let d = DVec3::new(0.3, -0.7, 0.5);
    let start = frame.nearest_node(motion(x), 1.0).unwrap();
    let nodes = frame.connected(x, 0.01, start);
    let way = x - body.points[start as usize];
    let slope = (frame.forward(start, way, &nodes).unwrap().jacobian * d).dot(DVec3::ONE);
    let along = |t: f64| forward(&frame, start, x + d * t, &nodes).dot(DVec3::ONE);
    let error = directional_error(along, slope, 1e-3, 1e-3);
    assert_below("jacobian", error, 1e-8);
}

#[test]
fn affine_motion_is_exact() {
    let body = body();
    let f = DMat3::from_cols_array(&[1.1, 0.1, 0.0, -0.2, 0.9, 0.3, 0.05, 0.0, 1.2]);
    let shift = DVec3::new(0.3, -1.0, 2.0);
    let moved: Vec<DVec3> = body.points.iter().map(|&x| f * x + shift).collect();
    let gradients = vec![f; moved.len()];
    let frame = body.map.frame(&moved, &gradients).unwrap();
    let mut random = cloud::Random::new(9);
    for _ in 0..300 {
        let material = DVec3::splat(0.5) + random.vector(0.5);
        let world = f * material + shift;
        let found = frame.preimage(world, &anywhere).unwrap();
        assert_below("affine", (found.position - material).length(), 1e-12);
        assert!(found.jacobian.abs_diff_eq(f, 1e-12));
    }
}

/// Two halves turn apart: what lies in one of them is found there, what lies between them nowhere.
#[test]
fn a_preimage_is_in_tissue_or_not_at_all() {
    let body = body();
    let middle = DVec3::splat(0.5);
    let side = |x: DVec3| x.x < 0.5;
    let map = cut_map(&body, |a, b| side(a) != side(b));
    let turn = |x: DVec3| DMat3::from_rotation_y(if side(x) { -0.25 } else { 0.25 });
    let open = |x: DVec3| turn(x) * (x - middle) + DVec3::X * if side(x) { -0.2 } else { 0.2 };
    let moved: Vec<DVec3> = body.points.iter().map(|&x| open(x)).collect();
    let mut gradients: Vec<DMat3> = body.points.iter().map(|&x| turn(x)).collect();
    // What has turned inside out is no tissue.
    gradients[body.points.len() / 2] = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    let frame = map.frame(&moved, &gradients).unwrap();
    let seen = |node: u32, x: DVec3| side(body.points[node as usize]) == side(x);
    let mut random = cloud::Random::new(8);
    for _ in 0..300 {
        let material = middle + random.vector(0.4) * DVec3::new(0.2, 1.0, 1.0);
        let found = frame.preimage(open(material), &seen).unwrap();
        assert_below("halves", (found.position - material).length(), 1e-12);
        assert!(seen(found.start_node, material));
        assert_within("J", found.jacobian.determinant(), 1.0, 1e-9);
        let between = random.vector(0.4) * DVec3::new(0.14, 1.0, 1.0);
        assert!(frame.preimage(between, &seen).is_none(), "{between}");
    }
    assert!(frame.preimage(DVec3::splat(3.0), &seen).is_none());
}

#[test]
fn bad_input_is_named() {
    let body = body();
    let empty = Neighborhoods::from_graph(vec![0], vec![]).unwrap();
    let made = MaterialMap::new(&[], &[], &empty);
    assert_matches!(made, Err(MapError::Cloud(CloudError::Empty)));
    let zero = vec![0.0; body.points.len()];
    let made = MaterialMap::new(&body.points, &zero, &body.graph);
    assert_matches!(made, Err(MapError::Cloud(CloudError::NotPositive { .. })));
    let made = body.map.frame(&body.points[1..], &[]);
    assert_matches!(made, Err(MapError::Graph(_)));
    let mut gradients = vec![DMat3::IDENTITY; body.points.len()];
    gradients[4].x_axis.x = f64::NAN;
    let made = body.map.frame(&body.points, &gradients);
    assert_matches!(made, Err(MapError::DeformationGradient { node: 4 }));
}

/// The walk that ends early and serves several iterates finds what a plain search of all nodes does.
#[test]
fn connected_nodes_equal_the_plain_search() {
    let body = body();
    let side = |x: DVec3| x.x < 0.4;
    // A cut that ends in the middle of the body.
    let map = cut_map(&body, |a, b| a.y < 0.5 && b.y < 0.5 && side(a) != side(b));
    let gradients = vec![DMat3::IDENTITY; body.points.len()];
    let frame = map.frame(&body.points, &gradients).unwrap();
    let mut random = cloud::Random::new(2);
    for _ in 0..60 {
        let x = DVec3::splat(0.5) + random.vector(0.45);
        let start = frame.nearest_node(x, 1.0).unwrap();
        let holds = |node: u32, factor: f64| {
            let h = map.support_radii[node as usize] * factor;
            (x - body.points[node as usize]).abs().max_element() <= h
        };
        let mut reached = vec![start];
        let mut next = 0;
        while next < reached.len() {
            let node = reached[next] as usize;
            next += 1;
            for pair in body.graph.pairs(node) {
                let other = body.graph.indices()[pair];
                if !map.severed[pair] && holds(other, ENLARGED) && !reached.contains(&other) {
                    reached.push(other);
                }
            }
        }
        reached.retain(|&node| {
            (x - body.points[node as usize]).length() < map.support_radii[node as usize]
        });
        reached.sort_unstable();
        assert_eq!(frame.connected(x, 0.0, start), reached);
    }
}
