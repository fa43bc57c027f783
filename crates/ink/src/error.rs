//! What can go wrong between a scene and its painting.

use yugen_motion::fire::FireError;
use yugen_realtime::StageError;
use yugen_scene::prepared::RowsError;

/// Why there is no painting.
#[derive(Clone, Debug, thiserror::Error)]
pub enum InkError {
    /// The camera's matrix or numbers make no picture.
    #[error("camera '{name}' cannot be painted through: {reason}")]
    Camera {
        /// Its name.
        name: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// What the realtime renderer sees.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The scene.
    #[error(transparent)]
    Rows(#[from] RowsError),
    /// A fire of it.
    #[error(transparent)]
    Fire(#[from] FireError),
    /// The device.
    #[error("the GPU refused: {0}")]
    Refused(String),
    /// More pixels than can be drawn.
    #[error("{0}")]
    TooLarge(String),
    /// Nobody wants it any more.
    #[error("the painting was stopped")]
    Stopped,
    /// A preset or a control.
    #[error("{0}")]
    Preset(String),
}
