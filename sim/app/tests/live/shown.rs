//! What the page shows while something moves, and the colours that it can show.

use std::io::Cursor;

use phyxel::scene::Scene;
use phyxel_cli::live::Session;
use phyxel_elastic::von_mises_stress;
use phyxel_splat::Frame;
use serde_json::json;

use crate::chromium::{Chromium, show};
use crate::page::{Live, middle, opened, pause, step, step_until};
use crate::session::liver;

/// A liver of so many surfels that does not come to rest, its page, and the browser that stands after some steps.
fn standing(surfels: u32, size: [u32; 2], steps: u64) -> Option<(Scene, Live, Chromium)> {
    let mut scene = liver(400, surfels);
    scene.integration.settle = None;
    let (live, mut browser) = opened(&scene, size)?;
    pause(&mut browser);
    step(&mut browser, steps);
    Some((scene, live, browser))
}

/// The canvas at so many samples to a side of a pixel, and which of its pixels show tissue: what is behind is not red.
fn tissue(browser: &mut Chromium, samples: f64, name: &str) -> (usize, Vec<bool>) {
    let png = browser.bytes(&format!(
        "(() => {{ stage.fit({samples}); stage.renderer.draw(stage.camera, []); \
         return stage.canvas.toDataURL('image/png').split(',')[1] }})()"
    ));
    show(name, &png);
    let frame = Frame::read_png(Cursor::new(&png)).unwrap();
    let red = frame.pixels.iter().map(|pixel| pixel[0] > pixel[1]);
    (frame.width as usize, red.collect())
}

/// Pixels of a picture of half the size that are behind where the fine one has tissue all around, and the other way round.
fn wrong(fine: &(usize, Vec<bool>), half: &(usize, Vec<bool>)) -> [usize; 2] {
    let height = half.1.len() / half.0;
    let mut wrong = [0; 2];
    for (at, seen) in half.1.iter().enumerate() {
        let [x, y] = [at % half.0, at / half.0];
        if x < 3 || y < 3 || x + 3 >= half.0 || y + 3 >= height {
            continue;
        }
        let near = (2 * y - 4..2 * y + 6).flat_map(|v| (2 * x - 4..2 * x + 6).map(move |u| (u, v)));
        let tissue = near.filter(|(u, v)| fine.1[v * fine.0 + u]).count();
        wrong[0] += usize::from(tissue == 100 && !seen);
        wrong[1] += usize::from(tissue == 0 && *seen);
    }
    wrong
}

/// Time (ms) of a picture in which everything moved, the median of seven.
fn time_of(browser: &mut Chromium, samples: f64) -> f64 {
    browser.number(&format!(
        "(() => {{ const {{ renderer }} = stage, {{ gl }} = renderer, times = []; stage.fit({samples}); \
         for (let k = 0; k < 8; k += 1) {{ const begun = performance.now(); renderer.bodies.forEach((body) => (body.stale = true)); \
         renderer.draw(stage.camera, []); gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4)); times.push(performance.now() - begun) }} \
         return times.slice(1).sort((a, b) => a - b)[3] }})()"
    ))
}

/// Few and large disks stand for all while pictures come slowly: they leave hardly a gap and lie over nothing, cut or not.
#[test]
#[ignore = "draws by software for a minute; `.ci/run` asks for it"]
fn coarse_pictures_are_whole() {
    let Some((_, _live, mut browser)) = standing(30_000, [960, 540], 2) else {
        return;
    };
    let times = [1.0, 0.7, 0.5].map(|samples| (samples, time_of(&mut browser, samples)));
    for (samples, time) in times {
        eprintln!("picture of 30,000 surfels at {samples} of 960x540: {time:.0} ms");
    }
    for name in ["whole", "severed"] {
        if name == "severed" {
            let [x, _] = middle(&mut browser);
            browser.key("2");
            browser.stroke(&[[x, 40.0], [x + 10.0, 500.0]]);
            step_until(&mut browser, "stage.panel.last.severed > 100");
            step(&mut browser, 300);
        }
        let fine = tissue(&mut browser, 1.0, &format!("{name}-fine"));
        let all = browser.number("stage.renderer.bodies[0].count");
        let half = tissue(&mut browser, 0.5, &format!("{name}-coarse"));
        let few = browser.number("stage.renderer.bodies[0].count");
        let [gaps, halo] = wrong(&fine, &half);
        eprintln!("{name}: {few} of {all} disks, {gaps} pixels of gaps, {halo} beside the body");
        assert!(few < 0.7 * all, "{few} of {all}");
        // As many as in still pictures of cut faces at most.
        let seen = half.1.iter().filter(|seen| **seen).count();
        assert!(2000 * gaps <= seen && halo == 0, "{gaps} of {seen}, {halo}");
    }

    // With a hand on it, as it comes.
    browser.evaluate("stage.quality.pinned = null; stage.link.ask({ do: 'play' })");
    browser.key("3");
    let [x, y] = middle(&mut browser);
    browser.mouse("mousePressed", [x - 40.0, y]);
    let begun = std::time::Instant::now();
    let before = browser.number("stage.frames");
    for k in 0..60 {
        browser.mouse("mouseMoved", [x - 40.0 + f64::from(k % 20), y]);
        std::thread::sleep(std::time::Duration::from_millis(40));
    }
    let rate = (browser.number("stage.frames") - before) / begun.elapsed().as_secs_f64();
    browser.wait("stage.panel.latency(0.5) !== null");
    let late = browser.evaluate("[0.5, 0.95].map((part) => Math.round(stage.panel.latency(part)))");
    eprintln!("{rate:.1} pictures a second, hand to picture {late} ms (p50, p95)");
    assert!(rate > 0.0);
}

/// Colours of quantities that the server sends for whoever asks, and nobody else.
#[test]
fn colours_show_stress_and_contact() {
    let Some((scene, _live, mut browser)) = standing(4_000, [820, 600], 20) else {
        return;
    };
    assert_eq!(browser.evaluate("stage.state.values"), json!(0));
    let plain = browser.number("stage.state.bytes");
    let color = |name: &str| {
        format!(
            "(() => {{ const s = document.getElementById('coloring'); s.value = '{name}'; s.dispatchEvent(new Event('change')) }})()"
        )
    };
    browser.evaluate(&color("stress"));
    browser.wait("stage.state.values === 1 && !stage.dirty");
    let nodes = browser.number("stage.panel.last.nodes");
    let more = format!("stage.state.bytes - {plain} === 4 + 4 * stage.panel.last.nodes");
    assert_eq!(browser.evaluate(&more), json!(true));
    browser.shot("stress");
    let mut session = Session::new(&scene).unwrap();
    let steps = browser.evaluate("stage.state.step").as_u64().unwrap();
    while session.world().steps() < steps {
        session.step().unwrap();
    }
    let elastic = session.world().bodies()[0].elastic();
    let stress = von_mises_stress(elastic.cauchy_stress(7));
    assert!(stress > 0.0);
    let same = format!("stage.state.bodies[0].values[0][7] === Math.fround({stress:?})");
    assert_eq!(browser.evaluate(&same), json!(true));
    assert!(
        browser
            .evaluate("document.getElementById('coloring-most').textContent")
            .as_str()
            .unwrap()
            .ends_with("kPa")
    );

    // The probe presses a few nodes; all others feel nothing.
    let [x, y] = middle(&mut browser);
    browser.key("3");
    browser.drag(&[[x, y], [x + 4.0, y]]);
    browser.evaluate(&color("contact"));
    step_until(&mut browser, "stage.state.tools[0].penetration > 0");
    step(&mut browser, 60);
    browser.shot("contact");
    let pressed = browser.number("stage.state.bodies[0].values[0].filter((p) => p > 0).length");
    assert!(
        pressed > 0.0 && pressed < 0.5 * nodes,
        "{pressed} of {nodes}"
    );
    browser.evaluate(&color("tissue"));
    browser.wait("stage.state.values === 0");

    // A plane is drawn behind its normal.
    let plane = "import('./tools.js').then(({ slab }) => { const heights = slab(2, [0, 3, 4]).map(([p]) => 0.6 * p[1] + 0.8 * p[2]); \
                 return [Math.max(...heights), Math.min(...heights)] })";
    let plane = browser.evaluate(plane);
    let [top, bottom] = [0, 1].map(|k| plane[k].as_f64().unwrap());
    assert!(
        top.abs() < 1e-12 && (bottom + 0.04).abs() < 1e-12,
        "{plane}"
    );
    assert_eq!(browser.evaluate("stage.renderer.gl.getError()"), json!(0));
}
