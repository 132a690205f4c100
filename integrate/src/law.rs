//! What implicit solvers need to know of forces.

use std::fmt;

use glam::{DMat3, DVec3};

/// Forces with their tangent, for solvers that need `K v`.
pub trait ForceLaw {
    /// Writes the forces `f = −dE/dx` (N) at `positions` (m) and returns the energy `E` (J). Positions
    /// without a finite answer (an inverted node) give a result that is not finite.
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64;

    /// Writes `K v` with `K = d²E/dx²` (N/m, symmetric), at the positions of the last
    /// [`ForceLaw::forces_into`].
    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]);

    /// Writes the diagonal blocks of `K` (N/m), or of a near one such as that at rest, and returns
    /// `true`; `false` if there are none. They only speed up the solve.
    fn tangent_blocks_into(&mut self, _blocks: &mut [DMat3]) -> bool {
        false
    }
}

impl<L: ForceLaw + ?Sized> ForceLaw for &mut L {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        (**self).forces_into(positions, forces)
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        (**self).tangent_product_into(vector, product);
    }

    fn tangent_blocks_into(&mut self, blocks: &mut [DMat3]) -> bool {
        (**self).tangent_blocks_into(blocks)
    }
}

/// Forces and their tangent from anything that has both, by two functions.
///
/// ```
/// use phyxel_integrate::glam::DVec3;
/// use phyxel_integrate::{ClosureLaw, NewtonSettings, StaticLoad, BoundaryConditions, solve_static};
///
/// // A spring of 50 N/m to the origin; with a body of `phyxel_elastic` it is
/// // `ClosureLaw::of(&mut body, Elastic::forces_into, Elastic::tangent_product_into)`.
/// let mut stiffness = 50.0;
/// let mut spring = ClosureLaw::of(
///     &mut stiffness,
///     |k, x, f| {
///         f[0] = -x[0] * *k;
///         0.5 * *k * x[0].length_squared()
///     },
///     |k, v, out| out[0] = v[0] * *k,
/// );
/// let mut x = [DVec3::X];
/// let held = BoundaryConditions::fixed_where(&x, |x| x.z > 1.0); // none
/// solve_static(&mut spring, &mut x, &held, &StaticLoad::of(&[DVec3::Y]), &NewtonSettings::default())?;
/// assert!((x[0] - DVec3::Y / 50.0).length() < 1e-9);
/// # Ok::<(), phyxel_integrate::SolveError>(())
/// ```
pub struct ClosureLaw<'a, B, F, K> {
    body: &'a mut B,
    forces: F,
    product: K,
}

impl<'a, B, F, K> ClosureLaw<'a, B, F, K>
where
    F: FnMut(&mut B, &[DVec3], &mut [DVec3]) -> f64,
    K: FnMut(&mut B, &[DVec3], &mut [DVec3]),
{
    /// `forces` and `product` do what [`ForceLaw::forces_into`] and
    /// [`ForceLaw::tangent_product_into`] say; the body remembers where it was evaluated.
    pub fn of(body: &'a mut B, forces: F, product: K) -> Self {
        Self {
            body,
            forces,
            product,
        }
    }
}

impl<B: fmt::Debug, F, K> fmt::Debug for ClosureLaw<'_, B, F, K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("ClosureLaw").field(&self.body).finish()
    }
}

impl<B, F, K> ForceLaw for ClosureLaw<'_, B, F, K>
where
    F: FnMut(&mut B, &[DVec3], &mut [DVec3]) -> f64,
    K: FnMut(&mut B, &[DVec3], &mut [DVec3]),
{
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        (self.forces)(self.body, positions, forces)
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        (self.product)(self.body, vector, product);
    }
}

/// Forces as a closure; their tangent by central differences.
///
/// `K v = (f(x - s v) - f(x + s v)) / 2 s` with `s |v|_max` equal to `length * cbrt(epsilon)`, which
/// balances the error of the difference, of second order, with that of round-off. A product takes two
/// evaluations; its error is about 1e-10 of the force that moves nodes by `length`.
pub struct Differences<F> {
    forces: F,
    length: f64,
    at: Vec<DVec3>,
    moved: Vec<DVec3>,
    behind: Vec<DVec3>,
}

impl<F: FnMut(&[DVec3], &mut [DVec3]) -> f64> Differences<F> {
    /// `forces` does what [`ForceLaw::forces_into`] says; `length` (m) is one over which they change by
    /// much of themselves, such as the node spacing.
    ///
    /// # Panics
    /// If the length is not positive and finite.
    pub fn new(forces: F, length: f64) -> Self {
        let fine = length > 0.0 && length.is_finite();
        assert!(fine, "a length of {length} m is none");
        Self {
            forces,
            length,
            at: Vec::new(),
            moved: Vec::new(),
            behind: Vec::new(),
        }
    }
}

impl<F> fmt::Debug for Differences<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct("Differences");
        shown.field("length", &self.length).finish_non_exhaustive()
    }
}

impl<F: FnMut(&[DVec3], &mut [DVec3]) -> f64> ForceLaw for Differences<F> {
    fn forces_into(&mut self, positions: &[DVec3], forces: &mut [DVec3]) -> f64 {
        self.at.clear();
        self.at.extend_from_slice(positions);
        (self.forces)(positions, forces)
    }

    fn tangent_product_into(&mut self, vector: &[DVec3], product: &mut [DVec3]) {
        let largest = vector.iter().fold(0.0_f64, |most, v| most.max(v.length()));
        if largest == 0.0 {
            product.fill(DVec3::ZERO);
            return;
        }
        let step = self.length * f64::EPSILON.cbrt() / largest;
        let mut at = |sign: f64, out: &mut [DVec3]| {
            self.moved.clear();
            let pairs = self.at.iter().zip(vector);
            self.moved
                .extend(pairs.map(|(x, v)| *x + *v * (sign * step)));
            (self.forces)(&self.moved, out);
        };
        self.behind.resize(vector.len(), DVec3::ZERO);
        at(-1.0, &mut self.behind);
        at(1.0, product);
        for (out, behind) in product.iter_mut().zip(&self.behind) {
            *out = (*behind - *out) / (2.0 * step);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Network, hung};
    use crate::{BoundaryConditions, EigenvalueSettings, NewtonSettings, StaticLoad};
    use crate::{largest_eigenvalue, solve_static};
    use testkit::cloud::uniform;

    /// The same static solution from the law itself, by two functions and by forces alone.
    #[test]
    fn three_ways_to_give_forces_find_one_equilibrium() {
        let (mut first, rest, supports, loads) = hung();
        let (mut second, mut third) = (hung().0, hung().0);
        let load = StaticLoad {
            forces: &loads,
            ..StaticLoad::default()
        };
        let solve = |law: &mut dyn ForceLaw| {
            let mut x = rest.clone();
            let settings = NewtonSettings::with_tolerance(1e-9);
            solve_static(law, &mut x, &supports, &load, &settings).unwrap();
            x
        };
        let itself = solve(&mut first);
        let mut law = ClosureLaw::of(
            &mut second,
            Network::forces_into,
            Network::tangent_product_into,
        );
        let given = solve(&mut law);
        let mut alone =
            Differences::new(|x: &[DVec3], f: &mut [DVec3]| third.forces_into(x, f), 0.3);
        let found = solve(&mut alone);
        for (what, found) in [("two functions", given), ("differences", found)] {
            let off = std::iter::zip(&found, &itself).map(|(a, b)| a.distance(*b));
            let off = off.fold(0.0, f64::max);
            assert!(off < 1e-8, "{what} lead elsewhere: {off:e} m");
        }
    }

    #[test]
    fn differences_are_the_tangent_at_any_scale_of_the_vector() {
        let (mut network, rest, ..) = hung();
        let x: Vec<DVec3> = rest.iter().map(|x| *x * 1.1).collect();
        let mut f = vec![DVec3::ZERO; 20];
        let mut alone = Differences::new(
            |x: &[DVec3], f: &mut [DVec3]| hung().0.forces_into(x, f),
            0.3,
        );
        network.forces_into(&x, &mut f);
        alone.forces_into(&x, &mut f);
        for size in [1e-9, 1.0, 1e9] {
            let v: Vec<DVec3> = uniform(20, 1.0, 5).iter().map(|v| *v * size).collect();
            let (mut exact, mut found) = (f.clone(), f.clone());
            network.tangent_product_into(&v, &mut exact);
            alone.tangent_product_into(&v, &mut found);
            let most = exact.iter().fold(0.0_f64, |most, k| most.max(k.length()));
            for (a, b) in exact.iter().zip(&found) {
                assert!(a.distance(*b) < 1e-8 * most, "{a} {b} at {size:e}");
            }
        }
        let mut none = f.clone();
        alone.tangent_product_into(&[DVec3::ZERO; 20], &mut none);
        assert_eq!(none, [DVec3::ZERO; 20]);
        let masses = [1.0; 20];
        let free = BoundaryConditions::free(20);
        let product = |v: &[DVec3], out: &mut [DVec3]| alone.tangent_product_into(v, out);
        let settings = EigenvalueSettings::default();
        let found = largest_eigenvalue(&masses, &free, product, &mut Vec::new(), &settings);
        let exact = |v: &[DVec3], out: &mut [DVec3]| network.tangent_product_into(v, out);
        let exact = largest_eigenvalue(&masses, &free, exact, &mut Vec::new(), &settings);
        let ratio = found.unwrap().rayleigh / exact.unwrap().rayleigh;
        assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
    }

    #[test]
    #[should_panic(expected = "is none")]
    fn a_length_of_zero_is_refused() {
        let _ = Differences::new(|_: &[DVec3], _: &mut [DVec3]| 0.0, 0.0);
    }
}
