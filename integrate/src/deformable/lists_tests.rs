use super::super::tests::{listed_anew, sample, sheets};
use super::super::{ContactDisks, DeformableContact, DeformableSettings};
use crate::DiskSample;
use glam::{DQuat, DVec3};
use testkit::cloud::Random;

/// An uncut surface and a flank near it at rest, however thin the tissue between them, are never in contact; two flanks are, and
/// two uncut sides of a slit that have no node in common.
#[test]
fn feather_edges_touch_nothing() {
    let rest: Vec<DVec3> = (0..9_u32)
        .map(|i| DVec3::new((i % 3).into(), (i / 3).into(), 0.0))
        .collect();
    let rest = [rest.clone(), rest].concat();
    let pair = |flanks: [bool; 2], gap: f64, apart: u32| {
        let mut disks = ContactDisks::default();
        for (k, flank) in flanks.into_iter().enumerate() {
            let z = [0.0, gap][k];
            let normal = [DVec3::Z, -DVec3::Z][k];
            let sample = sample(DVec3::new(1.0, 1.0, z), normal, 1.0, 0);
            disks.push(
                DiskSample { flank, ..sample },
                (
                    &[0, 1, 2, 3, 4, 5, 6, 7, 8].map(|node| node + apart * u32::from(k == 1)),
                    &[],
                ),
                &rest,
            );
        }
        let settings = DeformableSettings::default();
        let mut contact = DeformableContact::new(disks, settings, 1, |_, _| Some(0.0));
        contact.update_lists(&rest);
        contact.listed_pairs()
    };
    assert_eq!(pair([true, true], 0.0, 0), 2, "the flanks of a cut");
    assert_eq!(pair([false, true], 0.01, 0), 0, "a feather edge");
    assert_eq!(pair([false, false], 0.5, 9), 2, "a slit that the body has");
    assert_eq!(pair([false, false], 0.5, 0), 0, "one finer than the nodes");
}

/// Pairs that lists have and that act with nodes at `x`.
fn pairs(contact: &DeformableContact, x: &[DVec3]) -> Vec<(usize, u32)> {
    let mut found = Vec::new();
    contact.each_point(&contact.place(x), |point, pairs| {
        let others = pairs.iter().map(|pair| contact.near[pair.slot as usize]);
        found.extend(others.map(|other| (point, other)));
    });
    found
}

/// What moves and turns as a whole is listed once.
#[test]
fn what_turns_together_is_listed_once() {
    let (mut contact, rest) = sheets(0.0, 5);
    let mut lists = 0;
    for step in 0..60 {
        let turn = DQuat::from_scaled_axis(DVec3::new(0.3, 0.8, 0.2) * 0.006 * f64::from(step));
        let by = DVec3::X * f64::from(step);
        let x: Vec<DVec3> = rest.iter().map(|x| turn * *x + by).collect();
        lists += u32::from(contact.update_lists(&x));
    }
    assert_eq!(lists, 1);
}

/// A piece that goes off alone is not listed anew until it comes back, and then all pairs are there.
#[test]
fn what_is_apart_is_listed_once() {
    let (contact, rest) = sheets(0.0, 5);
    let half = rest.len() / 2;
    let mut random = Random::new(8);
    let shaken: Vec<DVec3> = rest.iter().map(|x| *x + random.vector(0.02)).collect();
    let at = |z: f64| -> Vec<DVec3> {
        let lift = |(n, x): (usize, &DVec3)| *x + DVec3::Z * if n < half { 0.0 } else { z };
        shaken.iter().enumerate().map(lift).collect()
    };
    let mut contact = contact;
    let mut lists = [0; 2];
    for (way, heights) in [(0..40).collect::<Vec<_>>(), (0..40).rev().collect()]
        .into_iter()
        .enumerate()
    {
        for height in heights {
            let x = at(0.3 * f64::from(height) - 0.05);
            lists[way] += u32::from(contact.update_lists(&x));
            let brute = listed_anew(&contact, 1e3, &x);
            assert_eq!(pairs(&contact, &x), pairs(&brute, &x), "at {height}");
        }
    }
    let [off, back] = lists;
    assert!(
        (2..20).contains(&off) && (2..20).contains(&back),
        "{off} and {back} of 40"
    );
}

/// Where no bodies may touch, lists hold for ever, and that is a state.
#[test]
fn what_touches_nothing_is_never_listed_again() {
    let (contact, rest) = sheets(0.0, 5);
    let disks = contact.disks().clone();
    let settings = DeformableSettings::default();
    let mut contact = DeformableContact::new(disks, settings, 2, |_, _| None);
    let mut lists = 0;
    for step in 0..9 {
        let apart = |(n, x): (usize, &DVec3)| *x * f64::from(1 + step) * (n % 3) as f64;
        let x: Vec<DVec3> = rest.iter().enumerate().map(apart).collect();
        lists += u32::from(contact.update_lists(&x));
        assert!(contact.fits(contact.state(), rest.len()));
    }
    assert_eq!(lists, 1);
}

/// Where a corner swings and samples of it change, as in a cut, pairs of its blocks alone are listed again: lists have all that
/// meet, and are those of a contact that begins from the state.
#[test]
fn blocks_that_swing_alone_are_listed_again() {
    const SIDE: u32 = 24;
    let node = |i: u32, j: u32, k: u32| (k * SIDE + j) * SIDE + i;
    let all = || (0..2 * SIDE * SIDE).map(|n| (n % SIDE, n / SIDE % SIDE, n / SIDE / SIDE));
    let height = |k: u32| 0.8 * f64::from(k);
    let rest: Vec<DVec3> = all()
        .map(|(i, j, k)| DVec3::new(i.into(), j.into(), height(k)))
        .collect();
    let mut disks = ContactDisks::default();
    for (i, j, k) in all() {
        let near = |i: u32| i.saturating_sub(1)..(i + 2).min(SIDE);
        let row = near(j).flat_map(|j| near(i).map(move |i| node(i, j, k)));
        let normal = DVec3::Z * if k == 0 { 1.0 } else { -1.0 };
        let sample = sample(rest[node(i, j, k) as usize], normal, 1.0, k);
        disks.push(sample, (&row.collect::<Vec<_>>(), &[]), &rest);
    }
    let settings = DeformableSettings::default();
    let begin = |disks| DeformableContact::new(disks, settings, 2, |_, _| Some(0.0));
    let mut contact = begin(disks);
    let mut random = Random::new(4);
    let (mut parts, mut wholes, mut before) = (0, 0, rest.clone());
    for step in 0..120 {
        let swing = 2.0 * (0.1 * f64::from(step)).sin();
        // At last all of it crumples.
        let shake = if step < 112 { 0.05 } else { 0.3 };
        let place = |((i, j, k), x): ((u32, u32, u32), &DVec3)| {
            let is_corner = i < 5 && j < 5 && k == 1;
            *x + random.vector(shake) + DVec3::Z * if is_corner { swing } else { 0.0 }
        };
        let x: Vec<DVec3> = all().zip(&rest).map(place).collect();
        for part in 1..=6 {
            let on_way = |(from, to): (&DVec3, &DVec3)| from.lerp(*to, f64::from(part) / 6.0);
            let x: Vec<DVec3> = before.iter().zip(&x).map(on_way).collect();
            let is_listed = !contact.state.listed_at.is_empty();
            let room = is_listed.then(|| contact.room_left(&x, None).0.pairs);
            let spent = room.is_none_or(|pairs| pairs[0].0 < 0.0);
            assert_eq!(contact.update_lists(&x), spent, "step {step}: lists hold");
            if spent {
                *(if contact.state.restless.is_empty() {
                    &mut wholes
                } else {
                    &mut parts
                }) += 1;
            }
        }
        x.clone_into(&mut before);
        if step == 60 {
            let mut disks = contact.take_disks(&x);
            for at in [3, 4] {
                let sample = disks.samples[at];
                let nodes = disks.nodes[disks.row(at)].to_vec();
                let position = sample.position + random.vector(0.3);
                disks.set(at, DiskSample { position, ..sample }, (&nodes, &[]), &rest);
                disks.push(sample, (&nodes, &[]), &rest);
            }
            contact.set_disks(disks, &[3, 4], &x);
        }
        let mut resumed = begin(contact.disks.clone());
        resumed.restore(contact.state.clone());
        assert!(resumed.points == contact.points && resumed.lists == contact.lists);
        let brute = listed_anew(&contact, 1.5, &x);
        assert_eq!(pairs(&contact, &x), pairs(&brute, &x), "step {step}");
    }
    assert!(wholes < 4 && parts > 10, "{wholes} and {parts}");
}

/// Surfaces that lie outside their rows, stretched or not, are listed before they meet, and those a spacing off are in no contact.
#[test]
fn membranes_that_come_near_are_listed_before_they_meet() {
    let side = |k: u32| -> Vec<DVec3> {
        let z = [0.0, 6.0][k as usize];
        (0..16_u32)
            .map(|i| DVec3::new((i % 4).into(), (i / 4).into(), z))
            .collect()
    };
    let rest = [side(0), side(1)].concat();
    let cases = [
        (0.3, true, 1.0),
        (0.95, true, 1.0),
        (0.95, true, 3.5),
        (1.1, false, 1.0),
    ];
    for (thickness, meets, stretch) in cases {
        let mut disks = ContactDisks::default();
        for (point, x) in (0_u32..).zip(&rest) {
            let (k, normal) = if point < 16 {
                (0, DVec3::Z)
            } else {
                (1, -DVec3::Z)
            };
            let sample = sample(*x + normal * thickness, normal, 1.0, k);
            let nodes: Vec<u32> = (0..16).map(|n| n + 16 * k).collect();
            disks.push(sample, (&nodes, &[]), &rest);
        }
        let settings = DeformableSettings::default();
        let mut contact = DeformableContact::new(disks, settings, 2, |_, _| Some(0.0));
        let mut most = 0;
        for height in 0..600 {
            let down = DVec3::Z * (-0.01 * f64::from(height));
            let stretch = DVec3::new(stretch, 1.0, 1.0);
            let lower =
                |(n, x): (usize, &DVec3)| *x * stretch + if n < 16 { DVec3::ZERO } else { down };
            let x: Vec<DVec3> = rest.iter().enumerate().map(lower).collect();
            contact.update_lists(&x);
            let brute = listed_anew(&contact, 1e3, &x);
            let count = |contact: &DeformableContact| {
                let mut pairs = 0;
                contact.each_point(&contact.place(&x), |_, met| pairs += met.len());
                pairs
            };
            assert_eq!(
                count(&contact),
                count(&brute),
                "{thickness}, {height}, {stretch}"
            );
            most = most.max(count(&contact));
        }
        assert_eq!(most > 0, meets, "{thickness}");
    }
}
