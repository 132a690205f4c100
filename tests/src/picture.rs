//! Pictures of surfaces against exact ones.

use glam::DVec3;

/// Pixels beside an edge of the exact picture where normals and depths are not compared.
pub const RIM: usize = 2;
/// Depths (m) that differ by more within the rim are an edge too.
const FOLD: f64 = 0.2;

/// What the ray of a pixel meets.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// How far away (m), along the view.
    pub depth: f64,
    /// Outward normal there.
    pub normal: DVec3,
}

/// How far a picture is from the exact one.
#[derive(Debug, Clone, Copy, Default)]
pub struct Difference {
    /// Background pixels more than a pixel inside the exact outline.
    pub holes: usize,
    /// Covered pixels more than a pixel outside of it.
    pub strays: usize,
    /// Pixels that the exact picture covers.
    pub inside: usize,
    /// Pixels that only one of the pictures covers, over those that the exact one covers.
    pub outline: f64,
    /// Root mean square error of the depth (m) away from edges.
    pub depth: f64,
    /// Mean angle (degrees) between normals away from edges.
    pub normal: f64,
}

/// Compares depths (m; infinite where nothing is) and normals of a picture with what rays meet, row-major.
#[must_use]
pub fn compare(
    width: usize,
    exact: &[Option<Hit>],
    depth: &[f32],
    normal: impl Fn(usize) -> DVec3,
) -> Difference {
    let around = |pixel: usize, reach: usize| {
        let (x, y, height) = (pixel % width, pixel / width, exact.len() / width);
        let rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
        let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
        rows.flat_map(move |row| &exact[row * width..][columns.clone()])
    };
    // Whether the picture around a pixel shows one smooth surface.
    let smooth = |pixel: usize| {
        let mut depths = around(pixel, RIM).map(|hit| hit.map(|hit| hit.depth));
        let range = depths.try_fold((f64::INFINITY, 0.0_f64), |(low, high), depth| {
            depth.map(|depth| (low.min(depth), high.max(depth)))
        });
        range.is_some_and(|(low, high)| high - low < FOLD)
    };
    let mut found = Difference::default();
    let mut compared = 0.0;
    for (pixel, hit) in exact.iter().enumerate() {
        let covered = depth[pixel].is_finite();
        let beside = |hit: bool| around(pixel, 1).any(|near| near.is_some() == hit);
        match hit {
            None if covered && !beside(true) => found.strays += 1,
            Some(_) if !covered && !beside(false) => found.holes += 1,
            Some(hit) if covered && smooth(pixel) => {
                found.depth += (f64::from(depth[pixel]) - hit.depth).powi(2);
                let cosine = normal(pixel).dot(hit.normal).clamp(-1.0, 1.0);
                found.normal += cosine.acos().to_degrees();
                compared += 1.0;
            }
            _ => {}
        }
        found.outline += f64::from(u8::from(hit.is_some() != covered));
        found.inside += usize::from(hit.is_some());
    }
    found.outline /= found.inside.max(1) as f64;
    found.depth = (found.depth / f64::max(compared, 1.0)).sqrt();
    found.normal /= f64::max(compared, 1.0);
    found
}
