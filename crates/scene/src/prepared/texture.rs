//! Textures looked up at a hit: nearest, bilinear, or trilinear in a mip pyramid by the ray's footprint.

use super::mesh::attribute;
use crate::{Mesh, Scene, Texture, TextureFilter, Value, Wrap};
use glam::{Affine2, Vec2, Vec3};
use std::sync::Arc;
use yugen_optics::Image;
use yugen_reflectance::btf::{Btf, Moments, Texel};

/// Where a texture is looked up.
#[derive(Clone, Copy)]
pub struct Lookup<'a> {
    /// Surface coordinates.
    pub uv: Vec2,
    /// Width of the ray's footprint in units of uv; 0 for none.
    pub footprint: f32,
    /// Where it is, for attributes of meshes. `None`: nowhere in particular, where every attribute is white.
    pub place: Option<&'a dyn Attributes>,
}

/// A place on a surface that may have attributes.
pub trait Attributes {
    /// One of them there: one number counts as grey. `None`: there is none of this name.
    fn attribute(&self, name: &str) -> Option<Vec3>;
}

/// A place on a triangle of a mesh.
pub struct OnTriangle<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Which triangle.
    pub triangle: u32,
    /// Weights of its second and third corner.
    pub barycentric: Vec2,
}

impl Attributes for OnTriangle<'_> {
    fn attribute(&self, name: &str) -> Option<Vec3> {
        attribute(self.mesh, self.triangle, self.barycentric, name)
    }
}

pub(super) enum Node {
    Image {
        levels: Vec<Arc<Image>>,
        filter: TextureFilter,
        wrap: [Wrap; 2],
        to_uv: Affine2,
        channel: Option<usize>,
    },
    Checkerboard {
        even: Value,
        odd: Value,
        to_uv: Affine2,
    },
    /// Levels of [`Moments`].
    Cloth {
        levels: Vec<Arc<Image>>,
        wrap: Wrap,
        to_uv: Affine2,
    },
    Attribute {
        name: String,
    },
    Scaled {
        texture: usize,
        factor: Vec3,
    },
    At {
        texture: usize,
        attribute: String,
    },
    Product([Value; 2]),
    Step {
        value: Value,
        edge: f32,
    },
}

/// All textures of a scene, with their pyramids.
pub struct Textures {
    pub(super) nodes: Vec<Node>,
    luminance: Vec3,
    filtered: bool,
}

impl Textures {
    /// Prepares the textures of `scene`.
    pub fn new(scene: &Scene) -> Self {
        let nodes: Vec<Node> = scene
            .textures
            .iter()
            .map(|t| match t {
                Texture::Image { image, filter, wrap, to_uv, channel } => Node::Image {
                    levels: if *filter == TextureFilter::Mip { pyramid(image) } else { vec![image.clone()] },
                    filter: *filter,
                    wrap: *wrap,
                    to_uv: *to_uv,
                    channel: *channel,
                },
                Texture::Checkerboard { even, odd, to_uv } => {
                    Node::Checkerboard { even: even.clone(), odd: odd.clone(), to_uv: *to_uv }
                }
                Texture::Cloth { maps, wrap, to_uv } => {
                    Node::Cloth { levels: pyramid(&Arc::new(moments(maps))), wrap: *wrap, to_uv: *to_uv }
                }
                Texture::MeshAttribute { name } => Node::Attribute { name: name.clone() },
                Texture::Scaled { texture, factor } => Node::Scaled { texture: *texture, factor: *factor },
                Texture::At { texture, attribute } => {
                    Node::At { texture: *texture, attribute: attribute.clone() }
                }
                Texture::Product { factors } => Node::Product(factors.clone()),
                Texture::Step { value, edge } => Node::Step { value: value.clone(), edge: *edge },
            })
            .collect();
        let filtered =
            |n: &Node| matches!(n, Node::Image { filter: TextureFilter::Mip, .. } | Node::Cloth { .. });
        let filtered = nodes.iter().any(filtered);
        Self { nodes, luminance: scene.working_space.luminance_weights(), filtered }
    }

    /// Whether any texture is filtered by the ray's footprint.
    pub fn filtered(&self) -> bool {
        self.filtered
    }

    /// A value as a colour.
    pub fn rgb(&self, value: &Value, at: &Lookup) -> Vec3 {
        match value {
            Value::Number(x) => Vec3::splat(*x),
            Value::Rgb(c) => *c,
            Value::Texture(id) => self.texture(*id, at).0,
        }
    }

    /// A value as a number: the luminance of a colour, the channel itself of a grey or single-channel texture.
    pub fn number(&self, value: &Value, at: &Lookup) -> f32 {
        match value {
            Value::Number(x) => *x,
            Value::Rgb(c) => self.luminance.dot(*c),
            Value::Texture(id) => match self.texture(*id, at) {
                (c, true) => c.x,
                (c, false) => self.luminance.dot(c),
            },
        }
    }

    /// ∂/∂u and ∂/∂v of a value as a number: that of the bilinear patch between texels, or by central differences over
    /// a texel (or 1/1000 where it has none).
    pub fn gradient(&self, value: &Value, at: &Lookup) -> Vec2 {
        let Value::Texture(id) = value else { return Vec2::ZERO };
        if let Node::Image { levels, filter: TextureFilter::Bilinear, wrap, to_uv, channel } =
            &self.nodes[*id]
        {
            let image = &levels[0];
            let size = Vec2::new(image.width as f32, image.height as f32);
            let place = to_uv.transform_point2(at.uv) * size - 0.5;
            let (corner, t) = (place.floor(), place - place.floor());
            let height = |dx: i64, dy: i64| {
                let c = texel(image, *wrap, corner.x as i64 + dx, corner.y as i64 + dy);
                match channel {
                    Some(i) => c[(*i).min(3)],
                    None if image.channels.len() < 3 => c.x,
                    None => self.luminance.dot(c.truncate()),
                }
            };
            let [a, b, c, d] = [height(0, 0), height(1, 0), height(0, 1), height(1, 1)];
            let slope =
                Vec2::new((b - a) * (1.0 - t.y) + (d - c) * t.y, (c - a) * (1.0 - t.x) + (d - b) * t.x);
            return to_uv.matrix2.transpose() * (slope * size);
        }
        let step = self.texel(*id) * 0.5;
        let look = |offset: Vec2| self.number(value, &Lookup { uv: at.uv + offset, ..*at });
        Vec2::new(
            (look(Vec2::new(step.x, 0.0)) - look(Vec2::new(-step.x, 0.0))) / (2.0 * step.x),
            (look(Vec2::new(0.0, step.y)) - look(Vec2::new(0.0, -step.y))) / (2.0 * step.y),
        )
    }

    /// Size of a texel in units of (u, v); 1/1000 where there are none.
    pub(super) fn texel(&self, id: usize) -> Vec2 {
        match &self.nodes[id] {
            Node::Image { levels, to_uv, .. } | Node::Cloth { levels, to_uv, .. } => {
                let scale = to_uv.matrix2;
                let (su, sv) = (scale.x_axis.length(), scale.y_axis.length());
                Vec2::new(
                    1.0 / (levels[0].width as f32 * su.max(1e-6)),
                    1.0 / (levels[0].height as f32 * sv.max(1e-6)),
                )
            }
            Node::Scaled { texture, .. } | Node::At { texture, .. } => self.texel(*texture),
            _ => Vec2::splat(1e-3),
        }
    }

    /// The colour, and whether it is a plain number in every channel.
    fn texture(&self, id: usize, at: &Lookup) -> (Vec3, bool) {
        match &self.nodes[id] {
            Node::Image { levels, filter, wrap, to_uv, channel } => {
                let uv = to_uv.transform_point2(at.uv);
                let c = match filter {
                    TextureFilter::Nearest => nearest(&levels[0], *wrap, uv),
                    TextureFilter::Bilinear => bilinear(&levels[0], *wrap, uv),
                    TextureFilter::Mip => {
                        let (lo, t) = level(levels, to_uv, at.footprint);
                        let a = bilinear(&levels[lo], *wrap, uv);
                        if t > 0.0 && lo + 1 < levels.len() {
                            a.lerp(bilinear(&levels[lo + 1], *wrap, uv), t)
                        } else {
                            a
                        }
                    }
                };
                match channel {
                    Some(i) => (Vec3::splat(c[(*i).min(3)]), true),
                    None => (c.truncate(), levels[0].channels.len() < 3),
                }
            }
            Node::Checkerboard { even, odd, to_uv } => {
                let uv = to_uv.transform_point2(at.uv);
                let mask = uv - uv.floor();
                let same = (mask.x > 0.5) == (mask.y > 0.5);
                let value = if same { even } else { odd };
                let grey = matches!(value, Value::Number(_));
                (self.rgb(value, at), grey)
            }
            Node::Cloth { .. } => (self.cloth(id, at).diffuse, false),
            Node::Attribute { name } => {
                // Where nobody knows it, as if white.
                let value = at.place.map_or(Some(Vec3::ONE), |place| place.attribute(name));
                (value.unwrap_or(Vec3::ZERO), false)
            }
            Node::Scaled { texture, factor } => {
                let (c, grey) = self.texture(*texture, at);
                (c * *factor, grey && factor.x == factor.y && factor.y == factor.z)
            }
            Node::At { texture, attribute } => {
                let own = at.place.and_then(|place| place.attribute(attribute));
                let uv = own.map_or(at.uv, Vec3::truncate);
                self.texture(*texture, &Lookup { uv, ..*at })
            }
            Node::Product(factors) => {
                let [a, b] = factors.each_ref().map(|value| match value {
                    Value::Texture(id) => self.texture(*id, at),
                    other => (self.rgb(other, at), matches!(other, Value::Number(_))),
                });
                (a.0 * b.0, a.1 && b.1)
            }
            Node::Step { value, edge } => {
                (Vec3::splat(f32::from(u8::from(self.number(value, at) >= *edge))), true)
            }
        }
    }

    /// What the maps of a cloth say, averaged over the footprint: trilinear in moments, which is what may be averaged.
    /// A black flat texel where `id` is no cloth.
    pub fn cloth(&self, id: usize, at: &Lookup) -> Texel {
        let Node::Cloth { levels, wrap, to_uv } = &self.nodes[id] else { return Moments::default().texel() };
        let uv = to_uv.transform_point2(at.uv);
        let (lo, t) = level(levels, to_uv, at.footprint);
        let mut sum = Moments::default();
        for (image, weight) in levels[lo..].iter().zip([1.0 - t, t]).filter(|l| l.1 > 0.0) {
            let (x, y) = (uv.x * image.width as f32 - 0.5, uv.y * image.height as f32 - 0.5);
            let (tx, ty) = (x - x.floor(), y - y.floor());
            let (x, y) = (x.floor() as i64, y.floor() as i64);
            for (dx, dy, part) in [
                (0, 0, (1.0 - tx) * (1.0 - ty)),
                (1, 0, tx * (1.0 - ty)),
                (0, 1, (1.0 - tx) * ty),
                (1, 1, tx * ty),
            ] {
                let x = wrap_index(x + dx, image.width, *wrap);
                let y = wrap_index(y + dy, image.height, *wrap);
                for (sum, v) in sum.values.iter_mut().zip(image.pixel(x, y)) {
                    *sum += v * (weight * part);
                }
            }
        }
        sum.texel()
    }

    /// The mean of a value over the unit square, for constants derived from textures.
    pub fn mean(&self, value: &Value) -> Vec3 {
        match value {
            Value::Texture(id) => {
                let n = 16;
                let mut sum = Vec3::ZERO;
                for y in 0..n {
                    for x in 0..n {
                        let uv = (Vec2::new(x as f32, y as f32) + 0.5) / n as f32;
                        sum += self.texture(*id, &Lookup { uv, footprint: 1.0 / n as f32, place: None }).0;
                    }
                }
                sum / (n * n) as f32
            }
            _ => self.rgb(value, &Lookup { uv: Vec2::ZERO, footprint: 0.0, place: None }),
        }
    }
}

/// The finer of the two levels that a footprint lies between, and how far it is to the other.
fn level(levels: &[Arc<Image>], to_uv: &Affine2, footprint: f32) -> (usize, f32) {
    let stretch = to_uv.matrix2.x_axis.length().max(to_uv.matrix2.y_axis.length());
    let texels = footprint * stretch * levels[0].width.max(levels[0].height) as f32;
    let level = texels.max(1.0).log2().min((levels.len() - 1) as f32);
    (level as usize, level.fract())
}

/// The [`Moments`] of every texel, as a picture with as many channels.
fn moments(maps: &Btf) -> Image {
    let names: Vec<String> = (0..Moments::COUNT).map(|i| i.to_string()).collect();
    let data = maps.texels.iter().flat_map(|t| Moments::of(t).values).collect();
    Image { width: maps.width, height: maps.height, channels: names, data }
}

fn wrap_index(i: i64, n: usize, wrap: Wrap) -> usize {
    let n = n as i64;
    (match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Mirror => {
            let m = i.rem_euclid(2 * n);
            if m < n { m } else { 2 * n - 1 - m }
        }
    }) as usize
}

pub(super) fn texel(image: &Image, wrap: [Wrap; 2], x: i64, y: i64) -> glam::Vec4 {
    let p = image.pixel(wrap_index(x, image.width, wrap[0]), wrap_index(y, image.height, wrap[1]));
    match *p {
        [r, g, b, a, ..] => glam::Vec4::new(r, g, b, a),
        [r, g, b] => glam::Vec4::new(r, g, b, 1.0),
        [y, a] => glam::Vec4::new(y, y, y, a),
        [y] => glam::Vec4::new(y, y, y, 1.0),
        [] => glam::Vec4::ZERO,
    }
}

fn nearest(image: &Image, wrap: [Wrap; 2], uv: Vec2) -> glam::Vec4 {
    texel(
        image,
        wrap,
        (uv.x * image.width as f32).floor() as i64,
        (uv.y * image.height as f32).floor() as i64,
    )
}

fn bilinear(image: &Image, wrap: [Wrap; 2], uv: Vec2) -> glam::Vec4 {
    let x = uv.x * image.width as f32 - 0.5;
    let y = uv.y * image.height as f32 - 0.5;
    let (x0, y0) = (x.floor(), y.floor());
    let (tx, ty) = (x - x0, y - y0);
    let (x0, y0) = (x0 as i64, y0 as i64);
    let top = texel(image, wrap, x0, y0).lerp(texel(image, wrap, x0 + 1, y0), tx);
    let bottom = texel(image, wrap, x0, y0 + 1).lerp(texel(image, wrap, x0 + 1, y0 + 1), tx);
    top.lerp(bottom, ty)
}

/// The image and its halvings down to one texel; each texel the mean of the area it covers.
fn pyramid(image: &Arc<Image>) -> Vec<Arc<Image>> {
    let mut levels = vec![image.clone()];
    while let Some(last) = levels.last() {
        if last.width <= 1 && last.height <= 1 {
            break;
        }
        let (w, h) = (last.width.div_ceil(2), last.height.div_ceil(2));
        let n = last.channels.len();
        let mut next =
            Image { width: w, height: h, channels: last.channels.clone(), data: vec![0.0; w * h * n] };
        // Box filter with fractional overlap, so that odd sizes do not shift the picture.
        let (sx, sy) = (last.width as f32 / w as f32, last.height as f32 / h as f32);
        for y in 0..h {
            for x in 0..w {
                let (x0, x1) = (x as f32 * sx, (x + 1) as f32 * sx);
                let (y0, y1) = (y as f32 * sy, (y + 1) as f32 * sy);
                let mut weight = 0.0;
                let mut sum = vec![0.0; n];
                for iy in y0 as usize..(y1.ceil() as usize).min(last.height) {
                    let wy = (y1.min((iy + 1) as f32) - y0.max(iy as f32)).max(0.0);
                    for ix in x0 as usize..(x1.ceil() as usize).min(last.width) {
                        let w = wy * (x1.min((ix + 1) as f32) - x0.max(ix as f32)).max(0.0);
                        weight += w;
                        for (s, v) in sum.iter_mut().zip(last.pixel(ix, iy)) {
                            *s += w * v;
                        }
                    }
                }
                for (to, s) in next.pixel_mut(x, y).iter_mut().zip(sum) {
                    *to = s / weight;
                }
            }
        }
        levels.push(Arc::new(next));
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene_with(filter: TextureFilter, wrap: Wrap) -> Scene {
        let mut image = Image::rgb(5, 3);
        for (i, v) in image.data.iter_mut().enumerate() {
            *v = ((i * 7919) % 13) as f32 / 13.0;
        }
        let image = Arc::new(image);
        Scene {
            textures: vec![Texture::Image {
                image,
                filter,
                wrap: [wrap; 2],
                to_uv: Affine2::IDENTITY,
                channel: None,
            }],
            ..Scene::default()
        }
    }

    #[test]
    fn texel_centres_give_the_texels_and_the_top_of_the_pyramid_the_mean() {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            for filter in [TextureFilter::Nearest, TextureFilter::Bilinear, TextureFilter::Mip] {
                let scene = scene_with(filter, wrap);
                let Texture::Image { image, .. } = &scene.textures[0] else { unreachable!() };
                let textures = Textures::new(&scene);
                let value = Value::Texture(0);
                for y in 0..3 {
                    for x in 0..5 {
                        let uv = Vec2::new((x as f32 + 0.5) / 5.0, (y as f32 + 0.5) / 3.0);
                        let c = textures.rgb(&value, &Lookup { uv, footprint: 0.0, place: None });
                        assert!(
                            (c - Vec3::from_slice(image.pixel(x, y))).length() < 1e-5,
                            "{filter:?} {wrap:?}"
                        );
                    }
                }
                if filter == TextureFilter::Mip {
                    let mean = image.data.chunks(3).map(Vec3::from_slice).sum::<Vec3>() / 15.0;
                    let c =
                        textures.rgb(&value, &Lookup { uv: Vec2::splat(0.3), footprint: 10.0, place: None });
                    assert!((c - mean).length() < 1e-5);
                }
            }
        }
    }

    #[test]
    fn wrapping() {
        assert_eq!([-1, 0, 4, 5].map(|i| wrap_index(i, 5, Wrap::Repeat)), [4, 0, 4, 0]);
        assert_eq!([-1, 0, 4, 5].map(|i| wrap_index(i, 5, Wrap::Clamp)), [0, 0, 4, 4]);
        assert_eq!([-1, 0, 4, 5, 9, 10].map(|i| wrap_index(i, 5, Wrap::Mirror)), [0, 0, 4, 4, 0, 0]);
    }
}
