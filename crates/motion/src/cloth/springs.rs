//! From triangles and a fabric to springs and hinges.
//!
//! A triangle's edges see three numbers of its strain, and the bends at its edges three of its curvature. Stiffnesses are
//! those, none negative, whose energy comes nearest to the fabric's for every strain and curvature: exact where edges follow the
//! threads, and as near as springs can come elsewhere (springs between points cannot have every Poisson ratio; woven cloth,
//! whose threads cross loosely, has nearly none). Where edges follow the threads bends are those of threads at vertices, and
//! bends at edges only resist twist: a mesh whose diagonals alternate could else bend every other vertex for nothing.

use super::{ClothError, Fabric, Sheet};
use glam::{DVec2, Vec2};
use std::collections::HashMap;

/// What a spring follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Along {
    /// The warp, v of the flat cloth.
    Warp,
    /// The weft, u.
    Weft,
    /// Neither: nearer to a diagonal than to a thread.
    Bias,
}

/// A spring with a damper in parallel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Two vertices.
    pub ends: [u32; 2],
    /// Length without force, m.
    pub rest: f32,
    /// N/m.
    pub stiffness: f32,
    /// N·s/m.
    pub damper: f32,
    /// Strain beyond which it does not stretch; infinite for none.
    pub limit: f32,
    /// What it follows.
    pub along: Along,
}

/// Resistance to a bend: of a thread at a vertex, or of two triangles at the edge that they share.
///
/// Σ `slopes` times the places of `vertices` is nought where these lie as in the flat cloth, else a vector along the normal
/// whose length is the change of slope, in radians while that is small (Wardetzky, Bergou, Harmon, Zorin and Grinspun 2007,
/// "Discrete quadratic curvature energies"): energy is half the stiffness times its square, forces are linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hinge {
    /// The tips on both sides, then the ends of the edge; of a thread, the vertex in the middle twice.
    pub vertices: [u32; 4],
    /// 1/m; their sum is nought.
    pub slopes: [f32; 4],
    /// N·m.
    pub stiffness: f32,
    /// N·m·s.
    pub damper: f32,
}

pub(super) struct Made {
    pub masses: Vec<f32>,
    pub springs: Vec<Spring>,
    pub hinges: Vec<Hinge>,
}

/// An edge between two vertices and the triangles at it.
struct Edge {
    ends: [u32; 2],
    /// Triangle and the number of its corner opposite; the first has `ends` in its own order.
    sides: [Option<(u32, usize)>; 2],
}

/// Edges in the order in which triangles name them, and of each triangle the edge opposite each corner.
fn edges(triangles: &[[u32; 3]]) -> Result<(Vec<Edge>, Vec<[u32; 3]>), ClothError> {
    let mut edges: Vec<Edge> = Vec::with_capacity(triangles.len() * 3 / 2);
    let mut known: HashMap<[u32; 2], u32> = HashMap::with_capacity(triangles.len() * 2);
    let mut of = vec![[0; 3]; triangles.len()];
    for (t, triangle) in triangles.iter().enumerate() {
        for corner in 0..3 {
            let [a, b] = [triangle[(corner + 1) % 3], triangle[(corner + 2) % 3]];
            if a == b {
                return Err(ClothError::Flat { index: t, place: "because it names a vertex twice" });
            }
            let id = *known.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                edges.push(Edge { ends: [a, b], sides: [None; 2] });
                edges.len() as u32 - 1
            });
            of[t][corner] = id;
            let edge = &mut edges[id as usize];
            let side = usize::from(edge.ends != [a, b]);
            if edge.sides[side].is_some() {
                let more = edge.sides.iter().all(Option::is_some);
                let triangles = if more { "more than two triangles, two" } else { "two triangles" };
                return Err(ClothError::Edge { a, b, triangles });
            }
            edge.sides[side] = Some((t as u32, corner));
        }
    }
    Ok((edges, of))
}

/// Twice the signed area.
fn twice_area(t: &[Vec2; 3]) -> f64 {
    let [a, b, c] = t.map(|p| p.as_dvec2());
    (b - a).perp_dot(c - a)
}

pub(super) fn make(sheet: &Sheet, fabric: &Fabric) -> Result<Made, ClothError> {
    let (edges, of) = edges(&sheet.triangles)?;
    let mut masses = vec![0.0f64; sheet.positions.len()];
    let mut stiffness = vec![0.0f64; edges.len()];
    let mut rest = vec![(0.0f64, 0.0f64); edges.len()];
    let mut course = vec![DVec2::ZERO; edges.len()];
    for (t, flat) in sheet.flat.iter().enumerate() {
        let area = 0.5 * twice_area(flat).abs();
        let corners = flat.map(Vec2::as_dvec2);
        let sides = [0, 1, 2].map(|k| corners[(k + 2) % 3] - corners[(k + 1) % 3]);
        let longest = sides.iter().map(|s| s.length()).fold(0.0, f64::max);
        // A needle a thousand times as long as high has no sides to speak of; its stiffness would be noise.
        if area <= 5e-4 * longest * longest {
            return Err(ClothError::Flat { index: t, place: "in the flat cloth" });
        }
        for v in sheet.triangles[t] {
            masses[v as usize] += area * f64::from(fabric.areal_mass) / 3.0;
        }
        let fitted = membrane(sides, area, fabric);
        for k in 0..3 {
            let e = of[t][k] as usize;
            stiffness[e] += fitted[k];
            rest[e].0 += sides[k].length();
            rest[e].1 += 1.0;
            // As a direction without sign: its angle doubled.
            course[e] += sides[k].normalize().rotate(sides[k].normalize());
        }
    }
    if let Some(index) = masses.iter().position(|m| *m == 0.0) {
        let value = "in no triangle".into();
        return Err(ClothError::Number { what: "vertex", index, value });
    }
    let springs = edges.iter().enumerate().map(|(e, edge)| {
        let (sum, count) = rest[e];
        let twice = course[e].normalize_or(DVec2::X);
        // cos 2θ is 1 along the weft, −1 along the warp and 0 on the bias; within 22.5° of a thread it counts as one.
        let along = match twice.x {
            c if c > 0.5f64.sqrt() => Along::Weft,
            c if c < -0.5f64.sqrt() => Along::Warp,
            _ => Along::Bias,
        };
        let limit = limit_along(DVec2::from_angle(0.5 * twice.to_angle()), [fabric.limit, fabric.bias_limit]);
        Spring {
            ends: edge.ends,
            rest: (sum / count) as f32,
            stiffness: stiffness[e] as f32,
            damper: (stiffness[e] * f64::from(fabric.damping)) as f32,
            limit: limit as f32,
            along,
        }
    });
    let springs: Vec<Spring> = springs.collect();
    let grain = Grain::new(sheet, &edges);
    let mut hinges = grain.bends(fabric);
    hinges.extend(bends(sheet, fabric, &edges, &of, &grain));
    Ok(Made { masses: masses.into_iter().map(|m| m as f32).collect(), springs, hinges })
}

/// Strain limit along a direction of the flat cloth, by those of threads and bias.
pub(super) fn limit_along(course: DVec2, [thread, bias]: [f32; 2]) -> f64 {
    let n = course.normalize();
    let c2 = (n.x * n.x - n.y * n.y).powi(2);
    c2 * f64::from(thread) + (1.0 - c2) * f64::from(bias)
}

/// Stiffnesses of a triangle's sides, N/m.
fn membrane(sides: [DVec2; 3], area: f64, fabric: &Fabric) -> [f64; 3] {
    let [warp, weft, shear] = [fabric.warp, fabric.weft, fabric.shear].map(f64::from);
    // Energy density ½(weft ε_uu² + warp ε_vv² + shear γ²), γ = 2 ε_uv. A side of length l along (c, s) is stretched by
    // l(c² ε_uu + s² ε_vv + cs γ).
    let columns = sides.map(|d| {
        let n = d.normalize();
        let q = [n.x * n.x, n.y * n.y, n.x * n.y];
        products(q).map(|p| p * d.length_squared())
    });
    let target = [weft, warp, shear, 0.0, 0.0, 0.0].map(|c| c * area);
    // Threads first: what is told from shear and coupling is a hundredth of them.
    let softer = 0.1 * (warp * weft).sqrt();
    // Couplings least: springs cannot but have that of both strains, and those with shear cancel between diagonals.
    let coupled = 30.0 * softer;
    let weights = [weft, warp, shear.max(softer), coupled, coupled, coupled].map(|c| 1.0 / (c * area));
    least_squares(columns, target, weights)
}

/// The six products of three numbers: squares, then 12, 13, 23.
fn products([a, b, c]: [f64; 3]) -> [f64; 6] {
    [a * a, b * b, c * c, a * b, a * c, b * c]
}

/// Three numbers, none negative, whose sum of columns comes nearest to the target: the best of the eight choices of those
/// that are not nought.
fn least_squares(columns: [[f64; 6]; 3], target: [f64; 6], weights: [f64; 6]) -> [f64; 3] {
    let scaled = |v: [f64; 6]| [0, 1, 2, 3, 4, 5].map(|i| v[i] * weights[i]);
    let (a, b) = (columns.map(scaled), scaled(target));
    let dot = |x: &[f64; 6], y: &[f64; 6]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let mut best = ([0.0; 3], dot(&b, &b));
    for choice in 1..8usize {
        let chosen: Vec<usize> = (0..3).filter(|k| choice >> k & 1 == 1).collect();
        let n = chosen.len();
        // Normal equations, solved by elimination; a hair on the diagonal keeps them solvable.
        let mut m = [[0.0; 4]; 3];
        for (r, &i) in chosen.iter().enumerate() {
            for (c, &j) in chosen.iter().enumerate() {
                m[r][c] = dot(&a[i], &a[j]) * if r == c { 1.0 + 1e-12 } else { 1.0 };
            }
            m[r][3] = dot(&a[i], &b);
        }
        for p in 0..n {
            if m[p][p] <= 0.0 {
                continue;
            }
            for r in (0..n).filter(|r| *r != p) {
                let f = m[r][p] / m[p][p];
                let row = m[p];
                m[r].iter_mut().zip(row).for_each(|(v, w)| *v -= f * w);
            }
        }
        let mut x = [0.0; 3];
        for (r, &i) in chosen.iter().enumerate() {
            x[i] = if m[r][r] > 0.0 { m[r][3] / m[r][r] } else { f64::NAN };
        }
        if !x.iter().all(|v| *v >= 0.0 && v.is_finite()) {
            continue;
        }
        let rest: [f64; 6] = std::array::from_fn(|i| b[i] - (0..3).map(|k| x[k] * a[k][i]).sum::<f64>());
        let error = dot(&rest, &rest);
        // By a margin, so that rounding does not decide between equals.
        if error < best.1 * (1.0 - 1e-9) {
            best = (x, error);
        }
    }
    best.0
}

/// Two triangles unfolded into the plane of the first: the tip of the second.
fn unfolded(first: &[DVec2; 3], corner: usize, second: &[DVec2; 3], opposite: usize) -> DVec2 {
    let (c, d) = (first[(corner + 1) % 3], first[(corner + 2) % 3]);
    // The second has the edge the other way round.
    let (d2, c2) = (second[(opposite + 1) % 3], second[(opposite + 2) % 3]);
    let tip = second[opposite] - c2;
    let along = (d2 - c2).normalize();
    let (x, y) = (tip.dot(along), along.perp_dot(tip));
    // A panel that lies in the flat cloth with its back up is turned over.
    let turn = |t: &[DVec2; 3]| (t[1] - t[0]).perp_dot(t[2] - t[0]).signum();
    let y = y * turn(first) * turn(second);
    let axis = (d - c).normalize();
    c + axis * x + axis.perp() * y
}

fn bends(sheet: &Sheet, fabric: &Fabric, edges: &[Edge], of: &[[u32; 3]], grain: &Grain) -> Vec<Hinge> {
    struct Bend {
        slopes: [f64; 4],
        stiffness: f64,
        /// What it sees of curvatures 1 along uu, vv and uv, in the flat cloth of either side.
        sees: [[f64; 3]; 2],
    }
    let [rigid_warp, rigid_weft] = fabric.rigidity();
    let flat: Vec<[DVec2; 3]> = sheet.flat.iter().map(|t| t.map(Vec2::as_dvec2)).collect();
    let mut bends: Vec<Option<Bend>> = edges
        .iter()
        .map(|edge| {
            let [Some((t, k)), Some((u, l))] = edge.sides else { return None };
            let (first, second) = (&flat[t as usize], &flat[u as usize]);
            // Tips a and b, ends c and d, in the plane of the first.
            let (a, c, d) = (first[k], first[(k + 1) % 3], first[(k + 2) % 3]);
            let b = unfolded(first, k, second, l);
            let (axis, length) = ((d - c).normalize(), (d - c).length());
            let height = |p: DVec2| axis.perp_dot(p - c).abs();
            let [ka, kb] = [1.0 / height(a), 1.0 / height(b)];
            let kd = -(ka * axis.dot(a - c) + kb * axis.dot(b - c)) / length;
            let slopes = [ka, kb, -(ka + kb + kd), kd];
            let seen = |points: [DVec2; 4]| {
                let of = |f: &dyn Fn(DVec2) -> f64| -> f64 { (0..4).map(|i| slopes[i] * f(points[i])).sum() };
                [of(&|p| 0.5 * p.x * p.x), of(&|p| 0.5 * p.y * p.y), of(&|p| p.x * p.y)]
            };
            // The same four points in the flat cloth of the second.
            let (b2, d2, c2) = (second[l], second[(l + 1) % 3], second[(l + 2) % 3]);
            let a2 = unfolded(second, l, first, k);
            // About the edge, lest numbers far from the origin cancel.
            let near = [a, b, c, d].map(|p| p - c);
            let far = [a2, b2, c2, d2].map(|p| p - c2);
            Some(Bend { slopes, stiffness: 0.0, sees: [seen(near), seen(far)] })
        })
        .collect();
    for (t, triangle) in of.iter().enumerate() {
        let area = 0.5 * twice_area(&sheet.flat[t]).abs();
        let sees = triangle.map(|e| {
            let side = usize::from(edges[e as usize].sides[0].map(|s| s.0) != Some(t as u32));
            bends[e as usize].as_ref().map_or([0.0; 3], |b| b.sees[side])
        });
        // Energy density ½(weft κ_uu² + warp κ_vv² + 2 twist κ_uv²); no source has the rigidity to twist of such cloth, so it
        // is that of a plate without Poisson ratio.
        let twist = 2.0 * (rigid_warp * rigid_weft).sqrt();
        let by_threads = sheet.triangles[t].iter().all(|v| grain.follows(*v));
        let [weft, warp] = if by_threads { [0.0; 2] } else { [rigid_weft, rigid_warp] };
        let target = [weft, warp, twist, 0.0, 0.0, 0.0].map(|c| c * area);
        // Cloth bends in one direction at a time: those along threads count most.
        let main = rigid_warp.max(rigid_weft).max(f64::MIN_POSITIVE);
        let weights = [
            rigid_weft.max(1e-3 * main),
            rigid_warp.max(1e-3 * main),
            10.0 * main,
            10.0 * main,
            10.0 * main,
            10.0 * main,
        ]
        .map(|c| 1.0 / (c * area));
        let fitted = least_squares(sees.map(products), target, weights);
        for (e, stiffness) in triangle.iter().zip(fitted) {
            if let Some(bend) = &mut bends[*e as usize] {
                bend.stiffness += stiffness;
            }
        }
    }
    let made = bends.iter().zip(edges).filter_map(|(bend, edge)| {
        let bend = bend.as_ref().filter(|b| b.stiffness > 0.0)?;
        let [Some((t, k)), Some((u, l))] = edge.sides else { return None };
        let tips = [sheet.triangles[t as usize][k], sheet.triangles[u as usize][l]];
        // Two triangles of the same three vertices fold onto each other; nothing bends there.
        (tips[0] != tips[1]).then(|| Hinge {
            vertices: [tips[0], tips[1], edge.ends[0], edge.ends[1]],
            slopes: bend.slopes.map(|k| k as f32),
            stiffness: bend.stiffness as f32,
            damper: (bend.stiffness * f64::from(fabric.bending_damping)) as f32,
        })
    });
    made.collect()
}

/// What lies next to vertices along their threads.
struct Grain {
    /// Towards +u, −u, +v, −v: the vertex and how far it is in the flat cloth, m.
    next: Vec<[Option<(u32, f64)>; 4]>,
    /// Where the cloth ends, one side may be missing.
    rim: Vec<bool>,
}

impl Grain {
    fn new(sheet: &Sheet, edges: &[Edge]) -> Self {
        let n = sheet.positions.len();
        let mut grain = Self { next: vec![[None; 4]; n], rim: vec![false; n] };
        for (triangle, flat) in sheet.triangles.iter().zip(&sheet.flat) {
            for (i, j) in [(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)] {
                let to = (flat[j] - flat[i]).as_dvec2();
                // Within a thousandth: files round.
                let side = if to.y.abs() < 1e-3 * to.x.abs() {
                    usize::from(to.x < 0.0)
                } else if to.x.abs() < 1e-3 * to.y.abs() {
                    2 + usize::from(to.y < 0.0)
                } else {
                    continue;
                };
                grain.next[triangle[i] as usize][side] = Some((triangle[j], to.length()));
            }
        }
        for edge in edges.iter().filter(|e| e.sides.iter().any(Option::is_none)) {
            edge.ends.iter().for_each(|v| grain.rim[*v as usize] = true);
        }
        grain
    }

    /// Whether edges follow both threads at a vertex.
    fn follows(&self, v: u32) -> bool {
        self.rim[v as usize] || self.next[v as usize].iter().all(Option::is_some)
    }

    /// Bends of threads.
    fn bends(&self, fabric: &Fabric) -> Vec<Hinge> {
        let [warp, weft] = fabric.rigidity();
        let mut hinges = Vec::new();
        for (v, next) in self.next.iter().enumerate().filter(|(v, _)| self.follows(*v as u32)) {
            for (along, across, rigidity) in [(0, 2, weft), (2, 0, warp)] {
                let (Some((a, la)), Some((b, lb))) = (next[along], next[along + 1]) else { continue };
                // Half a cell to either side that there is.
                let width =
                    [across, across + 1].iter().filter_map(|k| next[*k]).map(|n| n.1).sum::<f64>() / 2.0;
                let stiffness = rigidity * width / (0.5 * (la + lb));
                if stiffness <= 0.0 || a == b {
                    continue;
                }
                let slopes = [1.0 / la, 1.0 / lb, -1.0 / la - 1.0 / lb, 0.0];
                hinges.push(Hinge {
                    vertices: [a, b, v as u32, v as u32],
                    slopes: slopes.map(|k| k as f32),
                    stiffness: stiffness as f32,
                    damper: (stiffness * f64::from(fabric.bending_damping)) as f32,
                });
            }
        }
        hinges
    }
}

/// Of each triangle, the number of its panel: those that lie side by side in the flat cloth have the same.
pub(super) fn panels(sheet: &Sheet) -> Vec<u32> {
    let mut root: Vec<u32> = (0..sheet.triangles.len() as u32).collect();
    fn find(root: &mut [u32], mut t: u32) -> u32 {
        while root[t as usize] != t {
            root[t as usize] = root[root[t as usize] as usize];
            t = root[t as usize];
        }
        t
    }
    let mut known: HashMap<[u32; 2], ([Vec2; 2], u32)> = HashMap::new();
    for (t, (triangle, flat)) in sheet.triangles.iter().zip(&sheet.flat).enumerate() {
        for corner in 0..3 {
            let (i, j) = ((corner + 1) % 3, (corner + 2) % 3);
            let (mut ends, mut at) = ([triangle[i], triangle[j]], [flat[i], flat[j]]);
            if ends[0] > ends[1] {
                ends.reverse();
                at.reverse();
            }
            match known.get(&ends) {
                Some((other, u)) => {
                    // A thousandth of the edge: files round.
                    let slack = 1e-3 * at[0].distance(at[1]);
                    if (0..2).all(|k| other[k].distance(at[k]) <= slack) {
                        let [a, b] = [find(&mut root, t as u32), find(&mut root, *u)];
                        root[a.max(b) as usize] = a.min(b);
                    }
                }
                None => {
                    known.insert(ends, (at, t as u32));
                }
            }
        }
    }
    let mut number = HashMap::new();
    (0..root.len() as u32)
        .map(|t| {
            let r = find(&mut root, t);
            let next = number.len() as u32;
            *number.entry(r).or_insert(next)
        })
        .collect()
}
