//! What a run reports: the content of `summary.json` and of the closing table. `ending` makes it of a world.

use serde::Serialize;

use phyxel::{CutEnergy, Phase, Phases};

/// What a run did.
///
/// Everything outside [`Summary::timings`] is the same, bit for bit, for any number of threads.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the scene.
    pub scene: String,
    /// Version of the program.
    pub version: &'static str,
    /// One entry per body.
    pub bodies: Vec<BodySummary>,
    /// Time stepping.
    pub stepping: SteppingSummary,
    /// Cuts; absent if the scene has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cuts: Option<CutSummary>,
    /// One entry per tool; absent if the scene has none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tools: Vec<ToolSummary>,
    /// Contact of bodies with each other and of flanks; absent if the scene asks for none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<ContactSummary>,
    /// Pictures; absent if the scene draws none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pictures: Option<PictureSummary>,
    /// What the scene asked for without effect, one sentence each; absent if nothing.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Where the time went.
    pub timings: Timings,
    /// Files of the folder, by name.
    pub files: Vec<String>,
}

/// One body, its size, its energies and what must be conserved.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BodySummary {
    /// Name in the scene.
    pub name: String,
    /// Nodes.
    pub nodes: usize,
    /// Directed node pairs.
    pub pairs: usize,
    /// Tetrahedra that gave the nodes their volumes and edges.
    pub tetrahedra: usize,
    /// Nodes that a support holds or drives.
    pub supported: usize,
    /// Distance between nodes (m).
    pub spacing: f64,
    /// Volume (m³) of the rest shape.
    pub volume: f64,
    /// Deviation of the tetrahedra's volume from the body's, relative, which nodes of meshes make up for; `null` where a
    /// function alone gives the body.
    pub volume_error: Option<f64>,
    /// Mass (kg) before the first step.
    pub mass_before: f64,
    /// Mass (kg) after the last.
    pub mass_after: f64,
    /// Sum of the nodal volumes (m³) before the first step.
    pub volume_before: f64,
    /// Sum of the nodal volumes (m³) after the last.
    pub volume_after: f64,
    /// Largest residual of the stencils' integration constraint, relative; `null` for stencils that are
    /// not solved for.
    pub stencil_residual: Option<f64>,
    /// Iterations of the stencils' solve.
    pub stencil_iterations: Option<usize>,
    /// Connected pieces at the end.
    pub pieces: usize,
    /// Energies (J) at the end and over the run.
    pub energy: EnergySummary,
    /// `|Σ f_i| / Σ |f_i|` of the internal forces, largest over the run's records.
    pub momentum_error: f64,
    /// Smallest determinant of the deformation gradient of a node that carries strain energy, over all
    /// steps.
    pub smallest_determinant: f64,
    /// Largest speed (m/s) over the run's records.
    pub largest_speed: f64,
}

/// Energies of one body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EnergySummary {
    /// Kinetic, at the end (J).
    pub kinetic: f64,
    /// Elastic, at the end (J).
    pub elastic: f64,
    /// Work of gravity and of driven supports over the run (J).
    pub external_work: f64,
    /// Lost to damping over the run (J).
    pub dissipated: f64,
    /// Taken by an implicit scheme over the run, negative if it gave (J).
    pub numerical: f64,
    /// Stored in viscosity's terms at the end (J), a part of `elastic`.
    pub viscous: f64,
    /// Lost to viscosity over the run (J).
    pub relaxed: f64,
    /// Released by cutting over the run, less what cuts added (J).
    pub released_by_cuts: f64,
    /// Added by those updates of cuts that added energy, and by the decay of what rebuilt rows carried
    /// over, if that added any (J).
    pub added_by_cuts: f64,
    /// Largest addition of one update, relative to the elastic energy before it.
    pub largest_cut_addition: f64,
    /// What is left unexplained over the run, relative to the larger of what is stored and what damping
    /// took; 0 if nothing moved.
    pub imbalance: f64,
    /// Whether anything moved: whether the largest of the terms is more than round-off of the positions
    /// makes of the stiffest mode.
    pub moved: bool,
}

/// Contact of bodies with each other and of flanks, at the end and over the run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ContactSummary {
    /// Sum of the normal forces' amounts at the end (N).
    pub force: f64,
    /// Area under pressure at the end, at rest (m²).
    pub area: f64,
    /// Deepest penetration at the end (m).
    pub penetration: f64,
    /// Energy of the springs at the end (J).
    pub energy: f64,
    /// Lost to friction over the run (J).
    pub dissipated: f64,
    /// Work of the learned offsets over the run (J).
    pub offset_work: f64,
}

/// How time was stepped.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SteppingSummary {
    /// Steps, settling included.
    pub steps: u64,
    /// Steps spent on settling.
    pub settling_steps: u64,
    /// Simulated time (s), settling included.
    pub simulated: f64,
    /// Whether the body came to rest within the settling limit.
    pub rested: bool,
    /// First step size (s).
    pub step: f64,
    /// Stretches of steps that were rolled back and retried in shorter ones.
    pub retaken: u64,
    /// Smallest step size (s) of the run.
    pub smallest_step: f64,
    /// Largest stable step (s) of the uncut body.
    pub critical_step: f64,
    /// Largest eigenvalue (1/s²) of the uncut body.
    pub largest_eigenvalue: f64,
    /// How the step was chosen, in words.
    pub chosen: String,
}

/// What the blades did.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct CutSummary {
    /// Blade edges captured.
    pub captures: usize,
    /// Updates that changed the connectivity.
    pub updates: usize,
    /// Triangles of the cut surfaces.
    pub triangles: usize,
    /// Undirected pairs whose factor is below 1.
    pub weakened_pairs: usize,
    /// Undirected pairs whose factor is 0.
    pub severed_pairs: usize,
    /// Largest estimate of the largest eigenvalue after a cut, relative to the uncut body's.
    pub eigenvalue_growth: f64,
    /// Nodes that cuts left without a strain of their own: bonds hold them.
    pub weak_nodes: usize,
    /// Those of them that hang on no valid node: debris.
    pub loose_nodes: usize,
    /// Lattices of the dissertation's grids; absent without `cut_rule: Grid`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lattices: Option<usize>,
    /// Undirected pairs that no lattice could decide and that `Diffraction` weakened or severed; absent without
    /// `cut_rule: Grid`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pairs_without_lattice: Option<usize>,
    /// One entry per stroke and body, in the order in which they began.
    pub strokes: Vec<StrokeSummary>,
}

/// What one stroke of a blade did to one body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StrokeSummary {
    /// Name of the scene's cut.
    pub cut: String,
    /// Name of the body.
    pub body: String,
    /// Blade edges captured.
    pub captures: usize,
    /// Updates that changed the connectivity.
    pub updates: usize,
    /// What it did to the energy. The body's `released_by_cuts` is the sum of `released` less those of `added` and of
    /// `decay`, which while it lasts is counted with the stroke that changed something last.
    #[serde(flatten)]
    pub energy: CutEnergy,
}

/// What a tool felt.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ToolSummary {
    /// Name in the scene.
    pub name: String,
    /// Largest force (N) over all steps.
    pub largest_force: f64,
    /// Deepest penetration (m) over all steps.
    pub deepest_penetration: f64,
    /// Force (N) at the end.
    pub force: f64,
    /// Work (J) of the bodies on the tool.
    pub work: f64,
}

/// What was drawn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PictureSummary {
    /// Frames.
    pub frames: usize,
    /// Width of a frame (pixels).
    pub width: u32,
    /// Height of a frame (pixels).
    pub height: u32,
    /// Surfels of the outer surface.
    pub surfels: usize,
    /// Surfels of new skin.
    pub skin_surfels: usize,
}

/// Wall-clock figures of this process, which for a resumed run are those since it was resumed; they differ from run to run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Timings {
    /// Threads.
    pub threads: usize,
    /// Whole run (s).
    pub wall: f64,
    /// Stepping alone: forces, contact, integration and cuts (s).
    pub stepping: f64,
    /// Simulated seconds per wall second of stepping, drawing and writing left out.
    pub real_time_factor: f64,
    /// Milliseconds of stepping per step.
    pub milliseconds_per_step: f64,
    /// One entry per phase.
    pub phases: Vec<PhaseTiming>,
    /// From a blade update to the end of the first step with the new connectivity; absent without
    /// cuts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub update_to_step: Option<Latency>,
}

/// One phase's fraction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PhaseTiming {
    /// Name.
    pub phase: &'static str,
    /// Total (s).
    pub seconds: f64,
    /// Times entered.
    pub calls: u64,
    /// Mean of one call (ms).
    pub milliseconds_per_call: f64,
}

/// Milliseconds from cause to effect.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Latency {
    /// Measured times.
    pub count: usize,
    /// Median (ms).
    pub median: f64,
    /// Worst (ms).
    pub worst: f64,
}

impl Latency {
    /// Median and worst of times in milliseconds; `None` of none.
    pub(super) fn of(milliseconds: &[f64]) -> Option<Self> {
        let mut sorted = milliseconds.to_vec();
        sorted.sort_by(f64::total_cmp);
        let worst = *sorted.last()?;
        Some(Self {
            count: sorted.len(),
            median: sorted[sorted.len() / 2],
            worst,
        })
    }
}

impl Timings {
    /// Puts the figures of a run together.
    pub(super) fn new(
        phases: &Phases,
        wall: f64,
        threads: usize,
        steps: u64,
        simulated: f64,
        updates: &[f64],
    ) -> Self {
        use Phase::{Contact, Cut, Forces, Integration};
        let stepping = [Forces, Contact, Integration, Cut].map(|phase| phases.of(phase).seconds);
        let stepping: f64 = stepping.iter().sum();
        let share = |total: f64, count: u64| match count {
            0 => 0.0,
            _ => 1e3 * total / count as f64,
        };
        Self {
            threads,
            wall,
            stepping,
            real_time_factor: if stepping > 0.0 {
                simulated / stepping
            } else {
                0.0
            },
            milliseconds_per_step: share(stepping, steps),
            phases: Phase::ALL
                .iter()
                .map(|&(phase, name)| {
                    let spent = phases.of(phase);
                    PhaseTiming {
                        phase: name,
                        seconds: spent.seconds,
                        calls: spent.calls,
                        milliseconds_per_call: share(spent.seconds, spent.calls),
                    }
                })
                .collect(),
            update_to_step: Latency::of(updates),
        }
    }
}
