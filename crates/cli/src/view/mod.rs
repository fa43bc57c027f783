//! `yugen view`: a scene in a window.

#[cfg(feature = "view")]
mod files;

#[cfg(feature = "view")]
pub use with_window::View;
#[cfg(not(feature = "view"))]
pub use without_window::View;

#[cfg(feature = "view")]
mod with_window {
    use super::files::OnDisk;
    use crate::simulate::ClothOptions;
    use crate::{argument, font};
    use anyhow::{Context, Result, bail};
    use clap::Args;
    use std::path::PathBuf;
    use std::sync::Arc;
    use yugen_archive::formats::mesh::Up;
    use yugen_archive::formats::{self};
    use yugen_archive::read_bounded;
    use yugen_view::Options;
    use yugen_view::action::script;
    use yugen_view::language::Language;

    /// Most bytes of a script.
    const SCRIPT: u64 = 1 << 20;

    /// Opens a scene in a window: to be turned under its lights, its materials changed while one looks, and the
    /// path-traced reference beside it at the space bar.
    ///
    /// `yugen view scene.toml` is the common case; `?` shows all keys, and docs/view.md explains them. Scripts do the same
    /// without hands: `yugen view scene.xml --do "orbit 30 10; light 2 off; reference; wait 64; save shot.png; quit"`.
    #[derive(Args)]
    pub struct View {
        /// The scene file, or a mesh (.obj, .ply, .serialized), which is shown under a sun and a sky, or motion (.bvh,
        /// .c3d, …), which is shown as sticks.
        scene: PathBuf,

        /// Pixels of the window.
        #[arg(long, value_name = "WxH", default_value = "1280x800", value_parser = size)]
        size: [u32; 2],

        /// What to do, actions by their names with semicolons between them; each waits until what was before is seen. The
        /// list is in docs/view.md and under `?` in the window.
        #[arg(long = "do", value_name = "ACTIONS", conflicts_with = "script")]
        actions: Option<String>,

        /// The same from a file, one or more actions on each line; what follows a # is for people.
        #[arg(long, value_name = "FILE")]
        script: Option<PathBuf>,

        /// What the window speaks [default: as LC_ALL, LC_MESSAGES or LANG say].
        #[arg(long, value_name = "LANGUAGE", value_parser = Language::ALL.map(Language::code))]
        language: Option<String>,

        /// A font with Japanese characters (.ttf, .otf, .ttc) instead of one that is found.
        #[arg(long, value_name = "FILE")]
        font: Option<PathBuf>,

        #[command(flatten)]
        reading: argument::Reading,

        #[command(
            flatten,
            next_help_heading = "Cloth that is simulated in the window, as `yugen simulate` does"
        )]
        cloth: ClothOptions,

        /// Which way is up in a mesh (.obj, .ply, .serialized) or motion (.bvh, .c3d, …) [default: y; of motion as its file
        /// says].
        #[arg(long, value_name = "AXIS", value_parser = ["y", "z"])]
        up: Option<String>,
    }

    impl View {
        /// Does it.
        pub fn run(self) -> Result<()> {
            let text = match (&self.actions, &self.script) {
                (Some(text), _) => text.clone(),
                (_, Some(file)) => String::from_utf8(read_bounded(file, SCRIPT)?)
                    .with_context(|| format!("{}: a script is text in UTF-8", file.display()))?,
                _ => String::new(),
            };
            let script = match (script(&text), &self.script) {
                (Ok(script), _) => script,
                (Err(problem), Some(file)) => bail!("{}: {problem}", file.display()),
                (Err(problem), None) => bail!("--do: {problem}"),
            };
            let up = self.up.as_deref().map(|axis| if axis == "z" { Up::Z } else { Up::Y });
            let files = OnDisk {
                options: formats::Options { up, ..self.reading.options() },
                cloth: self.cloth.wanted()?.map(|cloth| (self.scene.clone(), cloth)),
            };
            let loaded = files.open(&self.scene)?;
            let language = self
                .language
                .as_deref()
                .map_or_else(of_environment, |l| Language::from_code(l).unwrap_or_default());
            let font = match &self.font {
                Some(file) => Some(font::read(file, 0)?),
                None => font::japanese(),
            };
            if let Some(font) = &font {
                tracing::info!("Japanese characters are from {}", font.name);
            }
            let options = Options { loaded, file: self.scene, size: self.size, language, font, script };
            Ok(yugen_view::run(options, Arc::new(files))?)
        }
    }

    fn size(text: &str) -> Result<[u32; 2], String> {
        argument::pair(text, 16384)
            .ok_or_else(|| "expected width x height in pixels, each 1 to 16384, as in 1280x800".into())
    }

    fn of_environment() -> Language {
        let set = |name| std::env::var(name).ok().filter(|v| !v.is_empty());
        let locale = ["LC_ALL", "LC_MESSAGES", "LANG"].into_iter().find_map(set);
        locale.map_or(Language::default(), |l| Language::of_locale(&l))
    }
}

#[cfg(not(feature = "view"))]
mod without_window {
    use anyhow::{Result, bail};
    use clap::Args;
    use std::ffi::OsString;

    /// Opens a scene in a window. This program was built without it: `cargo install --path crates/cli` builds one that has it.
    #[derive(Args)]
    pub struct View {
        /// Whatever there is.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
        rest: Vec<OsString>,
    }

    impl View {
        /// Says how to get it.
        pub fn run(self) -> Result<()> {
            bail!(
                "this yugen was built without its window, so it cannot show {}: build it with it (cargo install --path \
                 crates/cli, without --no-default-features), or make a picture with `yugen render`",
                self.rest.first().map_or("a scene".into(), |s| s.to_string_lossy())
            )
        }
    }
}
