//! Where the camera stands.

use glam::DVec3;
use phyxel_splat::{Camera, Lens};

use crate::scene::{Pictures, View};
use crate::world::World;

/// The camera that a scene's pictures ask for.
pub(super) fn camera_of(world: &World, pictures: &Pictures) -> Camera {
    match pictures.view {
        View::Around {
            azimuth,
            elevation,
            zoom,
            parallel,
        } => {
            let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            for member in world.members() {
                let bounds = member.body.solid.bounds();
                low = low.min(bounds.min);
                high = high.max(bounds.max);
            }
            let (sin_a, cos_a) = azimuth.to_radians().sin_cos();
            let (sin_e, cos_e) = elevation.to_radians().sin_cos();
            let towards = DVec3::new(sin_a * cos_e, -cos_a * cos_e, sin_e);
            let aspect = f64::from(pictures.width) / f64::from(pictures.height);
            if parallel {
                let mut camera =
                    Camera::framing_orthographic(low, high, -towards, DVec3::Z, aspect);
                if let Lens::Orthographic { height } = &mut camera.lens {
                    *height /= zoom;
                }
                return camera;
            }
            let mut camera = Camera::framing(low, high, -towards, DVec3::Z, aspect);
            let middle = low.midpoint(high);
            camera.eye = middle + (camera.eye - middle) / zoom;
            camera
        }
        View::Explicit {
            eye,
            target,
            field_of_view,
        } => Camera::looking_at(eye, target, DVec3::Z, field_of_view.to_radians()),
    }
}
