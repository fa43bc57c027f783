//! Makes stages and rows of scenes beside the window's own work.

use crate::edit::Edits;
use crate::live::{ClothSettings, SharedLive};
use crate::mailbox::Mailbox;
use std::sync::{Arc, PoisonError};
use std::time::Duration;
use yugen_realtime::{Lighting, Options, Preview, Stage, StageError};
use yugen_scene::prepared::Rows;
use yugen_scene::{Material, Scene};

/// What is to be made.
pub struct Order {
    /// As it was read.
    pub scene: Arc<Scene>,
    /// Where in which of its animations; as it was read where absent.
    pub moment: Option<(String, f32)>,
    /// Cloth of it that is simulated, how, and for how long at once.
    pub live: Option<(SharedLive, ClothSettings, Duration)>,
    /// What was changed of it.
    pub edits: Edits,
    /// What [`Made`] will call it.
    pub number: u64,
    /// The scene, the most bounces and the lighting of which it is, by which the window knows what it got.
    pub of: (u64, u32, Lighting),
    /// A stage; else rows for the one there is.
    pub stage: Option<(wgpu::Device, wgpu::Queue, Options)>,
}

/// What was made.
pub struct Made {
    /// Of which order.
    pub number: u64,
    /// As in the order.
    pub of: (u64, u32, Lighting),
    /// The changed scene and its rows or stage, or why there is none.
    pub outcome: Result<(Arc<Scene>, Ready), String>,
    /// Simulated cloth has not come to where it should be: the same is to be ordered again.
    pub behind: bool,
    /// How long it took.
    pub seconds: f64,
}

/// For the window.
pub enum Ready {
    /// Other values for the stage there is.
    Rows(Arc<Rows>),
    /// Another pose, and nothing else.
    Pose(Arc<Rows>),
    /// A stage.
    Stage(Box<Stage>),
}

/// A thread that makes the last thing that was asked for.
pub struct Maker(Mailbox<Order, Made>);

impl Maker {
    /// `wake` is called when something was made.
    pub fn new(wake: impl Fn() + Send + 'static) -> Self {
        let mailbox = Mailbox::default();
        let own = mailbox.clone();
        std::thread::spawn(move || {
            let mut last = None;
            while let Some(order) = own.next() {
                own.put(make(order, &mut last));
                wake();
            }
        });
        Self(mailbox)
    }

    /// Asks for something instead of what was asked for before and has not been begun.
    pub fn ask(&self, order: Order) {
        self.0.ask(order);
    }

    /// What was made last.
    pub fn take(&self) -> Option<Made> {
        self.0.take()
    }

    /// Whether anything is being made or waits to be taken.
    pub fn busy(&self) -> bool {
        self.0.busy()
    }
}

impl Drop for Maker {
    fn drop(&mut self) {
        self.0.close();
    }
}

/// The rows that were made last, and of what.
struct Last {
    scene: Arc<Scene>,
    edits: Edits,
    /// With the edits, in whatever pose.
    materials: Vec<Material>,
    rows: Arc<Rows>,
}

fn make(order: Order, last: &mut Option<Last>) -> Made {
    let started = std::time::Instant::now();
    let mut behind = false;
    let made = || {
        let mut scene = posed(&order, &mut behind)?;
        // Its rows have no need of them.
        scene.figures.clear();
        scene.fires.clear();
        scene.caches.clear();
        order.edits.light_scene(&mut scene);
        if let (Some(last), None) = (last.as_mut(), &order.stage)
            && Arc::ptr_eq(&last.scene, &order.scene)
            && last.edits == order.edits
        {
            // Their tables have been computed.
            scene.materials.clone_from(&last.materials);
            // Copied where the window still has them in its hands.
            Arc::make_mut(&mut last.rows).pose(&scene).map_err(|e| e.to_string())?;
            return Ok((Arc::new(scene), Ready::Pose(last.rows.clone())));
        }
        *last = None;
        order.edits.change_materials(&mut scene)?;
        let rows = Arc::new(Rows::new(&scene).map_err(|e| e.to_string())?);
        let ready = match &order.stage {
            None => Ready::Rows(rows.clone()),
            Some((device, queue, options)) => {
                let stage = || -> Result<Stage, StageError> {
                    let mut stage = Stage::new(device, queue, &rows, options)?;
                    stage.set_preview(Preview::ALL)?;
                    Ok(stage)
                };
                Ready::Stage(Box::new(stage().map_err(|e| e.to_string())?))
            }
        };
        // Only what moves is made anew often.
        *last = order.scene.moves().then(|| Last {
            scene: order.scene.clone(),
            edits: order.edits.clone(),
            materials: scene.materials.clone(),
            rows,
        });
        Ok((Arc::new(scene), ready))
    };
    // A fault in a scene must not leave the window waiting for ever.
    let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(made))
        .unwrap_or_else(|_| Err("the scene could not be prepared: this is a fault of the program".into()));
    Made { number: order.number, of: order.of, outcome, behind, seconds: started.elapsed().as_secs_f64() }
}

fn posed(order: &Order, behind: &mut bool) -> Result<Scene, String> {
    let mut scene = Scene::clone(&order.scene);
    if let Some((clip, seconds)) = &order.moment {
        let mut seconds = *seconds;
        if let Some((cloth, settings, within)) = &order.live {
            let mut cloth = cloth.lock().unwrap_or_else(PoisonError::into_inner);
            let reached = cloth.play(&mut scene, seconds, settings, *within)?;
            *behind = reached < seconds;
            seconds = reached;
        }
        scene.pose(Some(clip), seconds).map_err(|e| e.to_string())?;
    }
    Ok(scene)
}
