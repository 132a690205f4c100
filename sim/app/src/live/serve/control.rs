//! What clients ask for: time, undo, other scenes, values, files.

use glam::DVec3;
use phyxel_live::{ClientId, Control, To, Told};

use super::Show;
use crate::live::session::{Session, SessionError};
use phyxel::scene::Scene;

/// Largest picture (pixels to a side) that a client may ask for.
const LARGEST_PICTURE: u32 = 4096;

impl Show {
    pub(super) fn control(
        &mut self,
        client: ClientId,
        control: Control,
    ) -> Result<(), SessionError> {
        match control {
            Control::Play => self.playing = true,
            Control::Pause => self.playing = false,
            Control::Step { steps } => {
                self.playing = false;
                self.steps_left = self.steps_left.saturating_add(steps.min(100_000));
            }
            Control::Reset => {
                self.session.reset();
                self.begin_epoch();
            }
            Control::Undo => {
                if self.session.undo() {
                    self.begin_epoch();
                } else {
                    self.note(To::One(client), "there is no stroke to undo");
                }
            }
            Control::Save => {
                let files = self.session.save(&self.folder)?;
                let folder = self.folder.path().display().to_string();
                self.server.tell(To::All, &Told::Saved { folder, files });
            }
            picture @ Control::Picture { .. } => self.picture(client, &picture),
            Control::Scene { name } => {
                let scene = self.sources.scene(&name)?;
                self.show(scene)?;
            }
            Control::Set {
                gravity,
                damping,
                stiffness,
            } => self.set(client, gravity, damping, stiffness)?,
            Control::Invite => match self.server.url() {
                Ok(url) => self.server.tell(To::One(client), &Told::Invite { url }),
                Err(error) => self.complain(To::One(client), &error.to_string()),
            },
            _ => {}
        }
        self.send_stats();
        Ok(())
    }

    /// Shows another scene.
    pub(super) fn show(&mut self, scene: Scene) -> Result<(), SessionError> {
        self.session = Session::new(&scene)?;
        self.base = scene;
        self.lost_at = None;
        self.clock.slipped = 0.0;
        self.begin_epoch();
        Ok(())
    }

    pub(super) fn set(
        &mut self,
        client: ClientId,
        gravity: Option<f64>,
        damping: Option<f64>,
        stiffness: Option<f64>,
    ) -> Result<(), SessionError> {
        let within = |value: Option<f64>, low: f64, high: f64| {
            value.filter(|value| (low..=high).contains(value))
        };
        let asked = [gravity, damping, stiffness];
        let taken = [
            within(gravity, -100.0, 100.0),
            within(damping, 0.0, 1000.0),
            within(stiffness, 10.0, 1e9),
        ];
        if asked != taken {
            self.complain(
                To::One(client),
                "a value is out of its range and left as it was",
            );
        }
        if let Some(gravity) = taken[0] {
            let scene = self.base.gravity.map_or(DVec3::ZERO, |g| g.acceleration);
            let down = scene.try_normalize().unwrap_or(DVec3::NEG_Z);
            self.session.set_gravity(down * gravity);
        }
        if let Some(damping) = taken[1] {
            self.session.set_damping(damping);
        }
        if let Some(stiffness) = taken[2] {
            let mut scene = self.base.clone();
            for body in &mut scene.bodies {
                body.material.youngs_modulus = stiffness;
            }
            self.show(scene)?;
        }
        Ok(())
    }

    /// Writes a picture as the renderer of runs draws it.
    pub(super) fn picture(&mut self, client: ClientId, asked: &Control) {
        let camera = crate::live::told::camera_of(asked);
        let Some((camera, [width, height])) = camera else {
            return self.complain(To::One(client), "there is no such camera");
        };
        if !(1..=LARGEST_PICTURE).contains(&width) || !(1..=LARGEST_PICTURE).contains(&height) {
            let text = format!("pictures have 1 to {LARGEST_PICTURE} pixels to a side");
            return self.complain(To::One(client), &text);
        }
        self.grow_all();
        let (painter, world) = self.session.drawing();
        let (_, _, samples) = painter.view();
        painter.look(camera, [width, height], samples);
        painter.carry(world);
        let frame = painter.draw(world);
        self.saves += 1;
        let name = format!("picture-{:03}.png", self.saves);
        let mut bytes = Vec::new();
        let written = frame
            .write_png(&mut bytes)
            .map_err(|error| error.to_string());
        let written = written.and_then(|()| {
            self.folder
                .write(&name, &bytes)
                .map_err(|error| error.to_string())
        });
        match written {
            Ok(()) => {
                let folder = self.folder.path().display().to_string();
                let files = vec![name];
                self.server.tell(To::All, &Told::Saved { folder, files });
            }
            Err(error) => self.complain(To::One(client), &error),
        }
    }

    /// Shows a mesh that someone dropped on the page; it is kept in the output folder.
    pub(super) fn take_mesh(&mut self, client: ClientId, extension: &str, content: &[u8]) {
        self.saves += 1;
        let name = format!("mesh-{:03}.{extension}", self.saves);
        let shown = self
            .folder
            .write(&name, content)
            .map_err(|error| error.to_string())
            .and_then(|()| self.sources.take_mesh(&self.folder.path().join(&name)))
            .and_then(|(scene, note)| {
                self.show(scene).map_err(|error| error.to_string())?;
                Ok(note)
            });
        match shown {
            Ok(note) => self.note(To::All, &note),
            Err(error) => self.complain(To::One(client), &error),
        }
    }
}
