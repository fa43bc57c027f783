//! A scene on its way from its file, and whether the file has changed.

use super::{App, Wake};
use crate::error::ViewError;
use crate::files::Loaded;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::{Duration, Instant, SystemTime};
use winit::event_loop::ActiveEventLoop;

/// Between two looks at whether the file has changed.
pub(super) const WATCH: Duration = Duration::from_millis(500);

/// A scene on its way from its file.
pub(super) struct Loading {
    pub(super) file: PathBuf,
    /// When it had last changed.
    pub(super) changed: Option<SystemTime>,
    /// Somebody wants it; else the file has changed.
    pub(super) asked: bool,
    pub(super) scene: mpsc::Receiver<Result<Loaded, String>>,
}

impl App {
    /// Reads a scene, beside the window's work.
    pub(super) fn load(&mut self, file: &Path, asked: bool) {
        let (sender, receiver) = mpsc::channel();
        let (files, wake, path) = (self.files.clone(), self.proxy.clone(), file.to_path_buf());
        let changed = files.changed(file);
        std::thread::spawn(move || {
            // Nobody may listen any more.
            let _ = sender.send(files.load(&path));
            let _ = wake.send_event(Wake::Thread);
        });
        self.loading = Some(Loading { file: file.to_path_buf(), changed, asked, scene: receiver });
    }

    /// Takes a scene that has been read; looks whether the file has changed.
    pub(super) fn watch(&mut self, event_loop: &ActiveEventLoop) {
        if let Some(loading) = &self.loading {
            let (path, asked, changed) = (loading.file.clone(), loading.asked, loading.changed);
            let loaded = match loading.scene.try_recv() {
                Err(mpsc::TryRecvError::Empty) => return,
                Ok(loaded) => loaded,
                Err(mpsc::TryRecvError::Disconnected) => {
                    Err(format!("{}: reading it failed: this is a fault of the program", path.display()))
                }
            };
            self.loading = None;
            // What could not be read is not read again before it changes; another file is no longer of interest then.
            if loaded.is_ok() || path == self.state.file {
                self.watched = changed;
            }
            match loaded {
                Ok(Loaded { scene, live }) => {
                    self.state.set_scene(scene, &path);
                    self.state.set_live(live);
                    if let Some(graphics) = &self.graphics {
                        graphics.set_title(&path);
                    }
                }
                // A script goes on without what it did not ask for.
                Err(problem) if self.script.is_empty() || !asked => self.state.complain(problem),
                Err(problem) => self.fail(event_loop, ViewError::Scene(problem)),
            }
            if let Some(graphics) = &self.graphics {
                graphics.window.request_redraw();
            }
        } else if self.looked.elapsed() >= WATCH {
            self.looked = Instant::now();
            let changed = self.files.changed(&self.state.file);
            // Half written is not yet there, or changes once more.
            if changed.is_some() && changed != self.watched {
                let file = self.state.file.clone();
                self.load(&file, false);
            }
        }
    }
}
