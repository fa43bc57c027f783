//! A drawing as SVG and what is in it, for a reader that shares nothing with the writer: benches/ink_vectors.py.
//!
//! `svg_peer FOLDER` writes `FOLDER/drawing.svg`, and prints a line for each stroke in the order of the file: layer, object, identity,
//! whether it is closed, the box around its middle line and that around its ink (least and greatest x and y, pixels).

use glam::{Mat4, Vec2, Vec3};
use std::path::Path;
use yugen_ink::painter::{Painter, Style};
use yugen_ink::stroke::{Stroke, StrokePoint};
use yugen_realtime::Gpu;
use yugen_scene::{
    Camera, Film, Filter, Geometry, Light, Material, Projection, Scene, Shape, Value, look_along, primitives,
};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Pixels across and down.
const SIZE: [u32; 2] = [960, 540];

fn main() -> Result<()> {
    let folder = std::env::args().nth(1).ok_or("expected the folder to write to")?;
    let still = still_life();
    let eye = Vec3::new(1.6, 2.0, 5.4);
    let view = Camera {
        name: "eye".into(),
        to_world: look_along(eye, -eye, Vec3::Y),
        projection: Projection::pinhole(0.7),
        near_far: [0.01, 100.0],
        film: Film { width: SIZE[0], height: SIZE[1], crop: None, filter: Filter::Box },
        samples_per_pixel: 1,
    };
    let gpu = Gpu::open()?;
    let mut painter = Painter::new(&gpu.device, &gpu.queue, &still, &view, Style::default(), 2)?;
    let painting = painter.paint(&view)?;
    let name = |shape: u32| still.shapes.get(shape as usize - 1).map_or(String::new(), |s| s.name.clone());
    let svg = painter.svg(&painting, &name, None, Some(3));
    std::fs::write(Path::new(&folder).join("drawing.svg"), svg)?;
    for (layer, strokes) in [("cun", &painting.wrinkles), ("gou", &painting.strokes)] {
        // Objects in their order, and the strokes of each as they are painted.
        let mut strokes: Vec<&Stroke> = strokes.iter().collect();
        strokes.sort_by_key(|s| s.shape);
        for stroke in strokes {
            let around = |reach: f32| {
                let own = |p: &StrokePoint| (p.pixel - reach * p.radius, p.pixel + reach * p.radius);
                let boxes = stroke.points.iter().map(own);
                let [a, b] =
                    boxes.fold([Vec2::INFINITY, Vec2::NEG_INFINITY], |[a, b], (p, q)| [a.min(p), b.max(q)]);
                [a.x, a.y, b.x, b.y].map(|v| v.to_string()).join(" ")
            };
            let (id, closed) = (stroke.id, stroke.closed);
            println!("{layer}\t{}\t{id:08x}\t{closed}\t{}\t{}", name(stroke.shape), around(0.0), around(1.0));
        }
    }
    Ok(())
}

/// Blocks, one behind the other, and balls, of which nothing covers one: its outline is closed.
fn still_life() -> Scene {
    let block = |size: Vec3| Geometry::Mesh(primitives::block(size).into());
    let at = |x: f32, y: f32, z: f32| Mat4::from_translation(Vec3::new(x, y, z));
    let ball = |to_world: Mat4, radius: f32| to_world * Mat4::from_scale(Vec3::splat(radius));
    Scene {
        materials: vec![Material::lambert(Value::Rgb(Vec3::splat(0.5)))],
        lights: vec![Light::Directional {
            direction: Vec3::new(-0.5, -1.0, -0.5).normalize(),
            irradiance: Vec3::ONE,
        }],
        shapes: vec![
            Shape::new("block & \"co\"", block(Vec3::new(0.7, 0.9, 0.5)), at(0.2, 0.0, 0.3), 0),
            Shape::new("wall", block(Vec3::new(1.6, 1.2, 0.2)), at(0.0, 0.2, -0.8), 0),
            Shape::new("球", Geometry::Sphere, ball(at(-0.5, 0.0, 0.5), 0.4), 0),
            Shape::new("free", Geometry::Sphere, ball(at(1.6, -0.2, 0.4), 0.3), 0),
        ],
        ..Scene::default()
    }
}
