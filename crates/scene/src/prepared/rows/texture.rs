//! Textures as small programs: operands before what is made of them.

use super::{NONE, Rows, RowsError};
use crate::prepared::texture::{Node, Textures, texel};
use crate::{TextureFilter, Value, Wrap};
use glam::{Affine2, Vec2};
use std::collections::HashMap;
use std::sync::Arc;
use yugen_optics::Image;

/// Instructions; `texture.wgsl` knows them by the same names.
#[derive(Clone, Copy)]
#[repr(u32)]
enum Op {
    End,
    Constant,
    Image,
    Cloth,
    Checkerboard,
    Attribute,
    Scale,
    Product,
    Step,
}

/// Operands that may wait for another one, as in `texture.wgsl`.
const STACK: usize = 8;

/// Turns values into four words, and the textures among them into programs, each once.
pub(super) struct Programs<'a> {
    textures: &'a Textures,
    of_texture: HashMap<usize, u32>,
    levels: HashMap<*const Image, (u32, u32)>,
}

impl<'a> Programs<'a> {
    pub(super) fn new(textures: &'a Textures) -> Self {
        Self { textures, of_texture: HashMap::new(), levels: HashMap::new() }
    }

    /// Size of a texel of a texture in units of (u, v).
    pub(super) fn texel(&self, id: usize) -> Vec2 {
        self.textures.texel(id)
    }

    /// Tag and three words: 0 a number, 1 a colour, 2 where a program begins.
    pub(super) fn value(&mut self, value: &Value, rows: &mut Rows) -> Result<[u32; 4], RowsError> {
        Ok(match value {
            Value::Number(x) => [0, x.to_bits(), x.to_bits(), x.to_bits()],
            Value::Rgb(c) => [1, c.x.to_bits(), c.y.to_bits(), c.z.to_bits()],
            Value::Texture(id) => [2, self.program(*id, rows)?, 0, 0],
        })
    }

    /// Where the program of a texture begins.
    fn program(&mut self, id: usize, rows: &mut Rows) -> Result<u32, RowsError> {
        if let Some(known) = self.of_texture.get(&id) {
            return Ok(*known);
        }
        rows.has_programs = true;
        let mut code = Vec::new();
        self.compile(id, NONE, 1, id, rows, &mut code)?;
        code.push(Op::End as u32);
        let at = rows.words.len() as u32;
        rows.words.extend(code);
        self.of_texture.insert(id, at);
        Ok(at)
    }

    /// `uv`: the attribute that holds the coordinates. `depth`: operands on the stack when this one is done.
    fn compile(
        &mut self,
        id: usize,
        uv: u32,
        depth: usize,
        whole: usize,
        rows: &mut Rows,
        code: &mut Vec<u32>,
    ) -> Result<(), RowsError> {
        if depth > STACK || code.len() > 1 << 16 {
            return Err(RowsError::Deep { texture: whole, limit: STACK });
        }
        rows.operands = rows.operands.max(depth as u32);
        let textures = self.textures;
        let occurring = match &textures.nodes[id] {
            Node::Image { .. } => Op::Image,
            Node::Cloth { .. } => Op::Cloth,
            Node::Checkerboard { .. } => Op::Checkerboard,
            Node::Attribute { .. } => Op::Attribute,
            Node::Scaled { .. } => Op::Scale,
            Node::Product(_) => Op::Product,
            Node::Step { .. } => Op::Step,
            // Written into those inside.
            Node::At { .. } => Op::End,
        };
        rows.operations |= 1 << occurring as u32;
        let attribute = |name: &str, rows: &Rows| {
            rows.attribute_names.iter().position(|n| n == name).map_or(NONE, |i| i as u32)
        };
        match &textures.nodes[id] {
            Node::Image { levels, filter, wrap, to_uv, channel } => {
                let (at, count) = self.levels(levels, 1, rows);
                code.push(Op::Image as u32);
                code.extend(affine(to_uv));
                let filter = match filter {
                    TextureFilter::Nearest => 0,
                    TextureFilter::Bilinear => 1,
                    TextureFilter::Mip => 2,
                };
                let grey = u32::from(levels[0].channels.len() < 3);
                let channel = channel.map_or(0, |c| c.min(3) as u32 + 1);
                code.extend([uv, filter, wrap_word(wrap[0]), wrap_word(wrap[1]), channel, grey, at, count]);
            }
            Node::Cloth { .. } => {
                code.push(Op::Cloth as u32);
                code.extend(self.cloth(id, rows));
            }
            Node::Checkerboard { even, odd, to_uv } => {
                self.operand(even, uv, depth, whole, rows, code)?;
                self.operand(odd, uv, depth + 1, whole, rows, code)?;
                code.push(Op::Checkerboard as u32);
                code.extend(affine(to_uv));
                code.push(uv);
            }
            Node::Attribute { name } => code.extend([Op::Attribute as u32, attribute(name, rows)]),
            Node::Scaled { texture, factor } => {
                self.compile(*texture, uv, depth, whole, rows, code)?;
                code.push(Op::Scale as u32);
                code.extend(factor.to_array().map(f32::to_bits));
            }
            // The innermost coordinates count.
            Node::At { texture, attribute: name } => {
                let uv = attribute(name, rows);
                self.compile(*texture, uv, depth, whole, rows, code)?;
            }
            Node::Product([a, b]) => {
                self.operand(a, uv, depth, whole, rows, code)?;
                self.operand(b, uv, depth + 1, whole, rows, code)?;
                code.push(Op::Product as u32);
            }
            Node::Step { value, edge } => {
                self.operand(value, uv, depth, whole, rows, code)?;
                code.extend([Op::Step as u32, edge.to_bits()]);
            }
        }
        Ok(())
    }

    fn operand(
        &mut self,
        value: &Value,
        uv: u32,
        depth: usize,
        whole: usize,
        rows: &mut Rows,
        code: &mut Vec<u32>,
    ) -> Result<(), RowsError> {
        let (c, grey) = match value {
            Value::Texture(id) => return self.compile(*id, uv, depth, whole, rows, code),
            Value::Number(x) => ([*x; 3], 1),
            Value::Rgb(c) => (c.to_array(), 0),
        };
        if depth > STACK {
            return Err(RowsError::Deep { texture: whole, limit: STACK });
        }
        rows.operands = rows.operands.max(depth as u32);
        rows.operations |= 1 << Op::Constant as u32;
        code.push(Op::Constant as u32);
        code.extend(c.map(f32::to_bits));
        code.push(grey);
        Ok(())
    }

    /// What looking up a cloth takes: six floats of the map to its (u, v), its wrap, where its levels begin and how many
    /// there are. No levels where the texture is none.
    pub(super) fn cloth(&mut self, id: usize, rows: &mut Rows) -> [u32; 9] {
        let mut words = [0; 9];
        if let Node::Cloth { levels, wrap, to_uv } = &self.textures.nodes[id] {
            let (at, count) = self.levels(levels, 3, rows);
            words[..6].copy_from_slice(&affine(to_uv));
            words[6..].copy_from_slice(&[wrap_word(*wrap), at, count]);
        }
        words
    }

    /// The levels of a pyramid, `per_texel` rows of `texels` to each of its texels: for each where it begins, its width
    /// and its height.
    fn levels(&mut self, levels: &[Arc<Image>], per_texel: usize, rows: &mut Rows) -> (u32, u32) {
        let key = (Arc::as_ptr(&levels[0]), levels.len() as u32);
        // One picture may be looked up with a pyramid and without.
        if let Some((at, count)) = self.levels.get(&key.0)
            && *count >= key.1
        {
            return (*at, key.1);
        }
        let at = rows.words.len() as u32;
        for image in levels {
            rows.words.extend([rows.texels.len() as u32, image.width as u32, image.height as u32]);
            if per_texel == 1 {
                for y in 0..image.height as i64 {
                    for x in 0..image.width as i64 {
                        rows.texels.push(texel(image, [Wrap::Clamp; 2], x, y).to_array());
                    }
                }
            } else {
                let texels = image.data.chunks_exact(4);
                rows.texels.extend(texels.map(|t| [t[0], t[1], t[2], t[3]]));
            }
        }
        self.levels.insert(key.0, (at, key.1));
        (at, key.1)
    }
}

fn affine(m: &Affine2) -> [u32; 6] {
    m.to_cols_array().map(f32::to_bits)
}

fn wrap_word(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    }
}
