//! Pieces of a cut that end right before an older face or the surface of the body.

use std::collections::BTreeMap;
use std::ops::{ControlFlow, Range};

use glam::DVec3;

use crate::cuts::Cuts;
use crate::edges::FLAT;
use crate::front::{OVERSHOOT, SKIN, THROUGH};
use crate::predicate::segment_crosses_triangle;

impl Cuts {
    /// Carries the newest piece of the cut on through older faces and the surface of the body, where its free edges end within a
    /// tenth of a node spacing (0.05 influence radii) before them: a pair that passes through so thin a slit, or that lies in the
    /// surface, would hold on.
    ///
    /// # Arguments
    /// * `new` -- numbers of its triangles, the last ones of the cut.
    /// * `inside` -- whether a point (m, material coordinates) lies in the uncut body.
    ///
    /// # Returns
    /// The numbers with those of the triangles that were added.
    ///
    /// # Panics
    /// If `new` are not the last triangles.
    ///
    /// # Examples
    /// ```
    /// use phyxel_enrich::glam::DVec3;
    /// use phyxel_enrich::{CutSettings, Cuts};
    ///
    /// // The body ends at x = 1, and so does the sheet.
    /// let mut cuts = Cuts::new(&CutSettings::for_spacing(0.1));
    /// let blade = |x: f64| [DVec3::new(x, 0.0, -1.0), DVec3::new(x, 0.0, 1.0)];
    /// let stroke = cuts.start(&blade(-0.5))?;
    /// let new = cuts.append(stroke, &blade(1.0))?;
    /// let in_surface = [DVec3::new(1.0, -0.1, 0.1), DVec3::new(1.0, 0.1, 0.1)];
    /// assert!(!cuts.crosses(in_surface[0], in_surface[1]));
    /// assert_eq!(cuts.carry_through(new, &|x| x.x <= 1.0), 0..4);
    /// assert!(cuts.crosses(in_surface[0], in_surface[1]));
    /// # Ok::<(), phyxel_enrich::CutError>(())
    /// ```
    pub fn carry_through(
        &mut self,
        new: Range<usize>,
        inside: &dyn Fn(DVec3) -> bool,
    ) -> Range<usize> {
        assert_eq!(new.end, self.triangle_count(), "the newest triangles");
        let free = self.edges.free(&self.surface().1[new.clone()]);
        let mut outward: BTreeMap<u32, DVec3> = BTreeMap::new();
        for (ends, away) in &free {
            for end in ends {
                *outward.entry(*end).or_default() += *away;
            }
        }
        let ends = outward.into_iter();
        let carried = ends.filter_map(|(end, sum)| Some((end, self.beyond(end, sum, inside)?)));
        let carried: Vec<(u32, DVec3)> = carried.collect();
        let carried = carried.into_iter().map(|(end, at)| (end, self.welded(at)));
        let carried: BTreeMap<u32, u32> = carried.collect();
        for ([p, q], _) in free {
            if let (Some(&beyond_p), Some(&beyond_q)) = (carried.get(&p), carried.get(&q)) {
                self.add([p, q, beyond_q]);
                self.add([p, beyond_q, beyond_p]);
            }
        }
        new.start..self.triangle_count()
    }

    /// Where a vertex is carried to (m) along its edges' directions out of the cut, if a face or the surface is that near.
    fn beyond(&self, end: u32, sum: DVec3, inside: &dyn Fn(DVec3) -> bool) -> Option<DVec3> {
        let way = sum.try_normalize()?;
        let at = |share: f64| self.edges.vertices[end as usize] + way * (share * self.spacing());
        let (from, to) = (at(-SKIN), at(SKIN));
        let met = self.forest.on_segment(from, to, |triangle, &[p, q, r]| {
            // At smaller angles a face is the sheet itself, which bends.
            let is_across = self.normal(triangle as usize).dot(way).abs() > FLAT;
            if is_across && segment_crosses_triangle(from, to, p, q, r) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        if met.is_break() {
            Some(at(SKIN + THROUGH))
        } else {
            (inside(from) && !inside(to)).then(|| at(OVERSHOOT))
        }
    }
}
