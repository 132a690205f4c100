//! Static equilibrium by Newton steps with conjugate gradients, for any body that gives forces and
//! tangent products. Small and plain: a tool of tests, not of runs.

use glam::DVec3;

/// What the solver asks of a body.
#[derive(Debug)]
pub enum Request<'a> {
    /// Forces at positions; the energy is to be returned.
    Forces(&'a [DVec3], &'a mut [DVec3]),
    /// `K v` at the state of the last forces.
    Product(&'a [DVec3], &'a mut [DVec3]),
}

/// Outcome of [`solve`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Equilibrium {
    /// Newton steps made.
    pub steps: usize,
    /// Products made in all.
    pub products: usize,
    /// Largest force left on a free component, relative to the largest force at the start.
    pub residual: f64,
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn largest(r: &[DVec3]) -> f64 {
    r.iter().fold(0.0, |most, r| r.length().max(most))
}

/// Zeroes the components that are held.
fn mask(v: &mut [DVec3], held: &[[bool; 3]]) {
    for (v, held) in v.iter_mut().zip(held) {
        for axis in 0..3 {
            if held[axis] {
                v[axis] = 0.0;
            }
        }
    }
}

/// `K d = r` on the free components to a relative `tolerance`; stops at negative curvature.
fn conjugate_gradients(
    body: &mut dyn FnMut(Request<'_>) -> f64,
    held: &[[bool; 3]],
    r: &[DVec3],
    tolerance: f64,
    products: &mut usize,
) -> Vec<DVec3> {
    let mut d = vec![DVec3::ZERO; r.len()];
    let mut residual = r.to_vec();
    let mut p = r.to_vec();
    let mut kp = d.clone();
    let mut rr = dot(&residual, &residual);
    let stop = rr * tolerance * tolerance;
    for iteration in 0..20 * r.len() {
        if rr <= stop {
            break;
        }
        body(Request::Product(&p, &mut kp));
        *products += 1;
        mask(&mut kp, held);
        let curvature = dot(&p, &kp);
        if curvature <= 0.0 {
            if iteration == 0 {
                d.clone_from(&p);
            }
            break;
        }
        let step = rr / curvature;
        for i in 0..r.len() {
            d[i] += p[i] * step;
            residual[i] -= kp[i] * step;
        }
        let next = dot(&residual, &residual);
        for i in 0..r.len() {
            p[i] = residual[i] + p[i] * (next / rr);
        }
        rr = next;
    }
    d
}

/// Moves `x` to equilibrium under dead loads, fixed components staying where they are.
///
/// Ends when the residual is below `tolerance` times the force at the start, or no step lowers it.
pub fn solve(
    x: &mut [DVec3],
    held: &[[bool; 3]],
    load: &[DVec3],
    tolerance: f64,
    body: &mut dyn FnMut(Request<'_>) -> f64,
) -> Equilibrium {
    let mut f = vec![DVec3::ZERO; x.len()];
    let mut outcome = Equilibrium {
        steps: 0,
        products: 0,
        residual: f64::INFINITY,
    };
    let mut evaluate = |body: &mut dyn FnMut(Request<'_>) -> f64, x: &[DVec3]| {
        let energy = body(Request::Forces(x, &mut f)) - dot(load, x);
        let mut r: Vec<DVec3> = f.iter().zip(load).map(|(f, l)| *f + *l).collect();
        mask(&mut r, held);
        (energy, r)
    };
    let (mut energy, mut r) = evaluate(body, x);
    let scale = largest(&r).max(f64::MIN_POSITIVE);
    for _ in 0..60 {
        outcome.residual = largest(&r) / scale;
        if outcome.residual <= tolerance {
            break;
        }
        // Quadratic convergence near the end, no more than asked for, and never below round-off.
        let wanted = (0.1 * outcome.residual).max(0.1 * tolerance / outcome.residual);
        let accuracy = wanted.clamp(1e-13, 1e-3);
        let d = conjugate_gradients(body, held, &r, accuracy, &mut outcome.products);
        let slope = dot(&d, &r);
        let mut step = 1.0;
        let mut improved = false;
        for _ in 0..30 {
            let trial: Vec<DVec3> = x.iter().zip(&d).map(|(x, d)| *x + *d * step).collect();
            let (e, next) = evaluate(body, &trial);
            let lower = e <= energy - 1e-4 * step * slope;
            if e.is_finite() && (lower || largest(&next) < 0.5 * largest(&r)) {
                x.copy_from_slice(&trial);
                (energy, r) = (e, next);
                improved = true;
                break;
            }
            step *= 0.5;
        }
        outcome.steps += 1;
        if !improved {
            evaluate(body, x);
            break;
        }
    }
    outcome
}
