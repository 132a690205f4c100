//! What clients ask for: time, undo, other scenes, values, files.

use std::path::Path;

use glam::DVec3;
use phyxel_live::{ClientId, Control, Picture, To, Told};

use super::LiveShow;
use crate::live::session::{Recording, SAVED, Session, SessionError};
use crate::output::OutputFolder;
use phyxel::scene::Scene;

/// Largest picture (pixels to a side) that a client may ask for.
const LARGEST_PICTURE: u32 = 4096;

impl LiveShow {
    pub(super) fn control(
        &mut self,
        client: ClientId,
        control: Control,
    ) -> Result<(), SessionError> {
        match control {
            Control::Play => (self.playing, self.steps_left) = (true, 0),
            Control::Pause => (self.playing, self.steps_left) = (false, 0),
            Control::Step { steps } => {
                self.playing = false;
                self.steps_left = self.steps_left.saturating_add(steps.min(100_000));
            }
            Control::Reset => {
                self.session.reset();
                self.begin_epoch();
            }
            Control::Undo => {
                if self.session.undo()? {
                    self.begin_epoch();
                } else {
                    self.note(To::One(client), "there is no stroke to undo");
                }
            }
            Control::Save { name } => self.save(client, &name)?,
            Control::Picture(asked) => self.picture(client, &asked),
            Control::Scene { name } => {
                let scene = self.sources.scene(&name)?;
                self.show(scene)?;
            }
            Control::Set {
                gravity,
                damping,
                stiffness,
            } => self.set(client, gravity, damping, stiffness)?,
            Control::Unit { metres } => match self.sources.mesh_of(&self.base.name) {
                Some(file) if (1e-6..=1e3).contains(&metres) => {
                    let file = file.to_owned();
                    self.show_mesh(client, &file, Some(metres));
                }
                _ => self.complain(To::One(client), "this scene was made for no mesh file"),
            },
            Control::Color { by } => {
                self.colors[client] = by;
                self.fresh = true;
            }
            Control::Open { name } => self.open(client, &name)?,
            Control::Watch { watching } => self.away[client] = !watching,
            Control::Invite => match self.server.url() {
                Ok(url) => self.server.tell(To::One(client), &Told::Invite { url }),
                Err(error) => self.complain(To::One(client), &error.to_string()),
            },
            _ => {}
        }
        self.send_stats();
        Ok(())
    }

    /// Saves the session in a folder of a name.
    fn save(&mut self, client: ClientId, asked: &str) -> Result<(), SessionError> {
        let Some(name) = folder_name(asked) else {
            let text = "a name has up to 60 letters, digits, spaces, - and _";
            self.complain(To::One(client), text);
            return Ok(());
        };
        let name = self.free(|number| match number {
            1 => name.to_owned(),
            _ => format!("{name}-{number}"),
        });
        let folder = OutputFolder::create(&self.folder.path().join(name))?;
        let files = self.session.save(&folder)?;
        let folder = folder.path().display().to_string();
        self.server.tell(To::All, &Told::Saved { folder, files });
        Ok(())
    }

    /// Folders of recordings that were saved here, by name.
    pub(super) fn recordings(&self) -> Vec<String> {
        let folders = std::fs::read_dir(self.folder.path()).into_iter().flatten();
        let folders = folders.flatten().filter(|entry| {
            let has = |name: &&str| entry.path().join(name).is_file();
            SAVED.iter().all(has)
        });
        let names = folders.filter_map(|entry| entry.file_name().into_string().ok());
        let mut names: Vec<String> = names.filter(|name| folder_name(name).is_some()).collect();
        names.sort_unstable();
        names
    }

    /// Plays a recording that was saved here.
    fn open(&mut self, client: ClientId, name: &str) -> Result<(), SessionError> {
        if !self.recordings().iter().any(|known| known == name) {
            self.complain(To::One(client), "there is no such recording");
            return Ok(());
        }
        match Recording::read(&self.folder.path().join(name)) {
            Ok((scene, recording)) => {
                let mut session = Session::new(&scene)?;
                session.replay(recording);
                self.playing = true;
                self.set_session(session, scene);
            }
            Err(error) => self.complain(To::One(client), &error),
        }
        Ok(())
    }

    /// Shows another scene.
    pub(super) fn show(&mut self, scene: Scene) -> Result<(), SessionError> {
        let session = Session::new(&scene)?;
        self.set_session(session, scene);
        Ok(())
    }

    fn set_session(&mut self, session: Session, base: Scene) {
        (self.session, self.base) = (session, base);
        self.lost_at = None;
        self.clock.slipped = 0.0;
        self.begin_epoch();
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
        let gravity = within(gravity, -100.0, 100.0);
        let damping = within(damping, 0.0, 1000.0);
        let stiffness = within(stiffness, 10.0, 1e9);
        if asked != [gravity, damping, stiffness] {
            let text = "a value is out of its range and left as it was";
            self.complain(To::One(client), text);
        }
        if let Some(gravity) = gravity {
            let scene = self.base.gravity.map_or(DVec3::ZERO, |g| g.acceleration);
            let down = scene.try_normalize().unwrap_or(DVec3::NEG_Z);
            self.session.set_gravity(down * gravity);
        }
        if let Some(damping) = damping {
            self.session.set_damping(damping);
        }
        if let Some(stiffness) = stiffness {
            let mut scene = self.base.clone();
            for body in &mut scene.bodies {
                body.material.youngs_modulus = stiffness;
            }
            self.show(scene)?;
        }
        Ok(())
    }

    /// The first of some names, by number from 1, that the folder does not have: nothing is overwritten.
    fn free(&self, name: impl Fn(u32) -> String) -> String {
        let names = (1..).map(name);
        let mut free = names.filter(|name| !self.folder.path().join(name).exists());
        free.next().unwrap_or_default()
    }

    /// Writes a picture as the renderer of runs draws it.
    pub(super) fn picture(&mut self, client: ClientId, asked: &Picture) {
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
        painter.look(camera, [width, height]);
        painter.carry(world);
        let frame = painter.draw(world);
        let name = self.free(|number| format!("picture-{number:03}.png"));
        let mut bytes = Vec::new();
        let drawn = frame.write_png(&mut bytes);
        let written = drawn.map_err(|error| error.to_string()).and_then(|()| {
            let written = self.folder.write(&name, &bytes);
            written.map_err(|error| error.to_string())
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
        let name = self.free(|number| format!("mesh-{number:03}.{extension}"));
        let file = self.folder.path().join(&name);
        match self.folder.write(&name, content) {
            Ok(()) => self.show_mesh(client, &file, None),
            Err(error) => self.complain(To::One(client), &error.to_string()),
        }
    }

    /// Shows the default scene of a mesh file.
    fn show_mesh(&mut self, client: ClientId, file: &Path, scale: Option<f64>) {
        let shown = self.sources.take_mesh(file, scale);
        let shown = shown.and_then(|(scene, note)| {
            self.show(scene).map_err(|error| error.to_string())?;
            Ok(note)
        });
        match shown {
            Ok(note) => self.note(To::All, &note),
            Err(error) => self.complain(To::One(client), &error),
        }
    }
}

/// A name that someone gave a folder, which leads nowhere else; `save` where it is empty, nothing if it is none.
fn folder_name(asked: &str) -> Option<&str> {
    let fits = |c: char| c.is_alphanumeric() || "-_ ".contains(c);
    match asked.trim() {
        "" => Some("save"),
        name => Some(name).filter(|name| name.chars().count() <= 60 && name.chars().all(fits)),
    }
}
