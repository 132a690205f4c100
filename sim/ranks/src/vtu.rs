//! Nodes as ParaView reads them: a file per rank, and one that names them all.

use std::fmt::Write;
use std::fs;
use std::io;
use std::path::Path;

use glam::DVec3;
use phyxel_elastic::von_mises_stress;

use crate::share::Share;

/// Fields of the nodes, with their numbers of components.
const FIELDS: [(&str, usize); 3] = [
    ("rest_position_m", 3),
    ("velocity_m_s", 3),
    ("von_mises_stress_Pa", 1),
];

fn piece(rank: usize) -> String {
    format!("nodes-{rank:04}.vtu")
}

fn array(text: &mut String, name: &str, components: usize, values: impl Iterator<Item = f64>) {
    let _ = writeln!(
        text,
        "<DataArray type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">"
    );
    for value in values {
        let _ = write!(text, "{value:e} ");
    }
    text.push_str("\n</DataArray>\n");
}

fn integers(text: &mut String, kind: &str, name: &str, values: impl Iterator<Item = usize>) {
    let _ = writeln!(
        text,
        "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">"
    );
    for value in values {
        let _ = write!(text, "{value} ");
    }
    text.push_str("\n</DataArray>\n");
}

/// Writes a rank's own nodes, each a vertex, with rest position, velocity and von Mises stress.
pub(crate) fn write_piece(share: &Share, folder: &Path, rank: usize) -> io::Result<()> {
    let (own, motion) = (share.own(), &share.motion);
    let n = own.len();
    let numbers =
        |list: &'_ [DVec3]| -> Vec<f64> { list.iter().flat_map(|v| v.to_array()).collect() };
    let stress = own
        .clone()
        .map(|node| von_mises_stress(share.elastic.cauchy_stress(node)));
    let fields: [Vec<f64>; 3] = [
        numbers(&share.package.rest[own.clone()]),
        numbers(motion.velocities()),
        stress.collect(),
    ];
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" \
         byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n",
    );
    let _ = writeln!(
        text,
        "<Piece NumberOfPoints=\"{n}\" NumberOfCells=\"{n}\">\n<PointData>"
    );
    for ((name, components), values) in FIELDS.into_iter().zip(fields) {
        array(&mut text, name, components, values.into_iter());
    }
    text.push_str("</PointData>\n<Points>\n");
    array(
        &mut text,
        "position_m",
        3,
        numbers(&share.smoothed_positions()).into_iter(),
    );
    text.push_str("</Points>\n<Cells>\n");
    integers(&mut text, "Int64", "connectivity", 0..n);
    integers(&mut text, "Int64", "offsets", 1..=n);
    integers(&mut text, "UInt8", "types", std::iter::repeat_n(1, n));
    text.push_str("</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n");
    fs::write(folder.join(piece(rank)), text)
}

/// Writes the file that names the pieces of all ranks.
pub(crate) fn write_index(folder: &Path, ranks: usize) -> io::Result<()> {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" \
         byte_order=\"LittleEndian\">\n<PUnstructuredGrid GhostLevel=\"0\">\n<PPointData>\n",
    );
    for (name, components) in FIELDS {
        let _ = writeln!(
            text,
            "<PDataArray type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"{components}\"/>"
        );
    }
    text.push_str(
        "</PPointData>\n<PPoints>\n<PDataArray type=\"Float64\" Name=\"position_m\" \
         NumberOfComponents=\"3\"/>\n</PPoints>\n",
    );
    for rank in 0..ranks {
        let _ = writeln!(text, "<Piece Source=\"{}\"/>", piece(rank));
    }
    text.push_str("</PUnstructuredGrid>\n</VTKFile>\n");
    fs::write(folder.join("nodes.pvtu"), text)
}
