//! Materials: energy, stress and tangent at one deformation gradient. Knows no nodes.

pub(crate) mod arithmetic;
pub(crate) mod checks;
pub(crate) mod coefficients;
pub(crate) mod fiber;
pub(crate) mod material;
pub(crate) mod prony;
pub(crate) mod settings;
pub(crate) mod stress;
pub(crate) mod tensor;
pub(crate) mod viscosity;
