//! Reading a surface file for a command, with the very checks that the service makes.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use axum::body::Bytes;
use clap::Args;
use planish::api::Reading;
use planish::engine::trimming::Side;
use planish::formats::composition::Composition;
use planish::formats::surface::Weld;
use planish::formats::units::Units;

/// The surface file and how it is read.
#[derive(Debug, Args)]
pub(crate) struct SurfaceArguments {
    /// The surface: trimmed-surface JSON, or a mesh as .glb or as .gltf with embedded buffers; several trimmed surfaces are
    /// sewn to one part
    #[arg(required = true)]
    pub(crate) surface: Vec<PathBuf>,
    /// Unit of the file's lengths, before what the file says: mm, cm, m, in or ft
    #[arg(long, value_parser = word::<Units>)]
    pub(crate) units: Option<Units>,
    /// The show side, before what the file says: normal or reversed
    #[arg(long, value_parser = word::<Side>)]
    pub(crate) side: Option<Side>,
    /// For meshes, whether vertices at the same place become one: position (the default) or none
    #[arg(long, value_parser = word::<Weld>)]
    pub(crate) weld: Option<Weld>,
}

impl SurfaceArguments {
    /// How a file is read.
    const fn of_file(&self) -> Reading {
        Reading { units: self.units, side: self.side, weld: self.weld }
    }

    /// How what [`SurfaceArguments::bytes`] gives is read: a part of several files has been by then.
    pub(crate) fn reading(&self) -> Reading {
        if self.surface.len() > 1 { Reading::default() } else { self.of_file() }
    }

    /// The file's bytes, or those of the part that several files make.
    pub(crate) fn bytes(&self) -> anyhow::Result<Bytes> {
        if let [only] = &self.surface[..] {
            return file(only);
        }
        let mut whole = Composition::default();
        for path in &self.surface {
            let added = whole.add(&file(path)?, self.of_file(), "");
            added.map_err(|faults| {
                let lines: Vec<String> =
                    faults.iter().map(|fault| format!("  {} {}", fault.pointer, fault.detail)).collect();
                anyhow::anyhow!("{} has faults:\n{}", path.display(), lines.join("\n"))
            })?;
        }
        Ok(whole.text().into())
    }

    /// The files' names, for problems.
    pub(crate) fn name(&self) -> String {
        let names: Vec<String> = self.surface.iter().map(|path| path.display().to_string()).collect();
        names.join(", ")
    }
}

/// A file's bytes.
pub(crate) fn file(path: &Path) -> anyhow::Result<Bytes> {
    std::fs::read(path).map(Bytes::from).with_context(|| format!("{} cannot be read", path.display()))
}

/// A word of a vocabulary that serde knows.
fn word<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, String> {
    serde_json::from_value(serde_json::Value::from(text)).map_err(|error| error.to_string())
}
