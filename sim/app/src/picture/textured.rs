//! Images that the mesh file of a body brings along.

use std::path::Path;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2};
use phyxel_discretize::{Hierarchy, Mesh};
use phyxel_splat::{DrawnTissue, Surfel, TexturePlace};
use rayon::prelude::*;
use tobj::LoadOptions;

use super::{SkinProblem, image_of};
use phyxel::scene::{Body, Shape};

/// Lays the images of a body's OBJ file on its surface, and colours surfels by them.
pub(super) fn lay(placed: &Body, skin: &mut DrawnTissue) -> Result<(), SkinProblem> {
    let Shape::Mesh {
        file, scale, up, ..
    } = &placed.shape
    else {
        return Ok(());
    };
    let mut textured = Textured::read(file)?;
    let placed = placed.placement().of_file(*scale, *up);
    placed.place(&mut textured.mesh.vertices);
    let folder = file.parent().unwrap_or_else(|| Path::new(""));
    let images = textured.images.iter();
    let images = images.map(|name| image_of(&folder.join(name)).map(Arc::new));
    let images = images.collect::<Result<Vec<_>, _>>()?;
    let hierarchy = Hierarchy::new(&textured.mesh);
    let place = |surfel: &Surfel| {
        let tangents = Surfel::tangents(surfel.normal).into();
        textured.place(&hierarchy, surfel.position, tangents)
    };
    let surfels = skin.tissue.surfels().par_iter();
    let places: Vec<Option<TexturePlace>> = surfels.map(place).collect();
    skin.lay(images, places);
    Ok(())
}

/// A surface with the images that colour it.
#[derive(Default)]
struct Textured {
    mesh: Mesh,
    /// Texture coordinates of the corners of each triangle, u to the right and v up.
    coordinates: Vec<[DVec2; 3]>,
    /// Image of each triangle, if it has one.
    image: Vec<Option<u16>>,
    /// Image files, relative to the mesh file.
    images: Vec<String>,
}

impl Textured {
    /// Reads an OBJ file: `vt`, and the images that `map_Kd` of its materials (`usemtl`, `mtllib`) names.
    fn read(file: &Path) -> Result<Self, SkinProblem> {
        let options = LoadOptions {
            triangulate: true,
            ..LoadOptions::default()
        };
        let problem = |source| SkinProblem::Texture {
            file: file.to_owned(),
            source,
        };
        let (models, materials) = tobj::load_obj(file, &options).map_err(problem)?;
        let materials = materials.map_err(problem)?;
        let mut out = Self::default();
        for model in models {
            let mesh = model.mesh;
            let material = mesh.material_id.and_then(|id| materials.get(id));
            let image = material.and_then(|material| material.diffuse_texture.as_ref());
            let image = image.map(|image| {
                let known = out.images.iter().position(|known| known == image);
                known.unwrap_or_else(|| {
                    out.images.push(image.clone());
                    out.images.len() - 1
                })
            });
            let image = image.and_then(|image| u16::try_from(image).ok());
            let first = out.mesh.vertices.len();
            let points = mesh.positions.chunks_exact(3);
            out.mesh.vertices.extend(points.map(DVec3::from_slice));
            for (triangle, corners) in mesh.indices.chunks_exact(3).enumerate() {
                let at = [0, 1, 2].map(|k| {
                    let number = *mesh.texcoord_indices.get(3 * triangle + k)? as usize;
                    let pair = mesh.texcoords.get(2 * number..2 * number + 2)?;
                    Some(DVec2::from_slice(pair))
                });
                let all = at.iter().all(Option::is_some);
                out.image.push(image.filter(|_| all));
                out.coordinates.push(at.map(Option::unwrap_or_default));
                let vertex = |k: usize| u32::try_from(first).map_or(u32::MAX, |f| f + corners[k]);
                out.mesh.triangles.push([0, 1, 2].map(vertex));
            }
        }
        if out.image.iter().all(Option::is_none) {
            return Err(SkinProblem::NoTexture(file.to_owned()));
        }
        Ok(out)
    }

    /// Where the surface nearest to `x` (m) lies in an image, and how that changes along two directions (1/m),
    /// by the linear map of the nearest triangle; `None` where no image lies.
    fn place(&self, hierarchy: &Hierarchy, x: DVec3, along: [DVec3; 2]) -> Option<TexturePlace> {
        let closest = hierarchy.closest(x)?;
        let triangle = closest.triangle as usize;
        let image = self.image[triangle]?;
        let [a, b, c] = self.mesh.corners(triangle);
        let [at, at_b, at_c] = self.coordinates[triangle];
        let (u, v) = (b - a, c - a);
        let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
        let determinant = uu * vv - uv * uv;
        let map = |d: DVec3| {
            if determinant <= 0.0 {
                return DVec2::ZERO;
            }
            let (p, q) = (u.dot(d), v.dot(d));
            let (s, t) = (vv * p - uv * q, uu * q - uv * p);
            ((at_b - at) * s + (at_c - at) * t) / determinant
        };
        // Images are numbered from the top, texture coordinates from the bottom.
        let down = |at: DVec2| Vec2::new(at.as_vec2().x, -at.as_vec2().y);
        Some(TexturePlace {
            image,
            at: Vec2::Y + down(at + map(closest.point - a)),
            along: along.map(|d| down(map(d))),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texture coordinates that are linear in the position come out so at every point, with their slopes.
    #[test]
    fn places_of_linear_coordinates_are_exact() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let file = folder.path().join("strip.obj");
        let materials = "newmtl skin\nmap_Kd my skin.png\nnewmtl other\nmap_Kd other.png\n";
        std::fs::write(folder.path().join("my own.mtl"), materials)?;
        let linear = |p: DVec3| DVec2::new(0.1 + 0.2 * p.x + 0.05 * p.z, 0.9 - 0.3 * p.y);
        let corners = [
            [0, 0, 0],
            [1, 0, 0],
            [1, 1, 0],
            [0, 1, 0],
            [2, 0, 1],
            [2, 1, 1],
        ];
        let corners = corners.map(|p: [i32; 3]| DVec3::from_array(p.map(f64::from)));
        let mut text = String::from("mtllib my own.mtl\n");
        for p in corners {
            text += &format!("v {} {} {}\n", p.x, p.y, p.z);
        }
        // In another order than the vertices.
        for p in corners.iter().rev() {
            let at = linear(*p);
            text += &format!("vt {} {}\n", at.x, at.y);
        }
        let plain = format!("{text}f 1 2 3\n");
        text += "usemtl skin\nf 1/6 2/5 3/4 4/3\nusemtl other\nf 2/-2 5/-5 6/-6 3/-3\n";
        std::fs::write(&file, text)?;
        let textured = Textured::read(&file)?;
        assert_eq!(textured.images, ["my skin.png", "other.png"]);
        assert_eq!(textured.image, [0, 0, 1, 1].map(Some));
        let hierarchy = Hierarchy::new(&textured.mesh);
        for triangle in 0..4 {
            let [a, b, c] = textured.mesh.corners(triangle);
            let p = a + (b - a) * 0.3 + (c - a) * 0.2;
            let along = [b - a, c - a];
            let place = textured.place(&hierarchy, p, along).ok_or("no image")?;
            let down = |at: DVec2| Vec2::new(at.as_vec2().x, 1.0 - at.as_vec2().y);
            let off = place.at.distance(down(linear(p)));
            assert!(off < 1e-6, "off by {off:e} at {p}");
            for (d, found) in along.into_iter().zip(place.along) {
                let off = found.distance(down(linear(p + d)) - down(linear(p)));
                assert!(off < 1e-6, "slope off by {off:e}");
            }
        }
        std::fs::write(&file, plain)?;
        let no_images = Textured::read(&file);
        assert!(matches!(no_images, Err(SkinProblem::NoTexture(_))));
        std::fs::remove_file(folder.path().join("my own.mtl"))?;
        let no_materials = Textured::read(&file);
        assert!(matches!(no_materials, Err(SkinProblem::Texture { .. })));
        Ok(())
    }
}
