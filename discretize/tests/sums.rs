//! Sums, positions and quality of samplings of shapes, under rigid motions and scales.

use crate::common::{ball, check_count, check_sums, cube, shapes};
use glam::DVec3;
use phyxel_discretize::{
    Primitive, SampleSettings, SampleTarget, SampledNodes, Solid, SurfaceSamples, sample_surfels,
    sample_tetrahedra, surface_mesh, tetrahedra_edges,
};
use testkit::tol::{assert_below, assert_relative};

fn nodes(solid: &Solid, count: usize) -> SampledNodes {
    crate::common::sample(solid, count).expect("a whole body of some thickness")
}

#[test]
fn every_shape_at_three_counts() {
    for shape in shapes() {
        for count in [300, 2000] {
            let s = nodes(&shape.into(), count);
            check_sums(&format!("{shape:?} {count}"), &s);
            let n = s.positions.len();
            check_count(&format!("{shape:?}"), n, count);
            let angle = s.report.quality.smallest_dihedral;
            assert!(angle > 10.7, "{shape:?} {count}: {angle}");
            assert_eq!(s.report.pieces, 1);
            let size = shape.bounds().diagonal();
            for p in &s.positions {
                assert_below("node outside", shape.value(*p), 1e-12 * size);
            }
            let mut on_surface = vec![false; n];
            for v in s.surface_triangles.iter().flatten() {
                on_surface[*v as usize] = true;
            }
            for (p, on) in s.positions.iter().zip(&on_surface) {
                if *on {
                    assert_below("surface node off", shape.value(*p).abs(), 1e-11 * size);
                }
            }
        }
    }
}

/// And are filled exactly.
#[test]
fn boxes_of_any_shape_get_the_count_asked_for() {
    for (half_extents, counts, angle) in [
        (DVec3::new(0.03, 0.015, 0.02), COUNTS, 25.0),
        (DVec3::new(0.05, 0.05, 0.2), COUNTS, 25.0),
        (DVec3::new(1.0, 0.1, 0.7), COUNTS, 25.0),
        (DVec3::new(0.1, 0.13, 0.5), &[2000], 40.0),
    ] {
        for &count in counts {
            let s = nodes(&Primitive::Box { half_extents }.into(), count);
            check_sums("box", &s);
            check_count(&half_extents.to_string(), s.positions.len(), count);
            let volume = 8.0 * half_extents.element_product();
            assert_relative("volume", s.report.volume, volume, 0.0, 1e-12);
            let q = s.report.quality;
            assert!(q.smallest_dihedral > angle, "{half_extents} {count}: {q:?}");
        }
    }
}

const COUNTS: &[usize] = &[200, 300, 450, 1408, 5000];

/// A box has no sampling between some small counts: the nearest is taken.
#[test]
fn any_small_count_is_sampled() {
    let half_extents = DVec3::new(0.05, 0.03, 0.02);
    for solid in [
        Solid::from(Primitive::Box { half_extents }),
        Solid::from(Primitive::Ellipsoid {
            semi_axes: half_extents,
        }),
    ] {
        for wanted in (40..200).step_by(10) {
            let found = nodes(&solid, wanted).positions.len();
            assert!(found.abs_diff(wanted) * 5 <= wanted, "{found} of {wanted}");
        }
    }
}

/// A wanted spacing is the mean edge, whatever fraction of the nodes lies at the surface.
#[test]
fn a_wanted_spacing_is_met() {
    for shape in shapes() {
        let solid = Solid::from(shape);
        let size = shape.bounds().size().min_element();
        for (cells, smoothing_sweeps) in [(5.0, 0), (5.0, 4), (10.0, 4)] {
            let settings = SampleSettings {
                target: SampleTarget::Spacing(size / cells),
                smoothing_sweeps,
                ..SampleSettings::default()
            };
            let s = sample_tetrahedra(&solid, &settings).expect("a whole body");
            // Four or five whole cells on the box's short side: half a cell is an eighth of it.
            let whole = matches!(shape, Primitive::Box { .. });
            let bar = if whole { 0.5 / (cells - 1.0) } else { 0.05 };
            let (name, mean) = (format!("{shape:?}"), s.report.quality.mean_edge);
            assert_relative(&name, mean, size / cells, 0.0, bar);
        }
    }
}

#[test]
fn volumes_converge_to_closed_forms() {
    let ellipsoid = Primitive::Ellipsoid {
        semi_axes: DVec3::new(1.0, 0.6, 0.8),
    };
    let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.48;
    let error = |n| {
        let found = nodes(&ellipsoid.into(), n);
        let error = found.volumes.iter().sum::<f64>() / exact - 1.0;
        let told = found.report.volume_error.unwrap();
        assert_below("told", (error - told).abs(), 1e-12);
        error.abs()
    };
    let (coarse, fine) = (error(1000), error(8000));
    assert!(coarse < 0.03, "{coarse}");
    // Second order in the spacing: eight times the nodes, a quarter of the error.
    assert!(fine < 0.35 * coarse, "{coarse} {fine}");
}

#[test]
fn the_liver_is_a_liver() {
    let mesh = surface_mesh(&Primitive::Liver.into(), 0.003).unwrap();
    let size = mesh.bounds().size();
    let volume = mesh.volume();
    assert!((1.1e-3..1.6e-3).contains(&volume), "{volume}");
    assert!((0.14..0.18).contains(&size.x), "{size}");
    assert!(Primitive::Liver.bounds().min.cmplt(mesh.bounds().min).all());
    assert!(Primitive::Liver.bounds().max.cmpgt(mesh.bounds().max).all());
}

#[test]
fn edges_are_symmetric_sorted_and_complete() {
    let s = nodes(&Primitive::Liver.into(), 600);
    let (offsets, indices) = tetrahedra_edges(s.positions.len(), &s.tetrahedra);
    let row = |i: u32| &indices[offsets[i as usize] as usize..offsets[i as usize + 1] as usize];
    let mut expected = std::collections::BTreeSet::new();
    for t in &s.tetrahedra {
        for a in t {
            for b in t {
                if a != b {
                    expected.insert((*a, *b));
                }
            }
        }
    }
    let n = u32::try_from(s.positions.len()).unwrap();
    let found: Vec<(u32, u32)> = (0..n)
        .flat_map(|i| row(i).iter().map(move |j| (i, *j)))
        .collect();
    assert!(found.iter().eq(expected.iter()));
}

#[test]
fn smoothing_raises_the_smallest_height() {
    let at = |smoothing_sweeps| {
        let settings = SampleSettings {
            target: SampleTarget::NodeCount(3000),
            smoothing_sweeps,
            ..SampleSettings::default()
        };
        let s = sample_tetrahedra(&Primitive::Liver.into(), &settings).unwrap();
        check_sums("sums", &s);
        s.report.quality
    };
    let (plain, smooth) = (at(0), at(4));
    let gain = smooth.smallest_height / plain.smallest_height;
    assert!(gain > 1.2, "{gain}");
    assert!(smooth.smallest_dihedral > 10.7 && plain.smallest_dihedral > 10.7);
}

#[test]
fn surfels_cover_the_surface_evenly() {
    let liver = Solid::from(Primitive::Liver);
    let mesh = surface_mesh(&liver, 0.005).unwrap();
    let surfels = sample_surfels(&mesh, 2000, Some(&liver));
    let n = surfels.positions.len();
    assert!(n.abs_diff(2000) < 60, "{n}");
    let sum: f64 = surfels.areas.iter().sum();
    assert_relative("area", sum, mesh.area(), 0.0, 1e-10);
    assert!(surfels.areas.iter().all(|a| *a > 0.0));
    let packed = (mesh.area() / n as f64 * 2.0 / 3.0_f64.sqrt()).sqrt();
    for (i, p) in surfels.positions.iter().enumerate() {
        assert_below("off", Primitive::Liver.value(*p).abs(), 1e-12);
        assert_relative("normal", surfels.normals[i].length(), 1.0, 0.0, 1e-12);
        let outward = Primitive::Liver.value(*p + 1e-5 * surfels.normals[i]);
        assert!(outward > 0.0);
        let others = surfels.positions.iter().enumerate();
        let others = others.filter(|(j, _)| *j != i).map(|(_, q)| q.distance(*p));
        let nearest = others.fold(f64::INFINITY, f64::min) / packed;
        assert!(nearest > 0.25 && nearest < 1.6, "{nearest}");
    }
}

#[test]
fn the_hierarchy_agrees_with_brute_force() {
    let mesh = surface_mesh(&Primitive::Liver.into(), 0.01).unwrap();
    let hierarchy = phyxel_discretize::Hierarchy::new(&mesh);
    let mut random = testkit::cloud::Random::new(3);
    for _ in 0..500 {
        let p = random.vector(0.1);
        let exact = phyxel_discretize::winding_number(&mesh, p);
        assert_below("round", (exact - exact.round()).abs(), 1e-9);
        let fast = hierarchy.winding_number(p);
        assert_below("winding", (fast - exact).abs(), 0.1);
        let closest = hierarchy.closest(p).unwrap();
        let mut crossings = Vec::new();
        let q = random.vector(0.1);
        hierarchy.crossings_into(p, q, &mut crossings);
        // The jump of the winding number along the segment is the signed count of crossings.
        let jump: f64 = crossings
            .iter()
            .map(|c| mesh.area_vector(c.triangle as usize).dot(q - p).signum())
            .sum();
        let end = phyxel_discretize::winding_number(&mesh, q);
        assert_below("jump", (exact - end - jump).abs(), 1e-9);
        // No vertex is nearer than the closest point.
        let vertex = mesh.vertices.iter().map(|v| v.distance_squared(p));
        let vertex = vertex.fold(f64::INFINITY, f64::min);
        assert!(closest.distance_squared <= vertex * (1.0 + 1e-12));
        let solo = (0..mesh.triangles.len()).map(|t| {
            let one = phyxel_discretize::Mesh {
                vertices: mesh.corners(t).to_vec(),
                triangles: vec![[0, 1, 2]],
            };
            let h = phyxel_discretize::Hierarchy::new(&one);
            h.closest(p).unwrap().distance_squared
        });
        let brute = solo.fold(f64::INFINITY, f64::min);
        assert_relative("closest", closest.distance_squared, brute, 0.0, 1e-12);
    }
}

/// A mesh stands for a smooth surface with creases: a ball's has nearly a ball's normals, a cube's those
/// of its faces.
#[test]
fn surfels_of_a_mesh_have_the_normals_of_the_surface_it_stands_for() {
    let mesh = surface_mesh(&ball(1.0), 0.2).unwrap();
    let off = |surfels: &SurfaceSamples| {
        let both = surfels.positions.iter().zip(&surfels.normals);
        both.map(|(x, n)| n.distance(x.normalize()))
            .fold(0.0, f64::max)
    };
    let facets = off(&sample_surfels(&mesh, 3000, None));
    let solid = Solid::from_mesh(mesh.clone());
    let smooth = off(&sample_surfels(&mesh, 3000, Some(&solid)));
    // Facets are off by half a facet, what is interpolated by its square: 0.29 times here.
    assert!(smooth < 0.35 * facets, "{smooth} instead of {facets}");
    let mesh = cube(DVec3::ZERO);
    let solid = Solid::from_mesh(mesh.clone());
    for n in sample_surfels(&mesh, 300, Some(&solid)).normals {
        assert!((n.abs().max_element() - 1.0).abs() < 1e-15, "{n}");
    }
}

#[test]
fn round_off_outside_of_a_face_counts_as_inside_where_it_is_asked() {
    let shape = Primitive::Box {
        half_extents: DVec3::splat(0.5),
    };
    // The box stands around the origin, the cube on it.
    let solids = [
        (Solid::from(shape), DVec3::ZERO),
        (Solid::from_mesh(cube(DVec3::ZERO)), DVec3::splat(0.5)),
    ];
    for (solid, middle) in solids {
        let beside = |off: f64| middle + DVec3::new(0.5 + off, 0.11, -0.2);
        for (off, inside) in [(-1e-6, true), (1e-15, true), (1e-10, true), (1e-6, false)] {
            let found = solid.contains_within(beside(off), 1e-9);
            assert_eq!(found, inside, "{off:e}");
        }
        assert!(!solid.contains(beside(1e-10)), "without a tolerance");
    }
}
