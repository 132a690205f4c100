//! Volume and area of a body.

use glam::DVec3;

use crate::mesh::Bounds;

/// Volume (m³) and area (m²) of a body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Measures {
    pub volume: f64,
    pub area: f64,
}

/// Counts the points of a grid, so many along each axis of the body's box, that lie inside, and the faces between them that the
/// surface passes: area over faces is 2/3 in the mean over all directions.
pub(crate) fn measures_by_grid(
    bounds: Bounds,
    grid: usize,
    contains: impl Fn(DVec3) -> bool,
) -> Measures {
    let step = bounds.size() / grid as f64;
    let faces = [step.y * step.z, step.z * step.x, step.x * step.y];
    let place = |k: [usize; 3]| {
        let k = DVec3::from_array(k.map(|k| k as f64));
        bounds.min + (k + 0.5) * step
    };
    let mut inside = vec![false; grid * grid * grid];
    let stride = [1, grid, grid * grid];
    let (mut count, mut area) = (0.0, 0.0);
    for at in 0..inside.len() {
        let k = [0, 1, 2].map(|axis| at / stride[axis] % grid);
        inside[at] = contains(place(k));
        count += f64::from(u8::from(inside[at]));
        for axis in 0..3 {
            let before = k[axis] > 0 && inside[at - stride[axis]];
            let ends = k[axis] + 1 == grid && inside[at];
            let passed = u8::from(before != inside[at]) + u8::from(ends);
            area += faces[axis] * f64::from(passed);
        }
    }
    Measures {
        volume: count * step.element_product(),
        area: area / 1.5,
    }
}
