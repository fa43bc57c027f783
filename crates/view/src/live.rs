//! Cloth that is simulated while it is looked at.

use glam::Vec3;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use yugen_scene::Scene;

/// What can be changed of it while it moves.
#[derive(Clone, Debug, PartialEq)]
pub struct ClothSettings {
    /// What it is made of: one of [`Live::fabrics`].
    pub fabric: String,
    /// Velocity of the air, m/s.
    pub wind: Vec3,
}

/// The simulation, which whoever loaded the scene brings with it.
pub trait Live: Send {
    /// The animation of the scene in which it moves; none where nothing else moves.
    fn clip(&self) -> Option<String>;

    /// Frames that it computes a second; what is seen is always one of them.
    fn rate(&self) -> f64;

    /// With what it begins.
    fn settings(&self) -> ClothSettings;

    /// What it may be made of.
    fn fabrics(&self) -> Vec<&'static str>;

    /// The strongest wind that it takes, m/s.
    fn most_wind(&self) -> f32;

    /// Computes on towards `seconds`, or anew from the beginning where that lies behind, until that is reached or `within` is
    /// over, and gives `scene`, a copy of the one that it was loaded with, the cloth where it then is. Returns the seconds that were reached.
    ///
    /// # Errors
    /// A sentence.
    fn play(
        &mut self,
        scene: &mut Scene,
        seconds: f32,
        settings: &ClothSettings,
        within: Duration,
    ) -> Result<f32, String>;
}

/// A simulation that the window and its threads share.
pub type SharedLive = Arc<Mutex<Box<dyn Live>>>;

/// What the window knows of it.
pub struct LiveState {
    /// The simulation.
    pub cloth: SharedLive,
    /// As asked for.
    pub settings: ClothSettings,
    /// What it may be made of.
    pub fabrics: Vec<&'static str>,
    /// [`Live::rate`].
    pub rate: f64,
    /// [`Live::most_wind`].
    pub most_wind: f32,
}

impl LiveState {
    /// Of a simulation that has not begun.
    pub fn new(cloth: Box<dyn Live>) -> Self {
        let (settings, fabrics) = (cloth.settings(), cloth.fabrics());
        let (rate, most_wind) = (cloth.rate(), cloth.most_wind());
        Self { cloth: Arc::new(Mutex::new(cloth)), settings, fabrics, rate, most_wind }
    }
}

/// The end of an animation that cloth alone has, s.
pub const ALONE: f32 = 60.0;
