//! Rows of stencils and the passes over nodes and pairs.

pub(crate) mod completion;
pub(crate) mod dilatation;
pub(crate) mod fixed;
pub(crate) mod forces;
pub(crate) mod gather;
pub(crate) mod inactive;
pub(crate) mod lanes;
pub(crate) mod mean;
pub(crate) mod nodes;
pub(crate) mod pairs;
pub(crate) mod planes;
pub(crate) mod prestrain;
pub(crate) mod row;
pub(crate) mod stale;
pub(crate) mod storage;
pub(crate) mod subset;
pub(crate) mod tangent;
pub(crate) mod watch;
pub(crate) mod worst;
