//! Several bodies in one picture.

use std::sync::Arc;

use glam::Vec3;

use crate::render::{Clip, Splat, SplatView, Surfel};

/// The splats of several bodies in one set of arrays.
#[derive(Debug, Default, Clone)]
pub struct MergedSplats {
    splats: Vec<Splat>,
    surfels: Vec<Surfel>,
    colors: Vec<Vec3>,
    clips: Vec<Option<Arc<Clip>>>,
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
            all.surfels.extend(view.surfels.iter().map(|surfel| {
                let mut shifted = *surfel;
                shifted.material = first_material.saturating_add(surfel.material);
                if let Some(place) = &mut shifted.place {
                    place.image = first_image.saturating_add(place.image);
                }
                shifted
            }));
            all.splats.extend(view.splats);
            all.colors.extend(view.colors);
            all.clips.extend_from_slice(view.clips);
            all.inside = all.inside.or(view.inside);
            let capped = |count: usize| u16::try_from(count).unwrap_or(u16::MAX);
            first_material = first_material.saturating_add(capped(surfaces));
            first_image = first_image.saturating_add(capped(images));
        }
        all
    }

    /// Shrinks splats to a fraction of their radius.
    pub fn scale(&mut self, share: f64) {
        for splat in &mut self.splats {
            splat.axes = splat.axes.map(|axis| axis * share);
        }
        for surfel in &mut self.surfels {
            surfel.radius *= share;
        }
    }

    /// All of it, to be drawn.
    #[must_use]
    pub fn view(&self) -> SplatView<'_> {
        SplatView {
            clips: &self.clips,
            inside: self.inside,
            ..SplatView::new(&self.splats, &self.surfels, &self.colors)
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::render::surfels::TexturePlace;
    use testkit::cloud::golden_sphere;

    /// A body of so many splats, the first with an image or without.
    fn body(count: u32, image: Option<u16>) -> (Vec<Surfel>, Vec<Splat>, Vec<Vec3>) {
        let points = golden_sphere(count);
        let mut surfels = Surfel::covering(&points, &points).unwrap();
        for surfel in &mut surfels {
            surfel.material = 1;
        }
        surfels[0].place = image.map(|image| TexturePlace {
            image,
            at: Vec2::ZERO,
            along: [Vec2::ZERO; 2],
        });
        let splats: Vec<Splat> = surfels.iter().map(Surfel::at_rest).collect();
        let colors = vec![Vec3::ONE; splats.len()];
        (surfels, splats, colors)
    }

    #[test]
    fn numbers_of_surfaces_and_images_follow_each_other() {
        let bodies = [body(2, None), body(3, Some(0)), body(1, Some(1))];
        let merged = MergedSplats::of(bodies.iter().map(|(surfels, splats, colors)| {
            let images = usize::from(surfels[0].place.is_some()) * 2;
            (SplatView::new(splats, surfels, colors), 2, images)
        }));
        let view = merged.view();
        let materials: Vec<u16> = view.surfels.iter().map(|surfel| surfel.material).collect();
        assert_eq!(materials, [1, 1, 3, 3, 3, 5], "two surfaces each");
        let images = (view.surfels.iter()).map(|surfel| Some(surfel.place?.image));
        let expected = [None, None, Some(0), None, None, Some(3)];
        assert!(images.eq(expected), "none, and two images each");
        assert_eq!(view.colors.len(), 6);
        let (surfels, splats, colors) = body(20, None);
        let mut plain = MergedSplats::of([(SplatView::new(&splats, &surfels, &colors), 1, 0)]);
        plain.scale(0.5);
        let half = |a: f64, b: f64| (a - 0.5 * b).abs() < 1e-12 && b > 0.0;
        let mut radii = plain.view().surfels.iter().zip(&surfels);
        assert!(radii.all(|(a, b)| half(a.radius, b.radius)));
        let mut axes = plain.view().splats.iter().zip(&splats);
        assert!(axes.all(|(a, b)| half(a.axes[1].length(), b.axes[1].length())));
    }
}
