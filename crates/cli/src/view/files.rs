//! Files of the window.

use crate::render::interrupt::Interrupt;
use crate::simulate::{ClothOptions, LiveCloth, Task};
use crate::{json, output};
use anyhow::Result;
use serde_json::{Map, json};
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use yugen_archive::formats::image::{ReadOptions, WriteOptions, can_write, is_for_display, read, write};
use yugen_archive::formats::{self, load_scene};
use yugen_archive::{atomic_write, check_writable, read_bounded};
use yugen_optics::{ColourSpace, Image};
use yugen_view::live::Live;
use yugen_view::{Files, Loaded, Picture, Report};

/// Most bytes of a preset: a page of text.
const MOST: u64 = 1 << 16;

/// Scenes and pictures on disk.
pub struct OnDisk {
    /// How scenes are read.
    pub options: formats::Options,
    /// Of the scene in this file cloth is simulated, as these say.
    pub cloth: Option<(PathBuf, ClothOptions)>,
}

impl OnDisk {
    /// A scene, and its cloth.
    pub fn open(&self, path: &Path) -> Result<Loaded> {
        let mut scene = load_scene(path, &self.options)?;
        let cloth = self.cloth.as_ref().filter(|(file, _)| file == path);
        let live = cloth.map(|(file, options)| -> Result<Box<dyn Live>> {
            let task = Task { options: options.clone(), file: file.clone(), frames: None, quiet: false };
            Ok(Box::new(LiveCloth::new(task, &mut scene, &Interrupt::never())?))
        });
        let live = live.transpose()?;
        Ok(Loaded { scene, live })
    }
}

impl Files for OnDisk {
    fn load(&self, path: &Path) -> Result<Loaded, String> {
        self.open(path).map_err(|e| format!("{e:#}"))
    }

    fn changed(&self, path: &Path) -> Option<SystemTime> {
        std::fs::metadata(path).and_then(|m| m.modified()).ok()
    }

    fn output(&self, path: &Path, scene: &Path) -> Result<PathBuf, String> {
        let path = named(path, scene);
        check_writable(&path).map_err(|e| e.to_string())?;
        Ok(path)
    }

    fn save(&self, path: &Path, scene: &Path, picture: Picture) -> Result<PathBuf, String> {
        let path = named(path, scene);
        let say = |e: yugen_archive::Error| e.to_string();
        can_write(&path).map_err(say)?;
        let shown = is_for_display(&path);
        let options = WriteOptions {
            metadata: vec![
                ("yugen:version".into(), env!("CARGO_PKG_VERSION").into()),
                ("yugen:scene".into(), scene.display().to_string()),
                ("yugen:renderer".into(), "view".into()),
            ],
            exposure: if shown { picture.exposure } else { 0.0 },
            curve: picture.curve,
            ..WriteOptions::from(picture.space)
        };
        let image = match picture.image.select(&["R", "G", "B"]) {
            Some(rgb) if shown => rgb,
            _ => picture.image,
        };
        write(&path, &image, &options).map_err(say)?;
        Ok(path)
    }

    fn save_text(&self, path: &Path, scene: &Path, text: &str) -> Result<PathBuf, String> {
        let path = named(path, scene);
        atomic_write(&path, text.as_bytes()).map_err(|e| e.to_string())?;
        Ok(path)
    }

    fn read_text(&self, path: &Path) -> Result<String, String> {
        let bytes = read_bounded(path, MOST).map_err(|e| e.to_string())?;
        String::from_utf8(bytes).map_err(|_| format!("{}: not UTF-8", path.display()))
    }

    fn read_picture(&self, path: &Path) -> Result<Image, String> {
        read(path, &ReadOptions::to(ColourSpace::LinearSrgb)).map_err(|e| e.to_string())
    }

    fn report(&self, report: &Report) {
        let passes: Map<_, _> = report.passes.iter().map(|(name, ms)| (name.clone(), (*ms).into())).collect();
        let [width, height] = report.size;
        json::print(json!({
            "scene": report.file.display().to_string(),
            "adapter": report.adapter,
            "surface": report.surface,
            "width": width,
            "height": height,
            "frames": report.frames,
            "milliseconds": report.milliseconds,
            "passes": passes,
            "prepare_seconds": report.prepared,
            "reference_samples": report.samples,
            "relative_rmse": report.difference.map(|d| d.relative_rmse),
            "flip": report.difference.map(|d| d.flip),
            "selected": report.selected.as_ref().map(|(number, model, worn_by)| json!({
                "material": number,
                "model": model,
                "worn_by": worn_by,
            })),
            "animation": report.moment.as_ref().map(|(name, _)| name),
            "seconds": report.moment.as_ref().map(|(_, seconds)| seconds),
            "ink": report.ink.as_ref().map(|ink| json!({
                "preset": ink.preset,
                "width": ink.size[0],
                "height": ink.size[1],
                "strokes": ink.strokes,
                "seconds": ink.seconds,
                "stroke": ink.stroke.as_ref().map(|(id, _)| format!("{id:08x}")),
                "object": ink.stroke.as_ref().and_then(|(_, object)| object.as_ref()),
                "steered": ink.subject.as_ref().map(|(kind, name)| format!("{kind} {name}")),
                "mask": ink.mask.as_ref().map(|(name, on)| json!({"name": name, "on": on})),
                "unmet": ink.unmet,
            })),
            "message": report.message,
        }));
        // A script's reader waits for the line; that it cannot be written is said at the end.
        let _ = output::flush();
    }
}

/// `path`; where it is but an extension, the first free name after the scene, in the working folder.
fn named(path: &Path, scene: &Path) -> PathBuf {
    let text = path.to_string_lossy();
    let extension =
        text.strip_prefix('.').filter(|e| !e.is_empty() && e.chars().all(|c| c.is_ascii_alphanumeric()));
    let Some(extension) = extension else { return path.to_path_buf() };
    let stem = scene.file_stem().map_or("picture".into(), |s| s.to_string_lossy());
    let names = (1..).map(|n| PathBuf::from(format!("{stem}-{n:03}.{extension}")));
    names.into_iter().find(|name| !name.exists()).unwrap_or_else(|| path.to_path_buf())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_extension_alone_gets_a_name() {
        let scene = Path::new("a/stage.toml");
        assert_eq!(named(Path::new(".png"), scene), Path::new("stage-001.png"));
        for own in ["x.png", "./x.exr", "../.png", ".", ".a/b.png"] {
            assert_eq!(named(Path::new(own), scene), Path::new(own));
        }
    }
}
