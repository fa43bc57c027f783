//! What a fabric looks like from above: for every texel the thread on top, its surface and what that reflects.
//!
//! A thread is a curve through its crossings, swept by its cross-section. Its surface has a closed form, so the
//! normal is the gradient of the height exactly; the tangent is the direction of fibres or strip on that surface.

use super::fabric::{Fabric, Irregularity, Make, Yarn};
use crate::rows::for_rows;
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;
use yugen_optics::random::Pcg32;
use yugen_reflectance::btf::{Btf, Texel};

/// Which thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ThreadId {
    /// An end; else a pick.
    pub warp: bool,
    /// From the left or the bottom of the cloth.
    pub index: u32,
    /// Index into [`Fabric::yarns`].
    pub yarn: u32,
}

/// A cloth as maps of the same size, texel by texel from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Cloth {
    /// What it reflects.
    pub btf: Btf,
    /// Over the middle of the ground, in widths of a texel.
    pub heights: Vec<f32>,
    /// What lies on top; `None` where one looks through between the threads.
    pub threads: Vec<Option<ThreadId>>,
}

impl Cloth {
    /// The lower left part of an endless cloth, `extent` mm wide and high, on a grid of `size` texels. What whole
    /// repeats fit the extent tile without a seam, irregularities included. Same seed, same cloth.
    ///
    /// # Panics
    /// If a size is zero or an extent is not positive.
    pub fn weave(
        fabric: &Fabric,
        size: [usize; 2],
        extent: Vec2,
        irregular: Irregularity,
        seed: u32,
    ) -> Self {
        let [width, height] = size;
        assert!(width > 0 && height > 0 && extent.min_element() > 0.0, "a cloth has a size");
        let loom = Loom::new(fabric, extent, irregular, seed);
        let texel = extent / Vec2::new(width as f32, height as f32);
        let nothing = (through(), 0.0, None);
        let mut points = vec![nothing; width * height];
        for_rows(&mut points, width, |row, points| {
            let y = (height - row) as f32 - 0.5;
            for (x, point) in points.iter_mut().enumerate() {
                let at = Vec2::new(x as f32 + 0.5, y) * texel;
                *point = loom.look(at);
            }
        });
        Self {
            btf: Btf {
                width,
                height,
                colour_space: fabric.colour_space,
                texels: points.iter().map(|(t, ..)| *t).collect(),
            },
            heights: points.iter().map(|(_, z, _)| z / texel.x).collect(),
            threads: points.iter().map(|(.., id)| *id).collect(),
        }
    }
}

/// Between the threads there is darkness.
fn through() -> Texel {
    Texel {
        diffuse: Vec3::splat(0.005),
        specular: Vec3::ZERO,
        normal: Vec3::Z,
        tangent: Vec3::X,
        sigma: Vec2::splat(0.5),
        confidence: 1.0,
    }
}

/// A point that a thread passes through, and the float that it belongs to.
#[derive(Clone, Copy, Debug)]
struct Node {
    at: f32,
    z: f32,
    over: bool,
    /// Where the float begins and ends.
    float: Option<[f32; 2]>,
}

/// A thread in its place.
#[derive(Clone, Debug)]
struct Strand {
    id: ThreadId,
    /// Of its middle line, mm.
    at: f32,
    /// Amplitude in mm, angular frequency in 1/mm and phase of its waves.
    wave: [f32; 3],
    sigma: f32,
    colour: f32,
    twist: f32,
    roll: f32,
    /// Where a wrapped strip begins, in turns.
    turn: f32,
    nodes: Vec<Node>,
}

/// Threads of one direction, by place.
#[derive(Clone, Debug)]
struct Set {
    warp: bool,
    /// How wide all of them lie; then they come again.
    width: f32,
    /// How long they are; then they come again.
    length: f32,
    /// How long one repeat of the weave is along them.
    repeat: f32,
    /// No thread reaches farther from its middle line.
    reach: f32,
    strands: Vec<Strand>,
}

/// A fabric set up: every thread in its place.
#[derive(Clone, Debug)]
struct Loom<'a> {
    fabric: &'a Fabric,
    sets: [Set; 2],
}

/// What a thread's surface is like at a point.
struct Surface {
    z: f32,
    /// Slopes along the thread and across.
    along: f32,
    across: f32,
    /// Whether the core of a wrapped thread shows.
    core: bool,
}

impl<'a> Loom<'a> {
    fn new(fabric: &'a Fabric, extent: Vec2, irregular: Irregularity, seed: u32) -> Self {
        let repeat = fabric.repeat();
        // The extent of n repeats must not become n + 1 by rounding.
        let repeats = (extent / repeat - 1e-3).ceil().max(Vec2::ONE);
        let total = repeat * repeats;
        let place = |warp: bool| {
            let (threads, along) = if warp { (&fabric.warp, total.y) } else { (&fabric.weft, total.x) };
            let n = if warp { repeats.x } else { repeats.y } as usize * threads.len();
            let mut edge = 0.0;
            (0..n)
                .map(|i| {
                    let (kind, spacing) = threads[i % threads.len()];
                    let yarn = &fabric.yarns[kind];
                    let mut random = Pcg32::new(u64::from(seed), (i as u64) << 1 | u64::from(warp));
                    // A thread that takes no room among the others has its own to move in.
                    let room = if spacing > 0.0 { spacing } else { 2.0 * yarn.half_width };
                    let at = edge + 0.5 * spacing + irregular.place * room * random.normal();
                    edge += spacing;
                    let waves = (along / (10.0 * room)).round().max(1.0);
                    let even = irregular == Irregularity::NONE;
                    // Only real strips roll.
                    let roll = match yarn.make {
                        Make::Strip { roll } if !even => roll * random.normal(),
                        _ => 0.0,
                    };
                    Strand {
                        id: ThreadId { warp, index: i as u32, yarn: kind as u32 },
                        at,
                        // A sine has a standard deviation of 1/√2.
                        wave: [
                            irregular.wander * room * 2f32.sqrt(),
                            TAU * waves / along,
                            TAU * random.next_f32(),
                        ],
                        sigma: (irregular.sigma * random.normal()).exp(),
                        colour: (irregular.colour * random.normal()).exp(),
                        twist: irregular.twist * random.normal(),
                        roll,
                        turn: if even { 0.0 } else { random.next_f32() },
                        nodes: Vec::new(),
                    }
                })
                .collect::<Vec<_>>()
        };
        let (mut ends, mut picks) = (place(true), place(false));
        let (end_at, pick_at): (Vec<f32>, Vec<f32>) =
            (ends.iter().map(|s| s.at).collect(), picks.iter().map(|s| s.at).collect());
        let top = fabric.top();
        let (warp_ways, weft_ways) = (warp_ways(fabric, top), weft_ways(fabric, top));
        for strand in &mut ends {
            let way = &warp_ways[strand.id.index as usize % fabric.warp.len()];
            strand.nodes =
                nodes(way, &pick_at, fabric.weft.len(), total.y, &fabric.yarns[strand.id.yarn as usize]);
        }
        for strand in &mut picks {
            let way = &weft_ways[strand.id.index as usize % fabric.weft.len()];
            strand.nodes =
                nodes(way, &end_at, fabric.warp.len(), total.x, &fabric.yarns[strand.id.yarn as usize]);
        }
        let set = |warp: bool, mut strands: Vec<Strand>, width: f32, length: f32| {
            strands.sort_by(|a, b| a.at.total_cmp(&b.at));
            let reach = strands.iter().map(|s| fabric.yarns[s.id.yarn as usize].half_width + s.wave[0]);
            let repeat = if warp { repeat.y } else { repeat.x };
            Set { warp, width, length, repeat, reach: reach.fold(0.0, f32::max), strands }
        };
        Self { fabric, sets: [set(true, ends, total.x, total.y), set(false, picks, total.y, total.x)] }
    }

    /// What one sees at a point, in mm from the lower left corner: texel, height in mm, thread.
    fn look(&self, at: Vec2) -> (Texel, f32, Option<ThreadId>) {
        let all = Vec2::new(self.sets[0].width, self.sets[1].width);
        let at = at - all * (at / all).floor();
        let mut best: Option<(Surface, &Set, &Strand, f32)> = None;
        for set in &self.sets {
            let (lateral, s) = if set.warp { (at.x, at.y) } else { (at.y, at.x) };
            set.near(lateral, |strand, lateral| {
                let [amplitude, frequency, phase] = strand.wave;
                let (sin, cos) = (frequency * s + phase).sin_cos();
                let d = lateral - strand.at - amplitude * sin;
                let lean = amplitude * frequency * cos;
                let yarn = &self.fabric.yarns[strand.id.yarn as usize];
                if let Some(surface) = strand.surface(yarn, set, s, d)
                    && best.as_ref().is_none_or(|(b, ..)| surface.z > b.z)
                {
                    best = Some((surface, set, strand, lean));
                }
            });
        }
        match best {
            // As deep as the ground reaches.
            None => (through(), -self.fabric.top(), None),
            Some((surface, set, strand, lean)) => {
                (self.texel(&surface, set.warp, strand, lean), surface.z, Some(strand.id))
            }
        }
    }

    fn texel(&self, surface: &Surface, warp: bool, strand: &Strand, lean: f32) -> Texel {
        let yarn = &self.fabric.yarns[strand.id.yarn as usize];
        // The lateral distance shrinks by the lean of the thread where one goes along.
        let (slope, axis) = if warp {
            (Vec2::new(surface.across, surface.along - lean * surface.across), Vec2::new(lean, 1.0))
        } else {
            (Vec2::new(surface.along - lean * surface.across, surface.across), Vec2::new(1.0, lean))
        };
        let normal = (-slope).extend(1.0).normalize();
        let axis = axis.extend(slope.dot(axis)).normalize();
        let angle = match yarn.make {
            _ if surface.core => 0.0,
            Make::Fibres { twist } => twist + strand.twist,
            Make::Strip { .. } => strand.twist,
            Make::Wrapped { winding, .. } => winding + strand.twist,
        };
        // Z twist turns clockwise from the axis, seen from above.
        let tangent = axis * angle.cos() - normal.cross(axis) * angle.sin();
        let (diffuse, specular, sigma) = match yarn.make {
            Make::Wrapped { core, .. } if surface.core => (core, Vec3::splat(0.05), Vec2::new(0.3, 0.5)),
            _ => (yarn.diffuse, yarn.specular, yarn.sigma),
        };
        Texel {
            diffuse: (diffuse * strand.colour).min(Vec3::ONE),
            specular: (specular * strand.colour).min(Vec3::ONE),
            normal,
            tangent: tangent.normalize(),
            sigma: (sigma * strand.sigma).clamp(Vec2::splat(0.02), Vec2::ONE),
            confidence: 1.0,
        }
    }
}

/// The way of a thread through one repeat: number of the crossing thread, mm from its middle, height, whether the
/// thread lies on top.
type Way = Vec<(usize, f32, f32, bool)>;

fn warp_ways(fabric: &Fabric, top: f32) -> Vec<Way> {
    let n = fabric.weft.len();
    let mut middle = 0.0;
    let middles: Vec<f32> = fabric
        .weft
        .iter()
        .map(|(_, spacing)| {
            middle += spacing;
            middle - 0.5 * spacing
        })
        .collect();
    (0..fabric.warp.len())
        .map(|end| {
            // An end that holds a pattern weft stays above it and cannot reach the ground beneath.
            let mut covered = vec![false; n];
            for pick in (0..n).filter(|p| fabric.ties(end, *p)) {
                let half = 0.9 * fabric.yarns[fabric.weft[pick].0].half_width;
                let near = |other: usize| {
                    let apart = (middles[other] - middles[pick]).abs();
                    apart.min(middle - apart) < half
                };
                for step in [1, n - 1] {
                    let others = (1..n).map(|i| (pick + i * step) % n).take_while(|o| near(*o));
                    others.for_each(|o| covered[o] = true);
                }
            }
            let mut way = Way::new();
            for (pick, covered) in covered.into_iter().enumerate() {
                let (Some(z), _) = fabric.crossing(end, pick, top) else { continue };
                let up = fabric.weave.up(end, pick);
                if fabric.ties(end, pick) {
                    let half = 0.75 * fabric.yarns[fabric.weft[pick].0].half_width;
                    way.extend([(pick, -half, z, up), (pick, half, z, up)]);
                } else if !covered {
                    way.push((pick, 0.0, z, up));
                }
            }
            way
        })
        .collect()
}

fn weft_ways(fabric: &Fabric, top: f32) -> Vec<Way> {
    let way = |pick: usize| {
        (0..fabric.warp.len())
            .map(move |end| (end, 0.0, fabric.crossing(end, pick, top).1, !fabric.weave.up(end, pick)))
    };
    (0..fabric.weft.len()).map(|pick| way(pick).collect()).collect()
}

/// The way through all repeats, `places` being those of the crossing threads, `per_repeat` to a repeat.
fn nodes(way: &Way, places: &[f32], per_repeat: usize, length: f32, yarn: &Yarn) -> Vec<Node> {
    let mut nodes: Vec<Node> = (0..places.len() / per_repeat)
        .flat_map(|r| way.iter().map(move |w| (r * per_repeat, w)))
        .map(|(first, (other, offset, z, over))| Node {
            at: (places[first + other] + offset).rem_euclid(length),
            z: *z,
            over: *over,
            float: None,
        })
        .collect();
    nodes.sort_by(|a, b| a.at.total_cmp(&b.at));
    let n = nodes.len();
    let Some(start) = (0..n).find(|i| !nodes[*i].over).filter(|_| yarn.loft > 0.0) else { return nodes };
    // From one node beneath to the next; positions go on over the seam.
    let place = |i: usize, nodes: &[Node]| nodes[i % n].at + (i / n) as f32 * length;
    let mut i = start;
    while i < start + n {
        if !nodes[i % n].over {
            i += 1;
            continue;
        }
        let last = (i..start + n).take_while(|k| nodes[k % n].over).last().unwrap_or(i);
        let float = [place(i, &nodes), place(last, &nodes)];
        for k in i..=last {
            let turns = (k / n) as f32 * length;
            nodes[k % n].float = Some(float.map(|p| p - turns));
        }
        i = last + 1;
    }
    nodes
}

impl Set {
    /// Calls `visit` for every strand that may cover a lateral place, with that place counted so that the strand's
    /// own is near.
    fn near<'s>(&'s self, lateral: f32, mut visit: impl FnMut(&'s Strand, f32)) {
        for turn in [0.0, self.width, -self.width] {
            let place = lateral + turn;
            let first = self.strands.partition_point(|s| s.at < place - self.reach);
            let strands = self.strands[first..].iter().take_while(|s| s.at <= place + self.reach);
            strands.for_each(|s| visit(s, place));
        }
    }
}

impl Strand {
    /// Height and slope of the middle line.
    fn spine(&self, yarn: &Yarn, length: f32, s: f32) -> (f32, f32) {
        let (Some(first), Some(last)) = (self.nodes.first(), self.nodes.last()) else { return (0.0, 0.0) };
        let next = self.nodes.partition_point(|n| n.at <= s);
        let a = if next == 0 { Node { at: last.at - length, ..*last } } else { self.nodes[next - 1] };
        let b = self.nodes.get(next).map_or((first.at + length, first.z), |n| (n.at, n.z));
        let span = (b.0 - a.at).max(1e-6);
        let t = ((s - a.at) / span).clamp(0.0, 1.0);
        // Level where it passes over or under another thread.
        let mut z = a.z + (b.1 - a.z) * t * t * (3.0 - 2.0 * t);
        let mut slope = (b.1 - a.z) * 6.0 * t * (1.0 - t) / span;
        let turns = if next == 0 { length } else { 0.0 };
        if let Some([from, to]) = a.float.map(|f| f.map(|p| p - turns)).filter(|f| s < f[1]) {
            let long = to - from;
            let u = (s - from) / long;
            // A long float sags under its weight: its bulge grows no more beyond ten widths.
            let bulge = yarn.loft * long.min(20.0 * yarn.half_width);
            z += bulge * 4.0 * u * (1.0 - u);
            slope += bulge * 4.0 * (1.0 - 2.0 * u) / long;
        }
        (z, slope)
    }

    /// The surface at `s` along the thread and `d` across it, where the thread is.
    fn surface(&self, yarn: &Yarn, set: &Set, s: f32, d: f32) -> Option<Surface> {
        let u = d / yarn.half_width;
        if u.abs() >= 1.0 {
            return None;
        }
        let (z, along) = self.spine(yarn, set.length, s);
        let b = yarn.half_height;
        let lens =
            Surface { z: z + b * (1.0 - u * u), along, across: -2.0 * b * u / yarn.half_width, core: false };
        Some(match yarn.make {
            Make::Fibres { .. } => lens,
            Make::Strip { .. } => Surface { z: z + b + self.roll * d, across: self.roll, ..lens },
            Make::Wrapped { winding, pitch, cover, .. } => {
                let (sin, cos) = (winding + self.twist).sin_cos();
                // Turns along the thread, a whole number in a repeat, and across it on the thread unrolled; left of
                // an end lies what is above a pick.
                let along = (set.repeat * sin.abs() / pitch).round().max(1.0).copysign(sin) / set.repeat;
                let across = if set.warp { -cos / pitch } else { cos / pitch };
                let f = (s * along + d * across + self.turn).rem_euclid(1.0);
                if f >= cover {
                    return Some(Surface { core: true, ..lens });
                }
                // Bent over the edges of the turn beneath, each turn is a little round.
                let (q, ridge) = (f / cover, 0.08 * pitch);
                let rise = ridge * 4.0 * (1.0 - 2.0 * q) / cover;
                Surface {
                    z: lens.z + ridge * 4.0 * q * (1.0 - q),
                    along: lens.along + rise * along,
                    across: lens.across + rise * across,
                    core: false,
                }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{PRESETS, Twill, Weave};
    use super::*;
    use yugen_optics::ColourSpace;

    const SPACE: ColourSpace = ColourSpace::LinearRec2020;

    fn presets() -> impl Iterator<Item = Fabric> {
        PRESETS.iter().map(|p| Fabric::preset(p.name, SPACE).unwrap())
    }

    fn simple(weave: Weave) -> Fabric {
        let kinran = Fabric::preset("kinran", SPACE).unwrap();
        let mut yarn = kinran.yarns[0].clone();
        (yarn.half_width, yarn.half_height) = (0.055, 0.03);
        let (warp, weft) = (vec![(0, 0.1); weave.ends()], vec![(0, 0.1); weave.picks()]);
        Fabric { weave, yarns: vec![yarn], warp, weft, ..kinran }
    }

    /// The middle of every crossing shows the thread that the weave puts on top.
    #[test]
    fn crossings_show_what_the_weave_says() {
        let weaves = [Weave::plain(), Weave::satin(8, 3).unwrap(), Weave::twill(2, 1, Twill::Left).unwrap()];
        for fabric in weaves.map(simple).into_iter().chain(presets()) {
            let loom = Loom::new(&fabric, fabric.repeat(), Irregularity::NONE, 0);
            for end in &loom.sets[0].strands {
                for pick in &loom.sets[1].strands {
                    let (e, p) = (end.id.index as usize, pick.id.index as usize);
                    let (_, _, seen) = loom.look(Vec2::new(end.at, pick.at));
                    let rides = fabric.yarns[pick.id.yarn as usize].rides;
                    let up = fabric.weave.up(e, p);
                    // A pattern weft covers the ground around it; one that lies behind is never seen.
                    let other = seen.filter(|id| {
                        let yarn = &fabric.yarns[id.yarn as usize];
                        *id != end.id && *id != pick.id && (yarn.rides || rides)
                    });
                    // An end that holds a pattern weft stays above the picks beneath that weft.
                    let holds = (0..fabric.weft.len()).any(|q| {
                        let held = &loom.sets[1].strands.iter().find(|s| s.id.index as usize == q).unwrap();
                        let apart = (held.at - pick.at).abs();
                        let half = fabric.yarns[held.id.yarn as usize].half_width;
                        fabric.ties(e, q) && apart.min(loom.sets[1].width - apart) < half
                    });
                    match (rides, up) {
                        _ if holds && !rides => {}
                        (true, true) => assert_ne!(seen, Some(pick.id), "{} {e} {p}", fabric.name),
                        _ if other.is_some() => {}
                        (_, true) => assert_eq!(seen, Some(end.id), "{} {e} {p}", fabric.name),
                        (_, false) => assert_eq!(seen, Some(pick.id), "{} {e} {p}", fabric.name),
                    }
                }
            }
        }
    }

    #[test]
    fn the_normal_is_the_gradient_of_the_height() {
        for fabric in presets().chain([simple(Weave::plain())]) {
            let extent = fabric.repeat();
            let loom = Loom::new(&fabric, extent, Irregularity::default(), 3);
            let mut random = Pcg32::new(9, 1);
            let (mut tried, mut compared, mut total, mut worst) = (0, 0, 0.0, 0.0f32);
            while tried < 4000 {
                let at = random.next_vec3().truncate() * extent;
                let (texel, _, id) = loom.look(at);
                let step = 5e-4;
                let around = [Vec2::X, -Vec2::X, Vec2::Y, -Vec2::Y].map(|o| loom.look(at + o * step));
                tried += 1;
                // Across the edge of a thread, of a turn of its strip or of two floats there is no gradient.
                let smooth = |(t, _, other): &(Texel, f32, Option<ThreadId>)| {
                    *other == id && t.diffuse == texel.diffuse && t.normal.dot(texel.normal) > 0.99
                };
                if !around.iter().all(smooth) {
                    continue;
                }
                let slope = Vec2::new(around[0].1 - around[1].1, around[2].1 - around[3].1) / (2.0 * step);
                let normal = (-slope).extend(1.0).normalize();
                let error = (normal - texel.normal).length();
                (compared, total, worst) = (compared + 1, total + error, worst.max(error));
                assert!(
                    (texel.normal.length() - 1.0).abs() < 1e-5 && (texel.tangent.length() - 1.0).abs() < 1e-5
                );
                assert!(texel.normal.dot(texel.tangent).abs() < 1e-5);
            }
            let mean = total / compared as f32;
            println!("{}: {compared} compared, mean {mean}, worst {worst}", fabric.name);
            // Differences over a micron: of second order where the curvature is steady; where it jumps, as for a weft
            // that dives at the border of a figure, of first.
            assert!(compared > 2000 && mean < 6e-4 && worst < 0.1, "{}: {mean} {worst}", fabric.name);
        }
    }

    /// Whole repeats tile; without irregularity every repeat is the same.
    #[test]
    fn cloth_comes_again_after_its_repeats() {
        for fabric in presets() {
            let repeat = fabric.repeat();
            let even = Loom::new(&fabric, 2.0 * repeat, Irregularity::NONE, 0);
            let real = Loom::new(&fabric, 2.0 * repeat, Irregularity::default(), 5);
            assert_eq!(real.sets[0].strands.len(), 2 * fabric.warp.len());
            let mut random = Pcg32::new(1, 1);
            let (mut same, mut moved) = (0, 0);
            for _ in 0..500 {
                let at = random.next_vec3().truncate() * repeat;
                let near = |a: (Texel, f32, Option<ThreadId>), b: (Texel, f32, Option<ThreadId>)| {
                    (a.1 - b.1).abs() < 1e-3 && (a.0.normal - b.0.normal).length() < 0.03
                };
                same += usize::from(near(even.look(at), even.look(at + repeat)));
                moved += usize::from(!near(real.look(at), real.look(at + repeat)));
                let (a, b) = (real.look(at), real.look(at + 2.0 * repeat));
                same += usize::from(near((a.0, a.1, None), (b.0, b.1, None)));
            }
            // Rounding decides at the edges of threads, nowhere else.
            assert!(same >= 990, "{}: {same} of 1000", fabric.name);
            assert!(moved > 100, "{}: irregularity does nothing", fabric.name);
        }
    }

    #[test]
    fn fibres_run_at_their_twist_and_strips_along_the_weft() {
        let mut fabric = simple(Weave::plain());
        fabric.yarns[0].make = Make::Fibres { twist: 0.4 };
        let loom = Loom::new(&fabric, fabric.repeat(), Irregularity::NONE, 0);
        // On the ridge of an end that lies on top, Z twist leans to the right of +y.
        let (texel, _, id) = loom.look(Vec2::new(0.05, 0.05));
        assert!(id.unwrap().warp);
        assert!(
            (texel.tangent - Vec3::new(0.4f32.sin(), 0.4f32.cos(), 0.0)).length() < 1e-4,
            "{}",
            texel.tangent
        );
        let (texel, _, id) = loom.look(Vec2::new(0.15, 0.05));
        assert!(!id.unwrap().warp);
        assert!((texel.tangent - Vec3::new(0.4f32.cos(), -0.4f32.sin(), 0.0)).length() < 1e-4);

        let kinran = Fabric::preset("kinran", SPACE).unwrap();
        let cloth = Cloth::weave(&kinran, [200, 346], kinran.repeat(), Irregularity::NONE, 0);
        let strips = cloth.btf.texels.iter().zip(&cloth.threads);
        let strips: Vec<&Texel> =
            strips.filter(|(_, id)| id.is_some_and(|i| i.yarn == 3)).map(|(t, _)| t).collect();
        // Level and along the weft but where they dive behind the cloth at the border of the figure.
        let level = strips.iter().filter(|t| t.normal.z > 0.999 && t.tangent.x > 0.999).count();
        assert!(level * 10 > strips.len() * 9, "{level} of {}", strips.len());
        // Gold, no ground, narrower across than along.
        let f0 = yugen_reflectance::metals::Metal::Gold.f0(SPACE);
        assert!(strips.iter().all(|t| t.diffuse == Vec3::ZERO && (t.specular - 0.9 * f0).length() < 1e-6));
        assert!(strips.iter().all(|t| t.sigma.y < t.sigma.x));
        // Two fifths of the face are gold; hardly anywhere does one see through.
        let share = strips.len() as f32 / cloth.threads.len() as f32;
        assert!((0.3..0.6).contains(&share), "{share}");
        let holes = cloth.threads.iter().filter(|id| id.is_none()).count();
        assert!(holes * 100 < cloth.threads.len(), "{holes} holes");
    }

    #[test]
    fn presets_hold_together() {
        for fabric in presets() {
            let n = fabric.weft.len();
            let ground: Vec<usize> = (0..n).filter(|p| !fabric.yarns[fabric.weft[*p].0].rides).collect();
            let woven = Weave::from_fn(fabric.warp.len(), ground.len(), |e, p| fabric.weave.up(e, ground[p]));
            assert_eq!(woven.loose(), [const { Vec::<usize>::new() }; 2], "{}", fabric.name);
            // Satin 5/2 floats over four, a 2/1 twill over two; every tie of a pattern weft is one.
            let [warp, weft] = woven.longest_floats();
            assert!(warp <= 4 && weft <= 4, "{}: {warp} {weft}", fabric.name);
            for p in (0..n).filter(|p| fabric.yarns[fabric.weft[*p].0].rides) {
                let ends = fabric.warp.len();
                let shows = (0..ends).filter(|e| !fabric.weave.up(*e, p)).count();
                let longest = Weave::from_fn(ends, 1, |e, _| fabric.weave.up(e, p)).longest_floats()[1];
                assert!(shows == 0 || longest <= 12, "{} pick {p} floats over {longest}", fabric.name);
            }
            assert_eq!(Weave::of(&fabric.draft()), fabric.weave);
        }
    }

    #[test]
    fn same_seed_same_cloth() {
        let fabric = Fabric::preset("karaori", SPACE).unwrap();
        let take =
            |seed| Cloth::weave(&fabric, [120, 90], Vec2::new(8.0, 6.0), Irregularity::default(), seed);
        let first = take(1);
        assert!(first == take(1) && first != take(2));
        // The rows of a loom looked at one by one.
        let loom = Loom::new(&fabric, Vec2::new(8.0, 6.0), Irregularity::default(), 1);
        let step = Vec2::new(8.0, 6.0) / Vec2::new(120.0, 90.0);
        for (i, texel) in first.btf.texels.iter().enumerate() {
            let at = Vec2::new((i % 120) as f32 + 0.5, (90 - i / 120) as f32 - 0.5) * step;
            assert_eq!(*texel, loom.look(at).0);
        }
    }
}
