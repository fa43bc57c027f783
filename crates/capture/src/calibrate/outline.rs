//! The outline of a polished ball, also where the ball mirrors the table on which it lies.
//!
//! Seen from above, a mirror ball shows what stands above the table within sin 45° of its radius only; the ring around
//! that shows the table, ever denser toward the rim. On a lit table the strongest circle is therefore the inner border
//! of the ring, where the table ends, and the rim a faint step: the table's light times the ball's reflectance on one
//! side, the table's light on the other. Shadows and lamps move from picture to picture; the rim does not. So circles
//! are sought in the median of all pictures' gradients (of the logarithm, so that no picture counts for more), and from
//! a circle on outward for a fainter one around it.

use super::{Ball, View, mirror};
use glam::Vec2;
use std::f32::consts::TAU;

/// Pictures in which balls are looked for are this wide at most.
const OVERVIEW: usize = 400;
/// The smallest radius that is looked for, in pixels of that.
const SMALLEST: f32 = 6.0;
/// A ball's rim is at most this many times as large as the ring in which it mirrors the table: √2, and some for a near
/// camera.
const OUTWARD: f32 = 1.5;
/// A change of the logarithm a pixel that counts half as an edge: a chromium rim of two pixels' blur has six times as much.
const EDGE: f32 = 0.03;
/// The part of a circle that must show.
const SHOWN: f32 = 0.5;

/// What stays in place under all lights: the median of the gradients of the logarithms of pictures.
struct Field {
    width: usize,
    height: usize,
    gradient: Vec<Vec2>,
}

impl Field {
    fn new(pictures: &[Vec<f32>], width: usize, height: usize) -> Self {
        let logarithms: Vec<Vec<f32>> = pictures.iter().map(|p| logarithm(p)).collect();
        let mut gradient = vec![Vec2::ZERO; width * height];
        let (mut xs, mut ys) = (vec![0.0; pictures.len()], vec![0.0; pictures.len()]);
        for y in 1..height.saturating_sub(1) {
            for x in 1..width.saturating_sub(1) {
                for ((p, gx), gy) in logarithms.iter().zip(&mut xs).zip(&mut ys) {
                    let at = |dx: usize, dy: usize| p[(y + dy - 1) * width + x + dx - 1];
                    // Sobel and Feldman 1968.
                    *gx = (at(2, 0) + 2.0 * at(2, 1) + at(2, 2) - at(0, 0) - 2.0 * at(0, 1) - at(0, 2)) / 8.0;
                    *gy = (at(0, 2) + 2.0 * at(1, 2) + at(2, 2) - at(0, 0) - 2.0 * at(1, 0) - at(2, 0)) / 8.0;
                }
                gradient[y * width + x] = Vec2::new(middle(&mut xs), middle(&mut ys));
            }
        }
        Self { width, height, gradient }
    }

    /// Between pixels, linearly; nothing beyond the border.
    fn at(&self, pixel: Vec2) -> Option<Vec2> {
        let p = pixel - 0.5;
        if p.x.is_nan()
            || p.y.is_nan()
            || p.cmplt(Vec2::ONE).any()
            || p.x + 2.0 >= self.width as f32
            || p.y + 2.0 >= self.height as f32
        {
            return None;
        }
        let (x, y) = (p.x as usize, p.y as usize);
        let (fx, fy) = (p.x - x as f32, p.y - y as f32);
        let g = |dx: usize, dy: usize| self.gradient[(y + dy) * self.width + x + dx];
        Some(g(0, 0).lerp(g(1, 0), fx).lerp(g(0, 1).lerp(g(1, 1), fx), fy))
    }
}

/// Upper median.
fn middle(values: &mut [f32]) -> f32 {
    let half = values.len() / 2;
    *values.select_nth_unstable_by(half, f32::total_cmp).1
}

/// Of a picture and a little more, so that black stays finite: a fiftieth of what the brighter quarter has, or of
/// something brighter where that is black.
fn logarithm(picture: &[f32]) -> Vec<f32> {
    let mut known: Vec<f32> = picture.iter().copied().filter(|v| v.is_finite()).collect();
    let mut usual = 0.0;
    for share in [75, 95, 99, 100] {
        if usual <= 0.0 && !known.is_empty() {
            let nth = (known.len() * share / 100).min(known.len() - 1);
            usual = *known.select_nth_unstable_by(nth, f32::total_cmp).1;
        }
    }
    let floor = (0.02 * usual).max(1e-12);
    picture.iter().map(|v| if v.is_nan() { floor.ln() } else { (v.clamp(0.0, 1e30) + floor).ln() }).collect()
}

/// A circle that shows in the pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// Where.
    pub ball: Ball,
    /// The part of it that shows, 0 to 1.
    pub shown: f32,
    /// Whether it lies within the picture.
    pub whole: bool,
}

/// Pictures of one view, shrunk, in which to look for circles.
pub struct Overview {
    width: usize,
    height: usize,
    factor: usize,
    pictures: Vec<Vec<f32>>,
}

impl Overview {
    /// For pictures of this size, in pixels.
    pub fn new(width: usize, height: usize) -> Self {
        let factor = width.max(height).div_ceil(OVERVIEW).max(1);
        Self { width: width / factor, height: height / factor, factor, pictures: Vec::new() }
    }

    /// How many pixels became one, across and down.
    pub fn factor(&self) -> usize {
        self.factor
    }

    /// Takes one more, row by row.
    pub fn add(&mut self, picture: &[f32], width: usize) {
        let (w, factor) = (self.width, self.factor);
        let small = (0..w * self.height).map(|i| {
            let (x, y) = (i % w * factor, i / w * factor);
            let block = (0..factor * factor).map(|k| picture[(y + k / factor) * width + x + k % factor]);
            block.sum::<f32>() / (factor * factor) as f32
        });
        self.pictures.push(small.collect());
    }

    /// Up to `count` circles that stay in place under all lights, none within another, the surest first. Centres get the
    /// votes of edges that point at them (Ballard 1981); from each the outermost circle that shows is taken.
    pub fn circles(&self, count: usize) -> Vec<Circle> {
        let (w, h) = (self.width, self.height);
        let size = Vec2::new(w as f32, h as f32);
        if size.min_element() < 3.0 * SMALLEST || self.pictures.is_empty() {
            return Vec::new();
        }
        let field = Field::new(&self.pictures, w, h);
        let edges = edges(&field);
        let biggest = 0.6 * size.min_element();
        let mut circles: Vec<Circle> = Vec::new();
        let mut free: Vec<bool> = vec![true; edges.len()];
        while circles.len() < count {
            let mut best: Option<Circle> = None;
            for centre in centres(&edges, &free, w, h, biggest) {
                for start in rings(&edges, &free, centre, biggest) {
                    let Some(circle) = outermost(&field, start, biggest) else { continue };
                    let apart = circles.iter().all(|c| {
                        c.ball.centre.distance(circle.ball.centre)
                            > 0.8 * c.ball.radius.max(circle.ball.radius)
                    });
                    let worth = |c: &Circle| c.shown * c.ball.radius.sqrt();
                    if apart && best.is_none_or(|b| worth(&circle) > worth(&b)) {
                        best = Some(circle);
                    }
                }
            }
            let Some(circle) = best else { break };
            for (free, edge) in free.iter_mut().zip(&edges) {
                *free &= edge.at.distance(circle.ball.centre) > 1.1 * circle.ball.radius;
            }
            circles.push(circle);
        }
        for circle in &mut circles {
            let (reach, ball) = (circle.ball.radius + 1.0, &mut circle.ball);
            circle.whole =
                ball.centre.cmpgt(Vec2::splat(reach)).all() && (ball.centre + reach).cmplt(size).all();
            *ball =
                Ball { centre: ball.centre * self.factor as f32, radius: ball.radius * self.factor as f32 };
        }
        circles
    }
}

struct Edge {
    at: Vec2,
    normal: Vec2,
}

/// Where the picture changes most along its gradient, to a part of a pixel.
fn edges(field: &Field) -> Vec<Edge> {
    let (width, height) = (field.width, field.height);
    let length = |x: f32, y: f32| field.gradient[y as usize * width + x as usize].length();
    let mut all: Vec<f32> = field.gradient.iter().map(|g| g.length()).collect();
    // The strongest eighth.
    let nth = all.len() * 7 / 8;
    let threshold = (*all.select_nth_unstable_by(nth, f32::total_cmp).1).clamp(0.5 * EDGE, 4.0 * EDGE);
    let mut edges = Vec::new();
    for y in 2..height - 2 {
        for x in 2..width - 2 {
            let g = field.gradient[y * width + x];
            let here = g.length();
            if here < threshold {
                continue;
            }
            let normal = g / here;
            let step = normal.round();
            let (fx, fy) = (x as f32, y as f32);
            let (before, after) = (length(fx - step.x, fy - step.y), length(fx + step.x, fy + step.y));
            if here < before || here <= after {
                continue;
            }
            // The top of the parabola through the three.
            let bend = before + after - 2.0 * here;
            let part = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
            edges.push(Edge { at: Vec2::new(fx + 0.5, fy + 0.5) + step * part, normal });
        }
    }
    edges
}

/// Where most edges point at, the best first.
fn centres(edges: &[Edge], free: &[bool], w: usize, h: usize, biggest: f32) -> Vec<Vec2> {
    // A ball that reaches out of the picture may have its centre there.
    let margin = (0.5 * biggest) as usize;
    let (w, h) = (w + 2 * margin, h + 2 * margin);
    let shift = Vec2::splat(margin as f32);
    let mut votes = vec![0.0f32; w * h];
    for (edge, _) in edges.iter().zip(free).filter(|(_, free)| **free) {
        for side in [-1.0, 1.0] {
            for r in SMALLEST as usize..=biggest as usize {
                let at = edge.at + shift + edge.normal * (side * r as f32);
                if at.cmplt(Vec2::ZERO).any() || at.x >= w as f32 || at.y >= h as f32 {
                    break;
                }
                // A large circle has more edges to vote.
                votes[at.y as usize * w + at.x as usize] += 1.0 / r as f32;
            }
        }
    }
    let smooth = |i: usize| -> f32 {
        let (x, y) = (i % w, i / w);
        if x == 0 || y == 0 || x + 1 >= w || y + 1 >= h {
            return 0.0;
        }
        (0..9).map(|k| votes[(y + k / 3 - 1) * w + x + k % 3 - 1]).sum()
    };
    let mut peaks: Vec<(f32, usize)> = (0..w * h).map(|i| (smooth(i), i)).collect();
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut chosen: Vec<Vec2> = Vec::new();
    for (_, i) in peaks {
        let centre = Vec2::new((i % w) as f32 + 0.5, (i / w) as f32 + 0.5) - shift;
        if chosen.iter().all(|c| c.distance(centre) >= 4.0) {
            chosen.push(centre);
        }
        if chosen.len() == 12 {
            break;
        }
    }
    chosen
}

/// Circles around `centre` of which much shows, at most three.
fn rings(edges: &[Edge], free: &[bool], centre: Vec2, biggest: f32) -> Vec<Ball> {
    // Of the directions, so that a cluster of edges on one side does not count for the whole.
    let mut shown = vec![0u64; biggest as usize + 3];
    for (e, _) in edges.iter().zip(free).filter(|(_, free)| **free) {
        let out = e.at - centre;
        let r = out.length();
        // Edges of a circle point at its centre.
        if r >= SMALLEST && r < biggest && (out / r).dot(e.normal).abs() > 0.9 {
            let turn = out.y.atan2(out.x) / TAU + 0.5;
            shown[r as usize] |= 1 << ((turn * 64.0) as usize).min(63);
        }
    }
    let share = |r: usize| (shown[r - 1] | shown[r] | shown[r + 1]).count_ones();
    let mut radii: Vec<usize> = (SMALLEST as usize..=biggest as usize).filter(|r| share(*r) >= 22).collect();
    radii.sort_by_key(|r| std::cmp::Reverse(share(*r)));
    let mut chosen: Vec<usize> = Vec::new();
    for r in radii {
        if chosen.len() < 3 && chosen.iter().all(|c| c.abs_diff(r) > 2) {
            chosen.push(r);
        }
    }
    chosen.into_iter().map(|r| Ball { centre, radius: r as f32 + 0.5 }).collect()
}

/// The outermost circle that shows, about as large as `start` or up to half larger.
fn outermost(field: &Field, start: Ball, biggest: f32) -> Option<Circle> {
    let turns: Vec<Vec2> = (0..96).map(|i| Vec2::from_angle(TAU * (i as f32 + 0.5) / 96.0)).collect();
    // Signed: the rim is a step in one sense all around. Of what lies in the picture, if that is a third.
    let strength = |centre: Vec2, radius: f32| -> (f32, f32) {
        let (mut sum, mut count) = (0.0f32, 0.0f32);
        for u in &turns {
            if let Some(g) = field.at(centre + *u * radius) {
                sum += soft(g.dot(*u));
                count += 1.0;
            }
        }
        if count < 32.0 { (0.0, 0.0) } else { (sum.abs() / count, count / 96.0) }
    };
    let reach = (0.08 * start.radius).max(2.0);
    let step = (0.02 * start.radius).max(0.5);
    let offsets: Vec<f32> = (0..=(2.0 * reach / step) as usize).map(|i| i as f32 * step - reach).collect();
    let fine = (0.01 * start.radius).max(0.5);
    let radii: Vec<f32> = (0..)
        .map(|i| (start.radius - reach).max(SMALLEST - 1.0) + i as f32 * fine)
        .take_while(|r| *r <= (OUTWARD * start.radius).min(biggest))
        .collect();
    let best: Vec<((f32, f32), Vec2)> = radii
        .iter()
        .map(|r| {
            let mut best = ((0.0, 0.0), start.centre);
            for x in &offsets {
                for y in &offsets {
                    let centre = start.centre + Vec2::new(*x, *y);
                    let s = strength(centre, *r);
                    if s.0 > best.0.0 {
                        best = (s, centre);
                    }
                }
            }
            best
        })
        .collect();
    // The step must be the steepest place across a pixel or two, not a slope.
    let width = (1.5 / fine).ceil() as usize;
    let peak = |i: usize| {
        let around = i.saturating_sub(width)..(i + width + 1).min(best.len());
        best[around].iter().all(|b| b.0.0 <= best[i].0.0)
    };
    let i = (0..best.len()).rev().find(|&i| best[i].0.0 > SHOWN && peak(i))?;
    let (strength, inside) = best[i].0;
    Some(Circle { ball: Ball { centre: best[i].1, radius: radii[i] }, shown: strength * inside, whole: true })
}

/// From −1 to 1: how surely a change is an edge, and in which sense.
fn soft(change: f32) -> f32 {
    change / (change.abs() + EDGE)
}

/// A part of the picture, the same in all, at full size.
pub struct Window {
    /// Its top left corner in the picture, in pixels.
    pub corner: [usize; 2],
    /// Pixels across and down.
    pub size: [usize; 2],
    /// Row by row.
    pub pictures: Vec<Vec<f32>>,
}

impl Window {
    /// Around a circle that may be a ball's or the border of the table in it, with some of the table; empty where it lies
    /// outside.
    pub fn around(ball: Ball, width: usize, height: usize) -> Self {
        let reach = 3.0 * ball.radius + 8.0;
        let low = |c: f32| (c - reach).floor().max(0.0) as usize;
        let high = |c: f32, size: usize| ((c + reach).ceil().max(0.0) as usize).min(size);
        let corner = [low(ball.centre.x).min(width), low(ball.centre.y).min(height)];
        let far = [high(ball.centre.x, width), high(ball.centre.y, height)];
        Self {
            corner,
            size: [far[0].saturating_sub(corner[0]), far[1].saturating_sub(corner[1])],
            pictures: Vec::new(),
        }
    }

    /// Cuts it out of one more picture.
    pub fn add(&mut self, picture: &[f32], width: usize) {
        self.pictures.push(self.cut(picture, width));
    }

    /// What a picture shows in it.
    pub fn cut(&self, picture: &[f32], width: usize) -> Vec<f32> {
        let ([x, y], [w, h]) = (self.corner, self.size);
        (y..y + h).flat_map(|y| &picture[y * width + x..][..w]).copied().collect()
    }
}

/// The outline of a ball to a part of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outline {
    /// As a straight camera sees it; see [`View`].
    pub ball: Ball,
    /// One standard deviation of its centre, in pixels.
    pub sigma: f32,
    /// One standard deviation of its radius, in pixels.
    pub radius_sigma: f32,
    /// The part of the rim that was met, 0 to 1.
    pub shown: f32,
    /// By how much the outline is longer toward the middle of the picture than across, as a part of the radius: a
    /// camera that is nearer than `view` says. 0 where that is no more than chance.
    pub stretch: f32,
    /// For a camera that is taken for a distant one: the focal length in pixels with which what the ball mirrors agrees far
    /// better with what lies around it.
    pub nearer: Option<f32>,
    /// How many times as bright (or as dark) as within it is right outside of the rim, in the median.
    pub step: f32,
    /// How well what the ball mirrors agrees with what lies around it, −1 to 1; see [`mirror`].
    pub mirrored: f32,
}

/// A metal's rim shows as far as the reflectance at grazing angles differs from one, which rises within this part of the
/// radius: measured on chromium.
const GRAZING: f32 = 0.003;

/// Measures the ball whose rim, or whose border of the mirrored table, is near `circle` (as a straight camera sees it): by
/// the step at its rim within `reach` pixels, and by what it mirrors. `None` where neither shows.
pub fn measure(window: &Window, view: &View, circle: Ball, reach: f32) -> Option<Outline> {
    if window.pictures.is_empty() || window.size[0] < 8 || window.size[1] < 8 {
        return None;
    }
    let field = Field::new(&window.pictures, window.size[0], window.size[1]);
    let corner = Vec2::new(window.corner[0] as f32, window.corner[1] as f32);
    let whole = mirror::find(window, view, circle, |ball, slack| marked(&field, corner, view, ball, slack));
    let proven = whole.filter(|m| m.agreement > mirror::PROVEN && m.sigma.is_finite());
    let agreement = whole.map_or(0.0, |m| m.agreement);
    let Some(found) = proven else {
        let edge = refine(&field, corner, view, circle, reach)?;
        let radius_sigma = edge.radius_sigma.hypot(GRAZING * edge.ball.radius);
        return Some(Outline { mirrored: agreement, radius_sigma, ..edge });
    };
    let alone = Outline {
        ball: found.ball,
        sigma: found.sigma,
        radius_sigma: found.sigma,
        shown: 1.0,
        stretch: 0.0,
        nearer: None,
        step: 1.0,
        mirrored: agreement,
    };
    let nearer = if view.focal.is_none() { nearer(window, view, &found) } else { None };
    let alone = Outline { nearer, ..alone };
    // On a pattern the step changes its sense along the rim and says little.
    let Some(edge) = refine(&field, corner, view, found.ball, 2.0) else { return Some(alone) };
    let again = mirror::improve(window, view, edge.ball).filter(|m| m.sigma.is_finite());
    let found = again.filter(|m| m.agreement > found.agreement).unwrap_or(found);
    let agreement = found.agreement;
    let alone = Outline {
        ball: found.ball,
        sigma: found.sigma,
        radius_sigma: found.sigma,
        mirrored: agreement,
        ..alone
    };
    let apart = edge.ball.centre.distance(found.ball.centre);
    if apart > 3.0 * edge.sigma.hypot(found.sigma) + 0.05 || edge.shown < 0.8 {
        return Some(alone);
    }
    let mean = |a: f32, sigma_a: f32, b: f32, sigma_b: f32| {
        let (wa, wb) = (1.0 / (sigma_a * sigma_a).max(1e-6), 1.0 / (sigma_b * sigma_b).max(1e-6));
        ((wa * a + wb * b) / (wa + wb), 1.0 / (wa + wb).sqrt())
    };
    let (x, sigma) = mean(edge.ball.centre.x, edge.sigma, found.ball.centre.x, found.sigma);
    let (y, _) = mean(edge.ball.centre.y, edge.sigma, found.ball.centre.y, found.sigma);
    let rim = edge.radius_sigma.hypot(GRAZING * edge.ball.radius);
    let (radius, radius_sigma) = mean(edge.ball.radius, rim, found.ball.radius, found.sigma);
    Some(Outline {
        ball: Ball { centre: Vec2::new(x, y), radius },
        sigma,
        radius_sigma,
        nearer,
        mirrored: agreement,
        ..edge
    })
}

/// The focal length, of some, with which a ball agrees so much better that the camera cannot be distant.
fn nearer(window: &Window, view: &View, found: &mirror::Match) -> Option<f32> {
    // From wide angle to tele; between them the best differs by less than it does from a distant camera.
    let focals = [0.9, 1.5, 2.6, 4.5].map(|f| f * view.width as f32);
    let tried = focals.iter().filter_map(|&focal| {
        let near = View { focal: Some(focal), ..*view };
        Some((mirror::improve(window, &near, near.as_seen(found.ball))?.agreement, focal))
    });
    let (agreement, focal) = tried.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (1.0 - agreement < 0.6 * (1.0 - found.agreement)).then_some(focal)
}

/// Whether edges lie along a ball's rim, within `slack` pixels, rather than a little further out. On a pattern they are
/// lighter here and darker there.
fn marked(field: &Field, corner: Vec2, view: &View, ball: Ball, slack: f32) -> bool {
    let turns: Vec<f32> = (0..48).map(|i| TAU * (i as f32 + 0.5) / 48.0).collect();
    let Some(rim) = view.rim(ball, &turns) else { return false };
    let centre = rim.iter().copied().sum::<Vec2>() / 48.0;
    let steps = (slack + 1.0).ceil() as i32;
    let strength = |part: f32| {
        let edge = |rim: &Vec2| {
            let (at, outward) =
                (centre + (*rim - centre) * part - corner, (*rim - centre).normalize_or(Vec2::X));
            let step = |k: i32| field.at(at + outward * k as f32).map(|g| g.dot(outward).abs());
            (-steps..=steps).filter_map(step).max_by(f32::total_cmp)
        };
        let mut all: Vec<f32> = rim.iter().filter_map(edge).collect();
        if all.len() < 16 { 0.0 } else { middle(&mut all) }
    };
    let here = strength(1.0);
    here > EDGE && here > 1.5 * strength(1.15).min(strength(1.3))
}

/// Looks for the step at the rim of a ball in a window of pictures, near `start` (as a straight camera sees it), within
/// `reach` pixels. `None` where less than half of it shows.
fn refine(field: &Field, corner: Vec2, view: &View, start: Ball, reach: f32) -> Option<Outline> {
    let rim = view.rim(start, &[0.0, 0.25 * TAU, 0.5 * TAU, 0.75 * TAU])?;
    let inner = rim.iter().copied().sum::<Vec2>() / 4.0;
    let across = |p: Vec2, u: Vec2| field.at(p - corner).map_or(0.0, |g| g.dot(u));
    let count = ((2.0 * TAU * start.radius) as usize).clamp(96, 1440);
    let turns: Vec<f32> = (0..count).map(|i| TAU * (i as f32 + 0.5) / count as f32).collect();
    let mut ball = start;
    let mut reach = reach;
    let mut sign = 0.0;
    let mut result = None;
    const STEP: f32 = 0.25;
    for round in 0..8 {
        let steps = (reach / STEP).ceil() as i32;
        let rim = view.rim(ball, &turns)?;
        let outward: Vec<Vec2> = rim.iter().map(|p| (*p - inner).normalize_or(Vec2::X)).collect();
        let profile = |i: usize, k: i32| across(rim[i] + outward[i] * (k as f32 * STEP), outward[i]);
        if round == 0 {
            // The sense of the step: that in which the best circle around is stronger.
            let sum = |k: i32| (0..count).map(|i| soft(profile(i, k))).sum::<f32>();
            sign = (-steps..=steps).map(sum).max_by(|a, b| a.abs().total_cmp(&b.abs()))?.signum();
        }
        let mut points = Vec::with_capacity(count);
        for i in 0..count {
            let values: Vec<f32> = (-steps - 1..=steps + 1).map(|k| sign * profile(i, k)).collect();
            let within = &values[1..values.len() - 1];
            let Some(top) = (0..within.len()).max_by(|&a, &b| within[a].total_cmp(&within[b])) else {
                continue;
            };
            let (before, here, after) = (values[top], values[top + 1], values[top + 2]);
            if here < 0.5 * EDGE {
                continue;
            }
            let bend = before + after - 2.0 * here;
            let part = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-1.0, 1.0) } else { 0.0 };
            let at = (top as f32 - steps as f32 + part) * STEP;
            points.push((rim[i] + outward[i] * at, turns[i]));
        }
        if points.len() < count / 2 {
            return None;
        }
        let scale = (0.7 * reach).max(1.0);
        let met: Vec<Vec2> = points.iter().map(|p| p.0).collect();
        let mut next = ball;
        for _ in 0..6 {
            next = view.fit(next, &met, scale)?;
        }
        if next.centre.distance(start.centre) > 0.3 * start.radius
            || (next.radius / start.radius - 1.0).abs() > 0.3
        {
            return None;
        }
        ball = next;
        let last = round > 2 && reach <= 2.0;
        reach = (0.6 * reach).max(2.0);
        if last {
            let off: Vec<(f32, f32)> =
                points.iter().filter_map(|(p, turn)| Some((view.beyond(ball, *p)?, *turn))).collect();
            let mut sizes: Vec<f32> = off.iter().map(|o| o.0.abs()).collect();
            let scatter = 1.48 * middle(&mut sizes);
            let near: Vec<_> = off.iter().filter(|o| o.0.abs() < (4.0 * scatter).max(0.3)).collect();
            let shown = near.len() as f32 / count as f32;
            // Neighbours on the rim within three pixels share their noise.
            let free = (near.len() as f32 * TAU * ball.radius / count as f32 / 3.0).max(4.0);
            let sigma = scatter * (2.0 / free).sqrt();
            let out = ball.centre - 0.5 * Vec2::new(view.width as f32, view.height as f32);
            let toward = out.y.atan2(out.x);
            let stretch = near.iter().map(|o| o.0 * (2.0 * (o.1 - toward)).cos()).sum::<f32>() * 4.0
                / near.len() as f32;
            let stretch = if stretch > (4.0 * sigma).max(0.1) { stretch / ball.radius } else { 0.0 };
            let mut steps: Vec<f32> =
                (0..count).map(|i| (-10..=10).map(|k| STEP * profile(i, k)).sum::<f32>()).collect();
            let step = middle(&mut steps).abs().exp();
            result = Some(Outline {
                ball,
                sigma,
                radius_sigma: sigma,
                shown,
                stretch,
                nearer: None,
                step,
                mirrored: 0.0,
            });
            break;
        }
    }
    result.filter(|o| o.shown > SHOWN)
}
