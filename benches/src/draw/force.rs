//! Force over the indentation of a block by a sphere, beside Hertz and finite elements.

use std::path::Path;

use crate::StudyError;
use crate::problems::indentation::{SMALL, cube, graded};
use crate::problems::reference::Reference;
use crate::report::{Series, plots};

/// Force over indentation of the 2 m cube, small strain, beside Hertz and finite elements.
pub(super) fn draw(folder: &Path) -> Result<(), StudyError> {
    let depths = [
        0.005, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09, 0.1,
    ];
    let hertz = |d: f64| 4.0 / 3.0 / 0.91 * d.powf(1.5);
    let mut reference = Reference::new([8, 12])?;
    let mut elements = Vec::new();
    for d in depths {
        elements.push((d, reference.press(1.0, d)?.force));
    }
    let theory = depths.map(|d| (d, hertz(d))).to_vec();
    let mut curves = vec![
        Series::line("Hertz, half space", theory),
        Series::dots("finite elements", elements),
    ];
    for (name, mut press) in [
        ("5,832 regular nodes", cube(17)?),
        ("1,573 graded nodes", graded([10, 10, 12])?),
    ] {
        let mut points = Vec::new();
        for depth in depths {
            let found = press.press(1.0 / SMALL, depth * SMALL, 1e-10)?;
            points.push((depth, found.force / SMALL));
        }
        curves.push(Series::line(name, points));
    }
    let plots = plots![
        "force_indentation" "Sphere of 1 m in a 2 m cube, sides and bottom fixed",
            linear "indentation (m)", linear "force over Young's modulus (m²)" => curves;
    ];
    plots[0].write(folder)
}
