//! A block hangs from its top, comes to rest, and is cut half through.

use phyxel::glam::DVec3;
use phyxel::scene::{Body, Cut, Key, Region, Scene, Shape, Support, Target};
use phyxel::World;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let at = DVec3::new;
    let size = at(0.04, 0.04, 0.08);
    let mut body = Body::new(Shape::Box { size });
    body.sampling.target = Target::Nodes(800);
    let mut scene = Scene::new("block", vec![body]);
    let (point, normal) = (DVec3::Z * 0.0399, DVec3::Z);
    scene.supports = vec![Support::fixed(Region::HalfSpace { point, normal })];
    let edge = vec![at(0.0, -0.03, 0.0), at(0.0, 0.03, 0.0)];
    let path = [(0.0, -0.03), (0.2, 0.0)].map(|(time, x)| Key::new(time, at(x, 0.0, 0.001)));
    scene.cuts = vec![Cut::new(edge, path.to_vec())];
    let mut world = World::new(scene)?;
    world.play(0.3, |_| ())?;
    let cutting = world.members()[0].cutting.as_ref().ok_or("no cut")?;
    assert!((50..2000).contains(&cutting.severed_pairs()));
    Ok(())
}
