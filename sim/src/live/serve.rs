//! A session shown to clients: what they ask for is done, what moves is sent, at the pace of the clock.

use std::path::PathBuf;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

use glam::{DQuat, DVec3};
use phyxel_live::{
    ClientId, Control, Event, Hand, MAX_CLIENTS, Phase, Server, To, Told, encode_force,
    encode_nodes, encode_state,
};

use super::hands::resampled;
use super::session::{Session, SessionError};
use super::skin::{Skins, plain};
use super::sources::Sources;
use super::told::{bodies_of, scene_of, stats_of, tool_states};
use crate::output::{Interrupt, OutputFolder};
use crate::scene::{Pose, Scene};

/// Length of a tick: events are taken and a state is offered between two.
const TICK: Duration = Duration::from_millis(4);
/// Longest time that steps may take without a look at what clients want.
const LONGEST: Duration = Duration::from_millis(8);
/// Simulated time (s) that may be made up for after a delay; beyond it the clock slips.
const BEHIND: f64 = 0.03;
/// Most events that are taken in between two ticks: a flood must not stop time.
const MOST_EVENTS: usize = 256;
/// Time without anything to do after which interrupts are looked for.
const SLEEP: Duration = Duration::from_millis(500);
/// Time between two messages of figures.
const STATS: Duration = Duration::from_millis(200);
/// Steps in a row that must succeed after a loss; another loss before them stops the clock.
const SOUND_STEPS: u64 = 200;
/// Largest picture (pixels to a side) that a client may ask for.
const LARGEST_PICTURE: u32 = 4096;

/// How a session is served.
#[derive(Debug, Clone)]
pub struct LiveOptions {
    /// Folder of what is saved; nothing is written elsewhere.
    pub out: PathBuf,
    /// What may ask to stop.
    pub interrupt: Option<Interrupt>,
}

/// Serves a session of `scene` until it is interrupted. Nothing is computed while no client is there or
/// time stands.
///
/// # Errors
/// [`SessionError`] if the first world cannot be built or the folder not made; later failures are
/// told to clients.
pub fn serve(
    server: Server,
    scene: &Scene,
    sources: Sources,
    options: &LiveOptions,
) -> Result<(), SessionError> {
    let folder = OutputFolder::create(&options.out)?;
    let mut show = Show {
        server,
        sources,
        folder,
        base: scene.clone(),
        session: Session::new(scene)?,
        skins: Skins::default(),
        epoch: 1,
        number: 0,
        playing: true,
        steps_left: 0,
        heard: [0; MAX_CLIENTS],
        seen: [0; MAX_CLIENTS],
        owners: Owners::default(),
        fresh: false,
        clock: Clock::default(),
        lost_at: None,
        told: Instant::now(),
        saves: 0,
    };
    show.update_skins(To::All);
    loop {
        if options.interrupt.as_ref().is_some_and(Interrupt::asked) {
            return Ok(());
        }
        if show.wait() {
            return Ok(());
        }
        show.tick();
    }
}

/// Who leads what.
#[derive(Debug, Default)]
struct Owners {
    blade: Option<ClientId>,
    grip: Option<ClientId>,
    tools: Vec<(usize, ClientId)>,
}

/// Simulated and wall time.
#[derive(Debug)]
struct Clock {
    /// Wall and simulated time that belong together.
    origin: Option<(Instant, f64)>,
    slipped: f64,
    /// Since the last figures: wall time in steps, steps.
    stepping: (Duration, u32),
    /// Wall and simulated time of the last figures.
    last: Option<(Instant, f64)>,
}

impl Default for Clock {
    fn default() -> Self {
        Self {
            origin: None,
            slipped: 0.0,
            stepping: (Duration::ZERO, 0),
            last: None,
        }
    }
}

struct Show {
    server: Server,
    sources: Sources,
    folder: OutputFolder,
    /// The scene as it was before hands got it.
    base: Scene,
    session: Session,
    skins: Skins,
    epoch: u32,
    number: u32,
    playing: bool,
    /// Steps to take although time stands.
    steps_left: u32,
    /// Last sequence numbers of clients' hands: taken in, and part of a step.
    heard: [u32; MAX_CLIENTS],
    seen: [u32; MAX_CLIENTS],
    owners: Owners,
    /// Whether there is a state that no client was offered.
    fresh: bool,
    clock: Clock,
    /// Steps taken when a step was lost last.
    lost_at: Option<u64>,
    told: Instant,
    saves: u32,
}

impl Show {
    /// Whether there are steps to take.
    fn is_moving(&self) -> bool {
        self.steps_left > 0 || (self.playing && self.server.client_count() > 0)
    }

    /// Takes in what clients did, for as long as there is nothing better to do; `true` at the end.
    fn wait(&mut self) -> bool {
        let patience = if !self.is_moving() {
            self.clock.origin = None;
            SLEEP
        } else if self.steps_left > 0 || self.is_behind() {
            Duration::ZERO
        } else {
            TICK
        };
        let until = Instant::now() + patience;
        for _ in 0..MOST_EVENTS {
            let left = until.saturating_duration_since(Instant::now());
            match self.server.events().recv_timeout(left) {
                Ok((client, event)) => {
                    self.take(client, event);
                    if !self.is_moving() {
                        return false;
                    }
                }
                Err(RecvTimeoutError::Timeout) => return false,
                Err(RecvTimeoutError::Disconnected) => return true,
            }
        }
        false
    }

    /// Simulated time (s) at which the clock is.
    fn target(&mut self) -> f64 {
        let time = self.session.world().time();
        let (wall, simulated) = *self.clock.origin.get_or_insert((Instant::now(), time));
        simulated + wall.elapsed().as_secs_f64()
    }

    fn is_behind(&mut self) -> bool {
        self.target() > self.session.world().time() + TICK.as_secs_f64()
    }

    /// Takes the steps that are due and offers a state.
    fn tick(&mut self) {
        let begun = Instant::now();
        let counted = self.steps_left > 0;
        while self.steps_left > 0 && begun.elapsed() < LONGEST {
            self.steps_left -= 1;
            self.step();
        }
        if self.playing && self.is_moving() {
            let target = self.target();
            while self.playing && self.session.world().time() < target && begun.elapsed() < LONGEST
            {
                self.step();
            }
            let behind = self.target() - self.session.world().time();
            if behind > BEHIND {
                self.clock.slipped += behind;
                self.clock.origin = None;
            }
        }
        if self.fresh && self.server.wants_state() {
            self.send_state();
        }
        let due = self.told.elapsed() > STATS && self.is_moving();
        if (due || (counted && self.steps_left == 0)) && self.server.client_count() > 0 {
            self.send_stats();
        }
    }

    fn step(&mut self) {
        let begun = Instant::now();
        self.fresh = true;
        match self.session.step() {
            Ok(changed) => {
                self.seen = self.heard;
                if changed {
                    let bodies = self.session.world().members().len();
                    let painter = self.session.painter();
                    for message in self.skins.changes(self.epoch, painter, bodies) {
                        self.server.send(To::All, message);
                    }
                }
            }
            Err(error) => self.lose(&error),
        }
        self.clock.stepping.0 += begun.elapsed();
        self.clock.stepping.1 += 1;
    }

    /// A step was lost: says so and goes back to the last good state.
    fn lose(&mut self, error: &SessionError) {
        let steps = self.session.world().steps();
        self.complain(To::All, &format!("{error}; back to before the last stroke"));
        let again = self
            .lost_at
            .is_some_and(|before| steps < before + SOUND_STEPS);
        let back = if again {
            self.session.reset()
        } else {
            self.session.recover()
        };
        if again || back.is_err() {
            self.playing = false;
            self.steps_left = 0;
        }
        if let Err(error) = back {
            self.complain(To::All, &error.to_string());
        }
        self.lost_at = Some(self.session.world().steps());
        self.begin_epoch();
    }

    fn note(&self, to: To, text: &str) {
        let text = text.to_owned();
        self.server.tell(to, &Told::Note { bad: false, text });
    }

    fn complain(&self, to: To, text: &str) {
        let text = text.to_owned();
        self.server.tell(to, &Told::Note { bad: true, text });
    }

    fn update_skins(&mut self, to: To) {
        let bodies = self.session.world().members().len();
        let painter = self.session.painter();
        for message in self.skins.changes(self.epoch, painter, bodies) {
            self.server.send(to, message);
        }
    }

    /// Everything anew: another world is shown.
    fn begin_epoch(&mut self) {
        self.epoch += 1;
        self.server.forget_states();
        self.owners = Owners::default();
        self.skins = Skins::default();
        let bodies = self.session.world().members().len();
        // What clients know begins with this; they get it by `introduce`.
        self.skins
            .changes(self.epoch, self.session.painter(), bodies);
        self.clock.origin = None;
        self.clock.last = None;
        self.introduce(To::All);
    }

    /// Sends all that a client needs to know.
    fn introduce(&mut self, to: To) {
        let world = self.session.world();
        let scene = scene_of(self.epoch, &self.session, &self.base, &self.sources);
        self.server.tell(to, &Told::Scene(Box::new(scene)));
        for (index, member) in world.members().iter().enumerate() {
            let rest = plain(&member.body.rest);
            self.server.send(to, encode_nodes(self.epoch, index, &rest));
        }
        for message in self.skins.whole(self.epoch, self.session.painter()) {
            self.server.send(to, message);
        }
        self.fresh = true;
        self.send_stats();
    }

    fn send_state(&mut self) {
        self.number = self.number.wrapping_add(1);
        self.fresh = false;
        let world = self.session.world();
        let tools = tool_states(world);
        let bodies = bodies_of(world);
        let bodies: Vec<_> = bodies.iter().map(super::told::Moved::view).collect();
        let (mut energies, mut scale) = ([0.0; 3], 0.0);
        for member in world.members() {
            let audit = member.body.motion.audit();
            energies[0] += audit.kinetic;
            energies[1] += audit.elastic;
            energies[2] += audit.balance();
            scale += audit.scale();
        }
        energies[2] /= f64::max(scale, f64::MIN_POSITIVE);
        let blade = plain(self.session.blade());
        let state = encode_state(
            self.epoch,
            &phyxel_live::State {
                number: self.number,
                step: world.steps(),
                time: world.time(),
                step_size: world.step_size(),
                seen: self.seen,
                energies,
                grip: world.grip_force().unwrap_or(DVec3::ZERO).to_array(),
                tools: &tools,
                blade: &blade,
                bodies: &bodies,
            },
        );
        let count = tools.len();
        for (hand, samples) in self.session.forces().drain().into_iter().enumerate() {
            let idle = samples
                .iter()
                .all(|sample| sample.force.iter().all(|x| *x == 0.0));
            if !idle {
                let hand = if hand == count {
                    phyxel_live::GRIP
                } else {
                    u32::try_from(hand).unwrap_or(phyxel_live::GRIP)
                };
                self.server
                    .send(To::All, encode_force(self.epoch, hand, &samples));
            }
        }
        self.server.put_state(self.number, state);
    }

    fn send_stats(&mut self) {
        self.told = Instant::now();
        let time = self.session.world().time();
        let mut stats = stats_of(&self.session, self.skins.len());
        stats.playing = self.playing;
        stats.slipped = self.clock.slipped;
        let (spent, steps) = std::mem::take(&mut self.clock.stepping);
        stats.step_ms = 1e3 * spent.as_secs_f64() / f64::from(steps.max(1));
        if let Some((wall, before)) = self.clock.last {
            stats.real_time = (time - before).max(0.0) / wall.elapsed().as_secs_f64().max(1e-3);
        }
        self.clock.last = Some((Instant::now(), time));
        self.server.tell(To::All, &Told::Stats(Box::new(stats)));
    }

    /// Does what a client did or asked for.
    fn take(&mut self, client: ClientId, event: Event) {
        match event {
            Event::Joined => {
                self.heard[client] = 0;
                self.seen[client] = 0;
                self.introduce(To::One(client));
            }
            Event::Left => self.leave(client),
            Event::Hand(sequence, hand) => {
                self.heard[client] = sequence;
                self.hand(client, hand);
            }
            Event::Control(control) => {
                if let Err(error) = self.control(client, control) {
                    self.complain(To::One(client), &error.to_string());
                }
            }
            Event::Mesh(extension, content) => self.take_mesh(client, &extension, &content),
            Event::Ready => {}
        }
        if self.fresh && !self.is_moving() && self.server.wants_state() {
            self.send_state();
        }
    }

    fn leave(&mut self, client: ClientId) {
        if self.owners.blade == Some(client) {
            self.owners.blade = None;
            self.session.end_stroke();
        }
        if self.owners.grip == Some(client) {
            self.owners.grip = None;
            self.session.let_go();
        }
        let (own, others): (Vec<_>, Vec<_>) = self
            .owners
            .tools
            .iter()
            .partition(|(_, owner)| *owner == client);
        self.owners.tools = others;
        for (tool, _) in own {
            self.session.put_tool(tool, None);
        }
    }

    fn hand(&mut self, client: ClientId, hand: Hand) {
        match hand {
            Hand::Pose {
                tool,
                phase,
                position,
                rotation,
            } => {
                let pose = Pose {
                    rotation: DQuat::from_array(rotation).normalize(),
                    position: DVec3::from_array(position),
                };
                if tool >= self.session.world().scene().tools.len() {
                    return self.complain(To::One(client), &format!("there is no tool {tool}"));
                }
                self.owners.tools.retain(|(led, _)| *led != tool);
                if phase == Phase::End {
                    return self.session.put_tool(tool, None);
                }
                self.owners.tools.push((tool, client));
                match phase {
                    Phase::Begin => self.session.put_tool(tool, Some(pose)),
                    _ => self.session.lead_tool(tool, pose),
                }
            }
            Hand::Edge { phase, points } => {
                let points: Vec<DVec3> = points.into_iter().map(DVec3::from_array).collect();
                if self.owners.blade.is_some_and(|owner| owner != client) {
                    if phase == Phase::Begin {
                        self.complain(To::One(client), "someone else is cutting");
                    }
                    return;
                }
                match phase {
                    Phase::Begin => {
                        self.owners.blade = Some(client);
                        // A straight edge of two points may bend later.
                        self.session
                            .begin_stroke(resampled(&points, points.len().max(2)));
                    }
                    _ if self.owners.blade.is_none() => {}
                    Phase::Move => self.session.lead_stroke(&points),
                    Phase::End => {
                        if points.len() >= 2 {
                            self.session.lead_stroke(&points);
                        }
                        self.session.end_stroke();
                        self.owners.blade = None;
                    }
                }
            }
            Hand::Grip {
                phase,
                position,
                radius,
            } => {
                if self.owners.grip.is_some_and(|owner| owner != client) {
                    if phase == Phase::Begin {
                        self.complain(To::One(client), "someone else holds the tissue");
                    }
                    return;
                }
                let point = DVec3::from_array(position);
                match phase {
                    Phase::Begin => {
                        self.owners.grip = Some(client);
                        self.session.grip(point, radius);
                    }
                    Phase::Move => self.session.pull(point),
                    Phase::End => {
                        self.owners.grip = None;
                        self.session.let_go();
                    }
                }
            }
        }
    }

    fn control(&mut self, client: ClientId, control: Control) -> Result<(), SessionError> {
        match control {
            Control::Play => self.playing = true,
            Control::Pause => self.playing = false,
            Control::Step { steps } => {
                self.playing = false;
                self.steps_left = self.steps_left.saturating_add(steps.min(100_000));
            }
            Control::Reset => {
                self.session.reset()?;
                self.begin_epoch();
            }
            Control::Undo => {
                if self.session.undo()? {
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
    fn show(&mut self, scene: Scene) -> Result<(), SessionError> {
        self.session = Session::new(&scene)?;
        self.base = scene;
        self.lost_at = None;
        self.clock.slipped = 0.0;
        self.begin_epoch();
        Ok(())
    }

    fn set(
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
    fn picture(&mut self, client: ClientId, asked: &Control) {
        let camera = super::told::camera_of(asked);
        let Some((camera, [width, height])) = camera else {
            return self.complain(To::One(client), "there is no such camera");
        };
        if !(1..=LARGEST_PICTURE).contains(&width) || !(1..=LARGEST_PICTURE).contains(&height) {
            let text = format!("pictures have 1 to {LARGEST_PICTURE} pixels to a side");
            return self.complain(To::One(client), &text);
        }
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
    fn take_mesh(&mut self, client: ClientId, extension: &str, content: &[u8]) {
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
