//! What is in front at each pixel: depth and shape, for the lines that it hides and the marks that it holds.
//!
//! Where everything is opaque a depth buffer is filled here, by the processor: lines need nothing else of a picture, and a GPU
//! that is none takes ten times as long for it. What can be seen through is looked up in textures, which the real-time
//! renderer does.

use crate::contour::to_world;
use crate::projection::Projection;
use glam::{DAffine3, DMat3, DVec3, Vec2};
use yugen_optics::Image;
use yugen_scene::Aov;
use yugen_scene::prepared::{DrawRow, MeshRow, Rows};

/// Depth along the axis and the number of the shape at the centre of each pixel.
#[derive(Clone, Debug)]
pub struct DepthMap {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Row after row; infinite where nothing is.
    pub depth: Vec<f32>,
    /// Counted from one; 0 where nothing is.
    pub shape: Vec<u32>,
}

impl DepthMap {
    /// From the depth and the id of the real-time renderer; `None` where the picture has not both.
    pub fn new(image: &Image, projection: &Projection) -> Option<Self> {
        let [depth, id] = [Aov::Depth, Aov::Id].map(|aov| image.channel(aov.channels()[0]));
        let (depth, id) = (depth?, id?);
        let size = [image.width as u32, image.height as u32];
        let mut map = Self { size, depth: Vec::new(), shape: Vec::new() };
        for y in 0..size[1] {
            for x in 0..size[0] {
                let pixel = image.pixel(x as usize, y as usize);
                let shape = pixel[id].max(0.0) as u32;
                let z = projection.depth_of_ray(x, y, f64::from(pixel[depth])) as f32;
                map.depth.push(if shape == 0 { f32::INFINITY } else { z });
                map.shape.push(shape);
            }
        }
        Some(map)
    }

    /// Of opaque surfaces; `None` where light passes through one. `winding`: see [`crate::topology::Topology::winding`], of
    /// draws that are solids, whose far sides need not be looked at. The same for any number of threads.
    pub fn of(
        rows: &Rows,
        projection: &Projection,
        winding: &dyn Fn(&DrawRow) -> Option<f64>,
        threads: usize,
    ) -> Option<Self> {
        if rows.draws.iter().any(|d| d.flags & DrawRow::SEE_THROUGH != 0) {
            return None;
        }
        let size = projection.size();
        let [width, height] = size.map(|n| n as usize);
        let linear = LinearDepth { parallel: projection.is_parallel() };
        let mut map = Self {
            size,
            depth: vec![linear.of(f32::INFINITY); width * height],
            shape: vec![0; width * height],
        };
        let placed: Vec<Placed> =
            rows.draws.iter().map(|draw| Placed::new(rows, draw, projection, winding(draw))).collect();
        let lines = height.div_ceil(threads.max(1)).max(1);
        let bands = map.depth.chunks_mut(lines * width).zip(map.shape.chunks_mut(lines * width));
        let mut bands: Vec<Band> = bands
            .enumerate()
            .map(|(i, (depth, shape))| Band { width, first: i * lines, depth, shape, linear })
            .collect();
        let fill = |band: &mut Band| {
            placed.iter().for_each(|p| band.fill(p, rows, projection));
            band.depth.iter_mut().for_each(|d| *d = band.linear.depth(*d));
        };
        match &mut bands[..] {
            [band] => fill(band),
            bands => std::thread::scope(|scope| {
                for band in bands {
                    scope.spawn(|| fill(band));
                }
            }),
        }
        Some(map)
    }

    /// At a place in the picture, or at the nearest on its edge: depth and shape.
    pub fn at(&self, p: Vec2) -> (f32, u32) {
        let [w, h] = self.size.map(|n| n as i32 - 1);
        let (x, y) = ((p.x.floor() as i32).clamp(0, w), (p.y.floor() as i32).clamp(0, h));
        let i = y as usize * self.size[0] as usize + x as usize;
        (self.depth[i], self.shape[i])
    }
}

/// A draw as the camera sees it.
struct Placed {
    draw: DrawRow,
    first_vertex: u32,
    /// From the mesh to the camera.
    to_camera: DAffine3,
    corners: Vec<Corner>,
    /// Sign of the area that its triangles have where they face the eye; 0 where both sides may be seen.
    front: f32,
}

#[derive(Clone, Copy)]
struct Corner {
    /// Meaningless before the near plane.
    pixel: Vec2,
    /// Along the axis.
    depth: f32,
}

/// Depth as a value that is linear over the picture, and grows with it: the negative reciprocal, and depth itself where rays
/// are parallel.
#[derive(Clone, Copy)]
struct LinearDepth {
    parallel: bool,
}

impl LinearDepth {
    fn of(self, depth: f32) -> f32 {
        if self.parallel { depth } else { -1.0 / depth }
    }

    fn depth(self, linear: f32) -> f32 {
        match linear {
            linear if self.parallel => linear,
            0.0 => f32::INFINITY,
            linear => -1.0 / linear,
        }
    }
}

/// How far beyond its edges a triangle covers centres, of its largest coordinate: sixteen roundings of a float, of which each
/// of subtractions and products makes at most one. A thousandth of a pixel in a picture of a thousand.
const SLACK: f32 = 16.0 * f32::EPSILON / 2.0;

impl Placed {
    fn new(rows: &Rows, draw: &DrawRow, projection: &Projection, winding: Option<f64>) -> Self {
        let MeshRow { first_vertex, vertices, .. } = rows.meshes[draw.mesh as usize];
        let world = to_world(draw);
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| world(axis) - world(DVec3::ZERO));
        let in_world = DAffine3 {
            matrix3: DMat3::from_cols(axes[0], axes[1], axes[2]),
            translation: world(DVec3::ZERO),
        };
        let to_camera = projection.to_camera() * in_world;
        let of_mesh = &rows.vertices[first_vertex as usize..(first_vertex + vertices) as usize];
        let corner = |v: &yugen_scene::prepared::VertexRow| {
            let at = to_camera.transform_point3(DVec3::from_array(v.position.map(f64::from)));
            Corner { pixel: projection.pixel(at).as_vec2(), depth: at.z as f32 }
        };
        let corners: Vec<Corner> = of_mesh.iter().map(corner).collect();
        // An eye inside a solid has some of it behind itself.
        let outside = corners.iter().all(|c| c.depth > projection.near() as f32);
        let front = match winding {
            // Faces that wind to the left seen from outside wind to the right along the axis, along which pixels are seen.
            Some(winding) if outside => -(winding * to_camera.matrix3.determinant()).signum() as f32,
            _ => 0.0,
        };
        Self { draw: *draw, first_vertex, to_camera, corners, front }
    }
}

/// Some lines of the picture.
struct Band<'a> {
    width: usize,
    /// Its first line.
    first: usize,
    /// As [`LinearDepth`] has it.
    depth: &'a mut [f32],
    shape: &'a mut [u32],
    linear: LinearDepth,
}

impl Band<'_> {
    fn fill(&mut self, placed: &Placed, rows: &Rows, projection: &Projection) {
        let Placed { draw, first_vertex, to_camera, corners, front } = placed;
        let near = projection.near() as f32;
        let range = draw.first_triangle as usize..(draw.first_triangle + draw.triangles) as usize;
        for triangle in &rows.triangles[range] {
            let t = triangle.map(|v| corners[(v - first_vertex) as usize]);
            if t.iter().all(|c| c.depth > near) {
                self.triangle(t, draw.shape, *front);
            } else if t.iter().any(|c| c.depth > near) {
                let place = |v: u32| {
                    let p = rows.vertices[v as usize].position.map(f64::from);
                    to_camera.transform_point3(DVec3::from_array(p))
                };
                let cut = beyond(triangle.map(place), projection.near());
                let corner = |p: DVec3| Corner { pixel: projection.pixel(p).as_vec2(), depth: p.z as f32 };
                for i in 2..cut.len() {
                    let fan = [cut[0], cut[i - 1], cut[i]].map(corner);
                    self.triangle(fan, draw.shape, 0.0);
                }
            }
        }
    }

    /// The pixels whose centres a triangle covers, edges included, so that neighbours leave no gap.
    fn triangle(&mut self, [a, b, c]: [Corner; 3], shape: u32, front: f32) {
        let area = (b.pixel - a.pixel).perp_dot(c.pixel - a.pixel);
        if area * front < 0.0 || area == 0.0 || !area.is_finite() {
            return;
        }
        let (low, high) = (a.pixel.min(b.pixel).min(c.pixel), a.pixel.max(b.pixel).max(c.pixel));
        let last = [self.width, self.first + self.depth.len() / self.width];
        // Centres lie at halves. Whole numbers by conversion, which saturates: a call for each took half of the time.
        let up = |v: f32| ((v - 0.5) as i32).saturating_add(i32::from(v - 0.5 > ((v - 0.5) as i32) as f32));
        let from = |v: f32, first: usize| up(v).max(first as i32) as usize;
        let to = |v: f32, end: usize| ((v + 0.5) as i32).clamp(0, end as i32) as usize;
        let (x0, x1) = (from(low.x, 0), to(high.x, last[0]));
        let (y0, y1) = (from(low.y, self.first), to(high.y, last[1]));
        if x0 >= x1 || y0 >= y1 {
            return;
        }
        // To the left about the corners.
        let (b, c, area) = if area > 0.0 { (b, c, area) } else { (c, b, -area) };
        let (u, v, w) = (b.pixel - a.pixel, c.pixel - a.pixel, c.pixel - b.pixel);
        // A centre on an edge may lie on either side of it by rounding.
        let slack = -SLACK * low.abs().max(high.abs()).max_element();
        let least = [v, u, w].map(|edge| slack * edge.length());
        let mut slopes: Option<[f32; 3]> = None;
        for y in y0..y1 {
            let row = (y - self.first) * self.width;
            for x in x0..x1 {
                let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - a.pixel;
                let (wb, wc, wa) = (p.perp_dot(v), u.perp_dot(p), w.perp_dot(p - u));
                // One branch: which of the three edges a centre is beyond is as good as chance.
                if !((wb >= least[0]) & (wc >= least[1]) & (wa >= least[2])) {
                    continue;
                }
                // Most triangles of a fine mesh cover no centre.
                let [first, along_u, along_v] = *slopes.get_or_insert_with(|| {
                    let [a, b, c] = [a, b, c].map(|c| self.linear.of(c.depth));
                    [a, (b - a) / area, (c - a) / area]
                });
                let linear = first + wb * along_u + wc * along_v;
                if linear < self.depth[row + x] {
                    (self.depth[row + x], self.shape[row + x]) = (linear, shape);
                }
            }
        }
    }
}

/// The part of a triangle behind the near plane, in the camera's space: a polygon. Sutherland and Hodgman 1974.
fn beyond(corners: [DVec3; 3], near: f64) -> Vec<DVec3> {
    let mut out = Vec::with_capacity(4);
    for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a], corners[b])) {
        if a.z >= near {
            out.push(a);
        }
        if (a.z >= near) != (b.z >= near) {
            out.push(a.lerp(b, (near - a.z) / (b.z - a.z)));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Mat4, Vec3};
    use std::sync::Arc;
    use yugen_scene::{
        Camera, Film, Filter, Geometry, Material, Mesh, Projection as Kind, Scene, Shape, Value, look_along,
        primitives,
    };

    fn camera(eye: Vec3, kind: Kind) -> Projection {
        let film = Film { width: 160, height: 120, crop: None, filter: Filter::Box };
        let to_world = look_along(eye, Vec3::NEG_Z, Vec3::Y);
        let camera = Camera {
            name: "test".into(),
            to_world,
            projection: kind,
            near_far: [0.1, 100.0],
            film,
            samples_per_pixel: 1,
        };
        Projection::new(&camera).unwrap()
    }

    fn perspective() -> Kind {
        Kind::pinhole(0.9)
    }

    fn rows(mesh: Mesh, to_world: Mat4) -> Rows {
        Rows::new(&Scene {
            materials: vec![Material::lambert(Value::Rgb(Vec3::splat(0.5)))],
            shapes: vec![Shape::new("it", Geometry::Mesh(Arc::new(mesh)), to_world, 0)],
            ..Scene::default()
        })
        .unwrap()
    }

    /// Of a ball: those of rays, and the same for any number of threads.
    #[test]
    fn depths_are_those_of_rays() {
        for kind in [perspective(), Kind::Orthographic] {
            let projection = camera(Vec3::ZERO, kind);
            let ball = rows(primitives::ball(256), Mat4::from_translation(Vec3::Z * -3.0));
            for (threads, winding) in [(1, None), (2, None), (7, None), (2, Some(1.0))] {
                let map = DepthMap::of(&ball, &projection, &|_| winding, threads).unwrap();
                let alone = DepthMap::of(&ball, &projection, &|_| winding, 1).unwrap();
                assert!(map.depth == alone.depth && map.shape == alone.shape, "{threads} threads");
                let (mut seen, mut off) = (0, 0.0f64);
                for (i, (depth, shape)) in map.depth.iter().zip(&map.shape).enumerate() {
                    let at = glam::DVec2::new((i % 160) as f64 + 0.5, (i / 160) as f64 + 0.5);
                    // The eye's ray against the unit ball about (0, 0, 3) in the camera's space.
                    let way = projection.to_camera().transform_vector3(-projection.to_eye_at(at));
                    let start = if projection.is_parallel() {
                        let unit = projection.pixels_per_unit(1.0);
                        let middle = glam::DVec2::new(80.0, 60.0);
                        ((middle - at) / unit).extend(0.0)
                    } else {
                        DVec3::ZERO
                    };
                    let from = start - DVec3::Z * 3.0;
                    let (b, c) = (from.dot(way), from.length_squared() - 1.0);
                    let inside = b * b - c;
                    assert_eq!(*shape > 0, depth.is_finite());
                    // Near the outline facets decide.
                    if inside.abs() > 0.05 {
                        assert_eq!(*shape == 1, inside > 0.0, "{at}");
                    }
                    if inside > 0.05 {
                        let truth = (start + way * (-b - inside.sqrt())).z;
                        off = off.max((f64::from(*depth) - truth).abs());
                        seen += 1;
                    }
                }
                // Measured 6.1e-4: how far a facet lies within the ball, over its slope.
                assert!(seen > 1000 && off < 2.5e-3, "{seen} {off}");
            }
        }
    }

    /// A floor from before the near plane to far away: cut, not dropped.
    #[test]
    fn what_the_near_plane_cuts_is_seen_behind_it() {
        let projection = camera(Vec3::Y, perspective());
        let mut floor = Mesh::default();
        let (near, far) = (Vec3::new(0.0, 0.0, 5.0), Vec3::new(0.0, 0.0, -50.0));
        let side = Vec3::X * 60.0;
        floor.positions.extend([near - side, near + side, far + side, far - side]);
        floor.triangles.extend([[0, 1, 2], [0, 2, 3]]);
        let map = DepthMap::of(&rows(floor, Mat4::IDENTITY), &projection, &|_| None, 2).unwrap();
        // A line of the picture sees the floor at the height of the eye over the slope of its rays.
        for y in 70..120 {
            let slope = (f64::from(y) + 0.5 - 60.0) / projection.pixels_per_unit(1.0);
            let (depth, shape) = map.at(Vec2::new(80.5, y as f32 + 0.5));
            assert_eq!(shape, u32::from(1.0 / slope < 50.0), "{y}");
            assert!((f64::from(depth) * slope - 1.0).abs() < 1e-4, "{y}: {depth}");
        }
        assert_eq!(map.at(Vec2::new(80.5, 10.5)), (f32::INFINITY, 0));
    }

    /// Far sides of a solid are left out only where the eye is outside of it.
    #[test]
    fn a_solid_is_seen_from_inside() {
        let projection = camera(Vec3::ZERO, perspective());
        let ball = rows(primitives::ball(64), Mat4::from_scale(Vec3::splat(4.0)));
        let map = DepthMap::of(&ball, &projection, &|_| Some(1.0), 2).unwrap();
        assert!(map.shape.iter().all(|s| *s == 1));
        // Sabotage: outside, with the wrong winding, the far side is what is left.
        let ball = rows(primitives::ball(64), Mat4::from_translation(Vec3::Z * -3.0));
        let depth =
            |winding| DepthMap::of(&ball, &projection, &|_| Some(winding), 1).unwrap().depth[60 * 160 + 80];
        assert!((depth(1.0) - 2.0).abs() < 0.01 && (depth(-1.0) - 4.0).abs() < 0.01);
    }
}
