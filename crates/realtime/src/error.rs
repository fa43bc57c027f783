//! What can go wrong between a scene and its picture.

use crate::hierarchy::HierarchyError;

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StageError {
    /// No GPU and no software one.
    #[error(
        "no GPU was found; a software one will do (Debian: apt-get install mesa-vulkan-drivers), or the reference renderer, which needs none"
    )]
    NoAdapter,
    /// The driver gave no device.
    #[error("{adapter} gave no device: {reason}; update its driver, or use the reference renderer")]
    NoDevice {
        /// Name of the adapter.
        adapter: String,
        /// What the driver said.
        reason: String,
    },
    /// A part of the scene is larger than the device takes.
    #[error(
        "the {what} of the scene take {} MiB and this device takes {} MiB of one kind: simplify the meshes, or use the reference renderer",
        megabytes(*.bytes),
        .limit >> 20
    )]
    TooLarge {
        /// Of what there is too much.
        what: &'static str,
        /// Bytes needed.
        bytes: u64,
        /// Bytes that one binding may have.
        limit: u64,
    },
    /// More volumes than a frame marches through.
    #[error("the scene has {count} volumes and at most {limit} are shown: use the reference renderer")]
    Volumes {
        /// In the scene.
        count: usize,
        /// The most.
        limit: usize,
    },
    /// A picture of no size, or larger than a texture may be.
    #[error("a picture of {width} x {height} pixels cannot be made here: 1 to {limit} a side")]
    Size {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
        /// Most of either.
        limit: u32,
    },
    /// The camera's picture is not the stage's.
    #[error("the camera's picture has {found:?} pixels, the stage {stage:?}: resize one of them")]
    OtherSize {
        /// Of the camera's window.
        found: [u32; 2],
        /// Of the stage.
        stage: [u32; 2],
    },
    /// The camera's matrix or numbers make no picture.
    #[error("camera '{name}' cannot be looked through: {reason}")]
    Camera {
        /// Its name.
        name: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// Draws can be moved, not added or taken away.
    #[error("{found} placed meshes instead of {stage}, or other meshes: make the stage anew")]
    OtherDraws {
        /// How many were given.
        found: usize,
        /// How many the stage has.
        stage: usize,
    },
    /// Where a light is sampled is said when the stage is made.
    #[error("a mesh that shines was moved or deformed: make the stage anew")]
    MovedLight,
    /// A vertex of a cloth that it has not.
    #[error("vertex {vertex} of a mesh is to follow vertex {of} of a cloth, which has {vertices}")]
    ClothVertex {
        /// Of the mesh.
        vertex: usize,
        /// Of the cloth.
        of: u32,
        /// How many the cloth has.
        vertices: usize,
    },
    /// Tangents would stay where they are.
    #[error(
        "mesh {mesh} has tangents of its own and cannot follow a cloth: leave them out, and they lie along u of its texture coordinates"
    )]
    ClothTangents {
        /// Which mesh.
        mesh: u32,
    },
    /// The scene cannot be traced.
    #[error(transparent)]
    Hierarchy(#[from] HierarchyError),
    /// A buffer, texture or shader that the device refused.
    #[error("the GPU refused: {0}")]
    Refused(String),
    /// The device is gone.
    #[error("the GPU was lost ({0}): open it anew")]
    Lost(String),
}

fn megabytes(bytes: u64) -> u64 {
    bytes.div_ceil(1 << 20)
}
