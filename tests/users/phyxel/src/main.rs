//! A block hangs from its top, comes to rest, and is cut half through.

use phyxel::glam::DVec3;
use phyxel::scene::{Body, Region, Scene, Shape, Support, Target};
use phyxel::{StrokePhase, World};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let at = DVec3::new;
    let size = at(0.04, 0.04, 0.08);
    let mut body = Body::new(Shape::Box { size });
    body.sampling.target = Target::Nodes(800);
    let mut scene = Scene::new("block", vec![body]);
    let (point, normal) = (DVec3::Z * 0.0399, DVec3::Z);
    scene.supports = vec![Support::fixed(Region::HalfSpace { point, normal })];
    let mut world = World::new(scene)?;
    world.settle()?;
    let edge = |x: f64| [-0.03, 0.03].map(|y| at(x, y, 0.001));
    world.cut(StrokePhase::Start, &edge(-0.03))?;
    for k in 1..=20 {
        let time = 0.01 * f64::from(k);
        world.cut(StrokePhase::Update, &edge(0.15 * time - 0.03))?;
        world.play(time, |_| ())?;
    }
    world.cut(StrokePhase::End, &edge(0.0))?;
    world.play(0.3, |_| ())?;
    let lowest = world.positions(0).iter().map(|x| x.z).fold(0.0, f64::min);
    assert!(lowest < -0.041, "{lowest}");
    let cutting = world.bodies()[0].cutting.as_ref().ok_or("no cut")?;
    assert!((50..2000).contains(&cutting.severed_pairs()));
    Ok(())
}
