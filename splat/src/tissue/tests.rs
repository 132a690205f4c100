use super::*;
use crate::tissue::Measure;
use glam::{DMat3, DVec2, Vec3Swizzles};
use testkit::cloud::{filled_cube, lattice, patch, swept};

/// Whether the segment p-q crosses a triangle, by the signs of three volumes.
fn meets(&[a, b, c]: &[DVec3; 3], p: DVec3, q: DVec3) -> bool {
    let volume = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| (b - a).cross(c - a).dot(d - a);
    let sides = (volume(a, b, c, p) > 0.0) != (volume(a, b, c, q) > 0.0);
    let turns = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    sides && (turns.iter().all(|&v| v > 0.0) || turns.iter().all(|&v| v < 0.0))
}

/// The blade's edge at a capture of a wavy path: amplitude and middle along x, step and start along y.
fn wavy([wave, middle]: [f64; 2], [step, start]: [f64; 2], k: i32) -> [DVec3; 2] {
    let k = f64::from(k);
    let at = DVec3::new(wave * (0.9 * k).sin() + middle, step * k + start, 0.0);
    [at + 0.9 * DVec3::Z, at - 0.17 * DVec3::Z]
}

/// A slab's surface over random nodes is cut along a wavy way, piece by piece: what was bound
/// piece by piece is what binding every surfel again under the whole cut gives.
#[test]
fn binding_again_only_what_loses_a_node_equals_binding_all_again() {
    let (x, n, a) = patch(40, 0.0, 11);
    let nodes = filled_cube(9, 5);
    let mut tissue =
        Tissue::new(&x, &n, &a, &nodes, &TissueSettings::default()).expect("the samples are valid");
    let inside = |p: DVec3| p.abs().max_element() < 0.5;
    let edge = |k: i32| wavy([0.07, 0.0], [0.09, -0.4], k);
    let mut whole: Vec<[DVec3; 3]> = Vec::new();
    let (mut rebound, mut all) = (0, 0);
    for k in 0..9 {
        let new = swept(edge(k), edge(k + 1));
        whole.extend(new);
        let crosses = |p: DVec3, q: DVec3| whole.iter().any(|t| meets(t, p, q));
        rebound += tissue.cut(&new, &inside, &crosses).expect("finite").rebound;
        all += tissue.surfels().len();
        let mut again = tissue.clone();
        let every: Vec<u32> = (0..count(again.surfels.len())).collect();
        again.rebind(&every, &inside, &crosses);
        let other = (0..every.len())
            .filter(|&i| again.binding.row(i) != tissue.binding.row(i))
            .count();
        assert_eq!(other, 0, "rows of other nodes after piece {k}");
    }
    assert!(!tissue.doubles.is_empty(), "the cut splits disks");
    // Most of those that were lie beside the cut's end, where paths lead around it.
    assert!(4 * rebound < all, "{rebound} of {all} were sought again");
}

fn radii(tissue: &Tissue) -> Vec<f64> {
    tissue.surfels.iter().map(|surfel| surfel.radius).collect()
}

/// A block of nodes with a few surfels far from a cut that ends inside it; what the last piece of the
/// cut changed, and the radii before it.
fn inner_cut(pieces: i32) -> (Tissue, CutChange, Vec<f64>) {
    let nodes = lattice([7, 7, 7], 1.0 / 6.0, 0.2, 5);
    let x = [0.0, 1.0].map(|z| DVec3::new(0.5, 0.5, z));
    let settings = TissueSettings {
        skin_density: Some(2_000.0),
        ..TissueSettings::default()
    };
    let mut tissue = Tissue::new(&x, &[-DVec3::Z, DVec3::Z], &[0.5; 2], &nodes, &settings)
        .expect("the samples are valid");
    let (mut last, mut before) = (CutChange::default(), Vec::new());
    for k in 0..pieces {
        let edge = |k: i32| {
            let y = 0.2 + 0.1 * f64::from(k);
            [DVec3::new(0.52, y, 0.2), DVec3::new(0.52, y, 0.8)]
        };
        let top = edge(k + 1)[0].y;
        let crosses = |p: DVec3, q: DVec3| {
            let at = p.lerp(q, (0.52 - p.x) / (q.x - p.x));
            (p.x < 0.52) != (q.x < 0.52) && (0.2..top).contains(&at.y) && (0.2..0.8).contains(&at.z)
        };
        before = radii(&tissue);
        let change = tissue.cut(&swept(edge(k), edge(k + 1)), &|_| true, &crosses);
        last = change.expect("finite");
    }
    (tissue, last, before)
}

/// Radii of skin that grew piece by piece are those of the whole, bitwise, and only those near a
/// new piece are computed again.
#[test]
fn radii_computed_where_skin_grows_equal_those_of_all_of_it() {
    let (tissue, last, before) = inner_cut(6);
    let skin: Vec<u32> = (2..count(tissue.surfels.len())).collect();
    let whole = tissue.skin_radii(&skin);
    for (&s, radius) in skin.iter().zip(&whole) {
        let kept = tissue.surfels[index(s)].radius;
        assert_eq!(kept.to_bits(), radius.to_bits(), "{s}: {kept} for {radius}");
    }
    let most = tissue.skin_radius();
    assert!(whole.iter().all(|r| (0.3 * most..=most).contains(r)));
    // Cells are open along the border only, a spacing wide: an eighth of this cut.
    let smaller = whole.iter().filter(|&&r| r < 0.99 * most).count();
    let all = whole.len();
    assert!(6 * smaller > 5 * all, "{smaller} of {all}");
    // What no sample of the last piece lies near keeps its bits.
    let at = |s: u32| tissue.surfels[index(s)].position;
    let reach = 3.0 * tissue.sampler.spacing();
    let old = count(before.len());
    let fresh = old..count(tissue.surfels.len());
    let is_far = |s: &u32| fresh.clone().all(|f| at(f).distance(at(*s)) > reach);
    let far: Vec<u32> = (2..old).filter(is_far).collect();
    assert!(far.len() > 500, "{}", far.len());
    for &s in &far {
        let i = index(s);
        assert_eq!(before[i].to_bits(), tissue.surfels[i].radius.to_bits());
    }
    let resized = last.skin + 1..=all - far.len();
    assert!(resized.contains(&last.resized), "{last:?}");
}

/// A piece of a cut reports every surfel that it changes, and not all of them.
#[test]
fn what_a_piece_changes_is_reported() {
    let (before, ..) = inner_cut(4);
    let (after, last, _) = inner_cut(5);
    let reported: std::collections::HashSet<u32> = last.surfels.iter().copied().collect();
    assert!(last.surfels.is_sorted_by(|a, b| a < b));
    let mut same = 0;
    for s in 0..count(after.surfels.len()) {
        let i = index(s);
        let numbers = |tissue: &Tissue| {
            let (nodes, weights) = tissue.binding.row(i);
            let surfel = &tissue.surfels[i];
            let places = [surfel.position, surfel.normal];
            let all = places.map(|x| x.to_array().map(f64::to_bits));
            let weights: Vec<_> = weights.iter().map(|w| w.to_bits()).collect();
            (all, surfel.radius.to_bits(), nodes.to_vec(), weights)
        };
        let old = i < before.surfels.len();
        if old && numbers(&before) == numbers(&after) && before.clips[i] == after.clips[i] {
            same += u32::from(!reported.contains(&s));
        } else {
            assert!(reported.contains(&s), "surfel {s} changed");
        }
    }
    let all = count(after.surfels.len());
    assert!(4 * same > all, "{same} are not reported");
}

/// Points of the disks of skin that are drawn, by what is drawn of each.
fn drawn(tissue: &Tissue) -> Vec<DVec3> {
    let mut out = Vec::new();
    for (surfel, clip) in tissue.surfels.iter().zip(&tissue.clips).skip(2) {
        let (t0, t1) = Surfel::tangents(surfel.normal);
        let r = surfel.radius;
        for k in 0..400 {
            let q = DVec2::new(f64::from(k % 20) - 9.5, f64::from(k / 20) - 9.5) / 10.0;
            if q.length() < 1.0 && !clip.as_ref().is_some_and(|c| c.hides(q * r)) {
                out.push(surfel.position + (t0 * q.x + t1 * q.y) * r);
            }
        }
    }
    out
}

/// Skin covers its cut up to the edges where it ends, at every stage of growth, and reaches on into the
/// body, where its two sides cross.
#[test]
fn skin_reaches_the_free_edges_of_a_growing_cut() {
    for pieces in 1..6 {
        let (tissue, _, _) = inner_cut(pieces);
        let low = DVec2::splat(0.2);
        let high = DVec2::new(0.2 + 0.1 * f64::from(pieces), 0.8);
        let points: Vec<DVec2> = drawn(&tissue).iter().map(|p| p.yz()).collect();
        let beyond = |&p: &DVec2| (low - p).max(p - high).max_element();
        let over = points.iter().map(beyond).fold(f64::NEG_INFINITY, f64::max);
        // Of some hundred disks beside an edge one is nearer to it than half its radius.
        let least = 0.5 * tissue.skin_radius();
        assert!(over > least, "{pieces} pieces reach on by {over:e}");
        // Everywhere some disk is drawn within the steps of its 20 x 20 points.
        let step = 0.15 * tissue.skin_radius();
        for k in 0..2_500 {
            let unit = DVec2::new(f64::from(k % 50) + 0.5, f64::from(k / 50) + 0.5) / 50.0;
            let at = low + (high - low) * unit;
            let drawn = points.iter().any(|p| p.distance(at) < step);
            assert!(drawn, "nothing at {at} of {pieces} pieces");
        }
    }
}

/// At its end a cut closes: the two sides of its skin come together there, whatever the nodes do.
#[test]
fn the_sides_of_a_cut_meet_where_it_ends() {
    let (tissue, _, _) = inner_cut(3);
    // Nodes on the two sides move apart by up to one, without a change of shape.
    let apart = |&p: &DVec3| p + DVec3::X * if p.x < 0.52 { -0.5 } else { 0.5 };
    let moved: Vec<DVec3> = tissue.rest_nodes.iter().map(apart).collect();
    let gradients = vec![DMat3::IDENTITY; moved.len()];
    let mut splats = Vec::new();
    tissue.carry_into(&moved, &gradients, &mut splats);
    let mut gaps: Vec<(f64, f64)> = Vec::new();
    for i in 2..tissue.surfels.len() {
        let (p, n) = tissue.surfels[i].plane();
        let mut others = 2..tissue.surfels.len();
        let Some(j) = others.find(|&j| tissue.surfels[j].plane() == (p, -n)) else {
            continue;
        };
        let low = (p.y - 0.2).min(0.5 - p.y);
        let to_end = low.min(p.z - 0.2).min(0.8 - p.z);
        gaps.push((to_end, splats[i].position.distance(splats[j].position)));
    }
    let widest = |low: f64, high: f64| {
        let within = gaps.iter().filter(|g| (low..high).contains(&g.0));
        within.map(|g| g.1).fold(0.0, f64::max)
    };
    // Nodes are 1/6 apart; away from the end each side is carried by its own, or nearly so.
    assert!(widest(0.1, 0.2) > 0.8, "{}", widest(0.1, 0.2));
    // Within a hundredth the ways round are a fiftieth longer at most: a tenth of the opening.
    assert!(widest(0.0, 0.01) < 0.2, "{}", widest(0.0, 0.01));
}

/// A bumpy slab, radii by variation that are measured again, and a wavy cut that grows over it: beside the cut the
/// surface has a new edge, where variation, which was next to nothing, rises and disks become small, as those of
/// the new skin do at its rim; in the middle of the skin they are large, and what changes is reported.
#[test]
fn disks_at_a_new_edge_become_small_and_those_inside_the_cut_large() {
    let (mut x, n, a) = patch(40, 0.0, 11);
    // Bumps far from the cut give the measures their range.
    for p in &mut x {
        p.z += 0.02 * (40.0 * p.x).sin() * (p.x - 0.1).max(0.0);
    }
    let (least, most) = (0.01, 0.03);
    let settings = TissueSettings {
        radius: RadiusRule::Mapped {
            measure: Measure::Variation,
            neighbors: 12,
            least,
            most,
            at_cuts: true,
        },
        ..TissueSettings::default()
    };
    let mut tissue = Tissue::new(&x, &n, &a, &filled_cube(9, 5), &settings).expect("valid samples");
    let before = radii(&tissue);
    let edge = |k: i32| wavy([0.05, -0.2], [0.12, -0.55], k);
    let inside = |p: DVec3| p.abs().max_element() < 0.5;
    let mut whole: Vec<[DVec3; 3]> = Vec::new();
    let mut reported = std::collections::HashSet::new();
    for k in 0..9 {
        let new = swept(edge(k), edge(k + 1));
        whole.extend(new);
        let crosses = |p: DVec3, q: DVec3| whole.iter().any(|t| meets(t, p, q));
        let change = tissue.cut(&new, &inside, &crosses).expect("finite");
        reported.extend(change.surfels);
    }
    let at = |s: usize| tissue.surfels[s].position;
    let way = |y: f64| 0.05 * (0.9 * (y + 0.55) / 0.12).sin() - 0.2;
    let mean = |radii: &[f64], keep: &dyn Fn(usize) -> bool| {
        let kept = (0..radii.len()).filter(|&s| keep(s));
        let of: Vec<f64> = kept.map(|s| radii[s]).collect();
        assert!(of.len() > 20, "{} disks", of.len());
        of.iter().sum::<f64>() / of.len() as f64
    };
    let now = &radii(&tissue);
    let outer = tissue.outer_count;
    let within = |s: usize, near: f64| (at(s).x - way(at(s).y)).abs() < near;
    let at_rim = |s: usize| s < outer && within(s, 0.02);
    let (rim, old) = (mean(now, &at_rim), mean(&before, &at_rim));
    let skin = |s: usize| s >= outer && tissue.surfels[s].normal.z.abs() < 0.9;
    let middle = mean(now, &|s| skin(s) && at(s).z < 0.35);
    let edge = mean(now, &|s| skin(s) && at(s).z > 0.47);
    let between = |share: f64| least + share * (most - least);
    assert!(old > 0.99 * most, "flat before: {old}");
    assert!(rim < between(0.25), "at the rim: {rim}");
    assert!(edge < between(0.5), "skin at its edge: {edge}");
    assert!(middle > between(0.75), "inside the cut: {middle}");
    for s in 0..outer {
        let same = now[s].to_bits() == before[s].to_bits();
        assert!(same || reported.contains(&count(s)), "{s} unreported");
        let is_far = at(s).x < 0.0 && !within(s, 0.15);
        assert!(same || !is_far, "{s} is far from the cut");
    }
}

/// Nodes in three pieces that no surface parts: no surfel is carried by two of them.
#[test]
fn a_surfel_keeps_the_nodes_of_one_piece() {
    let (mut tissue, _, _) = inner_cut(1);
    let nodes = tissue.rest_nodes.iter();
    let pieces: Vec<u32> = nodes
        .map(|p| u32::from(p.x > 0.5) + u32::from(p.x + p.y > 1.2))
        .collect();
    let mixed = tissue.part(&pieces);
    assert!(mixed.len() > 10, "{} surfels", mixed.len());
    for &surfel in &mixed {
        let (row, weights) = tissue.binding.row(index(surfel));
        let piece = |node: &u32| pieces[index(*node)];
        assert!(row.iter().all(|node| piece(node) == piece(&row[0])));
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
    assert!(tissue.part(&pieces).is_empty(), "nothing is left to do");
}
