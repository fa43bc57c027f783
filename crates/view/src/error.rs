//! Why there is no window.

use yugen_realtime::StageError;

/// What ends the window.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ViewError {
    /// No screen.
    #[error(
        "no display was found: start this in a desktop session, or under Xvfb (Debian: apt-get install xvfb; xvfb-run \
         yugen view …); `yugen render` needs none"
    )]
    NoDisplay,
    /// The window could not be made.
    #[error("the window could not be opened: {0}")]
    NoWindow(String),
    /// No GPU, a scene too large for it, or a GPU that was lost.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The GPU shows nothing on this window.
    #[error("{0} cannot show anything in this window: `yugen render` makes pictures without one")]
    NoSurface(String),
    /// The GPU refused something.
    #[error("the GPU refused: {0}")]
    Refused(String),
    /// The scene cannot be shown, in a script, which has nobody to mend it.
    #[error("{0}")]
    Scene(String),
    /// A step of a script failed.
    #[error("step {step} of the script, '{what}': {problem}")]
    Script {
        /// Counted from one.
        step: usize,
        /// The step.
        what: String,
        /// What is wrong.
        problem: String,
    },
}
