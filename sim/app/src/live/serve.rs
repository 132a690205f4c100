//! A session shown to clients: what they ask for is done, what moves is sent, at the pace of the clock.

mod control;
mod events;
mod send;

use std::path::PathBuf;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

use phyxel_live::{ClientId, MAX_CLIENTS, Quantity, Server, To, Told};

use super::session::{Session, SessionError};
use super::skin::Skins;
use super::sources::Sources;
use crate::output::{Interrupt, OutputFolder};
use phyxel::scene::Scene;

/// Length of a tick: events are taken and a state is offered between two.
const TICK: Duration = Duration::from_millis(4);
/// Time after which steps that have fallen behind are left for a look at what clients want: it adds to the
/// time in which a user is answered.
const LONGEST: Duration = Duration::from_millis(2);
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

/// How a session is served.
#[derive(Debug, Clone)]
pub struct LiveOptions {
    /// Folder of what is saved; nothing is written elsewhere.
    pub out: PathBuf,
    /// What may ask to stop.
    pub interrupt: Option<Interrupt>,
}

/// Serves a session of `scene` until it is interrupted. Nothing is computed while no client looks on or
/// time stands.
///
/// # Errors
/// [`SessionError`] if the first world cannot be built, or the folder cannot be made or is another's; later
/// failures are reported to clients.
pub fn serve(
    server: Server,
    scene: &Scene,
    sources: Sources,
    options: &LiveOptions,
) -> Result<(), SessionError> {
    let folder = OutputFolder::claim(&options.out)?;
    let mut show = LiveShow {
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
        away: [false; MAX_CLIENTS],
        colors: [Quantity::None; MAX_CLIENTS],
        heard: [0; MAX_CLIENTS],
        seen: [0; MAX_CLIENTS],
        owners: Owners::default(),
        fresh: false,
        hurried: false,
        clock: Clock::default(),
        doubts: 0,
        lost_at: None,
        told: Instant::now(),
    };
    show.know_skins();
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

/// Who drives what.
#[derive(Debug, Default)]
struct Owners {
    blade: Option<ClientId>,
    grip: Option<ClientId>,
    tools: Vec<(usize, ClientId)>,
}

/// Simulated and wall time.
#[derive(Debug, Default)]
struct Clock {
    /// Wall and simulated time that belong together.
    origin: Option<(Instant, f64)>,
    slipped: f64,
    /// Since the last figures: wall time in steps, steps.
    stepping: (Duration, u32),
    /// Wall and simulated time of the last figures.
    last: Option<(Instant, f64)>,
}

struct LiveShow {
    server: Server,
    sources: Sources,
    folder: OutputFolder,
    /// The scene as it was before users got it.
    base: Scene,
    session: Session,
    skins: Skins,
    epoch: u32,
    number: u32,
    playing: bool,
    /// Steps to take although time stands.
    steps_left: u32,
    /// Clients that do not look on.
    away: [bool; MAX_CLIENTS],
    /// What clients colour nodes by.
    colors: [Quantity; MAX_CLIENTS],
    /// Last sequence numbers of clients' hands: taken in, and part of a step.
    heard: [u32; MAX_CLIENTS],
    seen: [u32; MAX_CLIENTS],
    owners: Owners,
    /// Whether there is a state that no client was offered.
    fresh: bool,
    /// Whether a user moved something since the last step: this is answered before the tick is over.
    hurried: bool,
    clock: Clock,
    /// Doubts of this epoch's world that were reported to clients.
    doubts: usize,
    /// Steps taken when a step was lost last.
    lost_at: Option<u64>,
    told: Instant,
}

impl LiveShow {
    /// Whether there are steps to take.
    fn is_moving(&self) -> bool {
        let away = self.away.iter().filter(|away| **away).count();
        self.steps_left > 0 || (self.playing && self.server.client_count() > away)
    }

    /// Takes in what clients did, for as long as there is nothing better to do; `true` at the end.
    fn wait(&mut self) -> bool {
        let patience = if !self.is_moving() {
            self.clock.origin = None;
            SLEEP
        } else if self.steps_left > 0 || self.is_behind() || self.session.surfaces_lag() {
            Duration::ZERO
        } else {
            TICK
        };
        let mut until = Instant::now() + patience;
        for _ in 0..MOST_EVENTS {
            let left = until.saturating_duration_since(Instant::now());
            match self.server.events().recv_timeout(left) {
                Ok((client, event)) => {
                    self.take(client, event);
                    if self.hurried {
                        until = Instant::now();
                    }
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
        // A hand that moved while a cut was made is answered before its surface is: each takes the time of
        // many steps.
        if self.hurried && !counted && self.is_moving() && self.session.surfaces_lag() {
            self.step();
            self.answer();
        }
        if counted || !self.is_moving() {
            self.grow_all();
        } else {
            self.grow();
        }
        while self.steps_left > 0 && begun.elapsed() < LONGEST {
            self.steps_left -= 1;
            self.step();
            self.grow_all();
        }
        if self.playing && self.is_moving() {
            let target = self.target();
            while self.playing && begun.elapsed() < LONGEST {
                // A hand is answered by a step of its own, but a flood of them does not hurry time.
                let ahead = self.session.world().time() - target;
                if ahead >= 0.0 && !(self.hurried && ahead < TICK.as_secs_f64()) {
                    break;
                }
                self.step();
                self.answer();
            }
            let behind = self.target() - self.session.world().time();
            if behind > BEHIND {
                self.clock.slipped += behind;
                self.clock.origin = None;
            }
        }
        for client in self.server.behind() {
            self.introduce(To::One(client));
        }
        if self.fresh && self.server.wants_state() {
            self.send_state();
        }
        let due = self.told.elapsed() > STATS && self.is_moving();
        if (due || (counted && self.steps_left == 0)) && self.server.client_count() > 0 {
            self.send_stats();
        }
    }

    /// Sends the state at once if a user waits for it.
    fn answer(&mut self) {
        if std::mem::take(&mut self.hurried) && self.server.wants_state() {
            self.send_state();
        }
    }

    fn step(&mut self) {
        let begun = Instant::now();
        self.fresh = true;
        match self.session.step() {
            Ok(()) => self.seen = self.heard,
            Err(error) => self.lose(&error),
        }
        self.clock.stepping.0 += begun.elapsed();
        self.clock.stepping.1 += 1;
    }

    /// Grows surfaces by all that was cut.
    fn grow_all(&mut self) {
        while self.session.surfaces_lag() {
            self.grow();
        }
    }

    /// Grows surfaces by some of what was cut and sends what that changed.
    fn grow(&mut self) {
        match self.session.grow() {
            Ok(changed) => {
                let painter = self.session.painter();
                for message in self.skins.changes(self.epoch, painter, &changed) {
                    self.server.send(To::All, message);
                }
            }
            Err(error) => self.lose(&error),
        }
    }

    /// A step was lost: says so and goes back to the last good state.
    fn lose(&mut self, error: &SessionError) {
        let steps = self.session.world().steps();
        self.complain(To::All, &format!("{error}; back to before the last stroke"));
        let again = self
            .lost_at
            .is_some_and(|before| steps < before + SOUND_STEPS);
        if again {
            self.session.reset();
            self.playing = false;
            self.steps_left = 0;
        } else {
            self.session.recover();
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
}
