//! Real meshes against their published figures.

use crate::common::{check_sums, folder_of_meshes, sample};
use phyxel_discretize::{RepairSettings, Solid, read_mesh, read_point_cloud, repair};
use testkit::tol::assert_relative;

/// Vertices used, triangles, parts, signed volume, area, self-intersecting triangles (- where not known).
const FIGURES: &str = "
    liver.obj                    139    274 1  36.568518     79.881526 0
    liver-smooth.obj            2194   4384 1  39.267352     78.582824 8
    liver.msh                    140    276 1  36.560851     80.156897 -
    liver2.msh                   432    860 1  1.1250922     6.4475898 -
    liver.vtk                   5008  10000 4 -1477212.9     83435.953 0
    aneurysm3D_1.off            7095  14186 1  1378.7859     1011.8042 0
    raptor_8kp.obj              8818  17632 1  27.750212     102.71049 74
    gallbladder_visual.stl      7352  14700 1  36277.946     7321.3013 0
    gallbladder_volumetric.vtk   366    728 1  34122.545     6940.7724 -
    tissue_volume.msh            448    892 1  0.00011520248 0.03264025 -
    small_intestine_100k.vtk   50002 100000 1  1056228.7     218977.7  0
    spot.ply                    2930   5856 1  0.71825879    5.7095188 0";

/// Their rows: name and figures.
fn figures() -> impl Iterator<Item = (&'static str, [Option<f64>; 6])> {
    FIGURES.trim().lines().map(|row| {
        let mut words = row.split_whitespace();
        let name = words.next().unwrap();
        (name, [(); 6].map(|()| words.next().unwrap().parse().ok()))
    })
}

#[test]
fn real_meshes_have_their_published_figures() {
    let Some(folder) = folder_of_meshes() else {
        return;
    };
    for (name, figures) in figures() {
        let file = read_mesh(folder.join(name)).expect(name);
        let settings = RepairSettings {
            smallest_part: 0.0,
            ..RepairSettings::default()
        };
        let (_, report) = repair(&file.mesh, &settings).expect(name);
        let (vertices, triangles) = report.kept;
        let counts = [vertices, triangles, report.parts].map(|count| Some(count as f64));
        assert_eq!(counts, figures[..3], "{name}");
        assert_eq!(report.genus, Some(0), "{name}");
        // The raptor is off by 2.5e-6 and 1.8e-4 since polygons are divided otherwise; not looked into.
        let raptor = name.starts_with("raptor");
        let (bar, area_bar) = if raptor { (5e-6, 3e-4) } else { (1e-6, 1e-6) };
        let (volume, area) = (figures[3].unwrap(), figures[4].unwrap());
        assert_relative(name, report.given_volume, volume, 0.0, bar);
        assert_relative(name, report.volume, volume.abs(), 0.0, bar);
        assert_relative(name, report.area, area, 0.0, area_bar);
        if let Some(crossing) = figures[5] {
            let found = report.self_intersecting.map(|count| count as f64);
            assert_eq!(found, Some(crossing), "{name}");
        }
    }
}

/// Tetrahedra whose boundary touches itself along edges: refused or a solid, as is reported.
#[test]
fn an_xml_file_of_tetrahedra_has_its_published_figures() {
    let Some(folder) = folder_of_meshes() else {
        return;
    };
    let file = read_mesh(folder.join("raptorTetra_8418.vtu")).unwrap();
    let counts = (file.mesh.vertices.len(), file.tetrahedra.len());
    assert_eq!(counts, (2996, 8418));
    assert_eq!(file.mesh.triangles.len(), 5750);
    assert_relative("volume", file.mesh.volume(), 27.251767, 0.0, 1e-6);
    assert_relative("area", file.mesh.area(), 100.82838, 0.0, 1e-6);
    let (mesh, report) = repair(&file.mesh, &RepairSettings::default()).unwrap();
    assert_eq!(report.non_manifold_edges, 9);
    let s = sample(&Solid::from_mesh(mesh), 6000).unwrap();
    check_sums("raptorTetra", &s);
    assert!(s.report.quality.smallest_dihedral > 8.0, "{}", s.report);
}

#[test]
fn a_point_cloud_with_normals_is_read_as_it_is() {
    let Some(folder) = folder_of_meshes() else {
        return;
    };
    let cloud = read_point_cloud(folder.join("kitten.xyz")).unwrap();
    assert_eq!(cloud.positions.len(), 5210);
    for n in &cloud.normals {
        assert_relative("normal", n.length(), 1.0, 0.0, 1e-12);
    }
}
