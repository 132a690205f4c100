//! The page in a real browser: what is seen is what the renderer of runs draws, real pointer events cut.

use std::io::Cursor;

use phyxel::scene::Scene;
use phyxel_cli::live::Session;
use phyxel_splat::Frame;
use serde_json::json;

use crate::chromium::{Chromium, show};
use crate::page::{
    Live, anew, drop_of, middle, opened, pause, read_once_there, step, step_until,
    unloaded_and_paused, wait_until_still,
};
use crate::session::{liver, run_of_files};

/// Difference of a channel (of 255) up to which two pixels are alike, and the share that must be: sums
/// on the graphics card are of half precision.
const ALIKE: i32 = 6;
const SHARE: f64 = 0.99;

fn frame(png: &[u8]) -> Frame {
    Frame::read_png(Cursor::new(png)).unwrap()
}

/// Bits of the nodes' positions that the page has, as text.
const BITS: &str = "(() => { const p = stage.state.bodies[0].positions; \
    return [stage.state.step, ...new Uint32Array(p.slice().buffer)].join() })()";

/// The canvas alone, without a user on it.
fn canvas(browser: &mut Chromium) -> Vec<u8> {
    browser.bytes(
        "(() => { stage.fit(1); stage.renderer.draw(stage.camera, []); \
         return stage.canvas.toDataURL('image/png').split(',')[1] })()",
    )
}

/// Draws the same state by the renderer of runs and compares pixels; the fraction of those alike.
fn compare(browser: &mut Chromium, live: &Live, number: u32) -> f64 {
    let own = canvas(browser);
    browser.evaluate("stage.savePicture()");
    let file = live.out.path().join(format!("picture-{number:03}.png"));
    let told = read_once_there(&file);
    show(&format!("page-{number}"), &own);
    show(&format!("renderer-{number}"), &told);
    let (own, told) = (frame(&own), frame(&told));
    assert_eq!((own.width, own.height), (told.width, told.height));
    let near = |(a, b): &(&[u8; 4], &[u8; 4])| {
        (0..3).all(|k| (i32::from(a[k]) - i32::from(b[k])).abs() <= ALIKE)
    };
    let pixels = own.pixels.iter().zip(&told.pixels);
    let share = pixels.filter(near).count() as f64 / own.pixels.len() as f64;
    eprintln!("picture {number}: a share of {share:.4} within {ALIKE} of 255");
    share
}

/// A target of the surfels that the page's card has carried: four numbers each.
fn carried(browser: &mut Chromium, target: u32) -> Vec<f64> {
    let numbers = format!("[...stage.renderer.bodies[0].carried({target})]");
    serde_json::from_value(browser.evaluate(&numbers)).unwrap()
}

/// Where the surfels of the page are, against those of a session that took the same steps; and where the page's own
/// arithmetic, which picks, puts one of them.
fn compare_places(browser: &mut Chromium, scene: &Scene) {
    let steps = browser.evaluate("stage.state.step").as_u64().unwrap();
    let [centers, facing] = [0, 3].map(|target| carried(browser, target));
    let picked = browser.evaluate("stage.renderer.bodies[0].surfel(77).center");
    let mut session = Session::new(scene).unwrap();
    while session.world().steps() < steps {
        session.step().unwrap();
    }
    let bounds = session.world().bodies()[0].solid.bounds();
    let size = bounds.size().length();
    let (painter, world) = session.drawing();
    painter.carry(world);
    let splats = painter.skins()[0].splats();
    assert_eq!(centers.len(), 4 * splats.len());
    let point = |numbers: &[f64], k: usize| glam::DVec3::from_slice(&numbers[4 * k..]);
    let (mut worst, mut turned) = (0.0, 1.0);
    for (k, splat) in splats.iter().enumerate() {
        worst = f64::max(worst, point(&centers, k).distance(splat.position));
        turned = f64::min(turned, point(&facing, k).dot(splat.normal));
    }
    let picked = [0, 1, 2].map(|k| picked[k].as_f64().unwrap());
    let off = glam::DVec3::from_array(picked).distance(splats[77].position);
    worst = f64::max(worst, off);
    eprintln!(
        "carried places: largest difference {:.1e} of the body at step {steps}",
        worst / size
    );
    assert!(worst < 1e-5 * size, "{worst} m");
    assert!(turned > 0.9999, "cosine {turned}");
}

/// The first minute of a user.
#[test]
#[ignore = "takes software half a minute; `.ci/run` asks for it"]
fn someone_cuts_undoes_presses_and_saves_in_a_browser() {
    let scene = liver(400, 4_000);
    let Some((live, mut browser)) = opened(&scene, [640, 400]) else {
        return;
    };
    browser.wait("!stage.panel.last.settling");
    // The code has left the address; the context is real.
    assert_eq!(browser.evaluate("location.hash"), json!(""));
    let card = browser.evaluate("stage.renderer.card");
    eprintln!("drawn by {card}");
    assert!(browser.evaluate("stage.renderer.gl instanceof WebGL2RenderingContext && stage.renderer.gl.getError() === 0") == json!(true));

    // Lockstep: time stands from here.
    pause(&mut browser);
    step(&mut browser, 3);
    let whole = canvas(&mut browser);
    let first = frame(&whole);
    let colors: std::collections::HashSet<_> = first.pixels.iter().collect();
    assert!(colors.len() > 500, "{} colours only", colors.len());
    let share = compare(&mut browser, &live, 1);
    assert!(share >= SHARE, "{share}");
    compare_places(&mut browser, &scene);

    cut_and_undo(&mut browser, &live, &first);
    press_and_pull(&mut browser);
    save_and_repeat(&mut browser, &live);
}

/// A stroke by real pointer events across the middle of what is seen, which `first` shows whole.
fn cut_and_undo(browser: &mut Chromium, live: &Live, first: &Frame) {
    let before = browser.evaluate(BITS);
    let [x, y] = middle(browser);
    let at = |dx: f64, dy: f64| [x + dx, y + dy];
    browser.drag(&[at(-60.0, -60.0), at(-40.0, 0.0), at(-30.0, 50.0)]);
    step(browser, 60);
    browser.shot("cutting");
    browser.mouse("mouseReleased", at(-30.0, 50.0));
    step(browser, 250);
    browser.wait("stage.panel.last.severed > 0");
    browser.wait("stage.renderer.bodies[0].surfels > stage.renderer.bodies[0].info.outer");
    browser.shot("cut");
    let cut = frame(&canvas(browser));
    let pairs = cut.pixels.iter().zip(&first.pixels);
    let changed = pairs
        .filter(|(a, b)| (i32::from(a[0]) - i32::from(b[0])).abs() > 40)
        .count();
    // A cut that lies closed is a line of a pixel; the stroke is 114 long, and where it begins is air or light.
    assert!(2 * changed > 114, "{changed} pixels show the cut");
    let share = compare(browser, live, 2);
    assert!(share >= SHARE, "{share}");

    // Undo: the very bits.
    anew(browser, "stage.link.ask({ do: 'undo' })");
    browser.wait("stage.panel.last.severed === 0");
    assert_eq!(browser.evaluate(BITS), before);
}

/// A probe presses, and a hand pulls what was severed: they feel forces.
fn press_and_pull(browser: &mut Chromium) {
    let [x, y] = middle(browser);
    let at = |dx: f64, dy: f64| [x + dx, y + dy];
    browser.key("3");
    browser.drag(&[at(0.0, 0.0), at(4.0, 0.0)]);
    step(browser, 200);
    browser.shot("pressing");
    let force = browser.number("Math.hypot(...stage.state.tools[0].force)");
    assert!(force > 0.05, "{force} N");
    assert!(browser.number("stage.panel.plot.peak") > 0.05);
    browser.mouse("mouseReleased", at(4.0, 0.0));

    // What was can be looked at again, and a hand comes back to what is.
    let now = browser.evaluate(BITS);
    browser.evaluate(
        "(() => { const s = document.getElementById('past'); s.value = 500; s.dispatchEvent(new Event('input')) })()",
    );
    browser.wait("stage.state.step < stage.newest.step - 50 && !stage.dirty");
    browser.stroke(&[at(0.0, 0.0)]);
    assert_eq!(browser.evaluate(BITS), now);

    // Severed and pulled.
    browser.key("2");
    browser.stroke(&[[x, 80.0], [x + 10.0, 390.0]]);
    step(browser, 600);
    browser.wait("stage.panel.last.strokes === 1");
    browser.key("4");
    browser.drag(&[at(60.0, 0.0), at(80.0, -20.0)]);
    step(browser, 100);
    browser.shot("pulling");
    let force = browser.number("Math.hypot(...stage.state.grip)");
    assert!(force > 0.02, "{force} N");
    browser.mouse("mouseReleased", at(80.0, -20.0));
    step(browser, 20);
}

/// Everything is saved in the folder and nowhere else, under a name that leads nowhere else.
fn save_and_repeat(browser: &mut Chromium, live: &Live) {
    browser.evaluate(
        "['../x', 'a first minute'].forEach((name) => stage.link.ask({ do: 'save', name }))",
    );
    let saved = live.out.path().join("a first minute");
    read_once_there(&saved.join("score.csv"));
    browser.wait("document.querySelector('#notes .bad')?.textContent.includes('a name has')");
    assert_eq!(browser.evaluate("stage.renderer.gl.getError()"), json!(0));

    // The card is lost and comes back: the page does so too, and shows the same.
    let now = browser.evaluate(BITS);
    browser.evaluate(
        "(() => { window.old = true; const lost = stage.renderer.gl.getExtension('WEBGL_lose_context'); lost.loseContext(); \
         addEventListener('webglcontextlost', () => setTimeout(() => lost.restoreContext(), 50), true) })()",
    );
    browser.wait("!window.old && window.stage && stage.state && stage.panel.last");
    assert_eq!(browser.evaluate(BITS), now);

    // A run of what was saved ends with the very energies that the page has.
    let (steps, [kinetic, elastic, _], _) = run_of_files(&saved);
    assert_eq!(browser.evaluate("stage.state.step"), json!(steps));
    let same = format!(
        "stage.state.kinetic === Math.fround({kinetic:?}) && stage.state.elastic === Math.fround({elastic:?})"
    );
    assert_eq!(browser.evaluate(&same), json!(true));
    play_again(browser, steps);
}

/// A recording is opened from the list of scenes, hands wait, the bar leads to its end and back, and the end has the very bits.
fn play_again(browser: &mut Chromium, steps: u64) {
    let end = browser.evaluate(BITS);
    anew(
        browser,
        "(() => { const s = document.getElementById('scenes'); s.value = 'a first minute'; s.dispatchEvent(new Event('change')); \
         document.getElementById('ask-yes').click() })()",
    );
    let bar = |at: u32| {
        format!(
            "(() => {{ const s = document.getElementById('past'); s.value = {at}; s.dispatchEvent(new Event('input')) }})()"
        )
    };
    browser.evaluate(&bar(500));
    browser.wait(&format!("stage.state.step > {}", steps / 4));
    browser.shot("replaying");
    let [x, y] = middle(browser);
    browser.key("3");
    browser.stroke(&[[x, y], [x + 4.0, y]]);
    browser.wait("document.getElementById('notes').textContent.includes('a recording is played')");
    browser.wait("!stage.past.shown && stage.past.now > 0.45");
    browser.evaluate(&bar(100));
    browser.wait("stage.past.shown && stage.state.time < 0.2 * stage.scene.length");
    // Steps up to the bar's middle are an estimate; those that are left are counted.
    browser.wait("document.getElementById('past-value').textContent.startsWith('-')");
    browser.evaluate("stage.lookBack(stage.past.now)");
    wait_until_still(browser);
    let at = browser.evaluate("stage.newest.step").as_u64().unwrap();
    step(browser, steps - at);
    assert_eq!(browser.evaluate(BITS), end);
    assert_eq!(browser.evaluate("stage.panel.last.replaying"), json!(false));
}

/// A cube of 4 cm as an OFF file.
const CUBE: &str = "OFF\n8 6 0\n0 0 0\n0.04 0 0\n0.04 0.04 0\n0 0.04 0\n0 0 0.04\n0.04 0 0.04\n\
    0.04 0.04 0.04\n0 0.04 0.04\n4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";

#[test]
fn a_line_across_the_picture_slices_through() {
    let Some((_live, mut browser)) = unloaded_and_paused([720, 480]) else {
        return;
    };
    let [x, _] = middle(&mut browser);
    browser.key("2");
    browser.stroke(&[[x, 80.0], [x + 10.0, 470.0]]);
    step(&mut browser, 250);
    browser.wait("stage.panel.last.severed > 0");
    browser.shot("sliced");

    // A gamepad is a second hand: its stick drives the probe in, its button grips.
    browser.evaluate(
        "window.pad = { connected: true, axes: [0, 0, 0, -0.4], buttons: [{ pressed: false }, { pressed: false }] }; \
         navigator.getGamepads = () => [window.pad]; stage.home(); \
         window.front = stage.surface(stage.canvas.clientWidth / 2, stage.canvas.clientHeight / 2).point; \
         setInterval(() => { if (stage.pad.place && Math.hypot(...stage.pad.place.map((x, k) => x - front[k])) < 0.4 * stage.probeRadius) pad.axes[3] = 0 }, 5)",
    );
    browser.wait("pad.axes[3] === 0");
    step_until(&mut browser, "stage.state.tools[0].penetration > 0");
    browser.evaluate("pad.buttons[0].pressed = true");
    browser.wait("stage.pad.holds");
    browser.evaluate("pad.axes[1] = -1");
    step_until(&mut browser, "Math.hypot(...stage.state.grip) > 0");
    browser.evaluate("pad.axes[1] = 0; pad.buttons[0].pressed = false");
    browser.wait("!stage.pad.holds");
    step_until(&mut browser, "Math.hypot(...stage.state.grip) === 0");
    // A token of another session: the server was started again.
    browser
        .evaluate("sessionStorage.setItem('phyxel-token', 'another'); stage.link.socket.close()");
    browser.wait("document.getElementById('curtain-text').textContent.includes('started again')");
}

/// Counts what a page asks for while it does something, which it does not ask for then.
fn asked(browser: &mut Chromium, action: &str) -> serde_json::Value {
    browser.evaluate(&format!(
        "(() => {{ const asked = []; const ask = stage.link.ask; stage.link.ask = (x) => asked.push(x.do); \
         {action}; stage.link.ask = ask; return asked }})()"
    ))
}

#[test]
fn the_link_heals_and_nothing_is_lost_unasked() {
    let Some((live, mut browser)) = unloaded_and_paused([480, 320]) else {
        return;
    };
    let key = |key: &str, repeat: bool| {
        format!("dispatchEvent(new KeyboardEvent('keydown', {{ key: '{key}', repeat: {repeat} }}))")
    };
    // A key that is held is one key.
    let held = format!("{};{}", key("r", false), key("r", true));
    assert_eq!(asked(&mut browser, &held), json!(["reset"]));

    // A stroke that begins in the air cuts where it comes to the organ.
    let [x, y] = middle(&mut browser);
    assert_eq!(browser.evaluate("stage.surface(10, 300)"), json!(null));
    browser.stroke(&[[10.0, y], [x, y + 20.0]]);
    step(&mut browser, 400);
    browser.wait("stage.panel.last.severed > 0 && stage.panel.last.strokes === 1");
    // Two positions of a cross that keys move are a stroke as well.
    browser.evaluate("stage.hands.place(null); stage.canvas.focus()");
    let press = |browser: &mut Chromium, key: &str| {
        browser.evaluate(&format!(
            "stage.canvas.dispatchEvent(new KeyboardEvent('keydown', {{ key: '{key}', bubbles: true }}))"
        ));
    };
    for name in "ArrowUp Enter ArrowDown ArrowDown ArrowDown Enter".split(' ') {
        press(&mut browser, name);
    }
    step(&mut browser, 300);
    browser.wait("stage.panel.last.strokes === 2");

    // What takes strokes away is asked about: another mesh, the start.
    browser.evaluate(&drop_of(CUBE, "cube.off"));
    browser.wait("document.getElementById('ask').open");
    browser.evaluate("document.querySelector('#ask [value=\"\"]').click()");
    assert_eq!(asked(&mut browser, &key("r", false)), json!([]));
    browser.wait("document.getElementById('ask').open");
    browser.shot("asked");
    browser.evaluate("document.querySelector('#ask [value=\"\"]').click()");
    browser.wait("!document.getElementById('ask').open");
    assert_eq!(browser.evaluate("stage.panel.last.strokes"), json!(2));
    let yes = "; document.getElementById('ask-yes').click()";
    anew(&mut browser, &(key("r", false) + yes));
    browser.wait("stage.panel.last.strokes === 0");

    // A connection that breaks is opened again, with what the session was and by the token that openings which fail leave.
    let before = browser.evaluate(BITS);
    browser.evaluate(
        "window.lost = stage.scene; window.tries = 0; const fetched = window.fetch; \
         window.fetch = (...what) => (window.tries++ < 2 ? Promise.reject(new TypeError()) : fetched(...what)); \
         stage.link.socket.close()",
    );
    browser.wait("stage.scene !== window.lost && stage.state");
    assert_eq!(browser.evaluate("window.tries"), json!(3));
    // One answer is one reset, whatever was asked and declined before it.
    assert_eq!(browser.evaluate("stage.scene.epoch"), json!(2));
    assert_eq!(browser.evaluate(BITS), before);
    look_away(&mut browser);
    // An end is said to be one.
    drop(live);
    browser.wait("document.getElementById('curtain-text').textContent.includes('has ended')");
}

#[test]
fn fingers_and_pens_cut_sliders_and_dropped_meshes_do_what_they_say() {
    let Some((live, mut browser)) = unloaded_and_paused([480, 320]) else {
        return;
    };
    let [x, y] = middle(&mut browser);
    let severed = |browser: &mut Chromium| browser.evaluate("stage.panel.last.severed").as_u64();

    // A finger cuts as a mouse does; two fingers turn and zoom the view and cut nothing.
    browser.touch("touchStart", &[[x - 60.0, y - 50.0]]);
    for k in 1..=8 {
        let way = [5.0, 12.0].map(|rate| rate * f64::from(k));
        browser.touch("touchMove", &[[x - 60.0 + way[0], y - 50.0 + way[1]]]);
    }
    browser.touch("touchEnd", &[]);
    step(&mut browser, 250);
    browser.wait("stage.panel.last.severed > 0");
    browser.shot("finger");
    anew(&mut browser, "stage.link.ask({ do: 'reset' })");
    browser.wait("stage.panel.last.severed === 0");
    let zoom = "stage.camera.distance";
    let before = browser.number(zoom);
    browser.touch("touchStart", &[[x - 20.0, y]]);
    browser.touch("touchStart", &[[x - 20.0, y], [x + 20.0, y]]);
    for k in 1..=6 {
        let way = 10.0 * f64::from(k);
        browser.touch("touchMove", &[[x - 20.0 - way, y], [x + 20.0 + way, y]]);
    }
    browser.touch("touchEnd", &[]);
    step(&mut browser, 60);
    let after = browser.number(zoom);
    assert!(after < 0.7 * before, "from {before} to {after}");
    assert_eq!(severed(&mut browser), Some(0));
    browser.evaluate("stage.home()");

    press_pens(&mut browser);

    // A stiffer tissue is another model seen from the same position.
    let camera = browser.evaluate("JSON.stringify(stage.camera)");
    anew(
        &mut browser,
        "(() => { const s = document.getElementById('stiffness'); s.value = 90; \
         s.dispatchEvent(new Event('input')); s.dispatchEvent(new Event('change')) })()",
    );
    assert_eq!(browser.evaluate("JSON.stringify(stage.camera)"), camera);
    browser.wait("stage.panel.last.severed === 0");
    let shown = browser.evaluate("document.getElementById('stiffness-value').textContent");
    assert_eq!(shown, json!("59 kPa"));
    step(&mut browser, 3);
    drop_meshes(&mut browser, &live);
}

/// A mesh file dropped on the page.
fn drop_meshes(browser: &mut Chromium, live: &Live) {
    anew(browser, &drop_of(CUBE, "cube.off"));
    let high = browser.number("stage.scene.high[2]");
    assert!((high - 0.04).abs() < 1e-6, "{high}");
    let kept = std::fs::read(live.out.path().join("mesh-001.off")).unwrap();
    assert_eq!(kept, CUBE.as_bytes());
    step(browser, 3);
    browser.shot("dropped");
    // Its numbers are in metres, or in centimetres: a click.
    let unit = |metres| format!("document.querySelector('[data-unit=\"{metres}\"]').click()");
    let pressed = "document.querySelector('#units [aria-pressed=true]').dataset.unit";
    assert_eq!(browser.evaluate(pressed), json!("1"));
    anew(browser, &unit("0.01"));
    let high = browser.number("stage.scene.high[2]");
    assert!((high - 4e-4).abs() < 1e-8, "{high}");
    assert_eq!(browser.evaluate(pressed), json!("0.01"));
    anew(browser, &unit("1"));
    // What is no mesh is said to be none, and the cube stays.
    browser.evaluate(&drop_of(&CUBE.replace("OFF", "of"), "cube.obj"));
    browser.wait("document.getElementById('notes').textContent.includes('mesh-001.obj')");
    step(browser, 3);
    assert_eq!(browser.evaluate("stage.renderer.gl.getError()"), json!(0));
}

/// The harder a pen is pressed the deeper the blade.
fn press_pens(browser: &mut Chromium) {
    let depth = "(() => { const e = stage.hands.active.edge; return Math.hypot(...e[0].map((v, k) => v - e.at(-1)[k])) })()";
    let [x, y] = middle(browser);
    let mut depths = Vec::new();
    for force in [0.1, 0.9] {
        browser.pen("mousePressed", [x, y], force);
        browser.pen("mouseMoved", [x + 3.0, y + 1.0], force);
        browser.pen("mouseMoved", [x + 6.0, y + 2.0], force);
        depths.push(browser.number(depth));
        browser.pen("mouseReleased", [x + 6.0, y + 2.0], 0.0);
        anew(browser, "stage.link.ask({ do: 'reset' })");
    }
    assert!(depths[1] > 1.5 * depths[0], "{depths:?} m");
}

/// Time stands while nobody looks on.
fn look_away(browser: &mut Chromium) {
    let hide = |hidden: bool| {
        format!(
            "Object.defineProperty(document, 'hidden', {{ value: {hidden}, configurable: true }}); \
             document.dispatchEvent(new Event('visibilitychange'))"
        )
    };
    browser.evaluate("stage.link.ask({ do: 'play' })");
    browser.wait("stage.panel.last.playing");
    browser.evaluate(&hide(true));
    std::thread::sleep(std::time::Duration::from_millis(200));
    let hidden = browser.evaluate("stage.state.step");
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert_eq!(browser.evaluate("stage.state.step"), hidden);
    browser.evaluate(&hide(false));
    browser.wait(&format!("stage.state.step > {hidden}"));
}
