//! What cuts leave: retained gradients, bonds, control of touched nodes and of fronts.

pub(crate) mod bond;
pub(crate) mod control;
pub(crate) mod front;
pub(crate) mod offset;
