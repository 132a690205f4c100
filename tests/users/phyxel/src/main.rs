//! A block hangs from its top, comes to rest, and is cut half through.

use phyxel::glam::DVec3;
use phyxel::scene::{Body, Cut, Key, Region, Scene, Shape, Support, Target};
use phyxel::world::World;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut body = Body::new(Shape::Box { size: DVec3::new(0.04, 0.04, 0.08) });
    body.sampling.target = Target::Nodes(800);
    let mut scene = Scene::new("block", vec![body]);
    scene.supports.push(Support::fixed(Region::HalfSpace { point: DVec3::Z * 0.0399, normal: DVec3::Z }));
    let edge = vec![DVec3::new(0.0, -0.03, 0.0), DVec3::new(0.0, 0.03, 0.0)];
    let path = [(0.0, -0.03), (0.2, 0.0)].map(|(time, x)| Key::new(time, DVec3::new(x, 0.0, 0.001)));
    scene.cuts.push(Cut::new(edge, path.to_vec()));
    let mut world = World::new(scene)?;
    world.play(0.3, |_| ())?;
    let severed = world.members()[0].cutting.as_ref().map_or(0, |cutting| cutting.severed_pairs());
    println!("{} steps, {severed} pairs severed", world.steps());
    assert!((50..2000).contains(&severed));
    Ok(())
}
