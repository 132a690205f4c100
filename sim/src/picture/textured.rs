//! Images that the mesh file of a body brings along.

use std::sync::Arc;

use glam::{DVec2, Vec2};
use phyxel_discretize::{Hierarchy, read_textured_mesh};
use phyxel_splat::{DrawnTissue, Surfels, TexturePlace};
use rayon::prelude::*;

use super::{SkinProblem, image_of};
use crate::scene::{Body, Shape};

/// Lays the images of a body's mesh file on its surface, and colours surfels by them.
pub(super) fn lay(placed: &Body, skin: &mut DrawnTissue) -> Result<(), SkinProblem> {
    let Shape::Mesh {
        file, scale, up, ..
    } = &placed.shape
    else {
        return Ok(());
    };
    let mut textured = read_textured_mesh(file)?;
    let placed = placed.placement().of_file(*scale, *up);
    placed.place(&mut textured.mesh.vertices);
    let images = textured
        .images
        .iter()
        .map(|file| image_of(file).map(Arc::new));
    let images = images.collect::<Result<Vec<_>, _>>()?;
    let hierarchy = Hierarchy::new(&textured.mesh);
    let surfels = skin.tissue.surfels();
    let samples = surfels.positions.par_iter().zip(&surfels.normals);
    let places: Vec<Option<TexturePlace>> = samples
        .map(|(&x, &normal)| {
            let place = textured.place(&hierarchy, x, Surfels::tangents(normal).into())?;
            // Images are numbered from the top, texture coordinates from the bottom.
            let down = |at: DVec2| Vec2::new(at.as_vec2().x, -at.as_vec2().y);
            Some(TexturePlace {
                image: place.image,
                at: Vec2::Y + down(place.at),
                along: place.along.map(down),
            })
        })
        .collect();
    skin.lay(images, places);
    Ok(())
}
