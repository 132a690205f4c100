//! Hard cases, each with what must happen. None may panic, make a number that is not finite, or end
//! without saying why; mass, momentum and energy are accounted for in all of them.
//!
//! | case | what must happen |
//! |---|---|
//! | slivers: three parallel cuts 10 µm apart | two pieces as after one cut; nothing between them |
//! | blade that ends on the surface, trembles, starts again | it severs; no fragments; no strip between the strokes |
//! | dice: two cuts along each axis | 27 pieces and debris, of which those not held fall freely |
//! | a hundred cuts | all are taken up; severed pairs never come back; the energy audit closes |
//! | cut while compressed to half | the halves come apart and the audit closes |
//! | twist by 360° and back | no node turns inside out; the energy comes back to its start |
//! | Poisson's ratio 0.499 | the bar sags less than at 0.45, and keeps its volume better |
//! | stiffness ratio 1e6 between two bodies | the stiff one sets the step; both audits close |
//! | single-node debris | the node falls with gravity, as far as a point mass does |
//! | ten nodes | refused with the least number, 30; with those it hangs, moves and keeps its mass |
//! | step at the stability limit | 1 of the critical step stays bounded; 1.2 is refused with the limit |
//! | tool pushed through the body | it comes out on the other side, the body lives or the error names it |
//! | blade faster than the body | one strip from start to end, as deep as a slow one |
//! | cut of the support itself | fixed nodes stay; both parts hang on |
//! | zero gravity | a cut body at rest stays at rest to round-off |
//! | graded nodes, cut where they are fine | two pieces, the audit closes |
//! | mesh with flipped parts | turned, reported, and as heavy as one without |

mod blades;
mod bodies;
mod cuts;
mod stage;
