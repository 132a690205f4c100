//! Nodes as ParaView reads them: a file per rank, and one that names them all.

use std::fmt::{Display, Write};
use std::fs;
use std::io;
use std::path::Path;

use phyxel_elastic::von_mises_stress;

use crate::share::Share;
use crate::wire::flat;

/// Fields of the nodes, with their numbers of components.
const FIELDS: [(&str, usize); 3] = [
    ("rest_position_m", 3),
    ("velocity_m_s", 3),
    ("von_mises_stress_Pa", 1),
];

fn piece(rank: usize) -> String {
    format!("nodes-{rank:04}.vtu")
}

fn array(text: &mut String, attributes: &str, values: impl Iterator<Item = impl Display>) {
    let _ = writeln!(text, "<DataArray {attributes} format=\"ascii\">");
    for value in values {
        let _ = write!(text, "{value} ");
    }
    text.push_str("\n</DataArray>\n");
}

fn numbers(text: &mut String, name: &str, components: usize, values: &[f64]) {
    let attributes =
        format!("type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"{components}\"");
    array(
        text,
        &attributes,
        values.iter().map(|value| format!("{value:e}")),
    );
}

/// Writes a rank's own nodes, each a vertex, with rest position, velocity and von Mises stress.
pub(crate) fn write_piece(share: &Share, folder: &Path, rank: usize) -> io::Result<()> {
    let (own, motion) = (share.own(), &share.motion);
    let n = own.len();
    let stress = own
        .clone()
        .map(|node| von_mises_stress(share.elastic.cauchy_stress(node)));
    let stress: Vec<f64> = stress.collect();
    let (rest, positions) = (&share.package.rest[own], share.smoothed_positions());
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" \
         byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n",
    );
    let _ = writeln!(
        text,
        "<Piece NumberOfPoints=\"{n}\" NumberOfCells=\"{n}\">\n<PointData>"
    );
    let fields = [flat(rest), flat(motion.velocities()), &stress[..]];
    for ((name, components), values) in FIELDS.into_iter().zip(fields) {
        numbers(&mut text, name, components, values);
    }
    text.push_str("</PointData>\n<Points>\n");
    numbers(&mut text, "position_m", 3, flat(&positions));
    text.push_str("</Points>\n<Cells>\n");
    let ones = std::iter::repeat_n(1, n);
    array(&mut text, "type=\"Int64\" Name=\"connectivity\"", 0..n);
    array(&mut text, "type=\"Int64\" Name=\"offsets\"", 1..=n);
    array(&mut text, "type=\"UInt8\" Name=\"types\"", ones);
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
