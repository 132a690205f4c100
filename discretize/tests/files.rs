//! Formats, and mutated files of each.

use crate::common::{binary_stl, repaired};
use glam::DVec3;
use phyxel_discretize::{
    Format, Mesh, Primitive, ReadError, RepairSettings, Solid, TextPlace, parse_mesh, ply_mesh,
    ply_surfels, read_point_cloud, repair, sample_surfels, surface_mesh,
};
use testkit::broken::broken;
use testkit::cloud::Random;
use testkit::tol::assert_relative;

/// The bytes of a number, given little-endian, in either order.
fn ordered<const N: usize>(big: bool, mut little: [u8; N]) -> [u8; N] {
    if big {
        little.reverse();
    }
    little
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for group in bytes.chunks(3) {
        let [a, b, c] = [0, 1, 2].map(|k| group.get(k).copied().unwrap_or(0));
        let bits = u32::from_be_bytes([0, a, b, c]);
        for k in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * k) & 63) as usize] as char;
            out.push(if k <= group.len() { letter } else { '=' });
        }
    }
    out
}

/// A VTK XML file of text, with the attributes and contents of its arrays replaced by those that `array` makes of their
/// bytes.
fn with(text: &str, mut array: impl FnMut(&[u8]) -> (String, String)) -> String {
    let mut pieces = text.split("format=\"ascii\">");
    let mut out = pieces.next().unwrap().to_owned();
    for piece in pieces {
        let (content, rest) = piece.split_once('<').unwrap();
        let (words, kind) = (
            content.split_whitespace(),
            out.rsplit_once("type=").unwrap().1,
        );
        let bytes: Vec<u8> = if kind.starts_with("\"Float64") {
            let bytes = |word: &str| word.parse::<f64>().unwrap().to_le_bytes();
            words.flat_map(bytes).collect()
        } else {
            let wide = if kind.starts_with("\"UInt8") { 1 } else { 4 };
            let bytes = |word: &str| word.parse::<i32>().unwrap().to_le_bytes();
            words
                .flat_map(|word| bytes(word).into_iter().take(wide))
                .collect()
        };
        let (attributes, content) = array(&bytes);
        out += &format!("{attributes}>{content}<{rest}");
    }
    out
}

fn in_base64(text: &str) -> Vec<u8> {
    let text = with(text, |data| {
        let content = base64(&[&word(data.len()), data].concat());
        ("format=\"binary\"".to_owned(), content)
    });
    text.into_bytes()
}

fn in_zlib(text: &str) -> Vec<u8> {
    let text = with(text, |data| {
        let packed = miniz_oxide::deflate::compress_to_vec_zlib(data, 6);
        let header = [1, data.len(), data.len(), packed.len()].map(word).concat();
        let content = base64(&header) + &base64(&packed);
        ("format=\"binary\"".to_owned(), content)
    });
    let compressed = "<VTKFile compressor=\"vtkZLibDataCompressor\"";
    text.replace("<VTKFile", compressed).into_bytes()
}

fn in_raw_bytes(text: &str) -> Vec<u8> {
    let mut appended = Vec::new();
    let text = with(text, |data| {
        let attributes = format!("format=\"appended\" offset=\"{}\"", appended.len());
        appended.extend((data.len() as u64).to_le_bytes());
        appended.extend(data);
        (attributes, String::new())
    });
    let text = text.replace("<VTKFile", "<VTKFile header_type=\"UInt64\"");
    let (head, tail) = text.split_once("</VTKFile>").unwrap();
    let mut out = format!("{head}<AppendedData encoding=\"raw\">_").into_bytes();
    out.extend(appended);
    out.extend(format!("</AppendedData></VTKFile>{tail}").bytes());
    out
}

fn word(n: usize) -> [u8; 4] {
    u32::try_from(n).unwrap().to_le_bytes()
}

/// A small body in every format of text.
const TEXTS: [(&str, &str); 13] = [
    ("obj", include_str!("specimens/cube.obj")),
    ("off", include_str!("specimens/cube.off")),
    ("ply", include_str!("specimens/cube.ply")),
    ("vtk", include_str!("specimens/cube.vtk")),
    ("msh1", include_str!("specimens/version1.msh")),
    ("msh2", include_str!("specimens/version2.msh")),
    ("msh4", include_str!("specimens/version4.msh")),
    ("vtk tets", include_str!("specimens/cells.vtk")),
    ("vtk tets 5", include_str!("specimens/cells5.vtk")),
    ("vtk strip", include_str!("specimens/strip.vtk")),
    ("stl", include_str!("specimens/cube.stl")),
    ("vtu", include_str!("specimens/grid.vtu")),
    ("vtp", include_str!("specimens/surface.vtp")),
];

/// The cube as PLY and VTK with binary numbers.
fn binary_cube(cube: &Mesh, order: &str, big: bool) -> [Vec<u8>; 2] {
    let (head, _) = TEXTS[2].1.split_once("end_header\n").unwrap();
    let head = head.replace("ascii", order).replace("face 6", "face 12");
    let mut ply = (head + "end_header\n").into_bytes();
    let head = "# vtk DataFile Version 3.0\ncube\nBINARY\nDATASET POLYDATA\nPOINTS 8 float\n";
    let mut vtk = head.as_bytes().to_vec();
    for x in cube.vertices.iter().flat_map(|p| p.as_vec3().to_array()) {
        ply.extend(ordered(big, x.to_le_bytes()));
        vtk.extend(x.to_be_bytes());
    }
    vtk.extend(b"\nPOLYGONS 12 48\n");
    for t in &cube.triangles {
        ply.push(3);
        vtk.extend(3_u32.to_be_bytes());
        for v in t {
            ply.extend(ordered(big, v.to_le_bytes()));
            vtk.extend(v.to_be_bytes());
        }
    }
    [ply, vtk]
}

/// A small body in every format.
fn specimens() -> Vec<(&'static str, Vec<u8>)> {
    let texts = TEXTS.map(|(name, text)| (name, text.as_bytes().to_vec()));
    let mut all = texts.to_vec();
    let cube = parse_mesh(&all[0].1).unwrap().mesh;
    all.push(("binary stl", binary_stl(&cube)));
    for (order, big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let [ply, vtk] = binary_cube(&cube, order, big);
        all.extend([(order, ply), ("binary vtk", vtk)]);
    }
    let (vtu, vtp) = (TEXTS[11].1, TEXTS[12].1);
    all.extend([
        ("vtu base64", in_base64(vtu)),
        ("vtu zlib", in_zlib(vtu)),
        ("vtu raw", in_raw_bytes(vtu)),
        ("vtp base64", in_base64(vtp)),
        ("vtp zlib", in_zlib(vtp)),
        ("vtp raw", in_raw_bytes(vtp)),
    ]);
    all
}

#[test]
fn every_format_gives_the_same_cube() {
    for (name, bytes) in specimens() {
        let file = parse_mesh(&bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        let (mesh, report) = repaired(&file.mesh);
        let (kind, tetrahedra) = match name.split(' ').next().unwrap() {
            "msh1" | "msh2" | "msh4" => (Format::Gmsh, 1),
            "vtu" => (Format::VtkXml, 1),
            "vtp" => (Format::VtkXml, 0),
            "vtk" if name.contains("tets") => (Format::Vtk, 1),
            "vtk" => (Format::Vtk, 0),
            "obj" => (Format::Obj, 0),
            "off" => (Format::Off, 0),
            "stl" => (Format::StlAscii, 0),
            "binary" if name.ends_with("stl") => (Format::StlBinary, 0),
            "binary" => (Format::Vtk, 0),
            _ => (Format::Ply, 0),
        };
        let found = (file.format, file.tetrahedra.len());
        assert_eq!(found, (kind, tetrahedra), "{name}");
        let cube = file.mesh.vertices.len() > 4;
        let exact = if cube { 1.0 } else { 1.0 / 6.0 };
        assert_relative(name, mesh.volume(), exact, 0.0, 1e-12);
        assert_eq!(report.turned_triangles + report.turned_parts, 0, "{name}");
        // Byte order mark and other line ends change nothing in text.
        if bytes.is_ascii() && !bytes.contains(&0) {
            let text = String::from_utf8(bytes).unwrap();
            for other in [
                format!("\u{feff}{text}"),
                text.replace('\n', "\r\n"),
                text.replace('\n', "\r"),
                text.replacen('\n', "\r\n", 3),
            ] {
                let read = parse_mesh(other.as_bytes()).unwrap();
                assert_eq!(read.mesh, file.mesh, "{name}");
            }
        }
    }
}

#[test]
fn what_is_written_reads_back() {
    let s = crate::common::sample(&Primitive::Liver.into(), 600).unwrap();
    let file = parse_mesh(&s.to_vtk()).unwrap();
    assert_eq!(file.mesh.vertices, s.positions);
    assert_eq!(file.tetrahedra, s.tetrahedra);
    let (surface, node_of) = s.surface();
    assert_eq!(node_of.len(), s.report.surface_nodes);
    let file = parse_mesh(&ply_mesh(&surface)).unwrap();
    assert_eq!(file.mesh, surface);
    assert_relative("volume", surface.volume(), s.report.volume, 0.0, 1e-12);
}

#[test]
fn surfels_as_written_are_points_to_read() {
    let ball = Solid::from(Primitive::Ellipsoid {
        semi_axes: DVec3::new(1.0, 2.0, 3.0),
    });
    let surface = surface_mesh(&ball, 0.3).unwrap();
    let surfels = sample_surfels(&surface, 200, None);
    let file = std::env::temp_dir().join(format!("phyxel-points-{}.ply", std::process::id()));
    std::fs::write(&file, ply_surfels(&surfels)).unwrap();
    let read = read_point_cloud(&file);
    // Without normals, as scanners write it.
    let text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n\
                property float z\nend_header\n1 2 3\n4 5 6\n";
    std::fs::write(&file, text).unwrap();
    let bare = read_point_cloud(&file).unwrap();
    std::fs::write(&file, format!("\u{feff}{text}")).unwrap();
    assert_eq!(
        read_point_cloud(&file),
        Ok(bare.clone()),
        "a byte order mark"
    );
    std::fs::remove_file(&file).unwrap();
    let read = read.unwrap();
    assert_eq!(read.positions, surfels.positions);
    for (read, written) in read.normals.iter().zip(&surfels.normals) {
        assert!(read.distance(*written) < 1e-15, "{read} for {written}");
    }
    assert_eq!(read.normals.len(), surfels.normals.len());
    assert_eq!(bare.positions[1], DVec3::new(4.0, 5.0, 6.0));
    assert!(bare.normals.is_empty() && bare.areas == [0.0; 2]);
}

/// An error's position is in the file, or a word on the file as a whole.
fn check_place(name: &str, error: &ReadError, file: &[u8]) {
    match error.place {
        TextPlace::Line(line) => {
            let breaks = file.iter().filter(|b| matches!(b, b'\n' | b'\r'));
            assert!((1..=breaks.count() + 1).contains(&line), "{name}: {error}");
        }
        TextPlace::Byte(byte) => assert!(byte <= file.len(), "{name}: {error}"),
        TextPlace::File => {}
    }
}

/// Thousands of mutants: no panic, no endless loop, no allocation beyond what the file justifies;
/// what still reads can be repaired or is refused.
#[test]
fn mutated_files_never_panic() {
    let mut random = Random::new(7);
    let (mut read, mut refused, mut placed) = (0, 0, 0);
    let before = largest_reservation();
    for (name, bytes) in specimens() {
        for _ in 0..500 {
            let mutant = broken(bytes.clone(), &mut random);
            match parse_mesh(&mutant) {
                Ok(file) => {
                    read += 1;
                    let held = file.mesh.vertices.len() + file.mesh.triangles.len();
                    assert!(held <= 2 * mutant.len() + 8, "{name}: {held}");
                    let _ = repair(&file.mesh, &RepairSettings::default());
                }
                Err(error) => {
                    refused += 1;
                    check_place(name, &error, &mutant);
                    placed += usize::from(error.place != TextPlace::File);
                }
            }
        }
    }
    let counts = format!("{read} read, {refused} refused, {placed} of them at a place");
    println!("{counts}");
    assert!(
        read > 500 && refused > 2000 && 2 * placed > refused,
        "{counts}"
    );
    // The specimens are below 2 kB; what was ever reserved at once grew by the threads' arenas.
    if let (Some(before), Some(after)) = (before, largest_reservation()) {
        println!("reserved {before} MB before, {after} MB after");
        assert!(after < before + 300, "{before} MB before, {after} MB after");
    }
}

/// Most address space that this process ever held (MB), where the system reports it.
fn largest_reservation() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmPeak:"))?;
    let kilobytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kilobytes / 1024)
}
