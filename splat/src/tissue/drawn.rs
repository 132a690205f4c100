//! A tissue as it is drawn: its colours, images and moved splats.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use crate::render::{Image, Splat, SplatView, Surface, TexturePlace};
use crate::tissue::{Tissue, TissueTexture};

/// What light reaches the bottom of a wound, where its sides do not quite meet.
const DEPTH: f32 = 0.25;

/// A tissue with what colours it, and its splats where nodes have carried them.
#[derive(Debug, Clone)]
pub struct DrawnTissue {
    /// The surface at rest; cuts change it.
    pub tissue: Tissue,
    /// Colours of its outside and inside.
    pub texture: TissueTexture,
    /// Optical properties of its materials.
    pub surfaces: Vec<Surface>,
    /// Images that surfels with a position in one show.
    pub images: Vec<Arc<Image>>,
    /// Linear colour of each surfel; [`DrawnTissue::carry`] gives new ones theirs.
    pub colors: Vec<Vec3>,
    splats: Vec<Splat>,
}

impl DrawnTissue {
    /// A tissue in the colours of a texture, with the surfaces of its materials.
    #[must_use]
    pub fn new(tissue: Tissue, texture: TissueTexture, surfaces: Vec<Surface>) -> Self {
        Self {
            colors: texture.colors(tissue.surfels()),
            tissue,
            texture,
            surfaces,
            images: Vec::new(),
            splats: Vec::new(),
        }
    }

    /// A copy without the splats, which [`DrawnTissue::carry`] computes again.
    #[must_use]
    pub fn unmoved(&self) -> Self {
        Self {
            tissue: self.tissue.clone(),
            texture: self.texture,
            surfaces: self.surfaces.clone(),
            images: self.images.clone(),
            colors: self.colors.clone(),
            splats: Vec::new(),
        }
    }

    /// Lays images on the surfels that have a position in one, one entry each, and colours these by them.
    pub fn lay(&mut self, images: Vec<Arc<Image>>, places: Vec<Option<TexturePlace>>) {
        self.tissue.set_places(places);
        for (to, surfel) in self.colors.iter_mut().zip(self.tissue.surfels()) {
            if let Some(place) = surfel.place {
                *to = place.color(&images, surfel.radius);
            }
        }
        self.images = images;
    }

    /// Moves the splats with the nodes' positions (m) and deformation gradients, and colours surfels that are new.
    ///
    /// # Panics
    /// If there are fewer nodes than the tissue is bound to.
    pub fn carry(&mut self, positions: &[DVec3], gradients: &[DMat3]) {
        self.tissue
            .carry_into(positions, gradients, &mut self.splats);
        for surfel in &self.tissue.surfels()[self.colors.len()..] {
            self.colors.push(match surfel.place {
                Some(place) => place.color(&self.images, surfel.radius),
                None => self.texture.color(surfel.position, surfel.material),
            });
        }
    }

    /// The splats where [`DrawnTissue::carry`] has moved them.
    #[must_use]
    pub fn splats(&self) -> &[Splat] {
        &self.splats
    }

    /// Linear colour of what gaps of a cut surface show.
    #[must_use]
    pub fn depth_color(&self) -> Vec3 {
        self.texture.parenchyma_dark * DEPTH
    }

    /// All of it, to be drawn.
    #[must_use]
    pub fn view(&self) -> SplatView<'_> {
        let cut = self.tissue.surfels().len() > self.tissue.outer_count();
        SplatView {
            // An uncut surface has no gaps.
            inside: cut.then(|| self.depth_color()),
            ..self.tissue.view(&self.splats, &self.colors)
        }
    }

    /// Heap bytes of the tissue and of its splats.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.tissue.bytes() + size_of_val(&*self.splats) + size_of_val(&*self.colors)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TissueSettings;

    /// A golden spiral on a ball of 0.1 m, one node.
    fn ball() -> Tissue {
        let normals = testkit::cloud::golden_sphere(2_000);
        let positions: Vec<DVec3> = normals.iter().map(|out| 0.1 * *out).collect();
        let areas = vec![4.0 * std::f64::consts::PI * 0.01 / 2_000.0; 2_000];
        let settings = TissueSettings::default();
        let tissue = Tissue::new(&positions, &normals, &areas, &[DVec3::ZERO], &settings);
        tissue.expect("it binds")
    }

    #[test]
    fn it_is_drawn_where_its_node_is_and_what_a_cut_lays_bare_has_a_colour() {
        let texture = TissueTexture::liver(0.2);
        let mut skin = DrawnTissue::new(ball(), texture, texture.surfaces());
        skin.carry(&[DVec3::X], &[DMat3::IDENTITY]);
        for (now, rest) in skin.splats().iter().zip(skin.tissue.surfels()) {
            assert!((now.position.distance(rest.position) - 1.0).abs() < 1e-12);
        }
        assert_eq!(skin.view().inside, None, "no gaps");
        let plane = [[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]];
        let [a, b, c, d] = plane.map(|[x, z]| DVec3::new(x, 0.003, z));
        let inside = |x: DVec3| x.length() < 0.1;
        let crosses = |p: DVec3, q: DVec3| (p.y < 0.003) != (q.y < 0.003);
        let cut = skin.tissue.cut(&[[a, b, c], [a, c, d]], &inside, &crosses);
        assert!(cut.expect("a finite cut").skin > 0, "new skin");
        skin.carry(&[DVec3::X], &[DMat3::IDENTITY]);
        let view = skin.view();
        assert_eq!(view.colors.len(), view.splats.len());
        assert_eq!(view.inside, Some(skin.depth_color()));
    }

    #[test]
    fn curvature_of_a_swollen_ball_is_its_new_radius() {
        let mut splats = Vec::new();
        let doubled = [DMat3::IDENTITY * 2.0];
        ball().carry_into(&[DVec3::ZERO], &doubled, &mut splats);
        assert_eq!(splats.len(), 2_000);
        for splat in splats {
            let found = splat.mean_curvature();
            // 1 / 0.2 m; the least squares over eight neighbours are 2 % off at worst.
            assert!((found - 5.0).abs() < 0.1, "{found} at {splat:?}");
        }
    }
}
