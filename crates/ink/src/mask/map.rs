//! Where in the picture the pixels of a mask on a surface are seen, so that it can be painted there.

use super::{Ground, MOST};
use crate::InkError;
use crate::contour::to_world;
use crate::depth::DepthMap;
use crate::projection::Projection;
use crate::steering::Names;
use glam::{DVec3, Vec2};
use yugen_scene::prepared::{DrawRow, Rows};

/// Most pixels of a mask that triangles may cover together: of one of 1024 a side, 64 times all of it. A second of work.
const MOST_PIXELS: f64 = (1u64 << 26) as f64;
/// How far beyond its triangles a surface goes on in a mask, in its pixels, for between two of them it is read smoothly.
const RIM: f32 = 1.42;
/// Part of its depth by which a place may lie behind what is seen in its pixel and be seen itself.
const SLACK: f64 = 2e-3;
/// The most that is added where it turns away.
const LIMB: f64 = 0.02;

/// Of a mask on a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct MaskMap {
    on: Ground,
    size: [usize; 2],
    places: Vec<(u32, Vec2)>,
}

impl MaskMap {
    /// On what the mask lies.
    pub fn on(&self) -> &Ground {
        &self.on
    }

    /// Its pixels across and down.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Pixels, counted row after row, and where in the picture each is seen, in parts of it across and down. One that lies on several
    /// places of the surface (a texture that repeats, objects of one name) is seen in several.
    pub fn places(&self) -> &[(u32, Vec2)] {
        &self.places
    }

    /// Of a mask of this size on something of a scene, through a projection whose depths `map` has.
    pub fn new(
        on: &Ground,
        size: [usize; 2],
        rows: &Rows,
        names: &Names,
        projection: &Projection,
        map: &DepthMap,
    ) -> Result<Self, InkError> {
        let refused = |what: String| Err(InkError::Preset(what));
        if size.iter().any(|n| !(1..=MOST).contains(n)) {
            return refused(format!("a mask of {} x {} pixels cannot be painted", size[0], size[1]));
        }
        let draws: Vec<&DrawRow> = rows.draws.iter().filter(|draw| on.has(draw, names)).collect();
        if draws.is_empty() {
            let cause = names.unknown(on).map_or_else(
                || format!("the mesh of {on} has no texture coordinates"),
                |unknown| format!("the scene has no {unknown}"),
            );
            return refused(format!("a mask cannot be painted on {on}: {cause}"));
        }
        let triangles = |draw: &DrawRow| {
            let first = draw.first_triangle as usize;
            rows.triangles[first..first + draw.triangles as usize]
                .iter()
                .map(|t| Triangle::new(rows, t, size))
        };
        let all: f64 = draws.iter().flat_map(|d| triangles(d)).flatten().map(|t| t.pixels()).sum();
        if all > MOST_PIXELS {
            return refused(format!(
                "a mask cannot be painted on {on}: its texture coordinates repeat it {:.0} times; take a smaller picture, or one that \
                 is painted elsewhere",
                draws.iter().flat_map(|d| triangles(d)).flatten().map(|t| t.area()).sum::<f64>()
                    / (size[0] * size[1]) as f64
            ));
        }
        // What a triangle covers is its own, whoever's rim is there too.
        let mut covered = vec![false; size[0] * size[1]];
        for triangle in draws.iter().flat_map(|d| triangles(d)).flatten() {
            triangle.each(size, |pixel, [_, _, _], distance| covered[pixel] |= distance == 0.0);
        }
        let picture = map.size.map(|n| n as f32);
        let mut places = Vec::new();
        for draw in draws {
            let move_to_world = to_world(draw);
            for triangle in triangles(draw).flatten() {
                let corners = triangle.corners.map(&move_to_world);
                let is_seen = |p: Vec2| p.cmpge(Vec2::ZERO).all() && p.cmplt(picture.into()).all();
                let seen = corners.map(|c| projection.project(c).map(|p| p.pixel.as_vec2()));
                if let [Some(a), Some(b), Some(c)] = seen {
                    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
                    if high.cmplt(Vec2::ZERO).any() || low.cmpge(picture.into()).any() {
                        continue;
                    }
                }
                triangle.each(size, |pixel, weights, distance| {
                    if distance > 0.0 && covered[pixel] {
                        return;
                    }
                    let place: DVec3 = corners.iter().zip(weights).map(|(c, w)| *c * f64::from(w)).sum();
                    let Some(at) = projection.project(place) else { return };
                    let p = at.pixel.as_vec2();
                    if is_seen(p) && is_in_front(map, p, at.depth, draw.shape) {
                        places.push((pixel as u32, p / Vec2::from(picture)));
                    }
                });
            }
        }
        if places.is_empty() {
            return refused(format!("nothing is seen of {on}, on which the mask lies"));
        }
        Ok(Self { on: on.clone(), size, places })
    }
}

/// Whether something of a shape is seen in the pixel of its place or in one beside it, at its depth or farther away: what is oblique has
/// many depths in a pixel, and where it turns away it goes on beyond the farthest of them.
fn is_in_front(map: &DepthMap, p: Vec2, depth: f64, shape: u32) -> bool {
    let near = [-1.0, 0.0, 1.0];
    let around = near.into_iter().flat_map(|y| near.map(|x| map.at(p + Vec2::new(x, y))));
    let seen = around.filter(|(_, of)| *of == shape).map(|(depth, _)| f64::from(depth));
    let (least, most) = seen.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), d| (a.min(d), b.max(d)));
    depth <= most + (most - least).min(LIMB * depth.abs()) + SLACK * depth.abs()
}

/// A triangle in a mask.
struct Triangle {
    /// In the coordinates of its mesh.
    corners: [DVec3; 3],
    /// In pixels of the mask, from its upper left corner.
    at: [Vec2; 3],
}

impl Triangle {
    /// `None` where its texture coordinates are no numbers, or such as have no place.
    fn new(rows: &Rows, triangle: &[u32; 3], size: [usize; 2]) -> Option<Self> {
        let vertices = triangle.map(|v| &rows.vertices[v as usize]);
        let scale = Vec2::new(size[0] as f32, size[1] as f32);
        let at = vertices.map(|v| Vec2::new(v.u, v.v) * scale);
        // Beyond, floats do not tell pixels apart.
        let small = at.iter().all(|p| p.is_finite() && p.abs().max_element() < 4e6);
        small.then(|| Self { corners: vertices.map(|v| DVec3::from_array(v.position.map(f64::from))), at })
    }

    fn bounds(&self) -> [Vec2; 2] {
        let [a, b, c] = self.at;
        [(a.min(b).min(c) - RIM).floor(), (a.max(b).max(c) + RIM).ceil()]
    }

    /// Those that [`Triangle::each`] looks at.
    fn pixels(&self) -> f64 {
        let [low, high] = self.bounds();
        f64::from(high.x - low.x) * f64::from(high.y - low.y)
    }

    /// In pixels of the mask.
    fn area(&self) -> f64 {
        let [a, b, c] = self.at.map(|p| p.as_dvec2());
        0.5 * (b - a).perp_dot(c - a).abs()
    }

    /// Calls for each pixel of the mask in it and along its rim: its number, the weights of the corners at its centre or at the place of
    /// the triangle nearest to it, and how far that is.
    fn each(&self, [w, h]: [usize; 2], mut f: impl FnMut(usize, [f32; 3], f32)) {
        let [a, b, c] = self.at;
        let [low, high] = self.bounds().map(|p| p.as_ivec2());
        let area = (b - a).perp_dot(c - a);
        for y in low.y..high.y {
            for x in low.x..high.x {
                let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let parts = [(c - b).perp_dot(p - b), (a - c).perp_dot(p - c), (b - a).perp_dot(p - a)];
                let weights = parts.map(|v| v / area);
                let (weights, distance) = match weights.iter().all(|v| *v >= 0.0) {
                    true => (weights, 0.0),
                    false => self.nearest(p),
                };
                if distance < RIM {
                    let pixel = [(x, w), (y, h)].map(|(v, n)| i64::from(v).rem_euclid(n as i64) as usize);
                    f(pixel[1] * w + pixel[0], weights, distance);
                }
            }
        }
    }

    /// The place of its edges nearest to a point, and how far it is.
    fn nearest(&self, p: Vec2) -> ([f32; 3], f32) {
        let of_edge = |i: usize| {
            let (k, from, to) = ((i + 1) % 3, self.at[i], self.at[(i + 1) % 3]);
            let along = to - from;
            let t = ((p - from).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
            let mut weights = [0.0; 3];
            (weights[i], weights[k]) = (1.0 - t, t);
            (weights, p.distance(from + along * t))
        };
        let [a, b, c] = [0, 1, 2].map(of_edge);
        [b, c].into_iter().fold(a, |best, next| if next.1 < best.1 { next } else { best })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mask::Grey;
    use crate::mask::brush::{MaskBrush, MaskStroke};
    use glam::{Mat4, Vec3};
    use std::sync::Arc;

    use yugen_scene::{
        Camera, Film, Filter, Geometry, Material, Scene, Shape, Value, look_along, primitives,
    };

    const SIZE: [usize; 2] = [128, 64];

    /// Two cards, one half behind the other, seen from the front.
    fn cards() -> (Scene, Camera) {
        let card = |name: &str, at: Vec3| {
            let mesh = Geometry::Mesh(primitives::grid(2.0, 2.0, [4, 4]).into());
            Shape::new(name, mesh, Mat4::from_translation(at), 0)
        };
        let mut scene = Scene {
            materials: vec![Material::lambert(Value::Number(0.8))],
            shapes: vec![card("near", Vec3::new(1.0, 0.0, 0.5)), card("far", Vec3::ZERO)],
            ..Scene::default()
        };
        scene.name_material(0, "card");
        let camera = Camera {
            name: "front".into(),
            to_world: look_along(Vec3::Z * 6.0, -Vec3::Z, Vec3::Y),
            projection: yugen_scene::Projection::pinhole(0.8),
            near_far: [0.01, 100.0],
            film: Film { width: 200, height: 150, crop: None, filter: Filter::Box },
            samples_per_pixel: 1,
        };
        (scene, camera)
    }

    fn map(on: &str, size: [usize; 2]) -> Result<MaskMap, String> {
        let (scene, camera) = cards();
        let (rows, projection) = (Rows::new(&scene).unwrap(), Projection::new(&camera).unwrap());
        let depth = DepthMap::of(&rows, &projection, &|_| None, 2).expect("it is opaque");
        let (on, names) = (Ground::parse(on).unwrap(), Names::of(&scene));
        MaskMap::new(&on, size, &rows, &names, &projection, &depth).map_err(|e| e.to_string())
    }

    #[test]
    fn pixels_of_a_mask_are_where_their_surface_is_seen() {
        let (scene, camera) = cards();
        let (rows, projection) = (Rows::new(&scene).unwrap(), Projection::new(&camera).unwrap());
        let map = map("object.far", SIZE).unwrap();
        // Against the corner of the grid with the texture coordinates (0, 0).
        let vertex = |u: f32, v: f32| {
            let near = |r: &&yugen_scene::prepared::VertexRow| (r.u - u).abs() + (r.v - v).abs() < 1e-6;
            Vec3::from(rows.vertices.iter().find(near).expect("it has this corner").position).as_dvec3()
        };
        let corners = [vertex(0.0, 0.0), vertex(1.0, 0.0), vertex(0.0, 1.0)];
        let mut seen = vec![0; SIZE[0] * SIZE[1]];
        for (pixel, place) in map.places() {
            let i = *pixel as usize;
            let uv = [(i % SIZE[0]) as f64 + 0.5, (i / SIZE[0]) as f64 + 0.5];
            let [u, v] = [uv[0] / SIZE[0] as f64, uv[1] / SIZE[1] as f64];
            let world = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
            let expected = projection.project(world).expect("before the camera").pixel.as_vec2();
            let found = *place * Vec2::new(200.0, 150.0);
            assert!(found.distance(expected) < 0.01, "{uv:?}: {found} {expected}");
            seen[i] += 1;
        }
        // The near card hides what of the far one is right of its left edge: seen from 6 away, at x = 0 of one that is .5 nearer.
        for (i, seen) in seen.iter().enumerate() {
            let [u, v] = [(i % SIZE[0]) as f64 + 0.5, (i / SIZE[0]) as f64 + 0.5];
            let world = corners[0]
                + (corners[1] - corners[0]) * (u / SIZE[0] as f64)
                + (corners[2] - corners[0]) * (v / SIZE[1] as f64);
            // A pixel is .03 wide there.
            if world.x.abs() > 0.06 {
                assert_eq!(*seen > 0, world.x < 0.0, "{i} at {world}");
            }
        }
    }

    #[test]
    fn a_stroke_on_a_surface_is_on_that_surface_alone_and_without_holes() {
        let map = map("object.far", SIZE).unwrap();
        let mut mask = Arc::new(Grey::black(SIZE));
        let brush = MaskBrush { radius: 0.1, strength: 1.0, erases: false };
        let mut stroke = MaskStroke::new(brush, &mask);
        let way = [Vec2::new(0.35, 0.5), Vec2::new(0.7, 0.5)];
        stroke.draw(Arc::make_mut(&mut mask), way, 200.0 / 150.0, Some(&map));
        for (pixel, place) in map.places() {
            let p = *place * Vec2::new(200.0 / 150.0, 1.0);
            let near = p.x > 0.35 * 200.0 / 150.0 && (p.y - 0.5).abs() < 0.049;
            let far = (p.y - 0.5).abs() > 0.101;
            let value = mask.values[*pixel as usize];
            assert!(!(near && value < 1.0 || far && value > 0.0), "{p} {value}");
        }
        // Behind the near card nothing is painted.
        let seen: std::collections::HashSet<u32> = map.places().iter().map(|(pixel, _)| *pixel).collect();
        let hidden = (0u32..).zip(&mask.values).filter(|(pixel, _)| !seen.contains(pixel));
        assert!(hidden.clone().count() > 1000 && hidden.clone().all(|(_, v)| *v == 0.0));
    }

    #[test]
    fn by_material_and_what_cannot_be_painted_on() {
        let both = map("material.card", SIZE).unwrap();
        assert!(both.places().len() > map("object.far", SIZE).unwrap().places().len());
        for (on, size, words) in [
            ("object.fra", SIZE, "the scene has no object 'fra'; did you mean 'far'?"),
            ("object.far", [0, 1], "0 x 1 pixels"),
        ] {
            let said = map(on, size).unwrap_err();
            assert!(said.contains(words), "{said}");
        }
        // Behind the camera; without coordinates; a thousand times over itself.
        let (mut scene, camera) = cards();
        let said = |scene: &Scene| {
            let (rows, projection) = (Rows::new(scene).unwrap(), Projection::new(&camera).unwrap());
            let depth = DepthMap::of(&rows, &projection, &|_| None, 1).expect("it is opaque");
            let on = Ground::Object("far".into());
            let map = MaskMap::new(&on, [1024; 2], &rows, &Names::of(scene), &projection, &depth);
            map.unwrap_err().to_string()
        };
        scene.shapes[1].to_world = Mat4::from_translation(Vec3::Z * 20.0);
        assert!(said(&scene).contains("nothing is seen of object.far"), "{}", said(&scene));
        let mut grid = primitives::grid(2.0, 2.0, [4, 4]);
        grid.uvs.iter_mut().for_each(|uv| *uv *= 40.0);
        scene.shapes[1] = Shape::new("far", Geometry::Mesh(grid.clone().into()), Mat4::IDENTITY, 0);
        assert!(said(&scene).contains("repeat it 1600 times"), "{}", said(&scene));
        grid.uvs.clear();
        scene.shapes[1] = Shape::new("far", Geometry::Mesh(grid.into()), Mat4::IDENTITY, 0);
        assert!(said(&scene).contains("no texture coordinates"), "{}", said(&scene));
    }
}
