//! Several bodies in one picture.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::render::clip::Clip;
use crate::render::scene::SplatView;
use crate::render::splats::Splats;
use crate::render::surfels::TexturePlace;

/// The splats of several bodies in one set of arrays.
#[derive(Debug, Default, Clone)]
pub struct MergedSplats {
    splats: Splats,
    colors: Vec<Vec3>,
    materials: Vec<u16>,
    texture_points: Vec<DVec3>,
    texture_normals: Vec<DVec3>,
    places: Vec<Option<TexturePlace>>,
    clips: Vec<Option<Arc<Clip>>>,
    radii: Vec<f64>,
    inside: Option<Vec3>,
}

impl MergedSplats {
    /// Puts bodies together, each with the number of its surfaces and of its images: those of a body follow those of
    /// the one before in [`crate::RenderSettings`]. All take the `inside` of the first that has one.
    ///
    /// Numbers beyond 65,535 are that.
    #[must_use]
    pub fn of<'a>(bodies: impl IntoIterator<Item = (SplatView<'a>, usize, usize)>) -> Self {
        let mut all = Self::default();
        let (mut first_material, mut first_image) = (0_u16, 0_u16);
        for (view, surfaces, images) in bodies {
            let shifted = view.materials.iter();
            let shifted = shifted.map(|m| first_material.saturating_add(*m));
            all.materials.extend(shifted);
            all.texture_points.extend(view.texture_points);
            all.texture_normals.extend(view.texture_normals);
            let shifted = |place: TexturePlace| TexturePlace {
                image: first_image.saturating_add(place.image),
                ..place
            };
            let places = view.places.iter().map(|place| place.map(shifted));
            all.places.extend(places);
            all.splats.extend(view.splats);
            all.colors.extend(view.colors);
            all.places.resize(all.colors.len(), None);
            all.clips.extend_from_slice(view.clips);
            all.radii.extend(view.radii);
            all.inside = all.inside.or(view.inside);
            let capped = |count: usize| u16::try_from(count).unwrap_or(u16::MAX);
            first_material = first_material.saturating_add(capped(surfaces));
            first_image = first_image.saturating_add(capped(images));
        }
        if all.places.iter().all(Option::is_none) {
            all.places.clear();
        }
        all
    }

    /// Shrinks splats to a fraction of their radius.
    pub fn scale(&mut self, share: f64) {
        let axes = self.splats.axes_u.iter_mut().chain(&mut self.splats.axes_v);
        axes.for_each(|axis| *axis *= share);
        self.radii.iter_mut().for_each(|radius| *radius *= share);
    }

    /// All of it, to be drawn.
    #[must_use]
    pub fn view(&self) -> SplatView<'_> {
        SplatView {
            splats: &self.splats,
            colors: &self.colors,
            materials: &self.materials,
            texture_points: &self.texture_points,
            texture_normals: &self.texture_normals,
            places: &self.places,
            clips: &self.clips,
            radii: &self.radii,
            inside: self.inside,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::render::surfels::Surfels;

    /// A body of so many splats, and with an image or without.
    fn body(count: usize, image: Option<u16>) -> (Surfels, Splats, Vec<Vec3>) {
        let positions: Vec<DVec3> = (0..count).map(|k| DVec3::X * k as f64).collect();
        let (normals, areas) = (vec![DVec3::Z; count], vec![1.0; count]);
        let mut surfels = Surfels::from_samples(&positions, &normals, &areas).unwrap();
        surfels.materials.fill(1);
        let place = |image| TexturePlace {
            image,
            at: Vec2::ZERO,
            along: [Vec2::ZERO; 2],
        };
        surfels.places = image.map_or(Vec::new(), |image| vec![Some(place(image))]);
        let splats = Splats::at_rest(&surfels);
        (surfels, splats, vec![Vec3::ONE; count])
    }

    #[test]
    fn numbers_of_surfaces_and_images_follow_each_other() {
        let bodies = [body(2, None), body(3, Some(0)), body(1, Some(1))];
        let merged = MergedSplats::of(bodies.iter().map(|(surfels, splats, colors)| {
            let images = usize::from(!surfels.places.is_empty()) * 2;
            (SplatView::new(splats, surfels, colors), 2, images)
        }));
        let view = merged.view();
        assert_eq!(view.materials, [1, 1, 3, 3, 3, 5], "two surfaces each");
        let images: Vec<Option<u16>> = (view.places.iter())
            .map(|place| place.map(|place| place.image))
            .collect();
        let expected = [None, None, Some(0), None, None, Some(3)];
        assert_eq!(images, expected, "none, and two images each");
        assert_eq!(view.colors.len(), 6);
        let (surfels, splats, colors) = body(2, None);
        let mut plain = MergedSplats::of([(SplatView::new(&splats, &surfels, &colors), 1, 0)]);
        assert!(plain.view().places.is_empty(), "no images, no places");
        let before = plain.view().radii.to_vec();
        plain.scale(0.5);
        let mut radii = plain.view().radii.iter().zip(before);
        assert!(radii.all(|(a, b)| (*a - 0.5 * b).abs() < 1e-12));
    }
}
