//! Hard cases, each with what must happen. None may panic, make a number that is not finite, or end
//! without saying why; mass, momentum and energy are accounted for in all of them.

mod blades;
mod bodies;
mod cuts;
mod stage;
