//! What a cloth is made of: a weave and the threads in it.

use super::Weave;
use glam::{Vec2, Vec3};
use yugen_archive::formats::wif::{Draft, Thread};
use yugen_optics::ColourSpace;
use yugen_reflectance::noh::Noh;

/// How a thread is made, and so which way its fibres or its metal run.
#[derive(Clone, Debug, PartialEq)]
pub enum Make {
    /// Fibres side by side, of lens-shaped cross-section (Hearle and Shanahan 1978).
    Fibres {
        /// Angle of the fibres to the thread in radians: positive for Z twist, zero for untwisted floss.
        twist: f32,
    },
    /// A flat strip of paper with metal leaf on its face (hirakinshi).
    Strip {
        /// Standard deviation of how far a strip is rolled about its length, in radians.
        roll: f32,
    },
    /// A metal strip wound around a core (nenkinshi).
    Wrapped {
        /// Angle of the strip to the thread in radians; positive winds as Z twist.
        winding: f32,
        /// From one turn of the strip to the next, across it, in mm.
        pitch: f32,
        /// Part of the pitch that metal covers; the core shows in the rest.
        cover: f32,
        /// Albedo of the core.
        core: Vec3,
    },
}

/// A kind of thread. Lengths in mm, colours linear in the fabric's space.
#[derive(Clone, Debug, PartialEq)]
pub struct Yarn {
    /// For people.
    pub name: String,
    /// Half the width in the plane of the cloth.
    pub half_width: f32,
    /// Half the height across it.
    pub half_height: f32,
    /// How much less than another thread it bends where they cross (any unit).
    pub stiffness: f32,
    /// How high a float bulges in its middle, as part of its length.
    pub loft: f32,
    /// A pattern weft: it lies on the ground or behind it and is not woven into it.
    pub rides: bool,
    /// Inner structure.
    pub make: Make,
    /// ρ_d.
    pub diffuse: Vec3,
    /// ρ_s as [`Noh`] has it.
    pub specular: Vec3,
    /// σ_x along the fibres or the strip, σ_y across.
    pub sigma: Vec2,
}

impl Yarn {
    /// The colour it has in a drawing: that of its metal, if it has one, else of its fibres. However black they are,
    /// their sheen is none of it.
    pub fn colour(&self) -> Vec3 {
        match self.make {
            Make::Fibres { .. } => self.diffuse,
            Make::Strip { .. } | Make::Wrapped { .. } => self.diffuse.max(self.specular),
        }
    }
}

/// How far real threads are from ideal ones; all are standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Irregularity {
    /// Of a thread's place, as part of its spacing.
    pub place: f32,
    /// Of the waves in which it runs, as part of its spacing; a wave is some ten spacings long.
    pub wander: f32,
    /// Of the logarithm of σ from thread to thread.
    pub sigma: f32,
    /// Of the logarithm of the colour from thread to thread.
    pub colour: f32,
    /// Of the angle of fibres or strip to the thread, in radians.
    pub twist: f32,
}

impl Default for Irregularity {
    /// A well woven cloth.
    fn default() -> Self {
        Self { place: 0.06, wander: 0.04, sigma: 0.06, colour: 0.04, twist: 0.03 }
    }
}

impl Irregularity {
    /// A drawing.
    pub const NONE: Self = Self { place: 0.0, wander: 0.0, sigma: 0.0, colour: 0.0, twist: 0.0 };
}

/// One repeat of a cloth: a weave and its threads.
#[derive(Clone, Debug, PartialEq)]
pub struct Fabric {
    /// For people.
    pub name: String,
    /// The repeat.
    pub weave: Weave,
    /// The kinds of thread.
    pub yarns: Vec<Yarn>,
    /// For each end its kind and its spacing in mm: the width it takes in the cloth.
    pub warp: Vec<(usize, f32)>,
    /// For each pick likewise; a pattern weft that lies on others takes none.
    pub weft: Vec<(usize, f32)>,
    /// Of the colours.
    pub colour_space: ColourSpace,
}

impl Fabric {
    /// The cloth that a draft weaves, of smooth twisted yarn in the colours of the draft, which are of `space`.
    pub fn from_draft(draft: &Draft, space: ColourSpace) -> Self {
        let mut yarns: Vec<Yarn> = Vec::new();
        let mut kinds: Vec<(Thread, usize)> = Vec::new();
        let mut place = |thread: &Thread| {
            let spacing = thread.spacing;
            let like = |t: &Thread| t.colour == thread.colour && t.thickness == thread.thickness;
            if let Some((_, kind)) = kinds.iter().find(|(t, _)| like(t)) {
                return (*kind, spacing);
            }
            kinds.push((*thread, yarns.len()));
            let radius = 0.5 * thread.thickness.max(1e-3);
            yarns.push(Yarn {
                name: format!("yarn {}", yarns.len() + 1),
                half_width: radius,
                // Flattened by the beat.
                half_height: 0.5 * radius,
                stiffness: 1.0,
                loft: 0.0,
                rides: false,
                make: Make::Fibres { twist: 0.35 },
                diffuse: thread.colour,
                // Cotton or wool: a weak sheen.
                specular: Vec3::splat(0.04),
                sigma: Vec2::new(0.3, 0.5),
            });
            (yarns.len() - 1, spacing)
        };
        let mut warp: Vec<(usize, f32)> = draft.warp.iter().map(&mut place).collect();
        let mut weft: Vec<(usize, f32)> = draft.weft.iter().map(&mut place).collect();
        for threads in [&mut warp, &mut weft] {
            // A draft may say that some threads take no room, but not that all do.
            if threads.iter().map(|(_, spacing)| spacing).sum::<f32>() < 1e-3 {
                threads.iter_mut().for_each(|(_, spacing)| *spacing = 1e-3);
            }
        }
        let name = draft.title.clone();
        Self { name, weave: Weave::of(draft), yarns, warp, weft, colour_space: space }
    }

    /// Width and height of the repeat in mm.
    pub fn repeat(&self) -> Vec2 {
        let length = |threads: &[(usize, f32)]| threads.iter().map(|(_, spacing)| spacing).sum();
        Vec2::new(length(&self.warp), length(&self.weft))
    }

    /// So many whole repeats across and up, which tile without a seam: texels of a picture `width` texels wide, and mm.
    pub fn repeats(&self, [across, up]: [u32; 2], width: usize) -> ([usize; 2], Vec2) {
        let extent = self.repeat() * Vec2::new(across as f32, up as f32);
        ([width, (extent.y / extent.x * width as f32).round().max(1.0) as usize], extent)
    }

    /// How to weave it.
    pub fn draft(&self) -> Draft {
        let thread = |(kind, spacing): &(usize, f32)| {
            let yarn = &self.yarns[*kind];
            Thread { colour: yarn.colour(), spacing: *spacing, thickness: 2.0 * yarn.half_width }
        };
        let threads = |all: &[(usize, f32)]| all.iter().map(thread).collect();
        self.weave.draft(&self.name, threads(&self.warp), threads(&self.weft))
    }

    /// The height in mm of the centres of end and pick where they cross, over the middle of the ground; `None` for a
    /// thread that takes no notice of the other.
    pub(super) fn crossing(&self, end: usize, pick: usize, top: f32) -> (Option<f32>, f32) {
        let (warp, weft) = (&self.yarns[self.warp[end].0], &self.yarns[self.weft[pick].0]);
        // Peirce 1937: together the crimps make up the thickness of both; the stiffer bends less.
        let both = warp.half_height + weft.half_height;
        let warps = both * weft.stiffness / (warp.stiffness + weft.stiffness);
        let up = self.weave.up(end, pick);
        if !weft.rides {
            let side = if up { 1.0 } else { -1.0 };
            return (Some(side * warps), -side * (both - warps));
        }
        let on = top + weft.half_height;
        if !up {
            (None, on)
        } else if self.ties(end, pick) {
            (Some(on + warps), on + warps - both)
        } else {
            (None, -on)
        }
    }

    /// Whether an end holds down a pattern weft that floats on both sides of it.
    pub(super) fn ties(&self, end: usize, pick: usize) -> bool {
        let n = self.weave.ends();
        let floats = |e: usize| !self.weave.up(e, pick);
        self.yarns[self.weft[pick].0].rides && !floats(end) && floats(end + 1) && floats(end + n - 1)
    }

    /// The height in mm of the highest point of the ground over its middle; it is as deep below.
    pub(super) fn top(&self) -> f32 {
        let mut pairs: Vec<(usize, usize)> = Vec::new();
        for (warp, _) in &self.warp {
            for (weft, _) in self.weft.iter().filter(|(kind, _)| !self.yarns[*kind].rides) {
                if !pairs.contains(&(*warp, *weft)) {
                    pairs.push((*warp, *weft));
                }
            }
        }
        let height = |(warp, weft): &(usize, usize)| {
            let (warp, weft) = (&self.yarns[*warp], &self.yarns[*weft]);
            let both = warp.half_height + weft.half_height;
            let warps = both * weft.stiffness / (warp.stiffness + weft.stiffness);
            (warps + warp.half_height).max(both - warps + weft.half_height)
        };
        pairs.iter().map(height).fold(0.0, f32::max)
    }
}

/// Silk and gold as [`Noh`]'s presets have them: ρ_d, ρ_s and σ.
pub(super) fn noh(name: &str, space: ColourSpace) -> Option<(Vec3, Vec3, Vec2)> {
    use yugen_reflectance::Model;
    let (m, _) = Noh::preset(name, space)?;
    Some((m.rho_d, m.rho_s, Vec2::new(m.sigma_x, m.sigma_y)))
}

#[cfg(test)]
mod tests {
    use super::super::PRESETS;
    use super::*;

    /// Peirce's geometry: where threads cross they touch, and none reaches above the top of the ground.
    #[test]
    fn threads_touch_where_they_cross() {
        for preset in PRESETS {
            let fabric = Fabric::preset(preset.name, ColourSpace::LinearSrgb).unwrap();
            let top = fabric.top();
            let mut ties = 0;
            for (end, pick) in
                (0..fabric.warp.len()).flat_map(|e| (0..fabric.weft.len()).map(move |p| (e, p)))
            {
                let (warp, weft) = (&fabric.yarns[fabric.warp[end].0], &fabric.yarns[fabric.weft[pick].0]);
                let both = warp.half_height + weft.half_height;
                let (z_warp, z_weft) = fabric.crossing(end, pick, top);
                let Some(z_warp) = z_warp else {
                    // A pattern weft that is not held keeps clear of the ground on its side.
                    assert!((z_weft.abs() - weft.half_height - top).abs() < 1e-6);
                    assert_eq!(z_weft < 0.0, fabric.weave.up(end, pick));
                    continue;
                };
                let apart = z_warp - z_weft;
                let side = if fabric.weave.up(end, pick) { 1.0 } else { -1.0 };
                assert!((apart - side * both).abs() < 1e-6, "{} {end} {pick}: {apart}", fabric.name);
                if fabric.ties(end, pick) {
                    ties += 1;
                } else {
                    assert!((z_warp + warp.half_height).max(z_weft + weft.half_height) <= top + 1e-6);
                }
            }
            assert!(ties > 100, "{}: only {ties} ties", fabric.name);
        }
    }

    /// Black is the hardest: its sheen is brighter than itself.
    #[test]
    fn yarns_come_back_in_the_colours_of_the_draft() {
        let space = ColourSpace::LinearRec2020;
        let colours = [Vec3::ZERO, Vec3::splat(0.03), Vec3::new(0.01, 0.002, 0.0), Vec3::ONE];
        let thread = |c: &Vec3| Thread { colour: *c, spacing: 0.5, thickness: 0.4 };
        let threads: Vec<Thread> = colours.iter().map(thread).collect();
        let draft =
            Weave::twill(2, 2, super::super::Twill::Right).unwrap().draft("", threads.clone(), threads);
        let woven = Fabric::from_draft(&draft, space).draft();
        assert_eq!((&woven.warp, &woven.weft), (&draft.warp, &draft.weft));
        let text = yugen_archive::formats::wif::write(&woven, space);
        let read = yugen_archive::formats::wif::read(text.as_bytes(), "w.wif".as_ref(), space).unwrap();
        for (a, b) in draft.warp.iter().zip(&read.warp) {
            // A step of a thousand in sRGB is at most 2.3e-3 of linear light.
            assert!((a.colour - b.colour).abs().max_element() < 2e-3, "{a:?} {b:?}");
        }
    }

    #[test]
    fn a_draft_keeps_its_colours_and_sizes() {
        let kinran = Fabric::preset("kinran", ColourSpace::LinearSrgb).unwrap();
        let draft = kinran.draft();
        let woven = Fabric::from_draft(&draft, kinran.colour_space);
        assert_eq!(woven.weave, kinran.weave);
        // Four kinds of thread, two of which look alike but for their width.
        assert_eq!(woven.yarns.len(), 4);
        for ((kind, spacing), thread) in woven.warp.iter().zip(&draft.warp) {
            assert_eq!(woven.yarns[*kind].diffuse, thread.colour);
            assert_eq!(*spacing, thread.spacing);
        }
    }
}
