//! The paintings: the old pine on the mirror board, in three panels, and bamboo on the side wall. Mineral colours on
//! planks of hinoki: malachite for needles and leaves, ochre and burnt earth for the trunk, shell white for lichen.

use crate::pattern::{Surface, Texel, fbm, lattice, noise, srgb};
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};
use yugen_optics::random::Pcg32;
use yugen_optics::special::smoothstep;

/// Texels of a panel: 3.3 mm each.
const ACROSS: usize = 512;
const DOWN: usize = 1024;
/// Width of the whole mirror board in units of the painting, three panels; its height is one panel's times this.
const WIDE: f32 = 5.2;
const HIGH: f32 = 3.4;

/// A canvas of metres, v down.
struct Canvas {
    /// Left edge and size, metres.
    left: f32,
    size: Vec2,
    texels: Vec<Texel>,
}

impl Canvas {
    /// Bare planks, laid lengthwise.
    fn planks(left: f32, size: Vec2, seed: u32) -> Self {
        let (early, late) = (srgb(0xc89a5e), srgb(0x9a6a38));
        let wood = Surface::bake(ACROSS, DOWN, size, |p| {
            let x = p.x + left;
            let plank = (p.y / 0.425).floor();
            let f = p.y / 0.425 - plank;
            let s = seed + plank as u32;
            let deep = 0.07 + 0.05 * (0.9 * x + 2.3 * plank).sin() + 0.012 * (2.7 * x + plank).sin();
            let across = (f - 0.5) * 0.425 + 0.05 * (plank * 1.7).sin();
            let r = Vec2::new(across, deep).length()
                + 0.004 * fbm(Vec2::new(1.5 * x + 64.0, across * 14.0 + 8.0), [256; 2], 3, s);
            let years = r / 0.0052 + noise(Vec2::new(r / 0.03, 0.5), [64; 2], s + 9);
            let g = years - years.floor();
            let late_wood = smoothstep(0.3, 0.9, g) * (1.0 - smoothstep(0.94, 1.0, g));
            let fibre = noise(Vec2::new(40.0 * x + 512.0, p.y / 0.004), [4096; 2], s + 3);
            let cloud = fbm(Vec2::new(1.2 * x + 32.0, 3.0 * p.y), [256; 2], 3, s + 5);
            let joint = smoothstep(0.0, 0.006, f.min(1.0 - f));
            let colour = (early + (late - early) * (0.55 * late_wood))
                * (1.0 + 0.06 * fibre + 0.1 * cloud)
                * (0.4 + 0.6 * joint);
            Texel {
                colour,
                roughness: 0.5 + 0.05 * cloud,
                metallic: 0.0,
                height: 3e-5 * late_wood + 4e-4 * joint,
            }
        });
        Self { left, size, texels: wood.texels }
    }

    /// Paints over every texel of a box whose coverage is not zero. `f` gets a place in metres; it gives colour and
    /// coverage.
    fn paint(&mut self, low: Vec2, high: Vec2, f: &dyn Fn(Vec2) -> Option<(Vec3, f32)>) {
        let scale = Vec2::new(ACROSS as f32, DOWN as f32) / self.size;
        let origin = Vec2::new(self.left, 0.0);
        let (a, b) = ((low - origin) * scale, (high - origin) * scale);
        let (x0, x1) = (a.x.max(0.0) as usize, b.x.ceil().clamp(0.0, ACROSS as f32) as usize);
        let (y0, y1) = (a.y.max(0.0) as usize, b.y.ceil().clamp(0.0, DOWN as f32) as usize);
        for y in y0..y1 {
            for x in x0..x1 {
                let p = origin + (Vec2::new(x as f32, y as f32) + 0.5) / scale;
                if let Some((colour, cover)) = f(p) {
                    let texel = &mut self.texels[y * ACROSS + x];
                    let c = cover.clamp(0.0, 1.0);
                    texel.colour += (colour - texel.colour) * c;
                    // Pigment in glue is matt, and stands out a little.
                    texel.roughness += (0.82 - texel.roughness) * c;
                    texel.height += 6e-5 * c;
                }
            }
        }
    }

    fn surface(self) -> Surface {
        Surface { width: ACROSS, height: DOWN, size: self.size, texels: self.texels }
    }
}

/// A stroke that tapers: a line of places and half widths.
struct Limb {
    line: Vec<(Vec2, f32)>,
}

impl Limb {
    /// Distance from the middle in half widths, how far along (metres), and the side.
    fn at(&self, p: Vec2) -> Option<(f32, f32, f32)> {
        let mut best: Option<(f32, f32, f32)> = None;
        let mut along = 0.0;
        for pair in self.line.windows(2) {
            let ((a, ra), (b, rb)) = (pair[0], pair[1]);
            let ab = b - a;
            let length = ab.length();
            let t = ((p - a).dot(ab) / ab.length_squared().max(1e-12)).clamp(0.0, 1.0);
            let d = (p - a - ab * t) / (ra + (rb - ra) * t).max(1e-4);
            let r = d.length();
            if r < 1.4 && best.is_none_or(|b| r < b.0) {
                best = Some((r, along + t * length, ab.perp_dot(p - a).signum() * r));
            }
            along += length;
        }
        best
    }

    fn bounds(&self) -> (Vec2, Vec2) {
        let all = self.line.iter();
        all.fold((Vec2::MAX, Vec2::MIN), |(low, high), (p, r)| {
            (low.min(*p - 1.4 * r), high.max(*p + 1.4 * r))
        })
    }
}

/// A smooth line through points (Catmull and Rom 1974).
fn curve(points: &[(f32, f32)], r0: f32, r1: f32) -> Limb {
    let p: Vec<Vec2> = points.iter().map(|(x, y)| Vec2::new(*x, *y)).collect();
    let n = p.len();
    let steps = 14;
    let total = ((n - 1) * steps) as f32;
    let mut line = Vec::new();
    for i in 0..n - 1 {
        let (a, b, c, d) = (p[i.saturating_sub(1)], p[i], p[i + 1], p[(i + 2).min(n - 1)]);
        for k in 0..=steps {
            if k == steps && i + 2 < n {
                continue;
            }
            let t = k as f32 / steps as f32;
            let q = 0.5
                * (2.0 * b
                    + (c - a) * t
                    + (2.0 * a - 5.0 * b + 4.0 * c - d) * t * t
                    + (3.0 * b - a - 3.0 * c + d) * t * t * t);
            let s = (i * steps + k) as f32 / total;
            line.push((q, r0 + (r1 - r0) * s.powf(0.8)));
        }
    }
    Limb { line }
}

/// The pine: trunk and boughs, then clouds of needles, all in metres from the board's upper left corner.
struct Pine {
    limbs: Vec<Limb>,
    /// Middle, half width and height of a cloud, and whether it hangs behind the trunk.
    clouds: Vec<(Vec2, Vec2, bool)>,
}

fn design() -> Pine {
    // An old tree: it rises left of the middle, bends to the right and back, and lays its boughs out to both sides.
    let trunk = curve(
        &[
            (2.12, 3.6),
            (2.2, 3.15),
            (2.42, 2.78),
            (2.78, 2.5),
            (2.93, 2.2),
            (2.74, 1.92),
            (2.42, 1.72),
            (2.32, 1.42),
            (2.52, 1.12),
            (2.84, 0.92),
            (2.94, 0.66),
            (2.82, 0.42),
        ],
        0.33,
        0.06,
    );
    let boughs = [
        curve(
            &[(2.45, 2.8), (2.1, 2.66), (1.72, 2.74), (1.32, 2.62), (0.9, 2.74), (0.45, 2.66)],
            0.125,
            0.03,
        ),
        curve(
            &[(2.9, 2.32), (3.25, 2.2), (3.55, 2.34), (3.95, 2.22), (4.35, 2.36), (4.85, 2.24)],
            0.135,
            0.03,
        ),
        curve(
            &[(2.42, 1.72), (2.08, 1.66), (1.78, 1.8), (1.35, 1.66), (0.95, 1.76), (0.5, 1.66)],
            0.115,
            0.028,
        ),
        curve(&[(2.4, 1.3), (2.8, 1.42), (3.25, 1.34), (3.65, 1.46), (4.1, 1.34), (4.6, 1.42)], 0.1, 0.026),
        curve(&[(2.45, 1.18), (2.1, 1.0), (1.7, 1.06), (1.3, 0.92), (0.95, 0.98)], 0.08, 0.024),
        curve(&[(2.84, 0.9), (3.2, 0.78), (3.55, 0.84), (3.95, 0.72), (4.3, 0.8)], 0.07, 0.02),
        curve(&[(2.9, 0.62), (2.55, 0.5), (2.2, 0.54)], 0.05, 0.02),
        curve(&[(1.72, 2.74), (1.58, 2.46), (1.25, 2.3), (1.0, 2.32)], 0.06, 0.02),
        curve(&[(3.55, 2.34), (3.8, 2.6), (4.2, 2.74), (4.55, 2.7)], 0.065, 0.022),
        curve(&[(3.25, 1.34), (3.45, 1.62), (3.75, 1.74)], 0.05, 0.018),
        curve(&[(1.35, 1.66), (1.2, 1.44), (0.9, 1.36)], 0.045, 0.018),
    ];
    let cloud = |x: f32, y: f32, w: f32, h: f32, behind: bool| (Vec2::new(x, y), Vec2::new(w, h), behind);
    let clouds = vec![
        cloud(2.86, 0.36, 0.66, 0.26, true),
        cloud(2.12, 0.50, 0.40, 0.20, false),
        cloud(3.55, 0.72, 0.42, 0.20, true),
        cloud(4.22, 0.74, 0.56, 0.25, false),
        cloud(1.72, 0.98, 0.36, 0.18, true),
        cloud(1.02, 0.92, 0.60, 0.26, false),
        cloud(3.32, 1.26, 0.34, 0.17, true),
        cloud(4.00, 1.30, 0.42, 0.20, false),
        cloud(4.70, 1.36, 0.44, 0.24, false),
        cloud(3.78, 1.74, 0.36, 0.17, false),
        cloud(0.82, 1.36, 0.38, 0.18, false),
        cloud(1.62, 1.68, 0.36, 0.18, true),
        cloud(0.52, 1.66, 0.44, 0.24, false),
        cloud(1.12, 1.76, 0.34, 0.17, false),
        cloud(0.98, 2.28, 0.50, 0.23, false),
        cloud(3.92, 2.16, 0.46, 0.22, true),
        cloud(4.78, 2.20, 0.40, 0.24, false),
        cloud(3.35, 2.18, 0.30, 0.16, true),
        cloud(4.46, 2.72, 0.50, 0.23, false),
        cloud(0.46, 2.66, 0.44, 0.25, false),
        cloud(1.16, 2.68, 0.44, 0.21, false),
        cloud(1.78, 2.70, 0.32, 0.17, true),
    ];
    Pine { limbs: std::iter::once(trunk).chain(boughs).collect(), clouds }
}

/// The third `panel` of the old pine.
pub fn pine(panel: usize) -> Surface {
    let size = Vec2::new(WIDE / 3.0, HIGH);
    let mut canvas = Canvas::planks(panel as f32 * size.x, size, 301);
    let design = design();
    for (i, cloud) in design.clouds.iter().enumerate().filter(|(_, c)| c.2) {
        needles(&mut canvas, cloud.0, cloud.1, 401 + i as u32);
    }
    // Boughs lie behind the trunk.
    for (i, limb) in design.limbs.iter().enumerate().rev() {
        trunk(&mut canvas, limb, 501 + i as u32);
    }
    for (i, cloud) in design.clouds.iter().enumerate().filter(|(_, c)| !c.2) {
        needles(&mut canvas, cloud.0, cloud.1, 401 + i as u32);
    }
    canvas.surface()
}

/// A limb with its plates of bark, outlined, with spots of lichen.
fn trunk(canvas: &mut Canvas, limb: &Limb, seed: u32) {
    let (base, dark, light, line) = (srgb(0x6e4a31), srgb(0x3c281c), srgb(0x9a7450), srgb(0x1d1512));
    let lichen = srgb(0x7fa58a);
    let girth = limb.line[0].1;
    let (low, high) = limb.bounds();
    canvas.paint(low, high, &|p| {
        let (r, along, side) = limb.at(p)?;
        let ragged = 0.08 * noise(p * 26.0 + 64.0, [8192; 2], seed)
            + 0.05 * noise(p * 9.0 + 64.0, [8192; 2], seed + 1);
        let edge = r + ragged;
        if edge > 1.0 {
            return None;
        }
        // Scales as painters draw them: rows of ovals that overlap.
        let size = 0.3 * girth + 0.02;
        let row = along / (0.62 * size);
        let column = 1.35 * side / (size / girth) * 0.42 + 0.5 * row.floor().rem_euclid(2.0);
        let cell = Vec2::new(row - row.floor() - 0.5, column - column.floor() - 0.5);
        let oval =
            (cell * Vec2::new(1.0, 0.95)).length() + 0.12 * noise(p * 40.0 + 64.0, [8192; 2], seed + 2);
        let tone = lattice(row.floor() as i32, column.floor() as i32, seed + 3);
        // Round: light from the upper left.
        let round = 0.5 - 0.5 * side * 0.85;
        let mut colour = dark + (base - dark) * round + (light - base) * smoothstep(0.55, 0.95, round) * 0.6;
        colour *= 0.85 + 0.3 * tone;
        colour +=
            (line - colour) * (smoothstep(0.40, 0.47, oval) * (1.0 - smoothstep(0.47, 0.53, oval)) * 0.75);
        let spot = fbm(p * 13.0 + 64.0, [8192; 2], 3, seed + 4);
        colour += (lichen - colour) * (smoothstep(0.34, 0.48, spot) * 0.55);
        colour += (line - colour) * (smoothstep(0.86, 0.93, edge) * 0.85);
        Some((colour, smoothstep(1.0, 0.975, edge)))
    });
}

/// A cloud of needles: fans in rows, the upper ones behind. Each fan is most of a disc whose needles spread from the
/// middle of its lower edge.
fn needles(canvas: &mut Canvas, middle: Vec2, half: Vec2, seed: u32) {
    let mut rng = Pcg32::new(u64::from(seed), 17);
    let size = 0.15;
    let mut fans: Vec<(Vec2, f32)> = Vec::new();
    let rows = ((2.0 * half.y) / (0.62 * size)).round().max(2.0) as usize;
    for row in 0..rows {
        // From the top down.
        let y = (row as f32 + 0.5) / rows as f32 * 2.0 - 1.0;
        // Flat below, round above.
        let wide = half.x * (1.0 - if y < 0.0 { y * y } else { 0.35 * y * y }).max(0.0).sqrt();
        let count = (2.0 * wide / (0.95 * size)).round().max(1.0) as usize;
        for i in 0..count {
            let x =
                if count == 1 { 0.0 } else { (i as f32 + 0.5 * (row % 2) as f32) / count as f32 * 2.0 - 1.0 };
            let jitter = Vec2::new(rng.next_f32() - 0.5, rng.next_f32() - 0.5) * 0.35 * size;
            fans.push((
                middle + Vec2::new(x * wide, y * half.y) + jitter,
                size * (0.85 + 0.3 * rng.next_f32()),
            ));
        }
    }
    // A ground of dark green that holds the fans together.
    let (deep, green, pale, line) = (srgb(0x1c3b30), srgb(0x2f6b50), srgb(0x7fae86), srgb(0x10231d));
    for (k, (at, r)) in fans.into_iter().enumerate() {
        let foot = at + Vec2::new(0.0, 0.55 * r);
        let key = seed * 1000 + k as u32;
        let tone = lattice(k as i32, 5, seed);
        let reach = 1.25 * r;
        canvas.paint(foot - Vec2::splat(reach), foot + Vec2::new(reach, 0.45 * r), &|p| {
            let d = p - foot;
            // Upwards is 0, to both sides ±.
            let angle = d.x.atan2(-d.y);
            let spread = 1.95;
            if angle.abs() > spread {
                return None;
            }
            let needle = (angle + PI) / TAU * 58.0;
            let (i, f) = (needle.floor(), needle - needle.floor());
            let long = r * (0.96 + 0.2 * lattice(i as i32, 1, key)) * (1.0 - 0.22 * (angle / spread).powi(4));
            let t = d.length() / long;
            if t > 1.0 {
                return None;
            }
            // Tips are points: gaps open between them.
            let gap = (f - 0.5).abs() * 2.0;
            if t > 0.78 && gap > (1.0 - t) / 0.22 {
                return None;
            }
            let mut colour = deep + (green - deep) * smoothstep(0.1, 0.75, t);
            colour += (pale - colour)
                * (smoothstep(0.5, 1.0, t) * (0.25 + 0.5 * tone) * (1.0 - smoothstep(0.25, 0.7, gap)));
            colour += (line - colour) * (smoothstep(0.62, 0.98, gap) * smoothstep(0.25, 0.6, t) * 0.75);
            Some((colour * (0.85 + 0.3 * lattice(i as i32, 2, key)), 1.0))
        });
    }
}

/// Bamboo on the side wall.
pub fn bamboo() -> Surface {
    let size = Vec2::new(2.45, HIGH);
    let mut canvas = Canvas::planks(0.0, size, 351);
    let (stem, shade, line) = (srgb(0x5f8f62), srgb(0x2c5740), srgb(0x14261d));
    let culms = [(1.02, 1.12, 0.052), (1.42, 1.28, 0.045), (1.98, 1.9, 0.05), (2.2, 2.34, 0.036)];
    let mut rng = Pcg32::new(77, 5);
    for (k, (x0, x1, r)) in culms.into_iter().enumerate() {
        let limb = curve(&[(x0, 3.6), (0.5 * (x0 + x1) - 0.03, 1.9), (x1, -0.2)], r, 0.85 * r);
        let (low, high) = limb.bounds();
        canvas.paint(low, high, &|p| {
            let (d, along, side) = limb.at(p)?;
            let joint = along / (0.40 + 0.03 * k as f32) + 0.3 * k as f32;
            let f = (joint - joint.floor()).min(joint.ceil() - joint) * 0.4;
            let swell = 1.0 + 0.16 * smoothstep(0.02, 0.0, f);
            if d > swell {
                return None;
            }
            let mut colour = stem + (shade - stem) * smoothstep(-0.2, 0.9, side);
            colour *= 0.9 + 0.2 * noise(Vec2::new(3.0 * along + 64.0, 14.0 * side + 64.0), [4096; 2], 611);
            colour += (srgb(0xd8dcc0) - colour) * (smoothstep(0.014, 0.006, f) * 0.6);
            colour += (line - colour)
                * (smoothstep(0.004, 0.002, f) * 0.9).max(smoothstep(0.88, 0.97, d / swell) * 0.7);
            Some((colour, 1.0))
        });
        // Leaves in groups of three to five, hanging.
        for _ in 0..16 {
            let t = 0.05 + 0.62 * rng.next_f32();
            let at = Vec2::new(x1 + (x0 - x1) * t, 3.4 * t) + Vec2::new((rng.next_f32() - 0.5) * 0.5, 0.0);
            let count = 3 + (3.0 * rng.next_f32()) as usize;
            for i in 0..count {
                let angle = (i as f32 - 0.5 * (count - 1) as f32) * 0.55 + 0.3 * (rng.next_f32() - 0.5);
                let way = Vec2::new(angle.sin(), angle.cos());
                let long = 0.2 + 0.1 * rng.next_f32();
                let tone = rng.next_f32();
                let (low, high) = (at.min(at + way * long) - 0.03, at.max(at + way * long) + 0.03);
                canvas.paint(low, high, &|p| {
                    let d = p - at;
                    let t = d.dot(way) / long;
                    if !(0.0..=1.0).contains(&t) {
                        return None;
                    }
                    let half = 0.021 * (t * 3.2).min(1.0) * (1.0 - t).powf(0.75);
                    let off = way.perp_dot(d);
                    if off.abs() > half {
                        return None;
                    }
                    let mut colour =
                        srgb(0x2d6a4c) * (0.75 + 0.6 * tone) * (1.0 - 0.2 * (off > 0.0) as u32 as f32);
                    colour += (line - colour)
                        * (smoothstep(0.75, 1.0, off.abs() / half) * 0.6)
                            .max(smoothstep(0.0016, 0.0, off.abs()) * 0.5);
                    Some((colour, 1.0))
                });
            }
        }
    }
    canvas.surface()
}
