use super::*;
use crate::motion::MotionSettings;
use crate::supports::BoundaryConditions;
use crate::testing::Chain;
use crate::trajectory::Trajectory;
use std::ops::Range;

/// Shares of a chain in one process, which exchange positions through a list of all.
struct Parts {
    chain: Chain,
    ranges: Vec<Range<usize>>,
    motions: Vec<Motion>,
    watched: Vec<usize>,
    places: Vec<DVec3>,
    forces: Vec<DVec3>,
    energy: f64,
}

impl Parts {
    fn new(whole: &Motion, chain: Chain, starts: &[usize], watched: &[usize]) -> Self {
        let n = whole.node_count();
        let ends = starts[1..].iter().copied().chain([n]);
        let ranges: Vec<Range<usize>> = starts.iter().zip(ends).map(|(&a, b)| a..b).collect();
        let part = |range: &Range<usize>| {
            let of = |list: &Vec<DVec3>| list.get(range.clone()).unwrap_or_default().to_vec();
            let state = whole.state();
            let mut motion = Motion::new(
                &of(&state.positions),
                &whole.masses()[range.clone()],
                whole.supports().part(range.clone()),
                *whole.settings(),
            )
            .unwrap();
            motion
                .set_loads(whole.loads().get(range.clone()).unwrap_or_default())
                .unwrap();
            motion.restore(State {
                positions: of(&state.positions),
                velocities: of(&state.velocities),
                forces: of(&state.forces),
                applied: of(&state.applied),
                viscous: of(&state.viscous),
                ..State::default()
            });
            motion
        };
        Self {
            chain,
            motions: ranges.iter().map(part).collect(),
            ranges,
            watched: watched.to_vec(),
            places: vec![DVec3::ZERO; n],
            forces: vec![DVec3::ZERO; n],
            energy: 0.0,
        }
    }

    /// Adopts the velocities of monitored nodes.
    fn take_velocities(&mut self, state: &State) {
        self.each(|node, at, motion| motion.places_mut().1[at] = state.velocities[node]);
    }

    /// Monitored nodes with their numbers in a share, and that.
    fn each(&mut self, mut work: impl FnMut(usize, usize, &mut Motion)) {
        for (range, motion) in self.ranges.iter().zip(&mut self.motions) {
            for node in self.watched.iter().filter(|node| range.contains(node)) {
                work(*node, node - range.start, motion);
            }
        }
    }
}

impl Shares for Parts {
    fn begin(&mut self, pass: &Pass, state: &mut State) {
        self.take_velocities(state);
        for motion in &mut self.motions {
            motion.begin_pass(pass);
        }
        self.each(|node, at, motion| {
            state.positions[node] = motion.positions()[at];
            state.velocities[node] = motion.velocities()[at];
        });
    }

    fn evaluate(&mut self, state: &mut State, forces: &mut [DVec3]) {
        self.each(|node, at, motion| motion.places_mut().0[at] = state.positions[node]);
        for (range, motion) in self.ranges.iter().zip(&self.motions) {
            self.places[range.clone()].copy_from_slice(motion.positions());
        }
        self.energy = self.chain.forces(&self.places, &mut self.forces);
        for &node in &self.watched {
            forces[node] = self.forces[node];
        }
    }

    fn end(
        &mut self,
        pass: &Pass,
        applied: &[DVec3],
        state: &mut State,
        viscous: &mut [DVec3],
    ) -> (f64, Vec<PassSums>) {
        let mut sums = Vec::new();
        for (range, motion) in self.ranges.iter().zip(&mut self.motions) {
            let applied = applied.get(range.clone()).unwrap_or_default();
            sums.extend(motion.end_pass(pass, &self.forces[range.clone()], applied));
        }
        self.each(|node, at, motion| {
            state.velocities[node] = motion.velocities()[at];
            if let Some(to) = viscous.get_mut(node) {
                *to = motion.state().viscous[at];
            }
        });
        (self.energy, sums)
    }

    fn fetch(&mut self, state: &mut State) {
        self.take_velocities(state);
        for (range, motion) in self.ranges.iter().zip(&self.motions) {
            let from = motion.state();
            let lists = [
                (&mut state.positions, &from.positions),
                (&mut state.velocities, &from.velocities),
                (&mut state.forces, &from.forces),
                (&mut state.viscous, &from.viscous),
            ];
            for (to, from) in lists {
                if let Some(to) = to.get_mut(range.clone()) {
                    to.copy_from_slice(from);
                }
            }
        }
    }

    fn store(&mut self, state: &State) {
        for (range, motion) in self.ranges.iter().zip(&mut self.motions) {
            let velocities = &state.velocities[range.clone()];
            motion.places_mut().1.copy_from_slice(velocities);
            let viscous = state.viscous.get(range.clone()).unwrap_or_default();
            motion.viscous_mut().copy_from_slice(viscous);
        }
    }
}

/// A chain of two and a half chunks that is loaded, damped in both ways, held at one end and driven at the other,
/// and pushed in its middle; or one that nothing holds.
fn shared_and_whole(free: bool) -> [State; 2] {
    let n = 2 * SHARED_NODES + 400;
    let chain = || Chain::new(n, 50.0, 0.3);
    let settings = MotionSettings {
        damping: 0.4,
        viscosity: 1e-3,
        ..MotionSettings::default()
    };
    let rest = chain().rest;
    let mut supports = BoundaryConditions::free(n);
    if !free {
        supports.fix(3);
        // It has not ended when the shares are asked for velocities.
        let path = Trajectory::ramp(0.0, 0.4, DVec3::Y * 0.2).unwrap();
        supports.drive(&[2300], [false, true, true], path, &rest);
    }
    let mut whole = Motion::new(&rest, &vec![0.3; n], supports, settings).unwrap();
    let moved: Vec<DVec3> = rest
        .iter()
        .map(|x| DVec3::new(0.1, 0.03 * x.x.sin(), 0.0))
        .collect();
    whole.set_velocities(&moved).unwrap();
    let loads: Vec<DVec3> = rest.iter().map(|x| DVec3::Z * (0.2 * x.x).cos()).collect();
    whole.set_loads(&loads).unwrap();
    if free {
        whole.set_pieces(&vec![0; n]);
    }
    let other = chain();
    whole.refresh(|x, f| other.forces(x, f)).unwrap();
    let mut front = whole.clone();
    let mut parts = Parts::new(
        &whole,
        chain(),
        &[0, SHARED_NODES, 2 * SHARED_NODES],
        &[1500, 2300],
    );
    for step in 0..12 {
        let push = |view: &crate::StepView<'_>, forces: &mut [DVec3]| {
            forces[1500] -= view.positions[1500] * 1e-4 + view.acceleration(1500) * 1e-3;
        };
        let at = 0.01 + 1e-3 * f64::from(step);
        whole
            .step_with(at, |x, f| other.forces(x, f), &mut { push })
            .unwrap();
        front
            .step_shared(at, &mut parts, Some(&mut { push }))
            .unwrap();
    }
    front.fetch(&mut parts);
    [front.state().clone(), whole.state().clone()]
}

#[test]
fn shares_move_as_the_whole_does_to_the_bit() {
    for free in [false, true] {
        let [shared, whole] = shared_and_whole(free);
        assert_eq!(shared, whole, "free: {free}");
        assert!(whole.audit.applied_work != 0.0, "the push works");
        let drives = whole.audit.support_work != 0.0;
        assert_ne!(drives, free, "so does the drive");
    }
}

#[test]
fn sums_come_back_as_they_went() {
    let sums = Sums {
        kinetic: 1.0,
        momentum: DVec3::new(2.0, 3.0, 4.0),
        dissipated: 5.0,
        applied: 6.0,
        potential: 7.0,
        lag: 8.0,
        bad: true,
    };
    let again = PassSums::of(&sums);
    assert_eq!(PassSums::of(&again.sums()), again);
    assert!(again.sums().bad && !PassSums([0.0; PassSums::LENGTH]).sums().bad);
}
