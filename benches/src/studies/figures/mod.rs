//! The dissertation's figures that no other study draws, each beside what it shows there.

mod bodies;
mod canvas;
mod clouds;
mod plane;
mod skins;
mod space;

use phyxel_splat::Frame;

use self::canvas::Image;
use super::splat::sheet::{Panel, sheet};
use crate::report::{Picture, Report};
use crate::{Effort, StudyError};

/// A panel of a figure.
struct Drawn {
    number: u32,
    caption: String,
    frame: Frame,
}

impl Drawn {
    fn new(number: u32, caption: impl Into<String>, image: &Image) -> Self {
        Self {
            number,
            caption: caption.into(),
            frame: image.frame(),
        }
    }
}

/// The figures of a table: number of a figure and its panels, what it shows there, and where phyxel's differs.
macro_rules! figures {
    ($($number:literal $there:literal => $here:literal;)*) => {
        &[$(($number, $there, $here)),*]
    };
}

const FIGURES: &[(u32, &str, &str)] = figures! {
    18 "The weight of a node beside a cut by the visibility criterion and by diffraction."
        => "The same two with the rules of this program: the shadow of a straight cut in (a), the way round its tip in (b).";
    20 "d1+ of a segment from t = 0 to 1."
        => "The same function, from the grid of that segment.";
    21 "d2 and phi of a segment as surfaces."
        => "The same.";
    22 "Contours of phi of a segment."
        => "The same, with its tips at 0.3 and 0.7.";
    23 "Enrichments of consecutive segments, multiplied: wrong beside the cut. With the cut that goes through, one side should be 1 and the other 0."
        => "The same product for a cut that ends inside and one that goes through: the side that should be 1 falls beside the cut and is below 1 nearly everywhere.";
    24 "The common frame turns as the cut grows."
        => "The same; directions are averaged as vectors, not as angles (eq. (40)).";
    25 "d1+ of the series of segments."
        => "The same.";
    26 "Regions of the segments."
        => "The same.";
    27 "s by the region's segment."
        => "The same.";
    28 "The enrichment of the series for two cuts."
        => "The same, and below each what the default rule makes of it for a node above the cut: no pair ahead of the tip is weakened.";
    29 "A strip in space and its projection to the common plane."
        => "The same for a strip of phyxel.";
    30 "Separators between the groups of triangles."
        => "The same in the common plane: lines through the edges of the blade, an arrow to the side of the next group.";
    31 "Regions of lattice points in space."
        => "The same, on three faces of the lattice's box.";
    32 "d2+ in space."
        => "The same, in three slices.";
    33 "s in space."
        => "The same, in three slices.";
    34 "Contours of phi, view 1."
        => "The same, across z.";
    35 "Contours of phi, view 2."
        => "The same, across x.";
    36 "Contours of phi, view 3."
        => "The same, along the cut.";
    37 "Level sets 1, 0.5 and 0 of the enrichment."
        => "The same at 0.98, 0.5 and 0.02, of (1 + phi) / 2: those of 1 and 0 fill prisms beside the cut, of which the hull is drawn; that of 0.5 continues from the cut's border.";
    43 "An alpha texture of eq. (50) on a polygon makes an oriented splat."
        => "One splat drawn with that weight, and without; there is no texture and no polygon, the weight is computed per pixel.";
    45 "Pixels of several splats land on one place, and the steps in which a graphics card blends them."
        => "The result of each way of drawing for three splats in one plane: from back to front each hides what lies under it; disks and three passes blend alike there. The card's buffers have no counterpart.";
    59 "Surfels follow the averaged displacements of their nodes; not drawn there."
        => "A bar twisted by 150 degrees, carried so (with its normals from the same displacements) and by the default: it is thinner, as every surfel lags behind.";
    62 "Points sampled uniformly on pairs of triangles of a cut, by density."
        => "The same for two densities; by a low-discrepancy sequence, which keeps the density asked for.";
    64 "The points that the inside test keeps."
        => "The same samples by the dissertation's own test of the two nearest surfels, in a ball.";
    65 "Inside by the two nearest oriented points: behind both at a convex rim, behind one at least at a concave one."
        => "That test in sections of three bodies: inside (green) and outside (grey) as they are, and what it misjudges (red): places outside, off the rims of the notched body and of a plate thinner than its surfels are apart.";
    66 "A cut meets the spherical support of a node."
        => "The nodes of a lattice whose supports a cut meets, by looking d3 up.";
    67 "d3 in space."
        => "The same, in three slices.";
    68 "Level sets 0.5 and 1.5 of d3."
        => "The same, in distances of nodes, taken as a fifth of the cut's length.";
    74 "The block of 1,408 regularly distributed nodes hangs; neighbours, 16 at most, as lines."
        => "The scenes block-1408 and block-1408-dissertation, with 16 neighbours, at rest under their weight: 8 x 8 x 22 nodes, and the pairs that they see.";
    75 "The block of 436 nodes from tetrahedra; neighbours are not limited."
        => "The scenes block-436 and block-436-dissertation, with as many neighbours as its supports hold; with the default's tetrahedra, 441 nodes.";
    76 "The block's splats, scaled down and coloured by curvature, from blue (low) to red (high)."
        => "By both models, disks at half their radius; the curvature of eq. (56) from the 12 nearest as they lie, from violet (flat) to yellow (edges).";
    77 "The block drawn with splats."
        => "By both models, drawn in the default way.";
    78 "The block cut once; scaled-down splats, curvature computed again."
        => "The same, by both models. Beside it, nearer and in the tissue's colour, disks at 0.4 of radii by curvature: those of before the cut, and those measured again beside it and on the new skin.";
    79 "The block cut a second time: a piece comes off."
        => "The same, by both models, 0.3 s after the second cut: the piece has fallen out of the picture.";
    80 "The cut block drawn with splats; artefacts at sharp turns of the normals."
        => "The same, by both models; splats are clipped at edges and cuts, so these artefacts are not there. Where the dissertation's model frays at the end of a cut, splats do.";
    81 "Nodes of the liver, 181 of them, with 21 neighbours each in the mean."
        => "The scenes liver-181 and liver-181-dissertation: another liver.";
    82 "The liver's splats, scaled down and coloured by curvature."
        => "The same two scenes, coloured as in figure 76.";
    83 "The liver drawn with splats, uncut."
        => "The same scenes before their cuts.";
    84 "A cut of the liver: scaled-down and full splats."
        => "The same scenes, cut once; in the dissertation's model the cut gapes far more, and its skin is drawn out and torn. Where a cut is closed, as in the default's, surfels of both its sides lie among the nearest and curvature is large.";
};

pub(crate) fn run(effort: Effort) -> Result<Report, StudyError> {
    let mut drawn = plane::draw()?;
    drawn.extend(space::draw()?);
    drawn.extend(skins::draw()?);
    drawn.extend(bodies::draw(effort)?);
    let mut pictures = Vec::new();
    for &(number, there, here) in FIGURES {
        let (panels, rest): (Vec<_>, Vec<_>) =
            drawn.into_iter().partition(|panel| panel.number == number);
        drawn = rest;
        let panels: Vec<Panel> = panels
            .into_iter()
            .map(|panel| Panel::new(panel.caption, panel.frame))
            .collect();
        // Four are two of each model.
        let columns = match panels.len() {
            0 | 1 => 1,
            2 | 4 => 2,
            _ => 3,
        };
        let title = match number {
            43 => "Figures 43 and 44".to_owned(),
            45 => "Figures 45 and 46".to_owned(),
            59 => "Equation (59)".to_owned(),
            _ => format!("Figure {number}"),
        };
        pictures.push(Picture {
            name: format!("figure{number}"),
            title: format!("{title}. There: {there} Here: {here}"),
            frame: sheet(panels, columns),
        });
    }
    let (plots, tables) = clouds::draw()?;
    Ok(Report {
        pictures,
        ..Report::new(&[WORDS], tables, plots)
    })
}

const WORDS: &str = "Figures of Aras 2014 that show data; sketches are left out. Its figures 41, 42, 47, 48, 50, 53 to 55 \
     are drawn by the study splat, 69 to 73 by hertz, and the frames per second of chapter 6 are in chapter6. \
     Figure 5: there and here SPH misses a constant, most at the ends, and moving least squares do not. \
     Figure 6: SPH gets worse as nodes lose their evenness. Figure 7: a quadratic basis reproduces a parabola, a linear \
     one does not. Figure 11: the kernel of eq. (15). Figures 14 and 16: data of ours, as those there are random and not \
     given; beside the radius 5 of the text 3 and 7. Figures 15 and 17: what each node gives to the ninth, weight \
     and shape function, as there; the latter sum up to 1. Table 1: the same cells are singular, the error grows with the \
     radius, quadratic below linear.";
