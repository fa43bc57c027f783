//! The outline of a ball from what it mirrors.
//!
//! Close to its rim a mirror ball shows the table around it: a ring of a pixel or two holds what lies as far out as the
//! ball is wide. Centre and radius say which place of the table a pixel of the ring shows, and that place is in the
//! picture as well. Where they are right the two agree in every picture, with the table's pattern and with the shadows
//! that turn with the lamp; a hundredth of the radius off they do not. That the rim itself may hardly show (a metal
//! mirrors all light at grazing angles) is no matter then.

use super::{Ball, View, Window};
use glam::Vec2;
use std::f32::consts::TAU;

/// From this agreement on a ball is proven: chromium on a matt table reaches .90 (few paths a pixel) to .99.
pub const PROVEN: f32 = 0.75;
/// Pictures that are compared.
const PICTURES: usize = 8;
/// The radius, in pixels, of the circle in the shrunk pictures in which the search begins.
const SEARCH: f32 = 18.0;
/// Places from which the best is sought.
const STARTS: usize = 6;
/// Where a pixel of the ring is looked up on the table, in pixels: it shows much of it.
const ACROSS: [f32; 5] = [-0.4, -0.2, 0.0, 0.2, 0.4];

/// An outline that was found, and how well the ring agrees with the table: 1 is wholly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// As a straight camera sees it.
    pub ball: Ball,
    /// Correlation.
    pub agreement: f32,
    /// One standard deviation of centre and radius, in pixels.
    pub sigma: f32,
}

/// Pictures of a window, each pixel the mean of `scale` squared.
struct Layer {
    corner: Vec2,
    scale: f32,
    width: usize,
    height: usize,
    pictures: Vec<Vec<f32>>,
}

impl Layer {
    fn new(window: &Window, factor: usize) -> Self {
        let [full, _] = window.size;
        let [width, height] = window.size.map(|s| s / factor);
        let every = window.pictures.len().div_ceil(PICTURES).max(1);
        let shrunk = |p: &Vec<f32>| {
            let one = |i: usize| {
                let (x, y) = (i % width * factor, i / width * factor);
                let block = (0..factor * factor).map(|k| p[(y + k / factor) * full + x + k % factor]);
                // Shadows count as well as lights.
                (block.sum::<f32>() / (factor * factor) as f32).max(0.0).sqrt()
            };
            (0..width * height).map(one).collect()
        };
        Self {
            corner: Vec2::new(window.corner[0] as f32, window.corner[1] as f32),
            scale: factor as f32,
            width,
            height,
            pictures: window.pictures.iter().step_by(every).map(shrunk).collect(),
        }
    }

    /// Where a pixel of the whole picture lies in it: index of the upper left of four and the parts beyond.
    fn place(&self, pixel: Vec2) -> Option<(usize, Vec2)> {
        let p = (pixel - self.corner) / self.scale - 0.5;
        let inside =
            p.x >= 0.0 && p.y >= 0.0 && p.x + 1.0 < self.width as f32 && p.y + 1.0 < self.height as f32;
        inside.then(|| (p.y as usize * self.width + p.x as usize, p.fract()))
    }

    fn read(&self, picture: &[f32], (i, part): (usize, Vec2)) -> f32 {
        let across = |i: usize| picture[i] + part.x * (picture[i + 1] - picture[i]);
        let (above, below) = (across(i), across(i + self.width));
        above + part.y * (below - above)
    }

    /// How well the ring within a ball's rim agrees with the table around it, and how many places were compared. `every`
    /// other place and picture: in haste.
    fn agreement(&self, view: &View, ball: Ball, every: usize) -> Option<(f32, usize)> {
        let pixels = ball.radius / self.scale;
        let count = ((TAU * pixels / 1.5) as usize).clamp(48, 240) / every;
        let turns: Vec<f32> = (0..count).map(|i| TAU * (i as f32 + 0.5) / count as f32).collect();
        let rim = view.rim(ball, &turns)?;
        let centre = rim.iter().copied().sum::<Vec2>() / count as f32;
        let (mut both, mut norm, mut compared, mut possible) = (0.0f64, 0.0f64, 0, 0);
        let mut places = Vec::with_capacity(count);
        for ring in 1..=5 {
            let part = 1.0 - ring as f32 / pixels;
            // Beyond lies what is far away, or not in the picture.
            if ring > 1 && part < 0.9 {
                break;
            }
            places.clear();
            for rim in &rim {
                possible += 1;
                let at = |part: f32| centre + (*rim - centre) * part;
                let Some(inside) = self.place(at(part)) else { continue };
                let table = ACROSS.map(|off| {
                    let ray = view.reflect(ball, at(part + off / pixels))?;
                    let down = -ray.origin.z / ray.direction.z;
                    let foot = ray.origin + ray.direction * down;
                    (down > 0.0).then(|| self.place(view.on_picture(foot))).flatten()
                });
                if let [Some(a), Some(b), Some(c), Some(d), Some(e)] = table {
                    places.push((inside, [a, b, c, d, e]));
                }
            }
            compared += places.len();
            if places.len() < count / 4 {
                continue;
            }
            for picture in self.pictures.iter().step_by(every) {
                let pair = |(inside, table): &((usize, Vec2), [(usize, Vec2); 5])| {
                    let mirrored = table.iter().map(|t| self.read(picture, *t)).sum::<f32>() / 5.0;
                    (f64::from(self.read(picture, *inside)), f64::from(mirrored))
                };
                let n = places.len() as f64;
                let (mut a, mut b, mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0, 0.0, 0.0);
                for (x, y) in places.iter().map(pair) {
                    a += x;
                    b += y;
                    aa += x * x;
                    bb += y * y;
                    ab += x * y;
                }
                both += ab - a * b / n;
                norm += ((aa - a * a / n).max(0.0) * (bb - b * b / n).max(0.0)).sqrt();
            }
        }
        (4 * compared >= possible && norm > 1e-12 && both.is_finite())
            .then(|| ((both / norm) as f32, compared * self.pictures.len()))
    }
}

/// Looks for the ball that mirrors what lies around it, near a circle or with the circle as the border of its mirrored
/// table. Of balls that agree those count that are `marked`, within the pixels that it is told: a ring of the table itself
/// agrees with what lies beyond it in the same shadow, but no edge marks it. `None` where there is nothing to compare.
pub fn find(window: &Window, view: &View, circle: Ball, marked: impl Fn(Ball, f32) -> bool) -> Option<Match> {
    let factor = ((circle.radius / SEARCH).round() as usize).max(1);
    let coarse = Layer::new(window, factor);
    let scale = factor as f32;
    // The border of the mirrored table is not round, and to a near camera not in the middle.
    let reach = (0.16 * circle.radius).max(1.5 * scale);
    let steps = (reach / (0.5 * scale)).ceil() as i32;
    let side = 2 * steps + 1;
    let mut found: Vec<(f32, Ball)> = Vec::new();
    let mut radius = 0.94 * circle.radius;
    while radius < 1.47 * circle.radius {
        for i in 0..side * side {
            let off = Vec2::new((i % side - steps) as f32, (i / side - steps) as f32);
            let ball = Ball { centre: circle.centre + off * (0.5 * scale), radius };
            if let Some((agreement, _)) = coarse.agreement(view, ball, 2) {
                found.push((agreement, ball));
            }
        }
        radius += 0.35 * scale;
    }
    found.retain(|(agreement, ball)| *agreement > 0.3 && marked(*ball, scale + 1.0));
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    // The best by far between the places of the search may not be the best at them.
    let mut starts: Vec<Ball> = Vec::new();
    for (_, ball) in found {
        let far = |s: &Ball| s.centre.distance(ball.centre) + (s.radius - ball.radius).abs() > 1.5 * scale;
        if starts.len() < STARTS && starts.iter().all(far) {
            starts.push(ball);
        }
    }
    let climbed = starts.iter().map(|s| climb(&coarse, view, *s)).filter(|c| marked(c.1, 0.5 * scale + 1.0));
    let (mut top, mut ball) = climbed.max_by(|a, b| a.0.total_cmp(&b.0))?;
    if top < 0.5 {
        return Some(Match { ball, agreement: top, sigma: f32::INFINITY });
    }
    let (mut factor, mut layer) = (factor, coarse);
    while factor > 1 {
        factor = (factor / 2).max(1);
        layer = Layer::new(window, factor);
        (top, ball) = climb(&layer, view, ball);
    }
    judged(&layer, view, ball, top)
}

/// The best near a ball that is right to half a pixel.
pub fn improve(window: &Window, view: &View, ball: Ball) -> Option<Match> {
    let layer = Layer::new(window, 1);
    let (top, ball) = climb(&layer, view, ball);
    judged(&layer, view, ball, top)
}

fn judged(layer: &Layer, view: &View, ball: Ball, top: f32) -> Option<Match> {
    let score = |ball: Ball| layer.agreement(view, ball, 1).map_or(-1.0, |a| a.0);
    let compared = layer.agreement(view, ball, 1)?.1;
    // Of Gaussian readings the logarithm of the likelihood is −n/2 ln(1 − ρ²): its bend is the inverse variance. In n
    // neighbours and pictures that share their errors count once: a twentieth.
    let bend = |x: f32, y: f32, r: f32| {
        let off = Vec2::new(x, y);
        let at = |k: f32| score(Ball { centre: ball.centre + off * k, radius: ball.radius + r * k });
        (2.0 * top - at(0.3) - at(-0.3)) / 0.09
    };
    let flattest = bend(1.0, 0.0, 0.0).min(bend(0.0, 1.0, 0.0)).min(bend(0.0, 0.0, 1.0));
    let n = compared as f32 / 20.0;
    let sigma =
        if flattest > 0.0 { ((1.0 - top * top) / (n * top * flattest)).sqrt() } else { f32::INFINITY };
    Some(Match { ball, agreement: top, sigma })
}

/// Up the hill of agreement, with ever smaller steps.
fn climb(layer: &Layer, view: &View, start: Ball) -> (f32, Ball) {
    let score = |ball: Ball| layer.agreement(view, ball, 1).map_or(-1.0, |a| a.0);
    let (mut top, mut ball) = (score(start), start);
    let mut step = 0.25 * layer.scale;
    while step > 0.015 * layer.scale {
        let mut moved = false;
        // A step aside is often right together with one of the radius.
        for i in (0..27).filter(|i| *i != 13) {
            let [x, y, r] = [i % 3, i / 3 % 3, i / 9].map(|k| (k as f32 - 1.0) * step);
            let next = Ball { centre: ball.centre + Vec2::new(x, y), radius: ball.radius + r };
            let s = score(next);
            if s > top {
                (top, ball, moved) = (s, next, true);
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
    (top, ball)
}
