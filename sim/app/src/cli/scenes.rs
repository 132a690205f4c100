//! `phyxel scenes`.

use std::io::{self, Write};

use clap::Args;

use super::CliError;
use phyxel_scene::{EMBEDDED, key_reference, schema};

#[derive(Debug, Args)]
pub(super) struct ScenesArguments {
    /// The scene to print; lists them all where not given.
    name: Option<String>,
    /// Print the reference of all keys of a scene file as Markdown.
    #[arg(long, conflicts_with = "name")]
    keys: bool,
    /// Print the JSON Schema of a scene file, for editors.
    #[arg(long, conflicts_with_all = ["name", "keys"])]
    schema: bool,
}

/// Lists the embedded scenes or prints one.
pub(super) fn scenes(arguments: &ScenesArguments) -> Result<(), CliError> {
    let mut out = io::stdout().lock();
    if arguments.keys {
        out.write_all(key_reference().as_bytes())?;
        return Ok(());
    }
    if arguments.schema {
        writeln!(out, "{:#}", schema())?;
        return Ok(());
    }
    let Some(name) = &arguments.name else {
        let longest = EMBEDDED.iter().map(|scene| scene.name.len()).max();
        let width = longest.unwrap_or(0) + 2;
        for scene in EMBEDDED {
            writeln!(out, "{:width$}{}", scene.name, scene.summary)?;
        }
        return Ok(());
    };
    // Says what is wrong with the name, in the words of `run`.
    phyxel_scene::embedded(name, &[])?;
    for scene in EMBEDDED.iter().filter(|scene| scene.name == name) {
        out.write_all(scene.text.as_bytes())?;
    }
    Ok(())
}
