//! Every reason for which a file, a surface or a sampling is refused.

use crate::common::{cube, join, repaired};
use glam::DVec3;
use phyxel_discretize::{
    Axis, Bounds, Mesh, Placement, Primitive, ReadErrorKind, RepairError, RepairSettings,
    SampleError, SampleSettings, Shape, Solid, SolidError, TextPlace, parse_mesh, read_mesh,
    read_point_cloud, repair, sample_points, sample_tetrahedra,
};
use testkit::assert_matches;
use testkit::tol::assert_relative;

#[test]
fn reading_names_reason_and_place() {
    // A file with its line ends as `\n`, and the message; indices are as the file writes them.
    for row in include_str!("refusals.txt").lines() {
        let (text, expected) = row.split_once(" => ").unwrap();
        let error = parse_mesh(text.replace("\\n", "\n").as_bytes()).unwrap_err();
        assert_eq!(error.to_string(), expected, "{text}");
    }
    let lost = parse_mesh(b"v 0 0 0\nf 1 2 3\n").unwrap_err();
    let kind = ReadErrorKind::IndexOutOfRange { index: 2, count: 1 };
    assert_eq!((lost.kind, lost.place), (kind, TextPlace::Line(2)));
    let missing = read_mesh("no/such/mesh.obj").unwrap_err();
    let kind = ReadErrorKind::Io(std::io::ErrorKind::NotFound);
    assert_eq!((missing.place, &missing.kind), (TextPlace::File, &kind));
    let message = missing.to_string();
    assert!(message.starts_with("no/such/mesh.obj: cannot read"));
}

#[test]
fn a_point_cloud_needs_six_finite_numbers_and_a_normal() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text, expected) in [
        ("five", "0 0 0 1 0\n", "six numbers"),
        ("flat", "# cloud\n0 0 0 0 0 0\n", "line 2: a coordinate"),
        ("none", "# nothing\n", "no points"),
        (
            "bent",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
             property float nx\nproperty float ny\nproperty float nz\nend_header\n1 2 3 0 0 0\n",
            "not a finite number",
        ),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let error = read_point_cloud(&path).unwrap_err().to_string();
        assert!(error.contains(expected) && error.contains(name), "{error}");
    }
}

/// Two closed cubes along one edge, one of them inside out: two parts, one turned.
#[test]
fn parts_that_share_an_edge_stay_two() {
    for inverted in [false, true] {
        for place in [DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, 1.0, 1.0)] {
            let both = join(&[(cube(DVec3::ZERO), false), (cube(place), inverted)]);
            let (mesh, report) = repaired(&both);
            assert_eq!(report.parts, 2);
            assert_eq!(report.turned_parts, usize::from(inverted));
            assert_eq!(report.cavities, 0);
            assert_eq!(report.non_manifold_edges, usize::from(place.z == 0.0));
            assert_relative("volume", mesh.volume(), 2.0, 0.0, 1e-12);
            let solid = Solid::from_mesh(mesh);
            assert!(solid.contains(DVec3::splat(0.5)) && solid.contains(place + 0.5));
            assert!(!solid.contains(DVec3::new(1.5, 0.5, 0.5)));
        }
    }
}

#[test]
fn repair_names_why_a_surface_is_no_solid() {
    let settings = RepairSettings::default();
    let why = |mesh: &Mesh| repair(mesh, &settings).unwrap_err();
    let good = cube(DVec3::ZERO);
    let spoilt = |spoil: &dyn Fn(&mut Mesh)| {
        let mut mesh = good.clone();
        spoil(&mut mesh);
        why(&mesh)
    };
    assert_eq!(why(&Mesh::default()), RepairError::Empty { dropped: 0 });
    let lines = spoilt(&|mesh| mesh.triangles.iter_mut().for_each(|t| t[2] = t[1]));
    assert_eq!(lines, RepairError::Empty { dropped: 12 });
    let nan = spoilt(&|mesh| mesh.vertices[2].x = f64::NAN);
    assert_eq!(nan, RepairError::NotFinite { vertex: 2 });
    let expected = RepairError::IndexOutOfRange {
        triangle: 1,
        vertex: 8,
        vertex_count: 8,
    };
    assert_eq!(spoilt(&|mesh| mesh.triangles[1][0] = 8), expected);
    assert_matches!(why(&good.clone().scaled(1e91)), RepairError::Scale { .. });
    let open = spoilt(&|mesh| mesh.triangles.truncate(10));
    assert_matches!(open, RepairError::Open { holes: 1, limit, .. } if (limit - 0.2 * 3.0_f64.sqrt()).abs() < 1e-12);
    // Two cubes with one wall between them: three sheets meet along its rim.
    let mut wall = join(&[(good.clone(), false), (cube(DVec3::X), false)]);
    wall.triangles.retain(|t| {
        let x = t.map(|v| (v >= 8, wall.vertices[v as usize].x));
        x.iter()
            .any(|(second, x)| !second || (*x - 1.0).abs() > 0.5)
    });
    let sheets = why(&wall);
    assert_matches!(sheets, RepairError::Unbalanced { edges: 4, near } if (near.x - 1.0).abs() < 1e-12);
    let mut flat = Mesh {
        vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)],
        triangles: vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
    };
    assert_matches!(why(&flat), RepairError::NoVolume { .. });
    flat.vertices[3].z = 1.0;
    assert!(repair(&flat, &settings).is_ok());
}

#[test]
fn sampling_names_why_it_stops() {
    let at = |solid: &Solid, settings| sample_tetrahedra(solid, &settings).unwrap_err();
    let liver = Solid::from(Primitive::Liver);
    let points = |settings| sample_points(&liver, &settings, true).unwrap_err();
    for spacing in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let settings = SampleSettings::spacing(spacing);
        assert_matches!(points(settings.clone()), SampleError::Spacing { .. });
        assert_matches!(at(&liver, settings), SampleError::Spacing { .. });
    }
    let cube = Solid::from(Primitive::Box {
        half_extents: DVec3::splat(0.05),
    });
    let coarse = at(&cube, SampleSettings::spacing(1e3));
    assert_matches!(coarse, SampleError::Vanished { .. });
    let few = SampleSettings::nodes(3);
    for error in [points(few.clone()), at(&liver, few)] {
        assert_matches!(error, SampleError::TooFewNodes { nodes: 3, .. });
    }
    let fine = SampleSettings::spacing(1e-9);
    for error in [points(fine.clone()), at(&liver, fine)] {
        assert_matches!(error, SampleError::TooFine { .. });
    }
    let plate = Primitive::Ellipsoid {
        semi_axes: DVec3::new(1.0, 1.0, 1e-5),
    };
    // A point off the plate's middle: no lattice point lies in it.
    let lower = Bounds::new(DVec3::new(-1.0, -1.0, -0.37), DVec3::new(1.0, 1.0, 0.4));
    let thin = Solid::implicit(lower, move |p| plate.value(p));
    let gone = at(&thin, SampleSettings::spacing(0.3));
    assert_matches!(gone, SampleError::Vanished { .. });
    let half_known = |p: DVec3| {
        if p.x > 0.0 {
            f64::NAN
        } else {
            p.length() - 0.05
        }
    };
    let nan = Solid::implicit(Primitive::Liver.bounds(), half_known);
    let unknown = at(&nan, SampleSettings::spacing(0.01));
    assert_matches!(unknown, SampleError::NotANumber { at } if at.x > 0.0);
    let half = Bounds::new(DVec3::splat(-1.2), DVec3::new(1.2, 1.2, 0.3));
    let cut = Solid::implicit(half, |p| p.length() - 1.0);
    let beyond = at(&cut, SampleSettings::spacing(0.2));
    assert_matches!(beyond, SampleError::OutsideBounds { at } if at.z > 0.3 && at.length() < 1.0);
    let exact = SampleSettings {
        count_tolerance: 0.0,
        ..SampleSettings::nodes(1001)
    };
    let block = Solid::from(Primitive::Box {
        half_extents: DVec3::ONE,
    });
    assert_matches!(
        at(&block, exact),
        SampleError::NodeCount { wanted: 1001, .. }
    );
}

#[test]
fn a_file_is_read_and_scaled_or_says_which_stage_failed() {
    let folder = tempfile::tempdir().unwrap();
    let run = |name: &str, bytes: &[u8]| {
        let file = folder.path().join(name);
        std::fs::write(&file, bytes).unwrap();
        let (scale, up, largest_hole) = (2.0, Axis::Z, 0.2);
        let shape = Shape::Mesh {
            file,
            scale,
            up,
            largest_hole,
        };
        shape.solid(&Placement::IDENTITY)
    };
    assert_matches!(run("read", b"?"), Err(SolidError::Read(_)));
    let sheet = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    assert_matches!(run("repair", sheet), Err(SolidError::Repair { .. }));
    let whole = phyxel_discretize::ply_mesh(&cube(DVec3::ZERO));
    let volume = run("whole", &whole).unwrap().0.volume().unwrap();
    assert_relative("volume", volume, 8.0, 0.0, 1e-12);
}
