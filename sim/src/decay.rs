//! All of a body that decays, once a step.

use phyxel_elastic::Elastic;

use crate::body::Body;
use crate::error::BodyProblem;
use crate::phases::timed;

/// Time in which retained gradients and bonds decay, over the shortest period's `1/ω`: nine steps. With 4 and 8 cuts
/// add energy at ν 0.49, with 16 to 64 none does.
const DECAY: f64 = 16.0;

impl Body {
    /// Advances all that decays by `step` (s) and books each with the others held fixed. First viscosity, whose loss is
    /// the jump of the energy. Then retained gradients and bonds, whose work is taken by the trapezoidal rule over the
    /// step: both of its ends then have the step's own potential. In the other order the evaluation that viscosity
    /// needs would count their work a second time. An implicit step is too long for that rule: what decays in it does
    /// so before it, where the nodes stand, and the jump of the energy is the work.
    ///
    /// Returns half of the work (J) of gradients and bonds, all of it before an implicit step, for
    /// [`Body::book_decay`]; `None` without any.
    pub(crate) fn decay(&mut self, step: f64) -> Result<Option<f64>, BodyProblem> {
        self.relax(step)?;
        if !self.whole.of_model(Elastic::decays) {
            return Ok(None);
        }
        let factor = (-step * self.eigenvalue.value.sqrt() / DECAY).exp();
        let half = self.decay_by(factor)?;
        if self.is_explicit() {
            return Ok(Some(half));
        }
        self.jump().map(Some)
    }

    /// Books the work (J) of gradients and bonds after the step, of which `half` is what [`Body::decay`] returned, with
    /// the body's cuts; nothing of a body without any.
    pub(crate) fn book_decay(&mut self, half: f64) {
        if self.cutting.is_none() {
            return;
        }
        let mut work = half;
        if self.is_explicit() {
            let [offsets, bonds] = self.decay_works();
            work = half + offsets + bonds;
            self.whole.as_it_is().1.correct_energy(work);
        }
        let cutting = self.cutting.iter_mut();
        cutting.for_each(|cutting| cutting.add_decay(work));
    }

    /// Advances viscosity by `step` (s): forces are then those of the step's potential, and the energy that
    /// viscosity lost is booked.
    pub(crate) fn relax(&mut self, step: f64) -> Result<(), BodyProblem> {
        let (elastic, _) = self.whole.as_it_is();
        if timed(&mut self.times.forces, || elastic.begin_viscous_step(step)) {
            self.relaxed -= self.jump()?;
        }
        Ok(())
    }

    /// Evaluates the forces after something decayed and books the energy's jump (J).
    fn jump(&mut self) -> Result<f64, BodyProblem> {
        let Self { times, whole, .. } = self;
        Ok(timed(&mut times.forces, || whole.refresh())?)
    }
}
