//! Nodes of meshes have the volume that tetrahedra leave between them and the surface.

use crate::common::{ball, check_sums, cube, join, sample, shapes};
use glam::{DMat3, DVec3};
use phyxel_discretize::{
    Mesh, SampleSettings, SampledNodes, Solid, nodal_boundary_vectors, nodal_volumes,
    sample_tetrahedra, surface_mesh, tetrahedron_volume,
};
use proptest::prelude::*;
use testkit::strategies::rotation;
use testkit::tol::{assert_below, assert_relative};

fn sampled(mesh: Mesh, spacing: f64) -> SampledNodes {
    let settings = SampleSettings::spacing(spacing);
    sample_tetrahedra(&Solid::from_mesh(mesh), &settings).expect("a whole body")
}

/// A cuboid around the origin.
fn cuboid(size: DVec3, turn: DMat3) -> Mesh {
    let mut mesh = cube(DVec3::splat(-0.5));
    let place = |v: &mut DVec3| *v = turn * (*v * size);
    mesh.vertices.iter_mut().for_each(place);
    mesh
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4))]

    /// At four to six cells tetrahedra have 2 to 3 % less volume than a turned cuboid and up to 7 % less second moments, which is what
    /// its bending stiffness lacks. What nodes have beyond their tetrahedra makes up for both.
    #[test]
    fn turned_cuboids_have_their_volume_and_second_moments(turn in rotation()) {
        let turn = DMat3::from_quat(turn);
        let size = DVec3::new(0.4, 0.25, 0.2);
        let found = sampled(cuboid(size, turn), 0.04);
        check_sums("cuboid", &found);
        let volume = size.element_product();
        assert_relative("volume", found.report.volume, volume, 0.0, 1e-12);
        let x: Vec<DVec3> = found.positions.iter().map(|x| turn.transpose() * *x).collect();
        let mut moments = DVec3::ZERO;
        for tetrahedron in &found.tetrahedra {
            let corners = tetrahedron.map(|node| x[node as usize]);
            let sum: DVec3 = corners.iter().sum();
            let squares: DVec3 = corners.iter().map(|x| x * x).sum();
            moments += (squares + sum * sum) * tetrahedron_volume(corners) / 20.0;
        }
        let own = nodal_volumes(&found.positions, &found.tetrahedra);
        for ((x, volume), own) in x.iter().zip(&found.volumes).zip(own) {
            moments += x * x * (volume - own);
        }
        let ratio = moments / (size * size * volume / 12.0);
        let off = (ratio - 1.0).abs().max_element();
        assert_below("second moments", off, 0.01);
    }
}

/// Bitwise.
#[test]
fn shapes_without_a_mesh_have_what_their_tetrahedra_have() {
    for shape in shapes() {
        let found = sample(&shape.into(), 500).unwrap();
        let (x, volumes) = (&found.positions, &found.volumes);
        assert_eq!(*volumes, nodal_volumes(x, &found.tetrahedra), "{shape:?}");
        let own = nodal_boundary_vectors(x, &found.surface_triangles);
        assert_eq!(found.boundary_vectors, own, "{shape:?}");
    }
}

/// Each of three bodies gets what it lacks itself: a coarse one lacks a larger fraction.
#[test]
fn volume_stays_where_it_is() {
    let turn = DMat3::from_rotation_x(0.7) * DMat3::from_rotation_y(0.4);
    let round = surface_mesh(&ball(0.15), 0.02).unwrap();
    let mut parts = [
        (cuboid(DVec3::splat(1.0), turn), false),
        (cuboid(DVec3::splat(0.25), turn), false),
        (round, false),
    ];
    for (at, (mesh, _)) in parts.iter_mut().enumerate() {
        let shift = DVec3::X * (2.0 * at as f64);
        mesh.vertices.iter_mut().for_each(|v| *v += shift);
    }
    let found = sampled(join(&parts), 0.07);
    check_sums("three", &found);
    assert_below("volume", found.report.volume_error.unwrap().abs(), 1e-12);
    let own = nodal_volumes(&found.positions, &found.tetrahedra);
    for (at, (mesh, _)) in parts.iter().enumerate() {
        let near = |x: &DVec3| (x.x - 2.0 * at as f64).abs() < 1.0;
        let sum = |volumes: &[f64]| {
            let nodes = found.positions.iter().zip(volumes);
            let sum: f64 = nodes.filter(|(x, _)| near(x)).map(|(_, v)| v).sum();
            sum / mesh.volume() - 1.0
        };
        let (before, now) = (sum(&own), sum(&found.volumes));
        // 0.004, 0.09 and 0.20: creases of the others count for the ball, too.
        assert!(now.abs() < 0.25 * before.abs(), "{at}: {before} {now}");
    }
}

/// A part that lies in another is counted twice in the mesh's volume. Nodes have no more than there is.
#[test]
fn what_a_mesh_counts_twice_is_not_given_to_nodes() {
    let turn = DMat3::from_rotation_x(0.7) * DMat3::from_rotation_y(0.4);
    let parts = [1.0, 0.4].map(|size| (cuboid(DVec3::splat(size), turn), false));
    let found = sampled(join(&parts), 0.2);
    let sum: f64 = found.volumes.iter().sum();
    assert!((0.95..1.001).contains(&sum), "{sum} of 1 m³");
    assert!(
        found.report.tetrahedra_error.unwrap() < -0.1,
        "{}",
        found.report
    );
}

/// A fin too thin for any node is cut off, and its volume reported as missing.
#[test]
fn what_is_cut_off_is_not_given_to_others() {
    let (fin, depth) = (0.02, 0.8);
    let outline = [
        (0.0, 0.0),
        (1.0, 0.0),
        (1.0, 0.5),
        (3.0, 0.5),
        (3.0, 0.5 + fin),
        (1.0, 0.5 + fin),
        (1.0, 1.0),
        (0.0, 1.0),
    ];
    let vertices = [0.0, depth]
        .into_iter()
        .flat_map(|z| outline.map(|(x, y)| DVec3::new(x, y, z)));
    let mut triangles = Vec::new();
    // The outline in triangles: the block's around the fin's root, and the fin's.
    for [a, b, c] in [
        [0, 1, 2],
        [0, 2, 5],
        [0, 5, 7],
        [5, 6, 7],
        [2, 3, 4],
        [2, 4, 5],
    ] {
        triangles.push([a + 8, b + 8, c + 8]);
        triangles.push([a, c, b]);
    }
    for a in 0..8 {
        let b = (a + 1) % 8;
        triangles.extend([[a, b, b + 8], [a, b + 8, a + 8]]);
    }
    let mesh = Mesh {
        vertices: vertices.collect(),
        triangles,
    };
    let volume = depth * (1.0 + 2.0 * fin);
    assert_relative("mesh", mesh.volume(), volume, 0.0, 1e-12);
    let found = sampled(mesh, 0.17);
    let missing = -found.report.volume_error.unwrap() * volume;
    let fin = 2.0 * fin * depth;
    assert!(
        missing > 0.5 * fin && missing < 1.2 * fin,
        "{missing} m³ of {fin}"
    );
}
