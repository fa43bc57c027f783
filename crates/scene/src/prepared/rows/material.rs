//! Materials as the list of what they may end in: for each the steps from the root to it.
//!
//! A shader has no recursion and a material few branches: every end is looked at, and left where a step says that the
//! eye, the side or a weight excludes it. The order is that of the tree.

use super::texture::Programs;
use super::{Rows, RowsError};
use crate::prepared::material::{Materials, Node, Textured};
use crate::{TurnedNormals, Value};
use std::collections::HashMap;
use yugen_reflectance::{Kind, ParamType};

/// Steps and ends; `material.wgsl` knows them by the same names.
#[derive(Clone, Copy)]
#[repr(u32)]
enum Op {
    Above,
    Below,
    First,
    Second,
    Sum,
    NormalMap,
    BumpMap,
    Body,
    Front,
    Back,
    // The ends.
    Model,
    Cloth,
    Through,
}

/// The table of materials: for each where its ends begin, and how many there are.
pub(super) fn write(
    materials: &Materials,
    programs: &mut Programs,
    rows: &mut Rows,
) -> Result<(), RowsError> {
    let count = materials.nodes.len();
    let table = rows.words.len();
    rows.words[3] = table as u32;
    rows.words.resize(table + 2 * count, 0);
    rows.lobes = 1;
    let mut tables = HashMap::new();
    for id in 0..count {
        let mut ends = Vec::new();
        let mut writer = Writer { materials, programs, rows, tables: &mut tables };
        writer.ends(id, &[], 0, &mut ends)?;
        let lobes = materials.most_lobes(id) as u32;
        rows.lobes = rows.lobes.max(lobes);
        let at = rows.words.len() as u32;
        rows.words[table + 2 * id..][..2].copy_from_slice(&[at, ends.len() as u32]);
        for end in ends {
            // So that one that is left can be skipped; the highest bit says that light goes straight through.
            let open = end.last() == Some(&(Op::Through as u32));
            rows.words.push((end.len() as u32 + 1) | (u32::from(open) << 31));
            rows.words.extend(end);
        }
    }
    Ok(())
}

struct Writer<'a, 'b> {
    materials: &'a Materials,
    programs: &'a mut Programs<'b>,
    rows: &'a mut Rows,
    /// Where a table lies, by where it lay.
    tables: &'a mut HashMap<*const f32, u32>,
}

impl Writer<'_, '_> {
    /// Adds the ends of material `id`, which is reached by `steps`, `turns` of them maps of normals or heights.
    fn ends(
        &mut self,
        id: usize,
        steps: &[u32],
        turns: u32,
        out: &mut Vec<Vec<u32>>,
    ) -> Result<(), RowsError> {
        self.rows.turns = self.rows.turns.max(turns);
        let occurring: &[Op] = match &self.materials.nodes[id] {
            Node::Model { .. } => &[Op::Model],
            Node::TwoSided { .. } => &[Op::Above, Op::Below],
            Node::Mask { .. } => &[Op::First, Op::Second, Op::Through],
            Node::Blend { .. } => &[Op::First, Op::Second],
            Node::Sum(_) => &[Op::Sum],
            Node::NormalMap { .. } => &[Op::NormalMap],
            Node::BumpMap { .. } => &[Op::BumpMap],
            Node::Cloth { .. } => &[Op::Cloth],
            Node::Body { .. } => &[Op::Body],
            Node::OneSided { .. } => &[Op::Front, Op::Back, Op::Through],
            Node::Null => &[Op::Through],
        };
        self.rows.steps |= occurring.iter().fold(0, |bits, op| bits | 1 << *op as u32);
        let then = |more: &[u32]| [steps, more].concat();
        let materials = self.materials;
        match &materials.nodes[id] {
            Node::Model { kind, slots, textured, table } => {
                let mut zeros = bits_of_zeros(slots);
                for t in textured {
                    let width = if t.kind == ParamType::Rgb { 3 } else { 1 };
                    zeros &= !(((1 << width) - 1) << t.slot);
                }
                self.occurs(*kind, zeros);
                let at = self.rows.numbers.len() as u32;
                self.rows.numbers.extend_from_slice(slots);
                let numbers = &mut self.rows.numbers;
                let table = *self.tables.entry(table.as_ptr()).or_insert_with(|| {
                    numbers.extend_from_slice(table);
                    (numbers.len() - table.len()) as u32
                });
                let mut end = then(&[
                    Op::Model as u32,
                    *kind as u32,
                    at,
                    table,
                    slots.len() as u32,
                    textured.len() as u32,
                ]);
                for t in textured {
                    end.extend(self.textured(t)?);
                }
                out.push(end);
            }
            Node::TwoSided { front, back } => {
                self.ends(*front, &then(&[Op::Above as u32]), turns, out)?;
                self.ends(*back, &then(&[Op::Below as u32]), turns, out)?;
            }
            Node::Mask { opacity, base } => {
                let opacity = self.value(opacity)?;
                out.push([&then(&[Op::First as u32])[..], &opacity, &[Op::Through as u32]].concat());
                self.ends(*base, &[&then(&[Op::Second as u32])[..], &opacity].concat(), turns, out)?;
            }
            Node::Blend { weight, first, second } => {
                let weight = self.value(weight)?;
                self.ends(*first, &[&then(&[Op::First as u32])[..], &weight].concat(), turns, out)?;
                self.ends(*second, &[&then(&[Op::Second as u32])[..], &weight].concat(), turns, out)?;
            }
            Node::Sum(all) => {
                let steps = then(&[Op::Sum as u32, (all.len() as f32).to_bits()]);
                for id in all {
                    self.ends(*id, &steps, turns, out)?;
                }
            }
            Node::NormalMap { texture, scale, turned, base } => {
                let mut steps = then(&[Op::NormalMap as u32, scale.to_bits(), flags(*turned)]);
                steps.extend(self.value(texture)?);
                self.ends(*base, &steps, turns + 1, out)?;
            }
            Node::BumpMap { texture, scale, turned, base } => {
                let mut steps = then(&[Op::BumpMap as u32, scale.to_bits(), flags(*turned)]);
                steps.extend(self.value(texture)?);
                let step = match texture {
                    Value::Texture(id) => self.programs.texel(*id) * 0.5,
                    _ => glam::Vec2::ONE,
                };
                steps.extend(step.to_array().map(f32::to_bits));
                self.ends(*base, &steps, turns + 1, out)?;
            }
            Node::Cloth { texture, form } => {
                self.occurs(Kind::Noh, 0);
                self.rows.turns = self.rows.turns.max(turns + 1);
                self.rows.has_cloth = true;
                let mut end = then(&[Op::Cloth as u32, form.0.to_bits()]);
                end.extend(self.programs.cloth(*texture, self.rows));
                out.push(end);
            }
            Node::Body { absorption, base } => {
                let mut steps = then(&[Op::Body as u32]);
                steps.extend(absorption.to_array().map(f32::to_bits));
                self.ends(*base, &steps, turns, out)?;
            }
            Node::OneSided { base } => {
                self.ends(*base, &then(&[Op::Front as u32]), turns, out)?;
                out.push(then(&[Op::Back as u32, Op::Through as u32]));
            }
            Node::Null => out.push(then(&[Op::Through as u32])),
        }
        Ok(())
    }

    /// Notes a model, and which of its slots are zero.
    fn occurs(&mut self, kind: Kind, zeros: u64) {
        let Rows { kinds, zeros: all, .. } = self.rows;
        match kinds.iter().position(|k| *k == kind) {
            Some(i) => all[i] &= zeros,
            None => {
                kinds.push(kind);
                all.push(zeros);
            }
        }
    }

    fn value(&mut self, value: &Value) -> Result<[u32; 4], RowsError> {
        self.programs.value(value, self.rows)
    }

    /// Slot, 1 for a colour, least, most, value.
    fn textured(&mut self, t: &Textured) -> Result<Vec<u32>, RowsError> {
        let colour = u32::from(t.kind == ParamType::Rgb);
        let mut words = vec![t.slot as u32, colour, t.min.to_bits(), t.max.to_bits()];
        words.extend(self.value(&t.value)?);
        Ok(words)
    }
}

fn bits_of_zeros(slots: &[f32]) -> u64 {
    slots.iter().enumerate().filter(|(_, v)| **v == 0.0).map(|(i, _)| 1 << i).sum()
}

/// 1: normals that look away are mirrored; 2: the shadowing function is on.
fn flags(turned: TurnedNormals) -> u32 {
    u32::from(turned.flip_invalid_normals) | (u32::from(turned.use_shadowing_function) << 1)
}
