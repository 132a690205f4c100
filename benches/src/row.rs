//! What is known of a scene after its run.

use std::fmt;

use serde::Serialize;

/// One scene's figures. Numbers that were not asked for or never came up are empty in CSV.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Row {
    /// Name of the scene in its study.
    pub scene: String,
    /// Whether the run came to its end.
    pub ended: bool,
    /// What it said if not.
    pub error: String,
    /// Nodes.
    pub nodes: usize,
    /// Steps taken.
    pub steps: u64,
    /// Simulated time (s), settling included.
    pub time: f64,
    /// Energy (J) that cuts release over the run, less what they added.
    pub released: f64,
    /// Part of it that is the work (J) of the decay of retained gradients, positive if that
    /// added energy.
    pub decay: f64,
    /// Stretches of steps that were rolled back and retried with shorter steps.
    pub retaken: u64,
    /// Those of them whose energy stayed off.
    pub unbalanced: u64,
    /// Largest energy that one update of the connectivity added, over the energy stored before it.
    pub added: f64,
    /// Step of that update.
    pub added_at: u64,
    /// Largest energy that all updates of one stroke together added, those that released left out, over
    /// the most that was stored during the stroke.
    pub added_by_stroke: f64,
    /// What the audit leaves unexplained at the end, over the larger of what is stored and what damping and the scheme took.
    pub imbalance: f64,
    /// The most that it ever left unexplained, over the most that either of the two ever was.
    pub worst_imbalance: f64,
    /// Largest step over the damped limit by an independent estimate of the largest eigenvalue.
    pub step_to_limit: Option<f64>,
    /// Step at which that was.
    pub step_to_limit_at: Option<u64>,
    /// First step size (s).
    pub first_step: f64,
    /// First step size over the smallest.
    pub shrink: f64,
    /// Smallest det F over every step, at nodes that carry strain energy.
    pub smallest_determinant: f64,
    /// Node and step of it.
    pub smallest_determinant_at: Place,
    /// First step and node with det F not above 0 at a node that carries strain energy.
    pub first_inverted_at: Option<Place>,
    /// Largest distance of a node from the nearest (relative to rest) of those that it is linked to,
    /// over their distance at rest; debris left out.
    pub farthest: f64,
    /// Node and step of it.
    pub farthest_at: Place,
    /// Fraction of the nodes that carry no strain energy and are no debris, at the end.
    pub followers: f64,
    /// Fraction of the nodes in pieces too small to count, at the end.
    pub debris: f64,
    /// Undirected pairs severed.
    pub severed: usize,
    /// Area (m²) of the cuts' surfaces in the body, in material coordinates.
    pub area: f64,
    /// Energy (J) lost to damping since the first update of the connectivity.
    pub damped: f64,
    /// Elastic energy (J) at the end.
    pub elastic: f64,
    /// Most elastic energy (J) at any step.
    pub most_elastic: f64,
    /// Kinetic energy (J) at the end.
    pub kinetic: f64,
    /// Energy (J) lost to damping.
    pub dissipated: f64,
    /// Weight against stiffness, `ρ g L / E`.
    pub load: f64,
    /// Wall time (s).
    pub wall: f64,
}

/// A node at a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Place {
    /// Index of the node.
    pub node: usize,
    /// Steps that were taken.
    pub step: u64,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}", self.node, self.step)
    }
}

impl Serialize for Place {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// What a row must hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bars {
    /// Smallest energy (J) released by cuts; none where a scene need not release any.
    pub released: Option<f64>,
    /// Most that one update may add, over what is stored.
    pub added: f64,
    /// Most that the audit may leave unexplained, over the larger of what is stored and what damping and the scheme took.
    pub imbalance: f64,
    /// Largest ratio of the first to the smallest step.
    pub shrink: f64,
    /// Whether every node that carries strain energy must keep det F above 0.
    pub upright: bool,
    /// Largest distance from linked nodes over that at rest.
    pub farthest: f64,
    /// Largest fraction of deficient nodes that follow.
    pub followers: f64,
}

impl Bars {
    /// What every scene of ordinary stiffness must hold.
    pub const fn ordinary() -> Self {
        Self {
            released: Some(0.0),
            added: 0.01,
            imbalance: 0.02,
            shrink: 3.0,
            upright: true,
            farthest: 3.0,
            followers: 0.03,
        }
    }
}

impl Row {
    /// The limits that the row misses, in words; empty if it holds them all.
    pub fn breaches(&self, bars: &Bars) -> Vec<String> {
        let mut found = Vec::new();
        if !self.ended {
            found.push(format!("does not end: {}", self.error));
        }
        if bars.released.is_some_and(|least| self.released < least) {
            found.push(format!("cuts add {:.3e} J", -self.released));
        }
        let mut above = |what: &str, value: f64, most: f64| {
            // What is not a number is above every limit.
            if value.is_nan() || value > most {
                found.push(format!("{what} {}, at most {most}", short(value)));
            }
        };
        let added = "energy added by one update over that stored";
        above(added, self.added, bars.added);
        above("energy-balance error", self.imbalance, bars.imbalance);
        above("step shrink", self.shrink, bars.shrink);
        above("distance from linked nodes", self.farthest, bars.farthest);
        let followers = "fraction of deficient nodes that follow";
        above(followers, self.followers, bars.followers);
        let step = self.step_to_limit.unwrap_or(0.0);
        above("step over its limit", step, 1.0);
        let inverted = self.smallest_determinant.is_nan() || self.smallest_determinant <= 0.0;
        if bars.upright && inverted {
            found.push(format!(
                "det F {} at {}, not above 0 first at {}",
                short(self.smallest_determinant),
                self.smallest_determinant_at,
                self.first_inverted_at.unwrap_or_default()
            ));
        }
        found
    }

    /// The limits that rows miss, each row those of its `bars`, in words that name its scene.
    pub fn all_breaches(rows: &[Self], bars: impl Fn(&Self) -> Bars) -> Vec<String> {
        let of = |row: &Self| {
            let breaches = row.breaches(&bars(row)).into_iter();
            let named = breaches.map(|breach| format!("{}: {breach}", row.scene));
            named.collect::<Vec<_>>()
        };
        rows.iter().flat_map(of).collect()
    }

    /// Names of the columns of [`Row`]'s text.
    pub fn header() -> String {
        let rest = " nodes  steps  released    added   stroke   imbal   worst  limit shrink  min detF farthest follow debris   wall again";
        format!("{:<34}{rest}", "scene")
    }
}

/// A number in nine characters or fewer, whatever its size.
fn short(value: f64) -> String {
    if value.abs() < 1e4 {
        format!("{value:.3}")
    } else {
        format!("{value:.1e}")
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let limit = self.step_to_limit.map(|x| format!("{x:.3}"));
        let limit = limit.unwrap_or_else(|| "-".to_owned());
        write!(
            f,
            "{:<34} {:>5} {:>6} {:>+9.2e} {:>8.1e} {:>8.1e} {:>7} {:>7} {limit:>6} {:>6.1} {:>9} {:>8} {:>5.1}% {:>5.1}% {:>5.0}s {:>5}",
            self.scene,
            self.nodes,
            self.steps,
            self.released,
            self.added,
            self.added_by_stroke,
            short(self.imbalance),
            short(self.worst_imbalance),
            self.shrink,
            short(self.smallest_determinant),
            short(self.farthest),
            1e2 * self.followers,
            1e2 * self.debris,
            self.wall,
            self.retaken
        )?;
        if self.ended {
            Ok(())
        } else {
            write!(f, "\n    {}", self.error)
        }
    }
}
