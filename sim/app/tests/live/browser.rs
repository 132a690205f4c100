//! The page in a real browser: what is seen is what the renderer of runs draws, real pointer events cut.

use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use phyxel::scene::Scene;
use phyxel_cli::live::{LiveOptions, Session, Sources, serve};
use phyxel_cli::output::Interrupt;
use phyxel_live::Server;
use phyxel_splat::Frame;
use serde_json::json;
use tempfile::TempDir;

use crate::chromium::{Chromium, base64, find};
use crate::session::liver;

/// Difference of a channel (of 255) up to which two pixels are alike, and the share that must be: sums
/// on the graphics card are of half precision.
const ALIKE: i32 = 6;
const SHARE: f64 = 0.99;

/// A session on a thread of its own.
struct Live {
    url: String,
    out: TempDir,
    interrupt: Interrupt,
    thread: Option<JoinHandle<()>>,
}

impl Live {
    fn start(scene: &Scene) -> Self {
        let server = Server::start(0, "phyxel under test").unwrap();
        let (url, out) = (server.url().unwrap(), tempfile::tempdir().unwrap());
        let interrupt = Interrupt::default();
        let options = LiveOptions {
            out: out.path().to_owned(),
            interrupt: Some(interrupt.clone()),
        };
        let scene = scene.clone();
        let thread = std::thread::spawn(move || {
            let meshes = Box::new(scene_of_mesh);
            let sources = Sources::new(&scene, None, meshes);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
            let served = || serve(server, &scene, sources, &options);
            pool.unwrap().install(served).unwrap();
        });
        Self {
            url,
            out,
            interrupt,
            thread: Some(thread),
        }
    }
}

/// A scene of a mesh file, with few nodes.
fn scene_of_mesh(file: &Path, scale: Option<f64>) -> Result<(Scene, String), String> {
    let scale = scale.unwrap_or(1.0);
    let text = format!(
        "(version: 1, name: \"dropped\", bodies: [(shape: Mesh(file: {file:?}, scale: {scale:?}), \
         sampling: (target: Nodes(200)), surfels: (target: Count(1000)), \
         material: (youngs_modulus: 2e4, poissons_ratio: 0.4))], \
         integration: (duration: 1, settle: None))"
    );
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("dropped.ron");
    std::fs::write(&scene, text).unwrap();
    let scene = phyxel_scene::load(&scene, &[]).map_err(|error| error.to_string())?;
    Ok((scene, "dropped".to_owned()))
}

impl Drop for Live {
    fn drop(&mut self) {
        self.interrupt.ask();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Writes a picture where `PHYXEL_SHOTS` says.
fn show(name: &str, png: &[u8]) {
    if let Some(folder) = std::env::var_os("PHYXEL_SHOTS") {
        std::fs::write(PathBuf::from(folder).join(format!("{name}.png")), png).unwrap();
    }
}

fn frame(png: &[u8]) -> Frame {
    Frame::read_png(Cursor::new(png)).unwrap()
}

/// Bits of the nodes' positions that the page has, as text.
const BITS: &str = "(() => { const p = stage.state.bodies[0].positions; \
    return [stage.state.step, ...new Uint32Array(p.slice().buffer)].join() })()";

/// Takes so many steps and waits until the last is drawn.
fn step(browser: &mut Chromium, steps: u64) {
    let now = browser.evaluate("stage.state.step").as_u64().unwrap();
    browser.evaluate(&format!("stage.link.ask({{ do: 'step', steps: {steps} }})"));
    browser.wait(&format!(
        "stage.state && stage.state.step >= {} && !stage.dirty",
        now + steps
    ));
}

/// The canvas alone, without a user on it.
fn canvas(browser: &mut Chromium) -> Vec<u8> {
    let text = browser.evaluate(
        "(() => { stage.fit(1); stage.renderer.draw(stage.camera, []); return stage.canvas.toDataURL('image/png') })()",
    );
    base64(text.as_str().unwrap().split_once(',').unwrap().1)
}

/// A file that is written within a minute.
fn read_once_there(file: &Path) -> Vec<u8> {
    let begun = std::time::Instant::now();
    while !file.exists() {
        assert!(begun.elapsed().as_secs() < 60, "no {}", file.display());
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    std::fs::read(file).unwrap()
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
    let text = browser.evaluate(&format!(
        "(() => {{ const b = new Uint8Array(stage.renderer.bodies[0].carried({target}).slice().buffer); let s = ''; \
         for (let k = 0; k < b.length; k += 8192) s += String.fromCharCode(...b.subarray(k, k + 8192)); \
         return btoa(s) }})()"
    ));
    let bytes = base64(text.as_str().unwrap());
    let numbers = bytes.chunks_exact(4);
    numbers
        .map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])))
        .collect()
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
    let bounds = session.world().members()[0].body.solid.bounds();
    let size = bounds.size().length();
    let (painter, world) = session.drawing();
    painter.carry(world);
    let (places, normals, _) = painter.surfels(0);
    assert_eq!(centers.len(), 4 * places.len());
    let point = |numbers: &[f64], k: usize| glam::DVec3::from_slice(&numbers[4 * k..]);
    let (mut worst, mut turned) = (0.0, 1.0);
    for (k, (place, normal)) in places.iter().zip(normals).enumerate() {
        worst = f64::max(worst, point(&centers, k).distance(*place));
        turned = f64::min(turned, point(&facing, k).dot(*normal));
    }
    let picked = [0, 1, 2].map(|k| picked[k].as_f64().unwrap());
    worst = f64::max(worst, glam::DVec3::from_array(picked).distance(places[77]));
    eprintln!(
        "carried places: largest difference {:.1e} of the body",
        worst / size
    );
    assert!(worst < 1e-5 * size, "{worst} m");
    assert!(turned > 0.9999, "cosine {turned}");
}

#[test]
fn someone_cuts_undoes_and_presses_in_a_browser() {
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
    let spent = browser.evaluate(
        "(() => { const { gl } = stage.renderer, pixel = new Uint8Array(4); const times = [0, 1, 2, 3, 4].map(() => { \
         const begun = performance.now(); stage.renderer.bodies[0].stale = true; stage.renderer.draw(stage.camera, []); \
         gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); return performance.now() - begun }); \
         return Math.min(...times) })()",
    );
    eprintln!("a picture of 720 x 480 pixels takes {spent} ms");

    // A stroke by real pointer events across the middle of what is seen.
    let before = browser.evaluate(BITS);
    let [x, y] = middle(&mut browser);
    let at = |dx: f64, dy: f64| [x + dx, y + dy];
    browser.drag(&[at(-60.0, -60.0), at(-40.0, 0.0), at(-30.0, 50.0)]);
    step(&mut browser, 60);
    show("cutting", &browser.screenshot());
    browser.mouse("mouseReleased", at(-30.0, 50.0));
    step(&mut browser, 250);
    browser.wait("stage.panel.last.severed > 0");
    browser.wait("stage.renderer.bodies[0].surfels > stage.renderer.bodies[0].info.outer");
    show("cut", &browser.screenshot());
    let cut = frame(&canvas(&mut browser));
    let pairs = cut.pixels.iter().zip(&first.pixels);
    let changed = pairs
        .filter(|(a, b)| (i32::from(a[0]) - i32::from(b[0])).abs() > 40)
        .count();
    // A cut that lies closed is a line of a pixel; the stroke is 114 long, and where it begins is air or light.
    assert!(2 * changed > 114, "{changed} pixels show the cut");
    let share = compare(&mut browser, &live, 2);
    assert!(share >= SHARE, "{share}");

    // Undo: the very bits.
    let epoch = browser.evaluate("stage.scene.epoch").as_u64().unwrap();
    browser.evaluate("stage.link.ask({ do: 'undo' })");
    browser.wait(&format!(
        "stage.scene.epoch > {epoch} && stage.state && stage.panel.last.severed === 0"
    ));
    assert_eq!(browser.evaluate(BITS), before);
    browser.wait("!stage.dirty");

    // A probe presses: it feels a force.
    browser.key("3");
    browser.drag(&[at(0.0, 0.0), at(4.0, 0.0)]);
    step(&mut browser, 200);
    show("pressing", &browser.screenshot());
    let force = browser
        .evaluate("Math.hypot(...stage.state.tools[0].force)")
        .as_f64()
        .unwrap();
    assert!(force > 0.05, "{force} N");
    assert!(browser.evaluate("stage.panel.plot.peak").as_f64().unwrap() > 0.05);
    browser.mouse("mouseReleased", at(4.0, 0.0));

    // Everything is saved in the folder and nowhere else.
    browser.evaluate("stage.link.ask({ do: 'save' })");
    read_once_there(&live.out.path().join("save/score.csv"));
    assert_eq!(browser.evaluate("stage.renderer.gl.getError()"), json!(0));
}

/// A cube of 4 cm as an OFF file.
const CUBE: &str = "OFF\n8 6 0\n0 0 0\n0.04 0 0\n0.04 0.04 0\n0 0.04 0\n0 0 0.04\n0.04 0 0.04\n\
    0.04 0.04 0.04\n0 0.04 0.04\n4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";

/// Where the middle of the bodies is on the page.
fn middle(browser: &mut Chromium) -> [f64; 2] {
    let place = browser.evaluate(
        "(() => { const s = stage, m = [0, 1, 2].map((k) => 0.5 * (s.scene.low[k] + s.scene.high[k])); \
         const p = s.camera.project(m), h = s.canvas.clientHeight; \
         return [0.5 * s.canvas.clientWidth + h * p[0], 0.5 * h + h * p[1]] })()",
    );
    [0, 1].map(|k| place[k].as_f64().unwrap())
}

/// Does something and waits until the page shows the world that comes of it.
fn anew(browser: &mut Chromium, action: &str) {
    let epoch = browser.evaluate("stage.scene.epoch").as_u64().unwrap();
    browser.evaluate(action);
    browser.wait(&format!(
        "stage.scene.epoch > {epoch} && stage.state && stage.panel.last"
    ));
    browser.evaluate("stage.link.ask({ do: 'pause' })");
    browser.wait("!stage.panel.last.playing && !stage.dirty");
}

/// A scene on a page, where there is a browser.
fn opened(scene: &Scene, size: [u32; 2]) -> Option<(Live, Chromium)> {
    let Some(program) = find() else {
        eprintln!("no Chromium here: the page was not tested (PHYXEL_CHROMIUM names one)");
        return None;
    };
    let live = Live::start(scene);
    let mut browser = Chromium::start(&program, size);
    browser.go(&live.url);
    browser.wait("window.stage && stage.state && stage.panel.last");
    Some((live, browser))
}

/// Time stands, and pictures are as fine as those of runs.
fn pause(browser: &mut Chromium) {
    browser.evaluate(
        "stage.quality.pinned = 1; stage.renderer.ground = false; stage.link.ask({ do: 'pause' })",
    );
    browser.wait("!stage.panel.last.playing");
}

/// A small liver without load on a page whose time stands.
fn unloaded_and_paused(size: [u32; 2]) -> Option<(Live, Chromium)> {
    let mut scene = liver(300, 2_000);
    scene.integration.settle = None;
    scene.gravity = None;
    let (live, mut browser) = opened(&scene, size)?;
    pause(&mut browser);
    step(&mut browser, 2);
    Some((live, browser))
}

#[test]
fn a_line_across_the_picture_slices_through() {
    let Some((_live, mut browser)) = unloaded_and_paused([720, 480]) else {
        return;
    };
    let [x, _] = middle(&mut browser);
    browser.key("2");
    let line = [[x, 20.0], [x + 10.0, 470.0]];
    browser.drag(&line);
    browser.mouse("mouseReleased", line[1]);
    step(&mut browser, 250);
    browser.wait("stage.panel.last.severed > 0");
    show("sliced", &browser.screenshot());
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
    browser.drag(&[[10.0, y], [x, y + 20.0]]);
    browser.mouse("mouseReleased", [x, y + 20.0]);
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

    // What takes strokes away is asked about.
    assert_eq!(asked(&mut browser, &key("r", false)), json!([]));
    browser.wait("document.getElementById('ask').open");
    show("asked", &browser.screenshot());
    browser.evaluate("document.querySelector('#ask [value=\"\"]').click()");
    browser.wait("!document.getElementById('ask').open");
    assert_eq!(browser.evaluate("stage.panel.last.strokes"), json!(2));
    let yes = "; document.getElementById('ask-yes').click()";
    anew(&mut browser, &(key("r", false) + yes));
    browser.wait("stage.panel.last.strokes === 0");

    // A connection that breaks is opened again, with what the session was.
    let before = browser.evaluate(BITS);
    browser.evaluate("stage.state = null; stage.link.socket.close()");
    browser.wait("stage.link.socket?.readyState === 1 && stage.state");
    assert_eq!(browser.evaluate(BITS), before);
    // Time stands while nobody looks on.
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
    show("finger", &browser.screenshot());
    anew(&mut browser, "stage.link.ask({ do: 'reset' })");
    browser.wait("stage.panel.last.severed === 0");
    let zoom = "stage.camera.distance";
    let before = browser.evaluate(zoom).as_f64().unwrap();
    browser.touch("touchStart", &[[x - 20.0, y]]);
    browser.touch("touchStart", &[[x - 20.0, y], [x + 20.0, y]]);
    for k in 1..=6 {
        let way = 10.0 * f64::from(k);
        browser.touch("touchMove", &[[x - 20.0 - way, y], [x + 20.0 + way, y]]);
    }
    browser.touch("touchEnd", &[]);
    step(&mut browser, 60);
    let after = browser.evaluate(zoom).as_f64().unwrap();
    assert!(after < 0.7 * before, "from {before} to {after}");
    assert_eq!(severed(&mut browser), Some(0));
    browser.evaluate("stage.home()");

    // A pen: the harder it is pressed the deeper the blade.
    let depth = "(() => { const e = stage.hands.active.edge; return Math.hypot(...e[0].map((v, k) => v - e.at(-1)[k])) })()";
    let [x, y] = middle(&mut browser);
    let mut depths = Vec::new();
    for force in [0.1, 0.9] {
        browser.pen("mousePressed", [x, y], force);
        browser.pen("mouseMoved", [x + 3.0, y + 1.0], force);
        browser.pen("mouseMoved", [x + 6.0, y + 2.0], force);
        depths.push(browser.evaluate(depth).as_f64().unwrap());
        browser.pen("mouseReleased", [x + 6.0, y + 2.0], 0.0);
        anew(&mut browser, "stage.link.ask({ do: 'reset' })");
    }
    assert!(depths[1] > 1.5 * depths[0], "{depths:?} m");

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

    // A mesh file dropped on the page.
    let drop = format!(
        "(() => {{ const d = new DataTransfer(); d.items.add(new File([{CUBE:?}], 'cube.off')); \
         dispatchEvent(new DragEvent('drop', {{ dataTransfer: d, cancelable: true }})) }})()"
    );
    anew(&mut browser, &drop);
    let high = browser.evaluate("stage.scene.high");
    assert!((high[2].as_f64().unwrap() - 0.04).abs() < 1e-6, "{high}");
    let kept = std::fs::read(live.out.path().join("mesh-001.off")).unwrap();
    assert_eq!(kept, CUBE.as_bytes());
    step(&mut browser, 3);
    show("dropped", &browser.screenshot());
    // Its numbers are in metres, or in centimetres: a click.
    let unit = |metres| format!("document.querySelector('[data-unit=\"{metres}\"]').click()");
    let pressed = "document.querySelector('#units [aria-pressed=true]').dataset.unit";
    assert_eq!(browser.evaluate(pressed), json!("1"));
    anew(&mut browser, &unit("0.01"));
    let high = browser.evaluate("stage.scene.high");
    assert!((high[2].as_f64().unwrap() - 4e-4).abs() < 1e-8, "{high}");
    assert_eq!(browser.evaluate(pressed), json!("0.01"));
    anew(&mut browser, &unit("1"));
    // What is no mesh is said to be none, and the cube stays.
    browser.evaluate(&drop.replace("OFF", "of").replace("cube.off", "cube.obj"));
    browser.wait("document.getElementById('notes').textContent.includes('mesh-001.obj')");
    step(&mut browser, 3);
    assert_eq!(browser.evaluate("stage.renderer.gl.getError()"), json!(0));
}
