//! The linear elastic solid of a problem.

/// Young's modulus (Pa), Poisson's ratio, density (kg/m³).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    /// Young's modulus (Pa).
    pub youngs_modulus: f64,
    /// Poisson's ratio.
    pub poissons_ratio: f64,
    /// Density (kg/m³).
    pub density: f64,
}

impl Solid {
    /// Shear modulus and first Lamé parameter (Pa).
    pub fn lame(self) -> (f64, f64) {
        let mu = self.youngs_modulus / (2.0 * (1.0 + self.poissons_ratio));
        let lambda = 2.0 * mu * self.poissons_ratio / (1.0 - 2.0 * self.poissons_ratio);
        (mu, lambda)
    }
}
