//! Finds a stroke of a brush on light paper in a photograph, and straightens it.
//!
//! Density is how much darker a pixel is than the paper around, which may be lit unevenly; a threshold (Otsu 1979) separates ink from
//! paper, and of what is joined the heaviest is the stroke. It is sampled across its middle line from the end that has more ink.

use super::coverage;
use crate::InkError;
use glam::{Mat2, Vec2, vec2};
use yugen_optics::Image;
use yugen_optics::colour::srgb_to_linear;

/// Most pixels of a side that are looked at; larger photographs are averaged down.
const MOST: usize = 1600;
/// Least pixels of a side.
const LEAST: usize = 64;
/// Blocks of the photograph across and down in which the paper is looked for.
const BLOCKS: usize = 8;
/// Least difference of density between ink and paper: ink that reflects seven tenths of what paper does.
const FAINT: f32 = 0.35;
/// Gap that is bridged, of the longer side: what flying white leaves between.
const BRIDGE: f32 = 0.015;
/// Least length over width.
const LONG: f32 = 3.0;
/// Rows of the straightened picture, and most columns.
const ROWS: usize = 128;
const COLUMNS: usize = 4096;
/// Width of the smoothing of the middle line, in half widths of the stroke.
const SMOOTH: f32 = 1.5;
/// Coverage below which a place in a stroke is white.
const WHITE: f32 = 0.3;
/// The part of strokes of ours that a photograph shows white, and the control `dryness` that they were painted with; painted and
/// photographed (tests/photograph.rs). Up to about .4 nothing is white: what has no white is taken for the middle of that.
const DRY: &[[f32; 2]] =
    &[[0.0, 0.2], [0.0022, 0.45], [0.0157, 0.6], [0.0309, 0.75], [0.0622, 0.9], [0.0975, 1.0]];
/// Raggedness of their edges, in half widths, and the control `roughness`; likewise. Of strokes that are wet all along, and of the first
/// third alone, where a brush is set down.
const ROUGH: &[[f32; 2]] = &[[0.0124, 0.0], [0.0154, 0.25], [0.0194, 0.5], [0.0237, 0.75], [0.0282, 1.0]];
const ROUGH_FIRST: &[[f32; 2]] =
    &[[0.0168, 0.0], [0.0195, 0.25], [0.0232, 0.5], [0.0271, 0.75], [0.0311, 1.0]];
/// The part of a third of a stroke up to which bristles that run dry do not fray its edges, and that above which edges say nothing.
const WET: [f32; 2] = [0.01, 0.05];

/// A stroke that was found.
#[derive(Clone, Debug)]
pub struct Found {
    /// The straight stroke: R, G, B, linear, ink dark on white.
    pub strip: Image,
    /// How long it is between its round ends, pixels of the photograph.
    pub length: f32,
    /// Half of its width, pixels of the photograph.
    pub half_width: f32,
    /// The part of it that is white, in its first, second and last third.
    pub white: [f32; 3],
    /// How far its edges stray from a smooth line where it is wet, half widths, root mean square.
    pub ragged: f32,
    /// The control `dryness` of strokes of ours that have as much white; 1 where none has.
    pub dryness: f32,
    /// The control `roughness` of strokes of ours whose edges are as ragged; where it is dry all along its edges do not say.
    pub roughness: Option<f32>,
}

impl Found {
    /// The part of all of it that is white.
    pub fn all_white(&self) -> f32 {
        self.white.iter().sum::<f32>() / 3.0
    }
}

/// Something by pixel.
struct Field {
    size: [usize; 2],
    values: Vec<f32>,
}

impl Field {
    fn at(&self, p: Vec2) -> f32 {
        let [w, h] = self.size;
        let p = (p - 0.5).clamp(Vec2::ZERO, vec2(w as f32 - 1.0, h as f32 - 1.0));
        let (x, y) = (p.x as usize, p.y as usize);
        let (u, v) = (p.x.fract(), p.y.fract());
        let get = |x: usize, y: usize| self.values[y.min(h - 1) * w + x.min(w - 1)];
        let row = |y| get(x, y) * (1.0 - u) + get(x + 1, y) * u;
        row(y) * (1.0 - v) + row(y + 1) * v
    }
}

/// The stroke in a photograph with channels R, G and B (or Y), linear.
pub fn find(photograph: &Image) -> Result<Found, InkError> {
    let wrong = |what: &str| InkError::Preset(what.into());
    let (density, step) = density(photograph)
        .ok_or_else(|| wrong("the photograph has no colours, or less than 64 pixels a side"))?;
    let limit = threshold(&density.values).ok_or_else(|| {
        wrong("no stroke was found: nothing in the photograph is much darker than the paper")
    })?;
    let dark: Vec<bool> = density.values.iter().map(|d| *d > limit).collect();
    let stroke = heaviest(&density, &dark)?;
    let (mut path, half) = middle(&density, &dark, &stroke)?;
    let length: f32 = path.windows(2).map(|w| w[0].distance(w[1])).sum();
    // Both ends are round: what is between them counts.
    let strip = |path: &[Vec2]| straighten(&density, path, half);
    let (mut ink, mut columns) = strip(&path);
    let mass = |from: usize, to: usize| -> f32 {
        (0..ROWS).map(|y| ink[y * columns + from..y * columns + to].iter().sum::<f32>()).sum()
    };
    if mass(columns / 2, columns) > mass(0, columns / 2) {
        path.reverse();
        (ink, columns) = strip(&path);
    }
    // As dark as it is where it is wet.
    let mut sorted: Vec<f32> = ink.iter().copied().filter(|d| *d > limit).collect();
    if sorted.len() < ROWS {
        return Err(wrong("no stroke was found: what is dark in the photograph is too thin"));
    }
    let rank = sorted.len() * 95 / 100;
    let wet = *sorted.select_nth_unstable_by(rank, f32::total_cmp).1;
    let mut image = Image::rgb(columns, ROWS);
    for (pixel, d) in image.data.chunks_exact_mut(3).zip(&ink) {
        pixel.fill(srgb_to_linear(1.0 - (d / wet).clamp(0.0, 1.0)));
    }
    let cover = coverage(&image).ok_or_else(|| wrong("no stroke was found: all of it is equally dark"))?;
    let third = |k: usize| [k * columns / 3, (k + 1) * columns / 3];
    let white = [0, 1, 2].map(|k| white(&cover, columns, third(k)));
    // Where bristles run dry they fray its edges too, however smooth the brush is.
    let least = white.iter().copied().fold(1.0, f32::min);
    let wet: Vec<usize> = (0..3).filter(|k| white[*k] <= least.max(WET[0])).collect();
    let ragged = ragged(&cover, columns, wet.iter().map(|k| third(*k)));
    // Between both tables for two of the thirds.
    let [all, first] = [ROUGH, ROUGH_FIRST].map(|table| looked_up(table, ragged));
    let roughness = (least <= WET[1]).then(|| first + (all - first) * (wet.len() as f32 - 1.0) / 2.0);
    let [length, half_width] = [length, half].map(|v| v * step as f32);
    let mut found = Found { strip: image, length, half_width, white, ragged, dryness: 0.0, roughness };
    found.dryness = looked_up(DRY, found.all_white());
    Ok(found)
}

/// How much darker each pixel is than the paper around, as a difference of logarithms; where it is large, of so many pixels a side
/// together.
fn density(photograph: &Image) -> Option<(Field, usize)> {
    let rgb = photograph.select(&["R", "G", "B"]).or_else(|| photograph.select(&["Y"]))?;
    let n = rgb.channels.len();
    if rgb.width.min(rgb.height) < LEAST {
        return None;
    }
    let step = rgb.width.max(rgb.height).div_ceil(MOST).min(rgb.width.min(rgb.height) / LEAST);
    let (w, h) = (rgb.width / step, rgb.height / step);
    let mut light = vec![0.0f32; w * h];
    for (i, to) in light.iter_mut().enumerate() {
        let (x, y) = (i % w * step, i / w * step);
        let sum: f32 = (y..y + step)
            .flat_map(|y| (x..x + step).map(move |x| [x, y]))
            .map(|[x, y]| {
                rgb.pixel(x, y).iter().map(|v| if v.is_finite() { v.max(0.0) } else { 0.0 }).sum::<f32>()
            })
            .sum();
        *to = (sum / (n * step * step) as f32 + 1e-4).ln();
    }
    // The lighter part of each block, and of those around it the lightest: a stroke fills no nine of them.
    let block = |k: usize, n: usize| k * n / BLOCKS..(k + 1) * n / BLOCKS;
    let light_of = |bx: usize, by: usize| {
        let mut all: Vec<f32> = block(by, h).flat_map(|y| light[y * w..][block(bx, w)].to_vec()).collect();
        let rank = all.len() * 4 / 5;
        *all.select_nth_unstable_by(rank, f32::total_cmp).1
    };
    let own: Vec<f32> = (0..BLOCKS * BLOCKS).map(|i| light_of(i % BLOCKS, i / BLOCKS)).collect();
    let around = |i: usize| {
        let (x, y) = (i % BLOCKS, i / BLOCKS);
        let near = |v: usize| v.saturating_sub(1)..(v + 2).min(BLOCKS);
        near(y).flat_map(|y| near(x).map(move |x| y * BLOCKS + x)).map(|i| own[i]).fold(f32::MIN, f32::max)
    };
    let paper = Field { size: [BLOCKS; 2], values: (0..BLOCKS * BLOCKS).map(around).collect() };
    let scale = vec2(BLOCKS as f32 / w as f32, BLOCKS as f32 / h as f32);
    let values = light
        .iter()
        .enumerate()
        .map(|(i, l)| {
            (paper.at(vec2((i % w) as f32 + 0.5, (i / w) as f32 + 0.5) * scale) - l).clamp(0.0, 4.0)
        })
        .collect();
    Some((Field { size: [w, h], values }, step))
}

/// Otsu's threshold; `None` where what it separates is too alike.
fn threshold(values: &[f32]) -> Option<f32> {
    const BINS: usize = 256;
    let of = |v: f32| ((v / 4.0 * BINS as f32) as usize).min(BINS - 1);
    let mut counts = [0.0f64; BINS];
    values.iter().for_each(|v| counts[of(*v)] += 1.0);
    let at = |i: usize| (i as f64 + 0.5) * 4.0 / BINS as f64;
    let (all, sum) = (values.len() as f64, (0..BINS).map(|i| counts[i] * at(i)).sum::<f64>());
    let (mut below, mut sum_below) = (0.0, 0.0);
    let mut best = (0.0, 0.0, 0.0);
    for (i, count) in counts.iter().enumerate().take(BINS - 1) {
        below += count;
        sum_below += count * at(i);
        if below == 0.0 || below == all {
            continue;
        }
        let apart = (sum - sum_below) / (all - below) - sum_below / below;
        let between = below * (all - below) * apart * apart;
        if between > best.0 {
            best = (between, at(i) + 2.0 / BINS as f64, apart);
        }
    }
    (best.2 > f64::from(FAINT)).then_some(best.1 as f32)
}

/// The pixels of the heaviest of what is joined, a gap being bridged.
fn heaviest(density: &Field, dark: &[bool]) -> Result<Vec<usize>, InkError> {
    let [w, h] = density.size;
    let reach = ((BRIDGE * w.max(h) as f32) as usize).max(1);
    let near = |v: usize, n: usize| v.saturating_sub(reach)..(v + reach + 1).min(n);
    let across: Vec<bool> = (0..w * h).map(|i| near(i % w, w).any(|x| dark[i / w * w + x])).collect();
    let joined: Vec<bool> = (0..w * h).map(|i| near(i / w, h).any(|y| across[y * w + i % w])).collect();
    let mut seen = vec![false; w * h];
    let mut all: Vec<(f32, Vec<usize>)> = Vec::new();
    for start in 0..w * h {
        if seen[start] || !joined[start] {
            continue;
        }
        let (mut open, mut own, mut mass) = (vec![start], Vec::new(), 0.0);
        seen[start] = true;
        while let Some(i) = open.pop() {
            if dark[i] {
                own.push(i);
                mass += density.values[i];
            }
            let (x, y) = (i % w, i / w);
            let sides = [
                (x > 0).then(|| i - 1),
                (x + 1 < w).then_some(i + 1),
                (y > 0).then(|| i - w),
                (y + 1 < h).then_some(i + w),
            ];
            for next in sides.into_iter().flatten().filter(|n| joined[*n]) {
                if !std::mem::replace(&mut seen[next], true) {
                    open.push(next);
                }
            }
        }
        all.push((mass, own));
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let wrong = |what: &str| Err(InkError::Preset(what.into()));
    let mut all = all.into_iter();
    let Some((mass, own)) = all.next() else { return wrong("no stroke was found in the photograph") };
    if all.next().is_some_and(|(other, _)| other > 0.5 * mass) {
        return wrong("there are several strokes in the photograph: crop it to the one that is meant");
    }
    let at_edge =
        own.iter().filter(|i| **i % w == 0 || **i % w == w - 1 || **i < w || **i >= w * (h - 1)).count();
    if at_edge > 2 {
        return wrong(
            "the stroke is cut off by the edge of the photograph, or its edge is dark: leave paper around it",
        );
    }
    Ok(own)
}

/// The middle line of a stroke from one end to the other, a point a pixel, and half of its width.
fn middle(density: &Field, dark: &[bool], stroke: &[usize]) -> Result<(Vec<Vec2>, f32), InkError> {
    let [w, h] = density.size;
    let place = |i: usize| vec2((i % w) as f32 + 0.5, (i / w) as f32 + 0.5);
    let centre = stroke.iter().map(|i| place(*i)).sum::<Vec2>() / stroke.len() as f32;
    let (mut xx, mut xy, mut yy) = (0.0f32, 0.0f32, 0.0f32);
    for p in stroke.iter().map(|i| place(*i) - centre) {
        (xx, xy, yy) = (xx + p.x * p.x, xy + p.x * p.y, yy + p.y * p.y);
    }
    let axis = Vec2::from_angle(0.5 * (2.0 * xy).atan2(xx - yy));
    let along = stroke.iter().map(|i| (place(*i) - centre).dot(axis));
    let (from, to) = along.fold((f32::MAX, f32::MIN), |(a, b), v| (a.min(v), b.max(v)));
    let mut path: Vec<Vec2> = (from as i32..=to as i32).map(|k| centre + axis * k as f32).collect();
    let is_dark = |p: Vec2| {
        let inside = p.x >= 0.0 && p.y >= 0.0 && (p.x as usize) < w && (p.y as usize) < h;
        inside && dark[p.y as usize * w + p.x as usize]
    };
    let bend = Err(InkError::Preset(
        "the stroke is too short or too bent to be straightened: photograph one that is three times as long as wide and bends \
         less than a quarter circle"
            .into(),
    ));
    let mut half = 0.0;
    for turn in 0..3 {
        let n = path.len();
        if n < 16 {
            return bend;
        }
        let way = |i: usize| {
            let (a, b) = (i.saturating_sub(8), (i + 8).min(n - 1));
            (path[b] - path[a]).normalize_or(axis)
        };
        // How far the stroke reaches to both sides; the first time it may be anywhere, then it is near.
        let reach = if turn == 0 { 0.5 * (to - from) } else { 2.0 * half };
        let sides: Vec<Option<(f32, f32)>> = (0..n)
            .map(|i| {
                let across = way(i).perp();
                let hits = (-(reach as i32)..=reach as i32).filter(|k| is_dark(path[i] + across * *k as f32));
                let (first, last) = hits.fold((None, 0), |(first, _), k| (first.or(Some(k)), k));
                first.map(|first| (first as f32, last as f32))
            })
            .collect();
        let mut widths: Vec<f32> = sides.iter().flatten().map(|(a, b)| 0.5 * (b - a + 1.0)).collect();
        if widths.len() < n / 2 {
            return bend;
        }
        let rank = widths.len() * 9 / 10;
        half = *widths.select_nth_unstable_by(rank, f32::total_cmp).1;
        let sigma = SMOOTH * half;
        // What is wide says more of the middle than what a bristle or two have left at the dry end.
        let smooth = |i: usize| {
            let most = (2.5 * sigma) as usize;
            let (mut sum, mut weights) = (0.0, 1e-6);
            for (k, side) in sides.iter().enumerate().take(i + most + 1).skip(i.saturating_sub(most)) {
                let Some((a, b)) = side else { continue };
                let weight = (-0.5 * ((k as f32 - i as f32) / sigma).powi(2)).exp() * (b - a + 1.0);
                (sum, weights) = (sum + weight * 0.5 * (a + b), weights + weight);
            }
            sum / weights
        };
        let moved: Vec<Vec2> = (0..n).map(|i| path[i] + way(i).perp() * smooth(i)).collect();
        path = evenly(&moved);
    }
    // Less at both ends by what is round of them.
    let cut = (0.6 * half) as usize;
    if path.len() < 2 * cut + 16 || (path.len() as f32) < LONG * 2.0 * half {
        return bend;
    }
    let path: Vec<Vec2> = path[cut..path.len() - cut].to_vec();
    let turned = path.windows(9).map(|w| (w[8] - w[0]).normalize_or(axis).dot(axis)).fold(1.0f32, f32::min);
    if turned < 0.0 { bend } else { Ok((path, half)) }
}

/// A point a pixel along a line.
fn evenly(line: &[Vec2]) -> Vec<Vec2> {
    let mut out = vec![line[0]];
    let mut left = 1.0;
    for pair in line.windows(2) {
        let length = pair[0].distance(pair[1]);
        let mut at = left;
        while at <= length {
            out.push(pair[0].lerp(pair[1], at / length));
            at += 1.0;
        }
        left = at - length;
    }
    out
}

/// Densities row after row across and along a line, and how many columns they have.
fn straighten(density: &Field, path: &[Vec2], half: f32) -> (Vec<f32>, usize) {
    let n = path.len();
    let columns = ((ROWS as f32 * n as f32 / (2.0 * half)) as usize).clamp(ROWS, COLUMNS);
    let mut out = vec![0.0; columns * ROWS];
    for x in 0..columns {
        let t = (x as f32 + 0.5) / columns as f32 * (n - 1) as f32;
        let (i, u) = ((t as usize).min(n - 2), t - (t as usize).min(n - 2) as f32);
        let at = path[i].lerp(path[i + 1], u);
        let (a, b) = (i.saturating_sub(6), (i + 7).min(n - 1));
        let way = (path[b] - path[a]).normalize_or(Vec2::X);
        let frame = Mat2::from_cols(way, way.perp());
        for y in 0..ROWS {
            let across = ((y as f32 + 0.5) / ROWS as f32 * 2.0 - 1.0) * half;
            out[y * columns + x] = density.at(at + frame * vec2(0.0, across));
        }
    }
    (out, columns)
}

/// First and last row that has ink in a column.
fn edges(cover: &[f32], columns: usize, x: usize) -> Option<[usize; 2]> {
    let inked = |y: &usize| cover[y * columns + x] > 0.5;
    let first = (0..ROWS).find(inked)?;
    Some([first, (0..ROWS).rev().find(inked)?])
}

/// The part of a stretch of the stroke that is white between its edges.
fn white(cover: &[f32], columns: usize, [from, to]: [usize; 2]) -> f32 {
    let (mut blank, mut all) = (0usize, 0usize);
    for x in from..to {
        let Some([first, last]) = edges(cover, columns, x) else {
            (blank, all) = (blank + ROWS, all + ROWS);
            continue;
        };
        blank += (first..=last).filter(|y| cover[y * columns + x] < WHITE).count();
        all += last + 1 - first;
    }
    blank as f32 / all.max(1) as f32
}

/// How far the edges of stretches stray from a smooth line, in half widths, root mean square.
fn ragged(cover: &[f32], columns: usize, stretches: impl Iterator<Item = [usize; 2]>) -> f32 {
    let all: Vec<Option<[usize; 2]>> = (0..columns).map(|x| edges(cover, columns, x)).collect();
    let reach = ROWS / 2;
    let (mut sum, mut count) = (0.0f64, 0usize);
    for x in stretches.flat_map(|[from, to]| from.max(reach)..to.min(columns.saturating_sub(reach))) {
        let Some(own) = all[x] else { continue };
        for side in [0, 1] {
            let near: Vec<f32> =
                all[x - reach..=x + reach].iter().flatten().map(|e| e[side] as f32).collect();
            let mean = near.iter().sum::<f32>() / near.len().max(1) as f32;
            sum += f64::from((own[side] as f32 - mean) / (0.5 * ROWS as f32)).powi(2);
            count += 1;
        }
    }
    (sum / count.max(1) as f64).sqrt() as f32
}

/// The second column of a table by the first, which grows, straight between its rows; beyond them as at its ends.
fn looked_up(table: &[[f32; 2]], v: f32) -> f32 {
    let [first, last] = [table[0], table[table.len() - 1]];
    let between = table.windows(2).find(|w| v < w[1][0]);
    let mix = |w: &[[f32; 2]]| w[0][1] + (w[1][1] - w[0][1]) * (v - w[0][0]) / (w[1][0] - w[0][0]);
    between.map_or(last[1], mix).max(first[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_motion::noise::noise;
    use yugen_optics::random::Pcg32;

    /// Half the length of the strokes below.
    const REACH: f32 = 230.0;

    /// A photograph of a stroke, made up: bent and turned, on paper that is lit from one side, with the noise of a sensor; `dry`: what
    /// of it is white at its end; drawn from right to left.
    fn photograph(dry: f32, turn: f32, bend: f32, rough: f32) -> Image {
        let (w, h) = (900, 600);
        let mut random = Pcg32::new(5, 1);
        let mut image = Image::rgb(w, h);
        let (half, reach) = (34.0, REACH);
        for (i, pixel) in image.data.chunks_exact_mut(3).enumerate() {
            let p = vec2((i % w) as f32 - 450.0, (i / w) as f32 - 300.0);
            let q = Vec2::from_angle(-turn).rotate(p);
            let (s, v) = (q.x, (q.y - bend * (q.x / reach).powi(2) * 60.0 + 0.5 * bend * 30.0) / half);
            let rim = 1.0 + rough * noise(glam::vec3(s / 9.0, v.signum() * 3.0, 0.2)).0;
            let inside = v.abs() < rim && s.abs() < reach;
            // The beginning is on the right.
            let late = 0.5 - 0.5 * s / reach;
            let bristle = 0.5 + 1.2 * noise(glam::vec3(s / 160.0, 9.0 * v, 3.3)).0;
            let inked = inside && (dry == 0.0 || bristle > 1.8 * dry * late);
            let paper = 0.75 - 0.25 * (i % w) as f32 / w as f32;
            let light = paper * if inked { 0.06 } else { 1.0 } * (1.0 + 0.04 * random.normal());
            pixel.copy_from_slice(&[light, 0.98 * light, 0.9 * light]);
        }
        image
    }

    #[test]
    fn a_stroke_is_found_wherever_it_lies_and_straightened() {
        for (turn, bend) in [(0.0, 0.0), (0.5, 1.0), (-1.2, 0.6), (3.0, -1.0), (1.57, 0.3)] {
            let found = find(&photograph(0.0, turn, bend, 0.0)).unwrap();
            assert!((found.half_width - 34.0).abs() < 2.0, "{turn} {bend}: {}", found.half_width);
            assert!((found.length - 2.0 * REACH + 41.0).abs() < 40.0, "{turn} {bend}: {}", found.length);
            // Straight: full in its middle, from end to end.
            let strip = &found.strip;
            let full = (0..strip.width).filter(|x| strip.pixel(*x, ROWS / 2)[0] < 0.2).count();
            let wide = (0..strip.width).filter(|x| strip.pixel(*x, 12)[0] < 0.3).count();
            assert!(
                full as f32 > 0.98 * strip.width as f32 && wide as f32 > 0.9 * strip.width as f32,
                "{turn} {bend}"
            );
            assert!(found.white.iter().all(|v| *v < 0.03), "{turn} {bend}: {:?}", found.white);
            let roughness = found.roughness.expect("it is wet");
            assert!(found.dryness < 0.7 && roughness < 0.35, "{} {roughness}", found.dryness);
            super::super::Bristles::new("found", strip).unwrap();
        }
    }

    #[test]
    fn the_dry_end_is_the_end_and_ragged_edges_are_rough() {
        let [wet, dry] = [0.1, 0.55].map(|d| find(&photograph(d, 0.4, 0.5, 0.0)).unwrap());
        assert!(dry.white[0] + 0.1 < dry.white[2], "{:?}", dry.white);
        assert!(dry.dryness >= wet.dryness && dry.dryness > 0.7, "{} {}", dry.dryness, wet.dryness);
        let [smooth, rough, rougher] =
            [0.0, 0.06, 0.12].map(|r| find(&photograph(0.0, 0.2, 0.0, r)).unwrap());
        println!("ragged {} {} {}", smooth.ragged, rough.ragged, rougher.ragged);
        assert!(smooth.ragged + 0.003 < rough.ragged && rough.ragged + 0.003 < rougher.ragged);
        assert!(smooth.roughness < Some(0.1) && rougher.roughness > Some(0.3), "{:?}", rougher.roughness);
    }

    #[test]
    fn tables_are_looked_up_between_their_rows() {
        let table = [[0.1, 0.2], [0.2, 0.4], [0.4, 1.0]];
        let all = [0.0, 0.1, 0.15, 0.3, 0.4, 9.0].map(|v| looked_up(&table, v));
        for (found, expected) in all.into_iter().zip([0.2, 0.2, 0.3, 0.7, 1.0, 1.0]) {
            assert!((found - expected).abs() < 1e-6, "{all:?}");
        }
        for table in [DRY, ROUGH, ROUGH_FIRST] {
            assert!(table.windows(2).all(|w| w[0][0] < w[1][0] && w[0][1] < w[1][1]));
        }
    }

    #[test]
    fn photographs_without_a_stroke_are_refused_in_a_sentence() {
        let said = |image: &Image| find(image).unwrap_err().to_string();
        let mut blank = Image::rgb(300, 200);
        let mut random = Pcg32::new(9, 9);
        blank.data.iter_mut().for_each(|v| *v = 0.6 * (1.0 + 0.05 * random.normal()));
        assert!(said(&blank).contains("nothing in the photograph is much darker"), "{}", said(&blank));
        let mut two = blank.clone();
        let fill = |image: &mut Image, x: std::ops::Range<usize>, y: std::ops::Range<usize>| {
            y.for_each(|y| x.clone().for_each(|x| image.pixel_mut(x, y).fill(0.03)));
        };
        fill(&mut two, 40..260, 40..60);
        fill(&mut two, 40..260, 130..150);
        assert!(said(&two).contains("several strokes"), "{}", said(&two));
        let mut cut = blank.clone();
        fill(&mut cut, 0..200, 90..110);
        assert!(said(&cut).contains("cut off"), "{}", said(&cut));
        let mut blot = blank.clone();
        fill(&mut blot, 120..160, 80..120);
        assert!(said(&blot).contains("too short"), "{}", said(&blot));
        assert!(said(&Image::rgb(20, 20)).contains("64 pixels"));
    }

    #[test]
    fn a_large_photograph_is_measured_in_its_own_pixels() {
        let small = photograph(0.0, 0.5, 1.0, 0.0);
        let (w, h) = (3 * small.width, 3 * small.height);
        let mut large = Image::rgb(w, h);
        for (i, pixel) in large.data.chunks_exact_mut(3).enumerate() {
            pixel.copy_from_slice(small.pixel(i % w / 3, i / w / 3));
        }
        let [small, large] = [&small, &large].map(|p| find(p).unwrap());
        // Every second pixel is looked at, so that ends and edges are found to a pixel or two.
        for (a, b) in [(small.length, large.length), (small.half_width, large.half_width)] {
            assert!((b / a - 3.0).abs() < 0.1, "{a} {b}");
        }
    }
}
