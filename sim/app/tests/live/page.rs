//! A session with its server, and a browser that looks at it.

use std::path::Path;
use std::thread::JoinHandle;

use phyxel::scene::Scene;
use phyxel_cli::live::{LiveOptions, Sources, serve};
use phyxel_cli::output::Interrupt;
use phyxel_live::Server;
use serde_json::json;
use tempfile::TempDir;

use crate::chromium::{Chromium, find};
use crate::session::liver;

/// A session on a thread of its own.
pub(crate) struct Live {
    pub(crate) url: String,
    pub(crate) out: TempDir,
    interrupt: Interrupt,
    thread: Option<JoinHandle<()>>,
}

impl Live {
    pub(crate) fn start(scene: &Scene) -> Self {
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
pub(crate) fn scene_of_mesh(file: &Path, scale: Option<f64>) -> Result<(Scene, String), String> {
    let scale = scale.unwrap_or(1.0);
    let text = format!(
        "(version: 1, name: \"dropped\", bodies: [(shape: Mesh(file: {file:?}, scale: {scale:?}), \
         sampling: (target: Nodes(200)), surfels: (target: Count(1000)), \
         material: (youngs_modulus: 2e4, poissons_ratio: 0.4))], \
         integration: (duration: 1, settle: None))"
    );
    let scene = phyxel_scene::from_text(&text, "dropped", "", &[]);
    let scene = scene.map_err(|error| error.to_string())?;
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

/// Takes so many steps and waits until the last is drawn.
pub(crate) fn step(browser: &mut Chromium, steps: u64) {
    let end = browser.evaluate("stage.state.step").as_u64().unwrap() + steps;
    browser.evaluate(&format!("stage.link.ask({{ do: 'step', steps: {steps} }})"));
    browser.wait(&format!("stage.state?.step >= {end} && !stage.dirty"));
}

/// Takes steps until an expression is true.
pub(crate) fn step_until(browser: &mut Chromium, expression: &str) {
    for _ in 0..10 {
        step(browser, 40);
        if browser.evaluate(expression) == json!(true) {
            return;
        }
    }
    panic!("not after many steps: {expression}");
}

/// A file that is written within a minute.
pub(crate) fn read_once_there(file: &Path) -> Vec<u8> {
    let begun = std::time::Instant::now();
    while !file.exists() {
        assert!(begun.elapsed().as_secs() < 60, "no {}", file.display());
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    std::fs::read(file).unwrap()
}

/// Drops a file on the page.
pub(crate) fn drop_of(content: &str, name: &str) -> String {
    format!(
        "(() => {{ const d = new DataTransfer(); d.items.add(new File([{content:?}], '{name}')); \
         dispatchEvent(new DragEvent('drop', {{ dataTransfer: d, cancelable: true }})) }})()"
    )
}

/// Where the middle of the bodies is on the page.
pub(crate) fn middle(browser: &mut Chromium) -> [f64; 2] {
    let place = browser.evaluate(
        "(() => { const s = stage, m = [0, 1, 2].map((k) => 0.5 * (s.scene.low[k] + s.scene.high[k])); \
         const p = s.camera.project(m), h = s.canvas.clientHeight; \
         return [0.5 * s.canvas.clientWidth + h * p[0], 0.5 * h + h * p[1]] })()",
    );
    [0, 1].map(|k| place[k].as_f64().unwrap())
}

/// Does something and waits until the page shows the world that comes of it.
pub(crate) fn anew(browser: &mut Chromium, action: &str) {
    let epoch = browser.evaluate("stage.scene.epoch").as_u64().unwrap();
    browser.evaluate(action);
    browser.wait(&format!(
        "stage.scene.epoch > {epoch} && stage.state && stage.panel.last"
    ));
    browser.evaluate("stage.link.ask({ do: 'pause' })");
    wait_until_still(browser);
}

/// Waits until time stands and the last state is drawn: figures overtake states.
pub(crate) fn wait_until_still(browser: &mut Chromium) {
    browser.wait(
        "!stage.panel.last.playing && stage.panel.last.step === stage.newest.step && !stage.dirty",
    );
}

/// A scene on a page, where there is a browser.
pub(crate) fn opened(scene: &Scene, size: [u32; 2]) -> Option<(Live, Chromium)> {
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
pub(crate) fn pause(browser: &mut Chromium) {
    browser.evaluate(
        "stage.quality.pinned = 1; stage.renderer.ground = false; stage.link.ask({ do: 'pause' })",
    );
    wait_until_still(browser);
}

/// A small liver without load on a page whose time stands.
pub(crate) fn unloaded_and_paused(size: [u32; 2]) -> Option<(Live, Chromium)> {
    let mut scene = liver(300, 2_000);
    scene.integration.settle = None;
    scene.gravity = None;
    let (live, mut browser) = opened(&scene, size)?;
    pause(&mut browser);
    step(&mut browser, 2);
    Some((live, browser))
}
