//! A surface as it was before cuts, as what they changed.

use super::{Binding, DrawnTissue};
use crate::render::Surfel;

/// What leads from a surface back to the one before it was cut.
#[derive(Debug, Clone)]
pub struct SurfaceChange {
    /// The surface before, without its surfels and what carries them.
    rest: DrawnTissue,
    count: usize,
    /// Surfels that are others since, as they were, and their nodes.
    rows: Vec<u32>,
    surfels: Vec<Surfel>,
    binding: Binding,
}

impl SurfaceChange {
    /// What of `before` is not so in `after`, which came of it by cuts.
    ///
    /// # Panics
    /// If `after` has fewer surfels.
    #[must_use]
    pub fn new(mut before: DrawnTissue, after: &DrawnTissue) -> Self {
        let all = std::mem::take(&mut before.tissue.surfels);
        let bound = before.tissue.binding.take_rows();
        let now = &after.tissue;
        let differs = |row: &u32| {
            let row = *row as usize;
            !is_same(&all[row], &now.surfels[row]) || !bound.is_same_row(&now.binding, row)
        };
        let rows: Vec<u32> = (0..).take(all.len()).filter(differs).collect();
        Self {
            count: all.len(),
            surfels: rows.iter().map(|&row| all[row as usize]).collect(),
            binding: bound.selected(&rows),
            rows,
            rest: before,
        }
    }

    /// The surface before, of the one after.
    ///
    /// # Panics
    /// If it is another than that of [`SurfaceChange::new`].
    #[must_use]
    pub fn undone(self, after: &DrawnTissue) -> DrawnTissue {
        let mut before = self.rest;
        let mut surfels = after.tissue.surfels[..self.count].to_vec();
        for (&row, surfel) in self.rows.iter().zip(&self.surfels) {
            surfels[row as usize] = *surfel;
        }
        before.tissue.surfels = surfels;
        let now = &after.tissue.binding;
        before
            .tissue
            .binding
            .put_rows(now, self.count, &self.rows, &self.binding);
        before
    }

    /// Heap bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let rows = size_of_val(&*self.rows) + size_of_val(&*self.surfels);
        self.rest.bytes() + rows + self.binding.bytes()
    }
}

/// Whether two surfels are bitwise the same; images of cuts never change.
fn is_same(a: &Surfel, b: &Surfel) -> bool {
    let bits = |surfel: &Surfel| {
        let own = [surfel.area, surfel.radius].map(f64::to_bits);
        let vectors = [surfel.position, surfel.normal, surfel.shape];
        (own, vectors.map(|v| v.to_array().map(f64::to_bits)))
    };
    bits(a) == bits(b) && a.material == b.material && a.place == b.place
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::{Tissue, TissueSettings, TissueTexture};

    /// A flat sheet of 40 x 40 surfels 1 cm apart over 9 x 9 nodes.
    fn sheet() -> (DrawnTissue, Vec<DVec3>) {
        let grid = |side: u32, apart: f64| -> Vec<DVec3> {
            let place = |k: u32| DVec3::new(f64::from(k % side), f64::from(k / side), 0.0) * apart;
            (0..side * side).map(place).collect()
        };
        let (x, nodes) = (grid(40, 0.01), grid(9, 0.05));
        let settings = TissueSettings::default();
        let tissue = Tissue::new(&x, &[DVec3::Z; 1600], &[1e-4; 1600], &nodes, &settings).unwrap();
        let texture = TissueTexture::liver(0.4);
        (DrawnTissue::new(tissue, texture, texture.surfaces()), nodes)
    }

    /// Cuts along x = 0.1 from y = `from` for 0.1 m.
    fn cut(skin: &mut DrawnTissue, from: f64) {
        let corner = |y: f64, z: f64| DVec3::new(0.103, y, z);
        let [a, b] = [corner(from, -0.1), corner(from + 0.1, -0.1)];
        let [c, d] = [corner(from + 0.1, 0.1), corner(from, 0.1)];
        let inside = |x: DVec3| x.z.abs() < 0.02;
        let crosses = |p: DVec3, q: DVec3| (p.x < 0.103) != (q.x < 0.103) && p.y < from + 0.1;
        let done = skin.tissue.cut(&[[a, b, c], [a, c, d]], &inside, &crosses);
        assert!(done.unwrap().surfels.len() > 10, "it changes something");
    }

    #[test]
    fn two_cuts_are_undone_to_the_very_bits() {
        let (mut skin, nodes) = sheet();
        let mut states = vec![skin.unmoved()];
        for from in [-0.01, 0.12] {
            cut(&mut skin, from);
            states.push(skin.unmoved());
        }
        let whole = states[2].bytes();
        let mut newest = states[2].clone();
        for before in [&states[1], &states[0]] {
            let change = SurfaceChange::new(before.clone(), &newest);
            assert!(2 * change.bytes() < whole, "{} of {whole}", change.bytes());
            newest = change.undone(&newest);
            let places = |skin: &DrawnTissue| {
                let mut moved = skin.clone();
                moved.carry(&nodes, &vec![DMat3::IDENTITY; nodes.len()]);
                format!("{moved:?}")
            };
            assert_eq!(places(&newest), places(before));
        }
    }
}
