//! Running a scene: from the validated scene to the files of its folder.

mod ending;
mod kept;
mod movie;
mod records;
mod report;
mod series;
mod states;
mod summary;

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use crate::output::{Interrupt, OutputError, OutputFolder, Progress};
use crate::picture::{Painter, PictureError};
use phyxel::scene::{Rest, Scene};
use phyxel::{BodyShares, Input, InputError, Phase, World, WorldError};

#[cfg(feature = "live")]
pub(crate) use ending::doubts;
use kept::Course;
pub use kept::{CHECKPOINT, RunState};
use movie::Movie;
use records::Records;
pub use report::table;
pub(crate) use series::csv_row;
pub use summary::{
    BodySummary, CutSummary, EnergySummary, Latency, PhaseTiming, PictureSummary, SteppingSummary,
    Summary, Timings, ToolSummary,
};

/// How a scene is run, beside what it says itself.
#[derive(Debug, Clone)]
pub struct RunOptions {
    /// Folder of the results; made where it is not there.
    pub out: PathBuf,
    /// Number of threads; all that the machine has where not given.
    pub threads: Option<usize>,
    /// Whether nothing is shown while the scene runs.
    pub quiet: bool,
    /// What may ask the run to stop, such as Ctrl-C; it then leaves a checkpoint.
    pub interrupt: Option<Interrupt>,
}

impl RunOptions {
    /// A run into a folder by so many threads that shows nothing and that nothing stops.
    #[must_use]
    pub fn quiet(out: impl Into<PathBuf>, threads: usize) -> Self {
        Self {
            out: out.into(),
            threads: Some(threads),
            quiet: true,
            interrupt: None,
        }
    }
}

/// A run that did not end well.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// A result cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The world cannot be built, or a step failed.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The world cannot be drawn.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A step failed; there is a state to resume from.
    #[error(
        "{source}; the last good state, at {time:.4} s, is kept: to resume with smaller steps: \
         phyxel run --resume {} --set {advice}",
        checkpoint.display()
    )]
    Diverged {
        /// The body at fault and what went wrong.
        source: Box<WorldError>,
        /// Time (s) of the state.
        time: f64,
        /// The change that halves the steps.
        advice: String,
        /// The file that holds it.
        checkpoint: PathBuf,
    },
    /// The user asked to stop.
    #[error("stopped at {time:.4} s; to resume: phyxel run --resume {}", checkpoint.display())]
    Interrupted {
        /// Time (s) reached.
        time: f64,
        /// The file that holds the state.
        checkpoint: PathBuf,
    },
    /// An input does not belong to the scene.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The threads cannot be started.
    #[error("cannot start {threads} threads: {source}; ask for fewer with --threads")]
    Threads {
        /// Number asked for.
        threads: usize,
        /// What the system said.
        source: rayon::ThreadPoolBuildError,
    },
    /// An image cannot be encoded.
    #[error("cannot encode {file}: {source}")]
    Image {
        /// The file.
        file: String,
        /// What the encoder said.
        source: phyxel_splat::ImageError,
    },
}

/// Runs `scene` and writes its results.
///
/// # Errors
/// [`RunError`] says what went wrong; the folder then holds no half-written file.
pub fn run(scene: &Scene, options: &RunOptions) -> Result<Summary, RunError> {
    go(scene, From::Start, options, None)
}

/// Runs `scene` with tools and blades doing what `inputs` say, such as those of
/// [`crate::output::read_input`], instead of what the scene's paths say.
///
/// # Errors
/// As [`run`], and [`RunError::Input`].
pub fn replay(
    scene: &Scene,
    inputs: Vec<Input>,
    options: &RunOptions,
) -> Result<Summary, RunError> {
    go(scene, From::Input(inputs), options, None)
}

/// Continues a run from a checkpoint ([`crate::output::read_checkpoint`]). The results are those
/// of a run that was never interrupted, bit for bit, timings aside; frames drawn before are taken from
/// the folder where they are there.
///
/// # Errors
/// As [`run`].
pub fn resume(scene: &Scene, state: RunState, options: &RunOptions) -> Result<Summary, RunError> {
    go(scene, From::State(Box::new(state)), options, None)
}

/// Runs `scene`, or resumes it from a state, with its body partitioned ([`World::new_shared`]) once `builders`
/// threads have built it. The results are those of [`run`] and [`resume`], bit for bit.
///
/// # Errors
/// As [`run`].
pub fn run_shared(
    scene: &Scene,
    state: Option<RunState>,
    options: &RunOptions,
    shares: Arc<Mutex<dyn BodyShares>>,
    builders: usize,
) -> Result<Summary, RunError> {
    let from = state.map_or(From::Start, |state| From::State(Box::new(state)));
    let builders = pool(Some(builders))?;
    go(scene, from, options, Some((shares, builders)))
}

/// What a run begins with, beside its scene.
enum From {
    Start,
    State(Box<RunState>),
    Input(Vec<Input>),
}

/// Shares of a body, and the threads that build it for them.
type SharesAndBuilders = (Arc<Mutex<dyn BodyShares>>, rayon::ThreadPool);

fn go(
    scene: &Scene,
    from: From,
    options: &RunOptions,
    shares: Option<SharesAndBuilders>,
) -> Result<Summary, RunError> {
    let pool = pool(options.threads)?;
    pool.install(|| {
        let run = Run::start(scene, from, options, shares)?;
        run.finish(pool.current_num_threads())
    })
}

/// So many threads; all that the machine has where not given.
///
/// # Errors
/// [`RunError::Threads`] if they cannot be started.
pub fn pool(threads: Option<usize>) -> Result<rayon::ThreadPool, RunError> {
    let threads = threads.unwrap_or_else(machine_threads);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|source| RunError::Threads { threads, source })
}

/// Threads that the machine has.
pub(crate) fn machine_threads() -> usize {
    std::thread::available_parallelism().map_or(1, Into::into)
}

/// Removes what an earlier run has written, so that every file of the folder is of one run. States and
/// frames go where the new ones are begun.
fn clean(folder: &OutputFolder, world: &World, also: &[&str]) -> Result<(), OutputError> {
    let names = ["summary.json", movie::ANIMATION, CHECKPOINT];
    for name in names.iter().chain(&records::FILES).chain(also) {
        folder.remove(name)?;
    }
    states::remove_last(folder)?;
    if world.scene().pictures.is_none() && folder.path().join("frames").exists() {
        folder.fresh_subfolder("frames", "frame-", ".png", &[])?;
    }
    Ok(())
}

/// Where this process began, which is what timings count from: a resumed run has steps and time behind it.
#[derive(Clone, Copy)]
struct Begun {
    clock: Instant,
    steps: u64,
    time: f64,
}

/// A scene that runs.
struct Run {
    begun: Begun,
    /// Before the folder, which is others' once it is dropped.
    movie: Option<Movie>,
    folder: OutputFolder,
    progress: Progress,
    world: World,
    painter: Option<Painter>,
    records: Records,
    course: Course,
    interrupt: Option<Interrupt>,
}

impl Run {
    fn start(
        scene: &Scene,
        from: From,
        options: &RunOptions,
        shares: Option<SharesAndBuilders>,
    ) -> Result<Self, RunError> {
        let clock = Instant::now();
        let folder = OutputFolder::claim(&options.out)?;
        let progress = Progress::new(options.quiet);
        progress.phase("setup");
        let mut world = match shares {
            None => World::new(scene.clone())?,
            Some((shares, builders)) => World::new_shared(scene.clone(), shares, &builders)?,
        };
        let mut painter = match &scene.pictures {
            Some(pictures) => {
                let start = Instant::now();
                let painter = Painter::new(&world, pictures)?;
                world.phases().add(Phase::Setup, start.elapsed());
                Some(painter)
            }
            None => None,
        };
        match &from {
            From::State(_) => folder.remove("summary.json")?,
            From::Start => clean(&folder, &world, &["input.csv"])?,
            // The recording may be the one of the run before.
            From::Input(_) => clean(&folder, &world, &[])?,
        }
        let (records, movie, course) = match from {
            From::State(state) => state.restore(&mut world, painter.as_mut())?,
            From::Start => (Records::new(&world), None, Course::new(&world)),
            From::Input(inputs) => {
                world.push(inputs)?;
                (Records::new(&world), None, Course::new(&world))
            }
        };
        records.states.clear(&folder, &world)?;
        folder.write("scene.ron", phyxel_scene::to_ron(scene).as_bytes())?;
        let pictures = scene.pictures.as_ref();
        let movie = pictures.map(|pictures| Movie::new(&folder, pictures, movie));
        let movie = movie.transpose()?;
        Ok(Self {
            begun: Begun {
                clock,
                steps: world.steps(),
                time: world.time(),
            },
            folder,
            progress,
            world,
            painter,
            movie,
            records,
            course,
            interrupt: options.interrupt.clone(),
        })
    }

    fn finish(mut self, threads: usize) -> Result<Summary, RunError> {
        let outcome = self.settle().and_then(|()| self.play());
        if outcome.is_err() {
            // What was recorded up to the failure helps to find its cause.
            self.records.write(&self.folder, &self.world)?;
        }
        outcome?;
        self.grow()?;
        self.keep()?;
        self.record(true)?;
        let mut files = vec!["scene.ron".to_owned()];
        files.extend(self.records.write(&self.folder, &self.world)?);
        if let Some(movie) = self.movie.take() {
            self.progress.phase("animation");
            let start = Instant::now();
            files.extend(movie.finish(&self.folder)?);
            self.world.phases().add(Phase::Writing, start.elapsed());
        }
        let (states, painter) = (&self.records.states, self.painter.as_mut());
        files.extend(states.write_last(&self.folder, &self.world, painter)?);
        files.extend([CHECKPOINT, "summary.json"].map(str::to_owned));
        let summary = ending::of(
            &mut self.world,
            self.painter.as_ref(),
            &self.records,
            &ending::Ending {
                begun: self.begun,
                threads,
                course: self.course,
                files,
            },
        );
        let mut text = serde_json::to_vec_pretty(&summary).unwrap_or_default();
        text.push(b'\n');
        self.folder.write("summary.json", &text)?;
        Ok(summary)
    }

    /// Lets the bodies come to rest.
    fn settle(&mut self) -> Result<(), RunError> {
        let integration = self.world.scene().integration;
        let Some(settle) = integration.settle else {
            return Ok(());
        };
        if self.world.scene_time().is_some() {
            return Ok(());
        }
        self.progress.phase("settling");
        while self.world.is_settling() {
            self.advance()?;
            self.course.settling_steps += 1;
            let longest = integration.duration + settle.limit;
            self.progress.set(self.world.time() / longest);
        }
        self.course.rested = settle.rest == Rest::Equilibrium || self.world.is_at_rest();
        self.world.start_scene()?;
        Ok(())
    }

    /// Plays the scene.
    fn play(&mut self) -> Result<(), RunError> {
        self.progress.phase("playing");
        let duration = self.world.scene().integration.duration;
        while let Some(time) = self.world.scene_time().filter(|_| !self.world.is_over()) {
            self.advance()?;
            self.course.smallest_step = self.course.smallest_step.min(self.world.step_size());
            let settled = self.world.time() - time;
            self.progress.set(self.world.time() / (settled + duration));
        }
        Ok(())
    }

    /// Writes what is due and takes one step.
    fn advance(&mut self) -> Result<(), RunError> {
        self.grow()?;
        self.record(false)?;
        let asked = self.interrupt.as_ref().is_some_and(Interrupt::asked);
        if asked || self.is_keeping_due() {
            self.keep()?;
        }
        if asked {
            return Err(RunError::Interrupted {
                time: self.world.time(),
                checkpoint: self.folder.path().join(CHECKPOINT),
            });
        }
        let told = self.world.alarms().len();
        let result = self.world.step();
        for alarm in &self.world.alarms()[told..] {
            self.progress.warn(alarm);
        }
        result.map_err(|source| self.failure(source))
    }

    /// Grows skin on new cuts.
    fn grow(&mut self) -> Result<(), PictureError> {
        let pieces = self.world.take_new_pieces();
        if let Some(painter) = &mut self.painter
            && !pieces.is_empty()
        {
            let start = Instant::now();
            painter.grow(&self.world, &pieces)?;
            self.world.phases().add(Phase::Skinning, start.elapsed());
        }
        Ok(())
    }

    /// Writes what is due, or everything at the `end`.
    fn record(&mut self, end: bool) -> Result<(), RunError> {
        let movie = self.movie.as_mut();
        let drawn = movie.is_some_and(|movie| end || movie.is_due(&self.world));
        self.records.take(&self.world, end);
        let painter = self.painter.as_mut();
        self.records
            .states
            .write_due(&self.folder, &self.world, painter)?;
        if let (Some(painter), Some(movie)) = (&mut self.painter, &mut self.movie)
            && drawn
        {
            let start = Instant::now();
            painter.carry(&self.world);
            self.world.phases().add(Phase::Skinning, start.elapsed());
            let start = Instant::now();
            let frame = painter.draw(&self.world);
            self.world.phases().add(Phase::Drawing, start.elapsed());
            let start = Instant::now();
            movie.add(frame)?;
            self.world.phases().add(Phase::Writing, start.elapsed());
            let (time, frames) = (self.world.time(), painter.frames());
            self.progress
                .message(format!("{time:.2} s simulated, {frames} frames"));
        }
        Ok(())
    }
}
