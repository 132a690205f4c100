use std::f64::consts::TAU;

use glam::DVec3;

use super::*;
use crate::cuts::CutSettings;
use crate::factors::{FactorSettings, PairFactors};
use crate::polyline::swept_surface;
use crate::tests::slow::Cloud;

/// Half the width of the block; its nodes lie one apart.
const HALF: f64 = 3.0;

/// Nodes on each side once a blade has been where `path` says, in a block in which the material is the world.
fn pieces(block: &Cloud, cuts: &Cuts) -> Vec<u32> {
    let mut factors = PairFactors::new(&block.graph(), &FactorSettings::default());
    factors.update(&block.graph(), cuts, 0..cuts.triangle_count(), &inside);
    let mut sizes = block.piece_sizes(&factors.to_vec());
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    sizes
}

fn inside(x: DVec3) -> bool {
    x.abs().max_element() <= HALF
}

fn place(from: DVec3, to: DVec3) -> EdgePlace {
    if inside(to) {
        EdgePlace::Inside {
            at: to,
            came: to - from,
        }
    } else if (to.abs() - HALF).max_element() < 1.0 {
        EdgePlace::Outside { at: to }
    } else {
        EdgePlace::Air
    }
}

/// A blade of 13 points, one apart, along y.
fn edge(x: f64, z: f64) -> Vec<DVec3> {
    let ys = (0..13).map(|k| f64::from(k) - 6.3);
    ys.map(|y| DVec3::new(x, y, z)).collect()
}

fn places(last: &[DVec3], now: &[DVec3]) -> Vec<EdgePlace> {
    last.iter().zip(now).map(|(a, b)| place(*a, *b)).collect()
}

/// The same where what lies inside is the blade's own gap.
fn in_gap(mut places: Vec<EdgePlace>) -> Vec<EdgePlace> {
    for place in &mut places {
        if let EdgePlace::Inside { .. } = place {
            *place = EdgePlace::Gap;
        }
    }
    places
}

/// Places in steps of 0.45 or less.
fn even(from: f64, to: f64, edge: impl Fn(f64) -> Vec<DVec3>) -> Vec<Vec<DVec3>> {
    let count = ((to - from).abs() / 0.45).ceil();
    let steps = (0..).map(f64::from).take_while(|step| *step <= count);
    let at = |step: f64| edge(from + (to - from) * (step / count));
    steps.map(at).collect()
}

/// Drives a blade along positions; asserts that the cut crosses all that it sweeps.
fn lead(block: &Cloud, path: &[Vec<DVec3>]) -> Cuts {
    let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
    lead_into(block, &mut cuts, path);
    cuts
}

fn lead_into(block: &Cloud, cuts: &mut Cuts, path: &[Vec<DVec3>]) {
    let mut front = Front::new(path[0].len(), 1.0);
    let mut last = &path[0];
    for now in path {
        let moved = last[0].distance(now[0]);
        let places = places(last, now);
        front.advance(cuts, &places, moved, &inside, SKIN).unwrap();
        let sweep = swept_surface(last, now);
        let swept = swept_pairs(&block.graph(), &block.x, &sweep, &|_| false);
        let missed = |cuts: &Cuts| -> Vec<DVec3> {
            let missed = |pair: &&SweptPair| pair.is_missed(&block.x, cuts, 1.0);
            swept.iter().filter(missed).map(|pair| pair.point).collect()
        };
        front.reach(cuts, &missed(cuts), &inside, SKIN).unwrap();
        for point in missed(cuts) {
            close_edge(cuts, point, 1.0, &inside).unwrap();
        }
        let left = missed(cuts);
        assert!(left.is_empty(), "at {}: {left:?}", now[0]);
        last = now;
    }
}

/// Drives a front along positions in tissue; what it added each time.
fn drive(front: &mut Front, cuts: &mut Cuts, path: &[Vec<DVec3>]) -> Vec<Patch> {
    let mut last = &path[0];
    let steps = path.iter().map(|now| {
        let places = places(last, now);
        last = now;
        front.advance(cuts, &places, 0.45, &inside, SKIN).unwrap()
    });
    steps.collect()
}

/// From above the block down to a height.
fn down(x: f64, end: f64) -> Vec<Vec<DVec3>> {
    even(5.0, end, |z| edge(x, z))
}

/// Area over the length of its vector, and the area that faces backwards.
fn folds(cuts: &Cuts) -> (f64, f64) {
    let all = 0..cuts.triangle_count();
    let vectors: Vec<DVec3> = all.map(|t| cuts.area(t) * cuts.normal(t)).collect();
    let sum: DVec3 = vectors.iter().sum();
    let area: f64 = vectors.iter().map(|v| v.length()).sum();
    let back = vectors.iter().filter(|v| v.dot(sum) < 0.0);
    (area / sum.length(), back.map(|v| v.length()).sum())
}

#[test]
fn a_blade_that_ends_on_the_surface_or_a_little_short_of_it_severs_the_block() {
    let block = Cloud::block();
    for offset in 0..24 {
        let x = -0.5 + f64::from(offset) / 24.0 + 1e-3;
        for short in [0.0, 0.05, -0.2] {
            let cuts = lead(&block, &down(x, -HALF + short));
            let sizes = pieces(&block, &cuts);
            assert_eq!(sizes.len(), 2, "x {x}, {short} short: {sizes:?}");
            assert!(folds(&cuts).0 < 1.0 + 1e-9, "x {x}: {:?}", folds(&cuts));
        }
    }
}

#[test]
fn a_blade_that_ends_inside_leaves_the_rest() {
    let block = Cloud::block();
    let cuts = lead(&block, &down(0.3, -1.4));
    assert_eq!(pieces(&block, &cuts), [343]);
    let (vertices, _) = cuts.surface();
    let lowest = vertices.iter().map(|v| v.z).fold(f64::INFINITY, f64::min);
    assert!((lowest + 1.4).abs() <= SKIN, "the cut ends at {lowest}");
}

#[test]
fn a_blade_that_trembles_cuts_once() {
    let block = Cloud::block();
    for tremble in [0.1, 0.2] {
        let mut path = Vec::new();
        for step in 0..60 {
            let t = f64::from(step);
            // Two steps forward and one back, to and fro.
            let z = 5.0 - 0.15 * t + 0.2 * (t * TAU / 3.0).sin();
            path.push(edge(0.3 + tremble * (0.7 * t).sin(), z.max(-3.4)));
        }
        path.push(edge(0.3, -3.4));
        let cuts = lead(&block, &path);
        assert_eq!(pieces(&block, &cuts).len(), 2, "tremble {tremble}");
        let (ratio, back) = folds(&cuts);
        assert!(back < 1e-9, "tremble {tremble}: {back} faces backwards");
        assert!(ratio < 1.0 + 2.0 * tremble, "tremble {tremble}: {ratio}");
    }
}

#[test]
fn a_blade_that_stands_or_goes_back_in_its_gap_adds_nothing() {
    let block = Cloud::block();
    let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
    let mut front = Front::new(13, 1.0);
    drive(&mut front, &mut cuts, &down(0.3, 0.0));
    let before = cuts.triangle_count();
    let back = [(0.3, 0.0), (0.3, 0.0), (0.3, 0.4), (0.35, 0.8), (0.3, 0.2)];
    let back = back.map(|(x, z)| edge(x, z));
    for (k, pair) in back.windows(2).enumerate() {
        let places = places(&pair[0], &pair[1]);
        let places = if k % 2 == 1 { in_gap(places) } else { places };
        let patch = front
            .advance(&mut cuts, &places, 0.45, &inside, SKIN)
            .unwrap();
        assert!(patch.triangles.is_empty(), "place {k}: {patch:?}");
    }
    assert_eq!(cuts.triangle_count(), before);
    let places = places(&back[4], &edge(0.3, -0.3));
    front
        .advance(&mut cuts, &places, 0.45, &inside, SKIN)
        .unwrap();
    assert!(cuts.triangle_count() > before, "it goes on from there");
    let inner = block.x.len();
    assert_eq!(pieces(&block, &cuts), [u32::try_from(inner).unwrap()]);
}

#[test]
fn a_branch_starts_through_the_sheet_and_severs() {
    let block = Cloud::block();
    // Down the middle and out, then sideways out of the gap.
    let mut cuts = lead(&block, &down(0.3, -3.4));
    let mut front = Front::new(13, 1.0);
    let mut last = edge(0.3, 0.4);
    for step in 0..10 {
        let now = edge(0.3 + 0.4 * f64::from(step), 0.4);
        let mut places = places(&last, &now);
        if step == 0 {
            places = in_gap(places);
        }
        front
            .advance(&mut cuts, &places, 0.4, &inside, SKIN)
            .unwrap();
        last = now;
    }
    let sizes = pieces(&block, &cuts);
    assert_eq!(sizes.len(), 3, "{sizes:?}");
}

#[test]
fn the_same_patches_give_the_same_cut() {
    let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
    let mut again = cuts.clone();
    let mut front = Front::new(13, 1.0);
    for patch in drive(&mut front, &mut cuts, &down(0.3, -3.4)) {
        again.set_weld_tolerance(0.0);
        again
            .add_surface(&patch.vertices, &patch.triangles)
            .unwrap();
    }
    assert_eq!(cuts.surface(), again.surface());
    let out = front.samples.iter().all(|sample| sample.anchor.is_none());
    assert!(out, "the blade is out");
}

#[test]
fn the_edge_of_a_cut_is_carried_through_a_point() {
    let block = Cloud::block();
    let mut cuts = lead(&block, &down(0.3, 0.2));
    let pair = [DVec3::new(0.0, 0.0, 0.0), DVec3::new(1.0, 0.0, -0.4)];
    assert!(!cuts.crosses(pair[0], pair[1]));
    close_edge(&mut cuts, pair[0].midpoint(pair[1]), 1.0, &inside).unwrap();
    assert!(cuts.crosses(pair[0], pair[1]));
    let far = close_edge(&mut cuts, DVec3::splat(-2.9), 0.1, &inside).unwrap();
    assert!(far.triangles.is_empty());
}

#[test]
fn cuts_across_each_other_dice_the_block() {
    let block = Cloud::block();
    let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
    for axis in 0..3 {
        for side in [-1.2, 1.2] {
            let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
            let middle = DVec3::AXES[axis] * side;
            let edge = |t: f64| -> Vec<DVec3> {
                (0..13)
                    .map(|k| middle + v * t + u * (f64::from(k) - 6.3))
                    .collect()
            };
            lead_into(&block, &mut cuts, &even(-5.0, 5.0, edge));
        }
    }
    let sizes = pieces(&block, &cuts);
    assert_eq!(sizes.len(), 27, "{sizes:?}");
}

/// A blade along y at a height, from one x to another.
fn sideways(from: f64, to: f64, z: f64) -> Vec<Vec<DVec3>> {
    even(from, to, |x| edge(x, z))
}

#[test]
fn a_blade_that_ends_at_a_face_of_an_older_sheet_or_begins_beside_it_severs() {
    let block = Cloud::block();
    let ends = [0.09, 0.05, 0.0, -0.05, -0.2].map(|end| (5.0, 0.3 + end));
    let begins = [0.0, 0.04, 0.09, -0.2].map(|beside| (0.3 + beside, 4.0));
    for (from, to) in ends.into_iter().chain(begins) {
        let mut cuts = lead(&block, &down(0.3, -3.4));
        lead_into(&block, &mut cuts, &sideways(from, to, 0.4));
        let sizes = pieces(&block, &cuts);
        assert_eq!(sizes.len(), 3, "from {from} to {to}: {sizes:?}");
    }
}

#[test]
fn a_blade_that_is_put_in_near_a_sheet_does_not_turn_to_it() {
    let block = Cloud::block();
    let mut cuts = lead(&block, &down(1.3, -3.4));
    let older = cuts.triangle_count();
    lead_into(&block, &mut cuts, &sideways(0.2, -1.6, 0.4));
    for t in older..cuts.triangle_count() {
        let corners = cuts.triangle(t);
        let highest = corners.map(|x| x.x).into_iter().fold(-9.0, f64::max);
        assert!(highest < 0.2 + 1e-9, "{corners:?} reaches back");
    }
}

#[test]
fn the_front_is_led_to_points_straight_ahead_of_it_only() {
    let block = Cloud::block();
    let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
    let mut front = Front::new(13, 1.0);
    drive(&mut front, &mut cuts, &down(0.3, 0.2));
    let before = cuts.triangle_count();
    let point = DVec3::new(0.3, 0.8, -0.3);
    // A segment through it, across the plane x.
    let (a, b) = (point - DVec3::X * 0.4, point + DVec3::X * 0.4);
    assert!(!cuts.crosses(a, b));
    front.reach(&mut cuts, &[point], &inside, SKIN).unwrap();
    assert!(cuts.crosses(a, b), "it lies between two samples");
    let sheet = before..cuts.triangle_count();
    let area: f64 = sheet.map(|t| cuts.area(t)).sum();
    // Two samples advance by 0.65, and their neighbours stay: a trapezoid of 1 and 3.
    assert!((area - 0.65 * 2.0).abs() < 1e-9, "{area}");
    let again = front.reach(&mut cuts, &[DVec3::new(0.3, 0.8, 1.0)], &inside, SKIN);
    assert!(again.unwrap().triangles.is_empty(), "behind it");
    let again = front.reach(&mut cuts, &[DVec3::new(0.9, 0.8, -0.5)], &inside, SKIN);
    assert!(again.unwrap().triangles.is_empty(), "beside it");
    assert!(front.is_sound() && block.x.len() == 343);
}

#[test]
fn the_edge_that_is_carried_on_lies_across_the_way() {
    let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
    let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
    let corners = corners.map(|[x, y]| DVec3::new(x, y, 0.0));
    cuts.add_surface(&corners, &[[0, 1, 2], [0, 2, 3]]).unwrap();
    // Off the corner, along one of the edges that meet there.
    let places = [[2.5, 1.999], [1.999, 2.5], [2.6, 2.0001], [2.0001, 2.6]];
    for point in places.map(|[x, y]| DVec3::new(x, y, 0.0)) {
        let patch = close_edge(&mut cuts.clone(), point, 1.0, &inside).unwrap();
        let [p, q, r] = [0, 1, 2].map(|k| patch.vertices[k]);
        let area = 0.5 * (q - p).cross(r - p).length();
        assert!(area > 0.4, "{point}: {patch:?}");
    }
}

/// A front that tears on from inside of a block severs it, straight, by half a spacing at a time; the blade that comes after finds
/// the gap.
#[test]
fn a_front_that_tears_severs_the_block() {
    let block = Cloud::block();
    for (x, end) in [(0.3, 0.2), (-1.4, 1.7), (2.2, -0.6)] {
        let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
        let mut front = Front::new(13, 1.0);
        drive(&mut front, &mut cuts, &down(x, end));
        assert_eq!(pieces(&block, &cuts), [343]);
        let everywhere = |[_, ahead, along]: [DVec3; 3]| {
            assert!(ahead.distance(-DVec3::Z) < 1e-12 && along.distance(DVec3::Y) < 1e-9);
            true
        };
        for tears in 0.. {
            let tearing: Vec<bool> = front.tearing(&everywhere).collect();
            if !tearing.contains(&true) {
                let most = ((end + HALF) / 0.5).ceil();
                assert!((f64::from(tears) - most).abs() <= 1.0, "{tears} of {most}");
                break;
            }
            front.tear(&mut cuts, &tearing, 0.5, &inside).unwrap();
            assert!(front.is_sound());
        }
        assert_eq!(pieces(&block, &cuts).len(), 2, "x {x}");
        assert!(folds(&cuts).0 < 1.0 + 1e-9, "x {x}: {:?}", folds(&cuts));
    }
}

/// Where it tears in part of its width alone it goes on there; the blade moves the rest, and what has torn once it is past that.
#[test]
fn a_blade_passes_what_has_torn() {
    let block = Cloud::block();
    let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
    let mut front = Front::new(13, 1.0);
    drive(&mut front, &mut cuts, &down(0.3, 1.2));
    for _ in 0..3 {
        let tearing = front.tearing(&|[at, ..]| at.y > 0.5).collect::<Vec<_>>();
        front.tear(&mut cuts, &tearing, 0.5, &inside).unwrap();
    }
    let crosses = |cuts: &Cuts, y: f64, z: f64| {
        let at = DVec3::new(0.3, y, z);
        cuts.crosses(at - DVec3::X * 0.3, at + DVec3::X * 0.3)
    };
    let torn = [[1.4, 0.1], [1.4, -0.6], [-1.4, 1.4], [-1.4, 0.1]];
    let torn = torn.map(|[y, z]| crosses(&cuts, y, z));
    assert_eq!(torn, [true, false, true, false]);
    // Beside the tear the blade begins nothing.
    let flank = |x: f64| places(&edge(x, 1.0), &edge(x, 0.6));
    let added = front.advance(&mut cuts, &flank(1.7), 0.45, &inside, SKIN);
    assert!(added.unwrap().triangles.is_empty());
    let path = even(1.2, -5.0, |z| edge(0.3, z));
    let mut last = &path[0];
    for now in &path {
        let mut places = places(last, now);
        for place in places.iter_mut().filter(|_| now[0].z > -0.3).skip(7) {
            *place = in_gap(vec![*place])[0];
        }
        front
            .advance(&mut cuts, &places, 0.45, &inside, SKIN)
            .unwrap();
        last = now;
    }
    let sizes = pieces(&block, &cuts);
    assert_eq!(sizes.len(), 2, "{sizes:?}");
    assert!(folds(&cuts).0 < 1.0 + 1e-9, "{:?}", folds(&cuts));
}

/// A blade that comes in again far from what has torn, beside it or ahead, begins anew there and takes the front nowhere.
#[test]
fn a_blade_that_comes_back_far_from_a_tear_begins_anew() {
    for x in [0.3, -2.6] {
        let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
        let mut front = Front::new(13, 1.0);
        drive(&mut front, &mut cuts, &down(0.3, 1.2));
        for _ in 0..3 {
            let tearing = front.tearing(&|_| true).collect::<Vec<_>>();
            front.tear(&mut cuts, &tearing, 0.5, &inside).unwrap();
        }
        drive(
            &mut front,
            &mut cuts,
            &[-5.0, -3.4, -2.9].map(|z| edge(x, z)),
        );
        let crosses = |x: f64, z: f64| {
            let at = DVec3::new(x, 1.4, z);
            cuts.crosses(at - DVec3::X * 0.3, at + DVec3::X * 0.3)
        };
        let places = [(x, -2.95), (0.3, -0.1), (0.3, -1.6)].map(|(x, z)| crosses(x, z));
        assert_eq!(places, [true, true, false], "at {x}");
    }
}

/// Tissue carries the blade's last point out through the face beside it and back, where it may hang in the gap. The sheet is
/// curved: a flat one does not meet itself.
#[test]
fn a_blade_whose_last_point_slides_out_beside_leaves_no_slits() {
    for (swing, waves, phase) in [(0.1, 3.0, 1.5), (0.2, 3.0, 0.0), (0.2, 3.0, 1.5)] {
        for offset in [-1.0, -0.9, -0.8, -0.5] {
            for slant in [0.0, 0.1] {
                let path = even(15.0, -15.0, |way| {
                    let z = way / 3.0;
                    let slid = offset + f64::sin(TAU * waves * z / 6.0 + phase);
                    let at = |k: u32| (f64::from(k) - 6.0) * (1.0 + swing * slid / HALF);
                    let point = |k| {
                        DVec3::new(
                            0.1 + 0.03 * f64::sin(5.0 * z + at(k)),
                            at(k),
                            z + slant * at(k),
                        )
                    };
                    (0..13).map(point).collect()
                });
                let cuts = lead_out(&path);
                let away = |(y, z)| [-2.0, 2.0].map(|x| DVec3::new(x, y, z));
                let ys = (0..=60).map(|k| 0.0999 * f64::from(k - 30));
                let grid = ys.flat_map(|y| (0..=40).map(move |k| (y, 0.065 * f64::from(k - 20))));
                let holes = grid.map(away).filter(|[a, b]| !cuts.crosses(*a, *b));
                let what = format!("{swing}, {waves}, {phase}, {offset}, {slant}");
                assert_eq!(
                    holes.count(),
                    0,
                    "swing, waves, phase, offset, slant: {what}"
                );
            }
        }
    }
}

/// Drives a blade of which every other place is in the gap where its point has lost its front.
fn lead_out(path: &[Vec<DVec3>]) -> Cuts {
    let mut cuts = Cuts::new(&CutSettings::for_spacing(1.0));
    let mut front = Front::new(path[0].len(), 1.0);
    let mut had = vec![false; path[0].len()];
    for (n, now) in path.iter().enumerate() {
        let mut places = places(&path[n.saturating_sub(1)], now);
        for ((sample, place), had) in front.samples.iter().zip(&mut places).zip(&mut had) {
            *had |= sample.anchor.is_some();
            if *had && sample.anchor.is_none() && n % 2 == 0 {
                *place = in_gap(vec![*place])[0];
            }
        }
        front
            .advance(&mut cuts, &places, 0.15, &inside, SKIN)
            .unwrap();
    }
    cuts
}
