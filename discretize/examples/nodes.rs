//! Draws the nodes of the liver as balls coloured by their volume.
//!
//! `cargo run --release -p phyxel-discretize --example nodes -- FILE.png`
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "pixels"
)]

use glam::DVec3;
use phyxel_discretize::{Primitive, SampleSettings, sample_tetrahedra};

const SIZE: [usize; 2] = [480, 360];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let settings = SampleSettings::nodes(6000);
    let nodes = sample_tetrahedra(&Primitive::Liver.into(), &settings)?;
    let largest = nodes.volumes.iter().copied().fold(0.0, f64::max);
    let scale = 0.9 * SIZE[0] as f64 / 0.18;
    let radius = 0.45 * nodes.spacing;
    let mut depth = vec![f64::NEG_INFINITY; SIZE[0] * SIZE[1]];
    let mut image = vec![255_u8; 3 * SIZE[0] * SIZE[1]];
    let light = DVec3::new(-0.4, 0.6, 0.7).normalize();
    for (p, v) in nodes.positions.iter().zip(&nodes.volumes) {
        // A cut through the middle shows the inside.
        if p.z > 0.012 && p.x > 0.0 {
            continue;
        }
        let pixels = (radius * scale).ceil() as i64;
        let center = [
            p.x * scale + SIZE[0] as f64 / 2.0,
            SIZE[1] as f64 / 2.0 - p.y * scale,
        ];
        for dy in -pixels..=pixels {
            for dx in -pixels..=pixels {
                let (x, y) = (center[0] as i64 + dx, center[1] as i64 + dy);
                let q = [
                    (x as f64 - center[0]) / scale,
                    (center[1] - y as f64) / scale,
                ];
                let rest = radius * radius - q[0] * q[0] - q[1] * q[1];
                if rest < 0.0 || x < 0 || y < 0 || x >= SIZE[0] as i64 || y >= SIZE[1] as i64 {
                    continue;
                }
                let z = rest.sqrt();
                let at = x as usize + SIZE[0] * y as usize;
                if p.z + z > depth[at] {
                    depth[at] = p.z + z;
                    let shade =
                        0.35 + 0.65 * DVec3::new(q[0], q[1], z).dot(light).max(0.0) / radius;
                    let color = ramp((v / largest).clamp(0.0, 1.0)) * shade * 255.0;
                    for (c, value) in color.to_array().into_iter().enumerate() {
                        // 64 shades a channel: the crate's package carries the picture.
                        image[3 * at + c] = value.min(255.0) as u8 & !3;
                    }
                }
            }
        }
    }
    let path = std::env::args()
        .nth(1)
        .ok_or("name the PNG file to write")?;
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, SIZE[0] as u32, SIZE[1] as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    encoder.write_header()?.write_image_data(&image)?;
    assert!(
        nodes.report.quality.smallest_dihedral > 10.7,
        "stuffing's bound"
    );
    Ok(())
}

/// Blue over white-yellow to red.
fn ramp(t: f64) -> DVec3 {
    let stops = [
        DVec3::new(0.19, 0.21, 0.58),
        DVec3::new(0.45, 0.68, 0.82),
        DVec3::new(1.0, 0.93, 0.65),
        DVec3::new(0.84, 0.19, 0.15),
    ];
    let s = 3.0 * t;
    let k = (s.floor() as usize).min(2);
    stops[k].lerp(stops[k + 1], s - k as f64)
}
