//! What varies over a surface.

use glam::{Affine2, Vec3};
use std::sync::Arc;
use yugen_optics::Image;
use yugen_reflectance::btf::Btf;

use crate::TextureId;

/// A number, a colour, or either of them varying over the surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number; where a colour is wanted, grey.
    Number(f32),
    /// A colour; where a number is wanted, its luminance.
    Rgb(Vec3),
    /// Looked up per hit.
    Texture(TextureId),
}

/// Something that varies over a surface.
#[derive(Clone, Debug)]
pub enum Texture {
    /// A picture, already linear and in the working space (or raw numbers).
    Image {
        /// Channels: one (grey) or at least R, G, B.
        image: Arc<Image>,
        /// How to look between texels.
        filter: TextureFilter,
        /// What lies outside [0, 1), across and down.
        wrap: [Wrap; 2],
        /// Applied to the surface's (u, v) first. v runs **down**: v = 0 is the top row of the picture, as in
        /// glTF and inside Mitsuba. Readers of formats where v runs up (OBJ) store 1 − v in the mesh.
        to_uv: Affine2,
        /// Use this channel, one of the first four, as a number instead of the colour.
        channel: Option<usize>,
    },
    /// Squares of two values, each half a unit of (u, v) wide as in Mitsuba.
    Checkerboard {
        /// Where floor(2u) + floor(2v) is even.
        even: Value,
        /// Elsewhere.
        odd: Value,
        /// Applied to (u, v) first.
        to_uv: Affine2,
    },
    /// An attribute of the mesh, interpolated between vertices or the same all over a triangle.
    MeshAttribute {
        /// For example `vertex_color`.
        name: String,
    },
    /// The maps of a cloth, for [`Material::Cloth`]; always filtered. As a colour: ρ_d.
    Cloth {
        /// In the working space.
        maps: Arc<Btf>,
        /// What lies outside [0, 1).
        wrap: Wrap,
        /// Applied to (u, v) first.
        to_uv: Affine2,
    },
    /// A texture times a constant (glTF's factors).
    Scaled {
        /// The texture.
        texture: TextureId,
        /// Channel-wise factor.
        factor: Vec3,
    },
    /// A texture at coordinates of its own: those that an attribute of the mesh, three numbers wide, has in its first
    /// two.
    At {
        /// The texture.
        texture: TextureId,
        /// For example `uv_1`.
        attribute: String,
    },
    /// The product of two values, channel by channel.
    Product {
        /// Both.
        factors: [Value; 2],
    },
    /// 1 where a number is at least `edge`, 0 elsewhere.
    Step {
        /// The number.
        value: Value,
        /// Where it steps.
        edge: f32,
    },
}

/// How an image is looked up between its texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum TextureFilter {
    /// The nearest texel.
    Nearest,
    /// Bilinear.
    #[default]
    Bilinear,
    /// Trilinear in a mip pyramid by the ray's footprint.
    Mip,
}

/// What an image shows outside [0, 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Every second tile mirrored.
    Mirror,
    /// The border texel goes on.
    Clamp,
}
