//! Formats, and mutated files of each.

use crate::common::{binary_stl, repaired};
use glam::DVec3;
use phyxel_discretize::{
    Format, Primitive, RepairSettings, Solid, TextPlace, parse_mesh, ply_mesh, ply_surfels,
    read_point_cloud, repair, sample_surfels, surface_mesh,
};
use testkit::cloud::Random;
use testkit::tol::assert_relative;

const TETRAHEDRON: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The bytes of a number, given little-endian, in either order.
fn ordered<const N: usize>(big: bool, mut little: [u8; N]) -> [u8; N] {
    if big {
        little.reverse();
    }
    little
}

fn msh2_binary(big: bool) -> Vec<u8> {
    let int = |v: i32| ordered(big, v.to_le_bytes());
    let mut out = b"$MeshFormat\n2.2 1 8\n".to_vec();
    out.extend(int(1));
    out.extend(b"\n$EndMeshFormat\n$Nodes\n4\n");
    for (k, p) in (10..).zip(TETRAHEDRON) {
        out.extend(int(k));
        out.extend(p.iter().flat_map(|x| ordered(big, x.to_le_bytes())));
    }
    out.extend(b"\n$EndNodes\n$Elements\n2\n");
    // A line (type 1) of two tags, then a tetrahedron.
    for v in [1, 1, 2, 7, 0, 1, 10, 11, 4, 1, 2, 8, 0, 1, 10, 11, 12, 13] {
        out.extend(int(v));
    }
    out.extend(b"\n$EndElements\n");
    out
}

fn msh4_binary() -> Vec<u8> {
    let mut out = b"$MeshFormat\n4.1 1 8\n".to_vec();
    out.extend(1_i32.to_le_bytes());
    out.extend(b"\n$EndMeshFormat\n$Nodes\n");
    let ints = |out: &mut Vec<u8>, v: &[i32]| v.iter().for_each(|v| out.extend(v.to_le_bytes()));
    let longs = |out: &mut Vec<u8>, v: &[u64]| v.iter().for_each(|v| out.extend(v.to_le_bytes()));
    longs(&mut out, &[1, 4, 1, 4]);
    ints(&mut out, &[3, 1, 0]);
    longs(&mut out, &[4, 1, 2, 3, 4]);
    out.extend(TETRAHEDRON.iter().flatten().flat_map(|x| x.to_le_bytes()));
    out.extend(b"\n$EndNodes\n$Elements\n");
    longs(&mut out, &[1, 1, 1, 1]);
    ints(&mut out, &[3, 1, 4]);
    longs(&mut out, &[1, 1, 1, 2, 3, 4]);
    out.extend(b"\n$EndElements\n");
    out
}

/// A VTK XML file as text, and the bytes of its arrays in their order in the file.
struct Xml {
    text: String,
    arrays: Vec<Vec<u8>>,
}

/// Name and values.
type List<'a> = (&'a str, &'a [u8]);

/// The tetrahedron: points, then the lists of integers of `cells`, each with type and name.
fn xml(kind: &str, counts: &str, cells: &[(&str, &[List<'_>])]) -> Xml {
    let points = TETRAHEDRON.iter().flatten();
    let mut arrays = vec![points.flat_map(|x| x.to_le_bytes()).collect()];
    let mut lists = String::new();
    for (section, own) in cells {
        lists += &format!("<{section}>\n");
        for (name, values) in *own {
            let words: Vec<String> = values.iter().map(ToString::to_string).collect();
            let (kind, wide) = if *name == "types" {
                ("UInt8", 1)
            } else {
                ("Int32", 4)
            };
            lists += &format!(
                "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">{}</DataArray>\n",
                words.join(" ")
            );
            let bytes = |v: &u8| i32::from(*v).to_le_bytes().into_iter().take(wide);
            arrays.push(values.iter().flat_map(bytes).collect());
        }
        lists += &format!("</{section}>\n");
    }
    let text = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"0.1\" \
        byte_order=\"LittleEndian\">\n<{kind}>\n<Piece NumberOfPoints=\"4\" {counts}>\n\
        <PointData></PointData>\n<Points>\n<DataArray type=\"Float64\" NumberOfComponents=\"3\" \
        format=\"ascii\">\n0 0 0 1 0 0 0 1 0 0 0 1\n</DataArray>\n</Points>\n{lists}</Piece>\n\
        </{kind}>\n</VTKFile>\n"
    );
    Xml { text, arrays }
}

/// One cell of an unstructured grid.
fn vtu() -> Xml {
    let own: [List<'_>; 3] = [
        ("connectivity", &[0, 1, 2, 3]),
        ("offsets", &[4]),
        ("types", &[10]),
    ];
    xml(
        "UnstructuredGrid",
        "NumberOfCells=\"1\"",
        &[("Cells", &own)],
    )
}

/// Polydata: three faces as polygons, the fourth as a strip, and vertices that are no faces.
fn vtp() -> Xml {
    let counts = "NumberOfVerts=\"1\" NumberOfLines=\"0\" NumberOfStrips=\"1\" NumberOfPolys=\"2\"";
    let sections: [(&str, &[List<'_>]); 4] = [
        ("Verts", &[("connectivity", &[3]), ("offsets", &[1])]),
        ("Lines", &[("connectivity", &[]), ("offsets", &[])]),
        // 0 2 1, then 1 2 3 turned.
        (
            "Strips",
            &[("connectivity", &[0, 2, 1, 3]), ("offsets", &[4])],
        ),
        (
            "Polys",
            &[("connectivity", &[0, 1, 3, 0, 3, 2]), ("offsets", &[3, 6])],
        ),
    ];
    xml("PolyData", counts, &sections)
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

impl Xml {
    /// The text with the attributes and contents of its arrays replaced.
    fn with(&self, mut array: impl FnMut(&[u8]) -> (String, String)) -> String {
        let mut pieces = self.text.split("format=\"ascii\">");
        let mut out = pieces.next().unwrap().to_owned();
        for (piece, bytes) in pieces.zip(&self.arrays) {
            let (attributes, content) = array(bytes);
            out += &format!("{attributes}>{content}<");
            out += piece.split_once('<').unwrap().1;
        }
        out
    }

    fn base64(&self) -> Vec<u8> {
        let text = self.with(|data| {
            let content = base64(&[&word(data.len()), data].concat());
            ("format=\"binary\"".to_owned(), content)
        });
        text.into_bytes()
    }

    fn zlib(&self) -> Vec<u8> {
        let text = self.with(|data| {
            let packed = miniz_oxide::deflate::compress_to_vec_zlib(data, 6);
            let header = [1, data.len(), data.len(), packed.len()].map(word).concat();
            let content = base64(&header) + &base64(&packed);
            ("format=\"binary\"".to_owned(), content)
        });
        let with = "<VTKFile compressor=\"vtkZLibDataCompressor\"";
        text.replace("<VTKFile", with).into_bytes()
    }

    fn raw(&self) -> Vec<u8> {
        let mut appended = Vec::new();
        let text = self.with(|data| {
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
}

fn word(n: usize) -> [u8; 4] {
    u32::try_from(n).unwrap().to_le_bytes()
}

/// A small body in every format.
fn specimens() -> Vec<(&'static str, Vec<u8>)> {
    let obj = "# cube\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
        f 4 3 2 1\nf 5/1 6/1 7/1 8/1\nf 1//2 2//2 6//2 5//2\nf -6 -5 -1 -2\nf 2 3 7 6\nf 1 5 8 4\n";
    let off = "OFF\n# cube\n8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n\
        4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 2 3 7 6\n4 1 2 6 5\n4 0 4 7 3\n";
    let ply = "ply\nformat ascii 1.0\ncomment cube\nelement vertex 8\nproperty float x\n\
        property float y\nproperty float z\nelement face 6\nproperty list uchar int vertex_indices\n\
        end_header\n";
    let rest = off.split_once("8 6 0\n").unwrap().1;
    let vtk = format!(
        "# vtk DataFile Version 3.0\ncube\nASCII\nDATASET POLYDATA\nPOINTS 8 float\n{}",
        rest.replacen("4 3 2 1 0", "POLYGONS 6 30\n4 3 2 1 0", 1)
    );
    let msh1 = "$NOD\n4\n10 0 0 0\n20 1 0 0\n30 0 1 0\n45 0 0 1\n$ENDNOD\n$ELM\n2\n\
        1 2 1 1 3 10 20 30\n2 4 1 1 4 10 20 30 45\n$ENDELM\n";
    let msh2 = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n\
        $EndNodes\n$Elements\n1\n1 4 2 0 1 1 2 3 4\n$EndElements\n";
    let msh4 = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n\
        1 0 0\n0 1 0\n0 0 1\n$EndNodes\n$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n";
    let tets = "# vtk DataFile Version 2.0\ntet\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n\
        0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n";
    let tets5 = "# vtk DataFile Version 5.1\ntet\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n\
        0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 2 4\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY vtktypeint64\n\
        0 1 2 3\nCELL_TYPES 1\n10\n";
    let strip = "# vtk DataFile Version 3.0\ntet\nASCII\nDATASET POLYDATA\nPOINTS 4 double\n\
        0 0 0 1 0 0 0 1 0 0 0 1\nTRIANGLE_STRIPS 1 7\n6 0 2 1 3 0 2\n";
    let mut all = vec![
        ("obj", obj.as_bytes().to_vec()),
        ("off", off.as_bytes().to_vec()),
        ("ply", (ply.to_owned() + rest).into_bytes()),
        ("vtk", vtk.into_bytes()),
        ("msh1", msh1.as_bytes().to_vec()),
        ("msh2", msh2.as_bytes().to_vec()),
        ("msh4", msh4.as_bytes().to_vec()),
        ("vtk tets", tets.as_bytes().to_vec()),
        ("vtk tets 5", tets5.as_bytes().to_vec()),
        ("vtk strip", strip.as_bytes().to_vec()),
    ];
    let cube = parse_mesh(obj.as_bytes()).unwrap().mesh;
    let mut text = "solid cube\n".to_owned();
    for t in 0..12 {
        text += "facet normal 0 0 0\n outer loop\n";
        for p in cube.corners(t) {
            text += &format!("  vertex {} {} {}\n", p.x, p.y, p.z);
        }
        text += " endloop\nendfacet\n";
    }
    all.push(("stl", (text + "endsolid cube\n").into_bytes()));
    all.push(("binary stl", binary_stl(&cube)));
    for big in [false, true] {
        let word = if big {
            "binary_big_endian"
        } else {
            "binary_little_endian"
        };
        let mut bytes = ply.replace("ascii", word).into_bytes();
        let head = "# vtk DataFile Version 3.0\ncube\nBINARY\nDATASET POLYDATA\nPOINTS 8 float\n";
        let mut vtk = head.as_bytes().to_vec();
        for p in &cube.vertices {
            for x in p.as_vec3().to_array() {
                bytes.extend(ordered(big, x.to_le_bytes()));
                vtk.extend(x.to_be_bytes());
            }
        }
        vtk.extend(b"\nPOLYGONS 12 48\n");
        let mut faces = bytes.clone();
        for t in &cube.triangles {
            faces.push(3);
            vtk.extend(3_u32.to_be_bytes());
            for v in t {
                faces.extend(ordered(big, v.to_le_bytes()));
                vtk.extend(v.to_be_bytes());
            }
        }
        let count = b"element face 6";
        let at = faces.windows(count.len()).position(|w| w == count).unwrap();
        faces.splice(at..at + count.len(), b"element face 12".iter().copied());
        all.push((word, faces));
        all.push(("binary vtk", vtk));
    }
    for (names, xml) in [
        (["vtu", "vtu base64", "vtu zlib", "vtu raw"], vtu()),
        (["vtp", "vtp base64", "vtp zlib", "vtp raw"], vtp()),
    ] {
        let files = [xml.base64(), xml.zlib(), xml.raw()];
        all.push((names[0], xml.text.into_bytes()));
        all.extend(names[1..].iter().copied().zip(files));
    }
    all.extend([
        ("msh2 binary", msh2_binary(false)),
        ("msh2 binary big", msh2_binary(true)),
        ("msh4 binary", msh4_binary()),
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
    let bare = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n\
                property float z\nend_header\n1 2 3\n4 5 6\n";
    std::fs::write(&file, bare).unwrap();
    let bare = read_point_cloud(&file).unwrap();
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

/// Thousands of mutants: no panic, no endless loop, no allocation beyond what the file justifies;
/// what still reads can be repaired or is refused.
#[test]
fn mutated_files_never_panic() {
    let mut random = Random::new(7);
    let mut pick = |n: usize| usize::try_from(random.bits() % n.max(1) as u64).unwrap();
    let words: [&[u8]; 10] = [
        b"4294967295",
        b"200000000",
        b"-1",
        b"99999999999999999999",
        b"nan",
        b"inf",
        b"1e400",
        b"0",
        b"\r",
        b"\xff",
    ];
    let (mut read, mut refused, mut placed) = (0, 0, 0);
    let before = largest_reservation();
    for (name, bytes) in specimens() {
        for round in 0..500 {
            let mut mutant = bytes.clone();
            for _ in 0..=pick(4) {
                let at = pick(mutant.len());
                match (round + pick(5)) % 5 {
                    0 => mutant.truncate(at.max(1)),
                    1 => mutant[at] ^= 1 << pick(8),
                    2 => mutant[at] = u8::try_from(pick(256)).unwrap(),
                    3 => {
                        // Replaces a word, most often a number.
                        let start = mutant[..at].iter().rposition(u8::is_ascii_whitespace);
                        let start = start.map_or(0, |s| s + 1);
                        let length = mutant[start..].iter().position(u8::is_ascii_whitespace);
                        let end = start + length.unwrap_or(mutant.len() - start);
                        mutant.splice(start..end, words[pick(10)].iter().copied());
                    }
                    _ => {
                        let end = (at + pick(40)).min(mutant.len());
                        let piece = mutant[at..end].to_vec();
                        let to = pick(mutant.len());
                        mutant.splice(to..to, piece);
                    }
                }
                if mutant.is_empty() {
                    mutant.push(b'v');
                }
            }
            match parse_mesh(&mutant) {
                Ok(file) => {
                    read += 1;
                    let held = file.mesh.vertices.len() + file.mesh.triangles.len();
                    assert!(held <= 2 * mutant.len() + 8, "{name}: {held}");
                    let _ = repair(&file.mesh, &RepairSettings::default());
                }
                Err(error) => {
                    refused += 1;
                    // The position is in the file, or a word on the file as a whole.
                    match error.place {
                        TextPlace::Line(line) => {
                            let breaks = mutant.iter().filter(|b| matches!(b, b'\n' | b'\r'));
                            assert!((1..=breaks.count() + 1).contains(&line), "{name}: {error}");
                        }
                        TextPlace::Byte(byte) => assert!(byte <= mutant.len(), "{name}: {error}"),
                        TextPlace::File => {}
                    }
                    placed += usize::from(error.place != TextPlace::File);
                }
            }
        }
    }
    println!("{read} read, {refused} refused, {placed} of them at a place");
    assert!(
        read > 500 && refused > 2000 && 2 * placed > refused,
        "{read} read, {refused} refused, {placed} of them at a place"
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
