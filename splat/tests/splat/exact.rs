//! Pictures against exact ones: no holes, true silhouettes, crisp rims; bitwise identical on any thread
//! count.
use crate::oracle::{Samples, Shape, box_distance, compare, ray, trace};
use glam::{DMat2, DMat3, DVec2, DVec3, Vec3};
use phyxel_splat::{
    Camera, DrawMode, DrawnMesh, Frame, Image, ImageCoat, Lens, RenderSettings, Renderer, Splat,
    SplatView, Surfel, TexturePlace, Tissue, TissueSettings,
};
use std::io::Cursor;
use std::sync::Arc;
use testkit::cloud::{filled_cube, patch, swept};

fn settings(mode: DrawMode, samples: u32) -> RenderSettings {
    RenderSettings {
        width: 320,
        height: 240,
        samples,
        mode,
        keep_normals: true,
        ..RenderSettings::default()
    }
}

fn draw(tissue: &Tissue, splats: &[Splat], camera: &Camera, settings: RenderSettings) -> Frame {
    let colors = vec![Vec3::splat(0.4); splats.len()];
    Renderer::new(settings).draw(&tissue.view(splats, &colors), &[], camera)
}

/// A body that nothing carries.
fn at_rest((x, n, a): Samples) -> (Tissue, Vec<Splat>) {
    let tissue = Tissue::new(&x, &n, &a, &[DVec3::ZERO], &TissueSettings::default()).unwrap();
    let splats = tissue.surfels().iter().map(Surfel::at_rest).collect();
    (tissue, splats)
}

fn cameras(low: DVec3, high: DVec3) -> Vec<Camera> {
    let directions = [[-0.5, -0.7, -1.0], [0.9, -0.3, 0.4], [0.05, -1.0, -0.02]];
    let both = directions.map(|direction| {
        [Camera::framing, Camera::framing_orthographic]
            .map(|framing| framing(low, high, DVec3::from(direction), DVec3::Y, 4.0 / 3.0))
    });
    both.as_flattened().to_vec()
}

/// An image that was written as PNG.
fn image(file: &Frame) -> Arc<Image> {
    let mut png = Vec::new();
    file.write_png(&mut png).unwrap();
    Arc::new(Image::read_png(Cursor::new(png)).unwrap())
}

#[test]
fn default_radii_leave_no_hole_and_no_stray() {
    let low = DVec3::splat(-1.0);
    for shape in Shape::ALL {
        let (tissue, splats) = at_rest(shape.samples(5_000));
        for (i, camera) in cameras(low, -low).iter().enumerate() {
            let frame = draw(&tissue, &splats, camera, settings(DrawMode::ThreePass, 1));
            let d = compare(shape, camera, &frame);
            let what = format!("{shape:?}, camera {i}: {d:?}");
            assert!(d.inside > 5_000, "{what}");
            assert_eq!((d.holes, d.strays), (0, 0), "{what}");
            assert!(d.depth < 0.03 && d.normal < 1.0, "{what}");
        }
    }
}

#[test]
fn errors_fall_as_surfels_become_more_than_pixels() {
    // 320 x 240 pixels, of which a body covers up to 17,000: of 40,000 surfels more face the viewer.
    // The height of a tangent disk over the surface falls as 1/n.
    let low = DVec3::splat(-1.0);
    let camera = cameras(low, -low)[0];
    for shape in [Shape::Sphere, Shape::UnevenSphere, Shape::Torus] {
        let errors = [2_500, 10_000, 40_000].map(|count| {
            let (tissue, splats) = at_rest(shape.samples(count));
            let frame = draw(&tissue, &splats, &camera, settings(DrawMode::ThreePass, 1));
            let d = compare(shape, &camera, &frame);
            assert_eq!((d.holes, d.strays), (0, 0), "{shape:?}, {count}: {d:?}");
            (d.depth, d.normal)
        });
        for pair in errors.windows(2) {
            let [(depth, normal), (next_depth, next_normal)] = [pair[0], pair[1]];
            assert!(next_depth < 0.5 * depth, "{shape:?}: {errors:?}");
            // Normals end at what single precision and the pixels' own slope leave.
            let falls = next_normal < 0.5 * normal || next_normal < 0.01;
            assert!(falls, "{shape:?}: {errors:?}");
        }
    }
}

#[test]
fn uneven_stretch_opens_no_hole() {
    // Waves of four nodes with stretches from 0.2 to 1.8 run over a patch.
    let (x, n, a) = patch(60, 0.0, 3);
    let nodes = filled_cube(13, 9);
    let tissue = Tissue::new(&x, &n, &a, &nodes, &TissueSettings::default()).unwrap();
    let wave = 2.0 * std::f64::consts::PI * 3.0;
    let moved =
        |p: DVec3| p + DVec3::new((wave * p.x).sin(), (wave * p.y).sin(), 0.0) * (0.8 / wave);
    let slope = |p: DVec3| {
        let at = |c: f64| 1.0 + 0.8 * (wave * c).cos();
        DMat3::from_diagonal(DVec3::new(at(p.x), at(p.y), 1.0))
    };
    let positions: Vec<DVec3> = nodes.iter().map(|&p| moved(p)).collect();
    let gradients: Vec<DMat3> = nodes.iter().map(|&p| slope(p)).collect();
    let mut splats = Vec::new();
    tissue.carry_into(&positions, &gradients, &mut splats);
    let low = DVec3::splat(-0.45);
    let camera = Camera::framing_orthographic(low, -low, DVec3::NEG_Z, DVec3::Y, 4.0 / 3.0);
    // The middle of the frame shows the patch only.
    let open = |splats: &[Splat]| {
        let frame = draw(&tissue, splats, &camera, settings(DrawMode::ThreePass, 1));
        (0..240 * 320)
            .filter(|k| (20..220).contains(&(k / 320)) && (60..260).contains(&(k % 320)))
            .filter(|&k| frame.depth[k].is_infinite())
            .count()
    };
    assert_eq!(open(&splats), 0, "pixels without a splat");
    // Disks that follow the mean gradient alone, without the change of the weights, do open holes.
    for (i, (surfel, splat)) in tissue.surfels().iter().zip(&mut splats).enumerate() {
        let (row, weights) = tissue.binding().row(i);
        let pairs = row.iter().zip(weights);
        let gradient: DMat3 = pairs.map(|(&node, &w)| gradients[node as usize] * w).sum();
        let tangents = <[DVec3; 2]>::from(Surfel::tangents(surfel.normal));
        splat.axes = tangents.map(|t| gradient * t * surfel.radius);
    }
    assert!(open(&splats) > 0, "the waves must be hard to cover");
}

#[test]
fn an_image_lies_on_the_surface_by_place() {
    // Red left, green right, blue below both; one repeat over the block's front.
    let mut file = Frame::blank(2, 2);
    let [red, green, blue] = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]];
    file.pixels = vec![red, green, blue, blue];
    let image = image(&file);
    assert_eq!(image.size(), (2, 2));
    let (tissue, splats) = at_rest(Shape::Block.samples(600));
    let low = DVec3::splat(-0.8);
    // The face y = -0.6: x to the right, z up.
    let camera = Camera::framing_orthographic(low, -low, DVec3::Y, DVec3::Z, 4.0 / 3.0);
    let mut settings = settings(DrawMode::ThreePass, 1);
    settings.surfaces[0].coat = Some(ImageCoat { image, size: 1.6 });
    let frame = draw(&tissue, &splats, &camera, settings);
    let strongest = |px: usize, py: usize| {
        let pixel = frame.pixels[py * 320 + px];
        (0..3).max_by_key(|&c| pixel[c]).unwrap()
    };
    // The image's corner lies at the origin, in the middle of the face and of the frame: below it to
    // the right the first texel, over it the lower row of the repeat above.
    assert_eq!([strongest(107, 173), strongest(213, 173)], [1, 0]);
    assert_eq!([strongest(107, 67), strongest(213, 67)], [2, 2]);
}

/// Two halves of a block, the right one moved by `gap`.
fn opened_block(clip: bool, gap: f64) -> (Tissue, Vec<Splat>) {
    let at = 0.113;
    let (x, n, a) = Shape::Block.samples(6_000);
    let mut nodes = Vec::new();
    for i in 0..10 * 8 * 8 {
        let k = DVec3::new(f64::from(i % 10), f64::from(i / 10 % 8), f64::from(i / 80));
        nodes.push((k - DVec3::new(4.5, 3.5, 3.5)) * 0.18);
    }
    let settings = TissueSettings {
        clip,
        ..TissueSettings::default()
    };
    let mut tissue = Tissue::new(&x, &n, &a, &nodes, &settings).unwrap();
    // The blade passes in seven strips.
    for strip in 0..7 {
        let z = |k: i32| -1.05 + 0.3 * f64::from(k);
        let edge = |k: i32| [-1.0, 1.0].map(|y| DVec3::new(at, y, z(k)));
        let crosses = |a: DVec3, b: DVec3| {
            let t = (at - a.x) / (b.x - a.x);
            (a.x < at) != (b.x < at) && a.lerp(b, t).z < z(strip + 1)
        };
        let inside = |p: DVec3| Shape::Block.distance(p) < 0.0;
        tissue
            .cut(&swept(edge(strip), edge(strip + 1)), &inside, &crosses)
            .unwrap();
    }
    let shift = |p: &DVec3| if p.x < at { *p } else { *p + DVec3::X * gap };
    let moved: Vec<DVec3> = nodes.iter().map(shift).collect();
    let mut splats = Vec::new();
    tissue.carry_into(&moved, &vec![DMat3::IDENTITY; nodes.len()], &mut splats);
    (tissue, splats)
}

/// Distance to the two halves of [`opened_block`].
fn halves(p: DVec3, gap: f64) -> f64 {
    let half = |low: f64, high: f64, p: DVec3| {
        let centre = DVec3::X * (0.5 * (low + high));
        box_distance(p - centre, DVec3::new(0.5 * (high - low), 0.6, 0.7))
    };
    half(-0.8, 0.113, p).min(half(0.113 + gap, 0.8 + gap, p))
}

/// Pixels nearer than anything exact within 1.5 pixels, and pixels missing inside.
fn strays_and_holes(frame: &Frame, camera: &Camera, gap: f64) -> (usize, usize) {
    let (w, h) = (frame.width as usize, frame.height as usize);
    // Twice as fine as the frame.
    let wide = 2 * w;
    let mut exact = vec![f64::INFINITY; 4 * w * h];
    for (k, depth) in exact.iter_mut().enumerate() {
        let at = ((k % wide) as f64 + 0.5, (k / wide) as f64 + 0.5);
        let (from, along) = ray(camera, (wide as f64, 2.0 * h as f64), at);
        if let Some(t) = trace(|p| halves(p, gap), from, along) {
            *depth = (along * t).dot(camera.forward);
        }
    }
    let (mut strays, mut holes) = (0, 0);
    for y in 1..h - 1 {
        for x in 1..w - 1 {
            // All exact samples within 1.5 pixels of the pixel's centre.
            let mut around = Vec::new();
            for v in (2 * y).saturating_sub(2)..(2 * y + 4).min(2 * h) {
                for u in (2 * x).saturating_sub(2)..(2 * x + 4).min(wide) {
                    let [du, dv] = [(u, x), (v, y)].map(|(u, x)| u as f64 - 2.0 * x as f64 - 0.5);
                    if du.hypot(dv) <= 3.0 {
                        around.push(exact[v * wide + u]);
                    }
                }
            }
            let nearest = around.iter().copied().fold(f64::INFINITY, f64::min);
            let farthest = around.iter().copied().fold(0.0, f64::max);
            let depth = f64::from(frame.depth[y * w + x]);
            strays += usize::from(depth < nearest - 0.02);
            holes += usize::from(depth > farthest + 0.02);
        }
    }
    (strays, holes)
}

#[test]
fn rim_of_a_straight_cut_is_crisp_only_with_clipping() {
    let gap = 0.25;
    let low = DVec3::new(-0.8, -0.6, -0.7);
    let high = DVec3::new(0.8 + gap, 0.6, 0.7);
    let [clipped, plain] = [true, false].map(|clip| opened_block(clip, gap));
    let mut bristles = 0;
    for direction in [
        DVec3::new(-0.5, -0.7, -1.0),
        DVec3::new(0.3, -0.9, -0.4),
        DVec3::new(0.0, -1.0, -0.3),
        DVec3::new(-0.8, -0.4, -0.5),
        DVec3::new(0.6, 0.5, -0.9),
    ] {
        let camera = Camera::framing(low, high, direction, DVec3::Y, 4.0 / 3.0);
        let [found, without] = [&clipped, &plain].map(|(tissue, splats)| {
            let frame = draw(tissue, splats, &camera, settings(DrawMode::ThreePass, 1));
            strays_and_holes(&frame, &camera, gap)
        });
        assert_eq!(found, (0, 0), "strays and holes from {direction}");
        bristles += without.0;
    }
    assert!(bristles > 100, "{bristles} pixels without clipping");
}

#[test]
fn same_bits_at_any_thread_count() {
    let (tissue, splats) = opened_block(true, 0.2);
    let low = DVec3::splat(-1.0);
    let camera = cameras(low, -low)[0];
    let tool = [DrawnMesh::capsule(
        DVec3::new(0.1, 0.2, 0.0),
        DVec3::new(0.4, 1.5, 0.6),
        0.08,
    )];
    let colors = vec![Vec3::new(0.5, 0.2, 0.1); splats.len()];
    let modes = [
        DrawMode::ThreePass,
        DrawMode::Squares,
        DrawMode::Disks,
        DrawMode::SinglePass,
    ];
    let with = |threads: usize| {
        testkit::on_threads(threads, || {
            let (tissue, splats) = opened_block(true, 0.2);
            let view = tissue.view(&splats, &colors);
            modes.map(|mode| Renderer::new(settings(mode, 2)).draw(&view, &tool, &camera))
        })
    };
    let one = with(1);
    assert!(one == with(4), "other threads, other pictures");
    for (mode, frame) in modes.into_iter().zip(one) {
        let again =
            Renderer::new(settings(mode, 2)).draw(&tissue.view(&splats, &colors), &tool, &camera);
        assert!(frame == again, "{mode:?}");
        let covered = frame.depth.iter().filter(|d| d.is_finite()).count();
        assert!(covered > 10_000, "{mode:?} covers {covered} pixels");
    }
}

#[test]
fn tools_hide_and_are_hidden() {
    let (tissue, splats) = opened_block(true, 0.0);
    let low = DVec3::splat(-1.0);
    let camera = Camera::framing_orthographic(low, -low, DVec3::NEG_Z, DVec3::Y, 4.0 / 3.0);
    let colors = vec![Vec3::ZERO; splats.len()];
    let mut renderer = Renderer::new(settings(DrawMode::ThreePass, 1));
    let view = tissue.view(&splats, &colors);
    let centre = 120 * 320 + 160;
    let eye_z = camera.eye.z;
    let mut depth_with = |z: f64| {
        let at = DVec3::new(0.0, 0.0, z);
        let frame = renderer.draw(&view, &[DrawnMesh::capsule(at, at, 0.1)], &camera);
        eye_z - f64::from(frame.depth[centre])
    };
    // A ball in front, half sunk, and inside the block, whose face is at z = 0.7.
    assert!((depth_with(1.0) - 1.1).abs() < 0.01);
    assert!((depth_with(0.7) - 0.8).abs() < 0.01);
    assert!((depth_with(0.0) - 0.7).abs() < 0.01);
}

/// A triangle across many tiles is seen where rays meet it and nowhere else. Under a distant eye it has one colour, in
/// every mode, with any samples, and whichever way round its corners are.
#[test]
fn triangles_are_seen_where_rays_meet_them_from_either_side() {
    let corners = [
        DVec3::new(-1.1, -0.8, 0.3),
        DVec3::new(1.2, -0.1, -0.4),
        DVec3::new(0.1, 0.9, 0.2),
    ];
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let (tissue, splats) = opened_block(true, 0.0);
    let nothing = SplatView {
        splats: &[],
        surfels: &[],
        colors: &[],
        clips: &[],
        ..tissue.view(&splats, &[])
    };
    for camera in cameras(DVec3::splat(-1.0), DVec3::ONE) {
        let [front, back] = [[0, 1, 2], [0, 2, 1]].map(|corner| {
            let mesh = DrawnMesh::metal(corners.to_vec(), vec![corner]);
            Renderer::new(settings(DrawMode::ThreePass, 1)).draw(&nothing, &[mesh], &camera)
        });
        assert!(front == back, "lit on the side that is seen");
        let (mut seen, mut colors) = (0, std::collections::HashSet::new());
        for (k, depth) in front.depth.iter().enumerate() {
            let (x, y) = ((k % 320) as f64 + 0.5, (k / 320) as f64 + 0.5);
            let (from, along) = ray(&camera, (320.0, 240.0), (x, y));
            let at = from + along * ((a - from).dot(normal) / along.dot(normal));
            let share = |p: DVec3, q: DVec3| (q - p).cross(at - p).dot(normal);
            let shares = [share(a, b), share(b, c), share(c, a)];
            let inside = shares.into_iter().fold(f64::INFINITY, f64::min) / normal.length_squared();
            if inside.abs() > 1e-5 {
                assert_eq!(depth.is_finite(), inside > 0.0, "pixel {k}: {inside}");
            }
            if depth.is_finite() && inside > 1e-5 {
                let exact = (at - camera.eye).dot(camera.forward);
                assert!(
                    (f64::from(*depth) - exact).abs() < 1e-4 * exact.abs(),
                    "pixel {k}"
                );
                seen += 1;
                colors.insert(front.pixels[k]);
            }
        }
        assert!(seen > 500, "{seen} pixels");
        if matches!(camera.lens, Lens::Orthographic { .. }) {
            let mesh = DrawnMesh::metal(corners.to_vec(), vec![[0, 1, 2]]);
            for (mode, samples) in [
                (DrawMode::SinglePass, 1),
                (DrawMode::SinglePass, 2),
                (DrawMode::ThreePass, 4),
            ] {
                let mut renderer = Renderer::new(settings(mode, samples));
                let frame = renderer.draw(&nothing, std::slice::from_ref(&mesh), &camera);
                // Amid it; its border is mixed with what is behind.
                let inner = |k: usize| {
                    (0..3).all(|row| {
                        (0..3).all(|column| {
                            let at = (k + 320 * row + column).checked_sub(321);
                            at.and_then(|at| front.depth.get(at))
                                .is_some_and(|depth| depth.is_finite())
                        })
                    })
                };
                let inner = (0..frame.pixels.len()).filter(|k| inner(*k));
                colors.extend(inner.map(|k| frame.pixels[k]));
            }
            assert_eq!(colors.len(), 1, "{colors:?}");
        }
    }
}

/// Through a gap one sees the body's inside, from behind; nothing else changes.
#[test]
fn gaps_show_the_inside() {
    // The normals of a ball's points are these; each has the same area.
    let (mut x, _, mut a) = Shape::Sphere.samples(4_000);
    x.retain(|p| p.z <= 0.8);
    a.truncate(x.len());
    let (tissue, splats) = at_rest((x.clone(), x.clone(), a));
    let colors = vec![Vec3::splat(0.4); splats.len()];
    let half = DVec3::splat(x[0].length());
    let camera = Camera::framing(-half, half, DVec3::NEG_Z, DVec3::Y, 4.0 / 3.0);
    let mut renderer = Renderer::new(settings(DrawMode::ThreePass, 1));
    let closed = SplatView {
        inside: Some(Vec3::new(0.02, 0.0, 0.0)),
        ..tissue.view(&splats, &colors)
    };
    let open = renderer.draw(&tissue.view(&splats, &colors), &[], &camera);
    let closed = renderer.draw(&closed, &[], &camera);
    let mut filled = 0;
    for (k, (before, after)) in open.depth.iter().zip(&closed.depth).enumerate() {
        if before.is_finite() {
            assert_eq!(open.pixels[k], closed.pixels[k], "pixel {k} was covered");
            assert_eq!(before.to_bits(), after.to_bits());
        } else if after.is_finite() {
            let [r, g, b, _] = closed.pixels[k];
            assert!(r > 2 * g.max(b), "pixel {k} is not red: {r} {g} {b}");
            filled += 1;
        }
        let (dx, dy) = ((k % 320) as f64 - 159.5, (k / 320) as f64 - 119.5);
        // The hole's radius is 0.6 of the ball's, which fills 0.44 of 240 pixels.
        if dx.hypot(dy) < 0.5 * 0.44 * 240.0 {
            assert!(after.is_finite(), "pixel {k} shows the background");
        }
    }
    assert!(filled > 5_000, "{filled} pixels were open");
}

/// A chequered image of 8 x 8 squares, red and green by turns, with a blue corner; which channel is strongest in a
/// square.
fn chequered() -> (Arc<Image>, fn(DVec2) -> usize) {
    let strongest = |at: DVec2| {
        let [x, y] = at.floor().to_array().map(|x| x.rem_euclid(8.0));
        match (x + y).rem_euclid(2.0) {
            _ if x < 2.0 && y < 2.0 => 2,
            odd => usize::from(odd > 0.5),
        }
    };
    let mut frame = Frame::blank(64, 64);
    for (k, pixel) in (0_u32..).zip(&mut frame.pixels) {
        let square = DVec2::new(f64::from(k % 64), f64::from(k / 64)) / 8.0;
        *pixel = [0, 0, 0, 255];
        pixel[strongest(square)] = 255;
    }
    (image(&frame), strongest)
}

/// An image that lies on splats by texture coordinates is seen per sample: squares finer than the splats come out where
/// they belong, on a mirrored and turned map too; splats without a position keep their own colour.
#[test]
fn images_lie_where_texture_coordinates_say() {
    const SIDE: u32 = 24;
    let (image, strongest) = chequered();
    let place = |k: u32| f64::from(k) / f64::from(SIDE - 1) - 0.5;
    let x = (0..SIDE * SIDE).map(|k| DVec3::new(place(k % SIDE), place(k / SIDE), 0.0));
    let x: Vec<DVec3> = x.collect();
    let areas = vec![f64::from(SIDE).powi(-2); x.len()];
    let (mut tissue, splats) = at_rest((x.clone(), vec![DVec3::Z; x.len()], areas));
    let half = DVec3::new(0.4, 0.4, 0.0);
    let camera = Camera::framing_orthographic(-half, half, DVec3::NEG_Z, DVec3::Y, 4.0 / 3.0);
    let settings = RenderSettings {
        images: vec![image],
        ..settings(DrawMode::ThreePass, 1)
    };
    for map in [
        DMat2::from_cols(DVec2::new(0.9, 0.0), DVec2::new(0.0, -0.9)),
        DMat2::from_cols(DVec2::new(0.0, 0.7), DVec2::new(0.7, 0.0)),
        DMat2::from_angle(0.4) * 0.6,
    ] {
        let at = |p: DVec3| DVec2::splat(0.5) + map * p.truncate();
        let tangents = <[DVec3; 2]>::from(Surfel::tangents(DVec3::Z));
        let place = |&p: &DVec3| TexturePlace {
            image: 0,
            at: at(p).as_vec2(),
            along: tangents.map(|t| (map * t.truncate()).as_vec2()),
        };
        // A strip at the left has none.
        tissue.set_places(x.iter().map(|p| (p.x > -0.3).then(|| place(p))).collect());
        let frame = draw(&tissue, &splats, &camera, settings.clone());
        let (w, h) = (f64::from(frame.width), f64::from(frame.height));
        let Lens::Orthographic { height } = camera.lens else {
            panic!("it is orthographic");
        };
        let (mut right, mut seen, mut gray) = (0, 0, 0);
        for (k, pixel) in (0_u32..).zip(&frame.pixels) {
            let (px, py) = (f64::from(k % frame.width), f64::from(k / frame.width));
            let p = DVec3::new(px + 0.5 - 0.5 * w, 0.5 * h - py - 0.5, 0.0) * (height / h);
            let [r, g, b, _] = pixel.map(u32::from);
            // Away from the borders of squares and of the strip.
            let at = at(p) * 8.0;
            let inner = (at - at.floor() - 0.5).abs().max_element() < 0.35;
            if p.x.abs().max(p.y.abs()) > 0.38 {
                continue;
            }
            if p.x < -0.35 {
                gray += u32::from(r.abs_diff(g).max(g.abs_diff(b)) < 40);
            } else if p.x >= -0.25 && inner {
                let mut channels = [r, g, b];
                channels.swap(0, strongest(at));
                seen += 1;
                right += u32::from(channels[0] > 2 * channels[1].max(channels[2]));
            }
        }
        assert!(seen > 5_000 && gray > 200, "{seen} pixels, {gray} grey");
        assert_eq!(right, seen, "pixels that show their square");
    }
}
