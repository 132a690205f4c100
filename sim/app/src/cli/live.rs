//! `phyxel live`.

use std::io::{self, BufRead, Write};
use std::path::PathBuf;
use std::process::{Command, Stdio};

use clap::Args;
use phyxel_live::{Server, ServerError};
use phyxel_scene::Override;

use super::source::Source;
use super::{CliError, Overrides, say};
use crate::live::{LiveOptions, Sources, serve};
use crate::output::Interrupt;
use crate::run::pool;

#[derive(Debug, Args)]
pub(super) struct LiveArguments {
    /// Embedded scene, scene file (.ron) or mesh file.
    #[arg(value_name = "SCENE|MESH")]
    scene: Option<std::ffi::OsString>,
    /// Port on the loopback address; 0 takes a free one.
    #[arg(long, value_name = "N", default_value_t = 8765)]
    port: u16,
    /// Open the page in the browser.
    #[arg(long)]
    open: bool,
    /// Folder for what is saved [default: out/NAME-live with the scene's name]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    overrides: Overrides,
    /// Number of threads [default: all of the machine's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

/// Serves a session until Ctrl-C.
pub(super) fn live(arguments: &LiveArguments) -> Result<(), CliError> {
    let overrides = arguments.overrides.parse()?;
    let source = Source::of(arguments.scene.as_deref())?;
    let (scene, note) = source.scene(&overrides)?;
    if let Some(note) = note {
        say(&note)?;
    }
    let program = concat!("phyxel ", env!("CARGO_PKG_VERSION"));
    let server = Server::start(arguments.port, program)?;
    let url = server.url()?;
    writeln!(io::stdout(), "{url}")?;
    io::stdout().flush()?;
    say("the address is good once; Enter prints another, Ctrl-C ends")?;
    if arguments.open {
        open(&url);
    }
    answer(server.urls());
    let folder = || PathBuf::from("out").join(format!("{}-live", scene.name));
    let options = LiveOptions {
        out: arguments.out.clone().unwrap_or_else(folder),
        interrupt: Some(Interrupt::listen()),
    };
    let meshes = Box::new(move |file: &std::path::Path, scale: Option<f64>| {
        let scale = scale.map(|scale| format!("bodies[0].shape.scale={scale:e}"));
        let scale = scale.map(|text| Override::parse(&text)).transpose();
        let scale = scale.map_err(|error| error.to_string())?;
        let changes: Vec<Override> = overrides.iter().cloned().chain(scale).collect();
        let scene = Source::Mesh(file.to_owned()).scene(&changes);
        let (scene, note) = scene.map_err(|error| error.to_string())?;
        Ok((scene, note.unwrap_or_default()))
    });
    let mesh = match source {
        Source::Mesh(file) => Some(file),
        _ => None,
    };
    let sources = Sources::new(&scene, mesh, meshes);
    let pool = pool(arguments.threads.map(usize::from))?;
    let served = pool.install(|| serve(server, &scene, sources, &options));
    Ok(served.map_err(Box::new)?)
}

/// Prints another address whenever someone presses Enter.
fn answer(urls: impl Fn() -> Result<String, ServerError> + Send + 'static) {
    // Without the thread there is only the first address.
    let _ = std::thread::Builder::new()
        .name("live-enter".into())
        .spawn(move || {
            for _ in io::stdin().lock().lines().map_while(Result::ok) {
                let Ok(url) = urls() else { return };
                if writeln!(io::stdout(), "{url}").is_err() {
                    return;
                }
            }
        });
}

/// Opens an address in the browser; who has none reads it above.
fn open(url: &str) {
    let program = if cfg!(target_os = "macos") {
        "open"
    } else if cfg!(target_os = "windows") {
        "explorer"
    } else {
        "xdg-open"
    };
    let _ = Command::new(program)
        .arg(url)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
}
