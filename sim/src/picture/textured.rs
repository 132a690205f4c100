//! Images that the mesh file of a body brings along.

use std::sync::Arc;

use glam::{DVec2, Vec2, Vec3};
use phyxel_discretize::{Hierarchy, read_textured_mesh};
use phyxel_splat::{Image, Surfels, TexturePlace, Tissue};
use rayon::prelude::*;

use super::image_of;
use crate::scene::{Body, Shape};
use crate::world::BodyProblem;

/// Lays the images of a body's mesh file on its surface, and colours surfels by them; the images.
pub(super) fn lay(
    placed: &Body,
    tissue: &mut Tissue,
    colors: &mut [Vec3],
) -> Result<Vec<Arc<Image>>, BodyProblem> {
    let Shape::Mesh {
        file, scale, up, ..
    } = &placed.shape
    else {
        return Ok(Vec::new());
    };
    let mut textured = read_textured_mesh(file)?;
    let (turn, scale) = (placed.turn() * up.rotation(), placed.scale * *scale);
    for vertex in &mut textured.mesh.vertices {
        *vertex = turn * (*vertex * scale) + placed.position;
    }
    let images = textured
        .images
        .iter()
        .map(|file| image_of(file).map(Arc::new));
    let images = images.collect::<Result<Vec<_>, _>>()?;
    let hierarchy = Hierarchy::new(&textured.mesh);
    let surfels = tissue.surfels();
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
    for ((to, place), radius) in colors.iter_mut().zip(&places).zip(&surfels.radii) {
        if let Some(place) = place {
            *to = color(&images, place, *radius);
        }
    }
    tissue.set_places(places);
    Ok(images)
}

/// Mean colour of what a disk of a radius (m) shows of its image: for pictures that light splats one by one,
/// and for whoever gets surfels and no images.
#[allow(clippy::cast_possible_truncation, reason = "a size on the screen")]
pub(super) fn color(images: &[Arc<Image>], place: &TexturePlace, radius: f64) -> Vec3 {
    let [u, v] = place.along.map(|along| along.length());
    let footprint = u.max(v) * radius as f32;
    images
        .get(usize::from(place.image))
        .map_or(Vec3::ONE, |image| image.color(place.at, footprint))
}
