//! Several bodies in one picture.

use glam::{DVec3, Vec3};
use phyxel_splat::{Camera, Clip, Frame, Mesh, Renderer, SplatView, Splats, TexturePlace};

use super::Skin;

/// The skins of several bodies in one set of arrays.
#[derive(Debug, Default)]
pub(super) struct Merged {
    splats: Splats,
    colors: Vec<Vec3>,
    materials: Vec<u16>,
    texture_points: Vec<DVec3>,
    texture_normals: Vec<DVec3>,
    places: Vec<Option<TexturePlace>>,
    clips: Vec<Option<Box<Clip>>>,
    radii: Vec<f64>,
    inside: Option<Vec3>,
}

impl Merged {
    pub(super) fn of(skins: &[Skin]) -> Self {
        let mut all = Self::default();
        let mut first_material = 0_u16;
        let mut first_image = 0_u16;
        let textured = skins.iter().any(|skin| !skin.images.is_empty());
        for skin in skins {
            let view = skin.view();
            all.splats.extend(view.splats);
            all.colors.extend(view.colors);
            // A scene has at most as many bodies as there are ids for.
            let shifted = view.materials.iter();
            let shifted = shifted.map(|m| first_material.saturating_add(*m));
            all.materials.extend(shifted);
            all.texture_points.extend(view.texture_points);
            all.texture_normals.extend(view.texture_normals);
            if textured {
                let shifted = |place: TexturePlace| TexturePlace {
                    image: first_image.saturating_add(place.image),
                    ..place
                };
                let places = view.places.iter().map(|place| place.map(shifted));
                all.places.extend(places);
                all.places.resize(all.colors.len(), None);
                let own = u16::try_from(skin.images.len()).unwrap_or(u16::MAX);
                first_image = first_image.saturating_add(own);
            }
            all.clips.extend_from_slice(view.clips);
            all.radii.extend(view.radii);
            all.inside = all.inside.or(view.inside);
            let own = u16::try_from(skin.surfaces.len()).unwrap_or(u16::MAX);
            first_material = first_material.saturating_add(own);
        }
        all
    }

    /// Draws its splats at a share of their radius.
    pub(super) fn scale(&mut self, share: f64) {
        let axes = self.splats.axes_u.iter_mut().chain(&mut self.splats.axes_v);
        axes.for_each(|axis| *axis *= share);
        self.radii.iter_mut().for_each(|radius| *radius *= share);
    }

    pub(super) fn draw(&self, renderer: &mut Renderer, tools: &[Mesh], camera: &Camera) -> Frame {
        let view = SplatView {
            splats: &self.splats,
            colors: &self.colors,
            materials: &self.materials,
            texture_points: &self.texture_points,
            texture_normals: &self.texture_normals,
            places: &self.places,
            clips: &self.clips,
            radii: &self.radii,
            inside: self.inside,
        };
        renderer.draw(&view, tools, camera)
    }
}
