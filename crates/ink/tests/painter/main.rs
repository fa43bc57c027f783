//! Scenes that nobody would paint: a picture or a clear sentence, never a panic; and what steers a painting.

mod masks;

use glam::{Mat4, Vec2, Vec3};
use std::sync::Arc;
use yugen_ink::InkError;
use yugen_ink::painter::{Painter, Style};
use yugen_ink::steering::StrokeEdit;
use yugen_motion::fire::Fire;
use yugen_realtime::Gpu;
use yugen_scene::{
    Camera, Film, Filter, Geometry, Light, Material, Mesh, Projection, Scene, Shape, Value, look_along,
    primitives,
};

fn camera(eye: Vec3) -> Camera {
    Camera {
        name: "test".into(),
        to_world: look_along(eye, -eye.normalize_or(Vec3::Z), Vec3::Y),
        projection: Projection::pinhole(0.8),
        near_far: [0.01, 100.0],
        film: Film { width: 160, height: 120, crop: None, filter: Filter::Box },
        samples_per_pixel: 1,
    }
}

fn scene(shapes: Vec<Shape>) -> Scene {
    Scene {
        materials: vec![Material::lambert(Value::Rgb(Vec3::splat(0.5)))],
        shapes,
        lights: vec![Light::Directional {
            direction: Vec3::new(1.0, -1.0, -1.0).normalize(),
            irradiance: Vec3::ONE,
        }],
        ..Scene::default()
    }
}

fn shape(mesh: Mesh, to_world: Mat4) -> Shape {
    Shape::new("it", Geometry::Mesh(Arc::new(mesh)), to_world, 0)
}

/// How many strokes a scene has, of a picture that is finite.
fn strokes(gpu: &Gpu, scene: &Scene, camera: &Camera) -> Result<usize, String> {
    let painter = Painter::new(&gpu.device, &gpu.queue, scene, camera, Style::default(), 2);
    let mut painter = painter.map_err(|e| e.to_string())?;
    let painting = painter.paint(camera).map_err(|e| e.to_string())?;
    let picture = painter.image(true).map_err(|e| e.to_string())?;
    assert!(picture.data.iter().all(|v| v.is_finite() && *v >= 0.0));
    let literal = painter.paint_literally(scene, camera).map_err(|e| e.to_string())?;
    assert!(literal.data.iter().all(|v| (0.0..=1.0).contains(v)));
    Ok(painting.strokes.len())
}

#[test]
fn scenes_that_nobody_would_paint_are_painted_or_refused() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let far = camera(Vec3::new(1.0, 1.5, 4.0));
    let ball = || primitives::ball(32);
    let at = |m: Mat4| scene(vec![shape(ball(), m)]);
    let plain = strokes(&gpu, &at(Mat4::IDENTITY), &far).unwrap();
    assert!(plain > 0);
    // Mirrored and inside out it has the same outline.
    assert_eq!(strokes(&gpu, &at(Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0))), &far), Ok(plain));
    let mut inside_out = ball();
    inside_out.normals.iter_mut().for_each(|n| *n = -*n);
    inside_out.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    assert_eq!(strokes(&gpu, &scene(vec![shape(inside_out, Mat4::IDENTITY)]), &far), Ok(plain));
    // From inside there is no outline; behind the eye and very far there is nothing; in a point there is no size.
    assert_eq!(strokes(&gpu, &at(Mat4::IDENTITY), &camera(Vec3::new(0.1, 0.0, 0.2))), Ok(0));
    assert_eq!(strokes(&gpu, &at(Mat4::from_translation(Vec3::Z * 9.0)), &far), Ok(0));
    assert_eq!(strokes(&gpu, &at(Mat4::from_translation(Vec3::Z * -1e6)), &far), Ok(0));
    assert!(strokes(&gpu, &at(Mat4::from_scale(Vec3::splat(1e-6))), &far).is_ok());
    assert_eq!(strokes(&gpu, &scene(Vec::new()), &far), Ok(0));

    // Three wings on an edge, a triangle without area, one twice.
    let torn = Mesh {
        positions: vec![Vec3::ZERO, Vec3::Y, Vec3::X, Vec3::Z, -Vec3::X, Vec3::Y * 2.0],
        triangles: vec![[0, 1, 2], [0, 1, 3], [1, 0, 4], [0, 1, 5], [0, 1, 2], [2, 2, 2]],
        ..Mesh::default()
    };
    assert!(strokes(&gpu, &scene(vec![shape(torn, Mat4::IDENTITY)]), &far).unwrap() > 0);

    let mut nan = ball();
    nan.positions[3].x = f32::NAN;
    let said = strokes(&gpu, &scene(vec![shape(nan, Mat4::IDENTITY)]), &far).unwrap_err();
    assert!(said.contains("shape 'it': vertex 3 is not finite"), "{said}");
    let mut none = far.clone();
    none.film.width = 0;
    assert!(strokes(&gpu, &at(Mat4::IDENTITY), &none).unwrap_err().contains("no pixels"));
    let mut flat = far;
    flat.to_world = Mat4::from_scale(Vec3::new(1.0, 0.0, 1.0));
    assert!(strokes(&gpu, &at(Mat4::IDENTITY), &flat).unwrap_err().contains("cannot be inverted"));
}

/// A mesh of two blocks, of which one winds the other way, is drawn as where both wind alike: neither loses its near side.
#[test]
fn parts_that_wind_the_other_way_are_seen_the_same() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let view = camera(Vec3::new(1.0, 1.5, 4.0));
    let mut two = primitives::block(Vec3::splat(0.8));
    let half = two.triangles.len();
    let (count, other) = (two.positions.len() as u32, two.clone());
    two.positions.iter_mut().for_each(|p| p.x -= 0.7);
    two.positions.extend(other.positions.iter().map(|p| *p + Vec3::X * 0.7));
    two.normals.extend(other.normals);
    two.uvs.extend(other.uvs);
    two.tangents.clear();
    two.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + count)));
    let length = |turned: std::ops::Range<usize>| {
        let mut mesh = two.clone();
        mesh.triangles[turned].iter_mut().for_each(|t| t.swap(1, 2));
        let scene = scene(vec![shape(mesh, Mat4::IDENTITY)]);
        let mut painter = Painter::new(&gpu.device, &gpu.queue, &scene, &view, Style::default(), 2).unwrap();
        painter.follow(&view).unwrap().0.iter().map(|s| s.length()).sum::<f32>()
    };
    let plain = length(0..0);
    assert!(plain > 100.0, "{plain}");
    for turned in [0..half, half..2 * half, 0..2 * half] {
        let found = length(turned.clone());
        assert!((found / plain - 1.0).abs() < 0.01, "{turned:?}: {found} of {plain}");
    }
}

/// Tables of strokes that no picture has had are known.
#[test]
fn strokes_that_are_steered_and_never_drawn_are_told() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let view = camera(Vec3::new(1.0, 1.5, 4.0));
    let scene = scene(vec![shape(primitives::ball(32), Mat4::IDENTITY)]);
    let painter = |style| Painter::new(&gpu.device, &gpu.queue, &scene, &view, style, 2).unwrap();
    let id = painter(Style::default()).follow(&view).unwrap().0[0].id;
    let mut style = Style::default();
    let hidden = StrokeEdit { hide: true, ..StrokeEdit::default() };
    style.steering.strokes = [(id, hidden.clone()), (id ^ 1, hidden)].into();
    let mut painter = painter(style);
    assert_eq!(painter.unmet_strokes().len(), 2);
    assert!(painter.follow(&view).unwrap().0.iter().all(|s| s.id != id));
    let said = painter.unmet_strokes();
    assert!(said.len() == 1 && said[0].contains(&format!("[stroke.{:08x}]", id ^ 1)), "{said:?}");
}

/// The strokes of a painter that follows `cameras`, frame by frame, as identities; those that are going are left out.
fn identities(gpu: &Gpu, scene: &Scene, cameras: &[Camera], style: &Style) -> Vec<Vec<(u32, u32)>> {
    let made = Painter::new(&gpu.device, &gpu.queue, scene, &cameras[0], style.clone(), 2);
    let mut painter = made.expect("it can be");
    let of = |camera| -> Vec<(u32, u32)> {
        let strokes = painter.follow(camera).expect("it can be followed").0;
        strokes.iter().filter(|s| !s.fading).map(|s| (s.id, s.shape)).collect()
    };
    cameras.iter().map(of).collect()
}

fn pinned(id: u32, detail: f32) -> Style {
    let mut style = Style::default();
    style.controls.detail = detail;
    style.steering.strokes = [(id, StrokeEdit { pin: true, ..StrokeEdit::default() })].into();
    style
}

/// Of the two edges of a thin slab little detail leaves one; the other is drawn where it is pinned, in each frame of a film.
#[test]
fn a_pinned_stroke_is_never_left_out_for_others() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let slab = scene(vec![shape(primitives::block(Vec3::new(1.0, 0.06, 1.0)), Mat4::IDENTITY)]);
    let eyes = (0..12).map(|i| Vec3::new(2.5 + 0.02 * i as f32, 1.2, 3.5));
    let cameras: Vec<Camera> = eyes.map(camera).collect();
    let with = |detail: f32| Style {
        controls: {
            let mut c = Style::default().controls;
            c.detail = detail;
            c
        },
        ..Style::default()
    };
    let ids = |style: &Style| identities(&gpu, &slab, &cameras, style);
    let (all, few) = (ids(&with(1.0)), ids(&with(0.0)));
    let left_out: Vec<u32> =
        all[0].iter().map(|s| s.0).filter(|id| few.iter().all(|f| f.iter().all(|s| s.0 != *id))).collect();
    assert!(!left_out.is_empty(), "{all:?} {few:?}");
    for id in left_out {
        let drawn = ids(&pinned(id, 0.0));
        assert!(drawn.iter().all(|f| f.iter().any(|s| s.0 == id)), "{id:08x}: {drawn:?}");
    }
}

/// The camera goes past a pillar that hides a far block for a while: what is pinned is the same stroke before and after.
#[test]
fn a_pinned_stroke_that_was_hidden_is_the_same_again() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let far = primitives::block(Vec3::new(0.5, 0.5, 0.5));
    let pillar =
        shape(primitives::block(Vec3::new(0.45, 3.0, 0.1)), Mat4::from_translation(Vec3::new(0.0, 0.0, 2.5)));
    let scene = scene(vec![shape(far, Mat4::from_translation(Vec3::Z * -1.0)), pillar]);
    let cameras: Vec<Camera> = (0..60)
        .map(|i| {
            let eye = Vec3::new(-1.5 + 0.05 * i as f32, 0.9, 5.0);
            Camera { to_world: look_along(eye, -Vec3::Z - Vec3::Y * 0.12, Vec3::Y), ..camera(eye) }
        })
        .collect();
    let of_block = |style: &Style| -> Vec<Vec<u32>> {
        let all = identities(&gpu, &scene, &cameras, style).into_iter();
        all.map(|f| f.into_iter().filter(|s| s.1 == 1).map(|s| s.0).collect()).collect()
    };
    let plain = of_block(&Style::default());
    let hidden = (0..60).filter(|i| plain[*i].is_empty()).count();
    assert!(hidden > 8, "the block is hidden for {hidden} frames");
    // Others come back as new ones.
    let (first, last) = (&plain[0], &plain[59]);
    assert!(!first.is_empty() && !last.is_empty() && first.iter().all(|id| !last.contains(id)), "{plain:?}");
    let both: Vec<u32> = first
        .iter()
        .copied()
        .filter(|id| {
            let film = of_block(&pinned(*id, Style::default().controls.detail));
            film[0].contains(id) && film[59].contains(id)
        })
        .collect();
    // Contours slide over the surface; the block's own edges do not.
    assert!(2 * both.len() >= first.len(), "{both:?} of {first:?}");
}

/// What is far and low is lost in mist; what is near is not, nor the top of what is tall.
#[test]
fn mist_swallows_what_is_far_and_low() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let block = |size: [f32; 3], at: [f32; 3]| {
        shape(primitives::block(Vec3::from(size)), Mat4::from_translation(Vec3::from(at)))
    };
    let scene = scene(vec![
        block([0.8, 0.8, 0.8], [-0.9, 0.0, 2.0]),
        block([7.0, 2.0, 6.0], [7.0, 0.0, -30.0]),
        block([4.0, 24.0, 4.0], [-5.0, 11.0, -30.0]),
    ]);
    let view = camera(Vec3::new(0.0, 1.2, 6.0));
    let paint = |mist: f32| {
        let mut style = Style::default();
        style.controls.set("mist", mist).unwrap();
        let mut painter = Painter::new(&gpu.device, &gpu.queue, &scene, &view, style, 2).unwrap();
        let painting = painter.paint(&view).unwrap();
        [1, 2, 3].map(|shape| {
            let of_it = painting.strokes.iter().filter(|s| s.shape == shape);
            of_it.map(|s| s.points.iter().map(|p| p.ink * p.radius).sum::<f32>()).sum::<f32>()
        })
    };
    let (clear, misty) = (paint(0.0), paint(0.5));
    assert!(clear.iter().all(|ink| *ink > 1.0), "{clear:?}");
    assert!(misty[1] < 0.05 * clear[1], "{misty:?} of {clear:?}");
    assert!(misty[0] > 0.2 * clear[0] && misty[2] > 0.02 * clear[2], "{misty:?} of {clear:?}");
}

/// Whatever was painted before: another style, another size, other values, something that was stopped half way.
#[test]
fn a_painter_that_goes_on_paints_what_a_new_one_does() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let turned = Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2) * Mat4::from_scale(Vec3::splat(2.0));
    let mut first = scene(vec![
        Shape::new("ball", Geometry::Sphere, Mat4::from_translation(Vec3::new(0.0, 0.5, 0.0)), 0),
        Shape::new("table", Geometry::Rectangle, turned, 1),
    ]);
    first.materials.push(Material::lambert(Value::Number(0.8)));
    let mut darker = first.clone();
    darker.materials[1] = Material::lambert(Value::Number(0.05));
    let large = camera(Vec3::new(0.3, 2.0, 4.0));
    let mut small = large.clone();
    small.resize(80, 60);
    let style = |text: &str| {
        yugen_ink::preset::read(text, "own", &yugen_ink::preset::no_pictures).expect("a preset").style
    };
    let styles =
        ["", "size = 2\nbleed = 0.9\npaper = 'silk'", "light = 0.5\nink = 1.2\n[object.ball]\nsize = 3"];
    let styles = styles.map(style);
    let anew = |scene: &Scene, camera: &Camera, style: &Style| {
        let mut painter =
            Painter::new(&gpu.device, &gpu.queue, scene, camera, style.clone(), 2).expect("it can be");
        painter.paint(camera).expect("it can be painted");
        painter.image(true).expect("it can be read").data
    };
    let mut live =
        Painter::new(&gpu.device, &gpu.queue, &first, &large, styles[0].clone(), 2).expect("it can be");
    let mut before = Vec::new();
    for (what, scene, camera, style) in [
        ("first", &first, &large, &styles[0]),
        ("another style", &first, &large, &styles[1]),
        ("smaller", &first, &small, &styles[1]),
        ("of one object", &first, &small, &styles[2]),
        ("large again", &first, &large, &styles[2]),
        ("other values", &darker, &large, &styles[2]),
        ("smaller again", &darker, &small, &styles[0]),
    ] {
        assert!(!live.restyle(style.clone()));
        if what == "other values" {
            live.refill(scene).expect("the same scene");
        }
        // Light is seen in four steps, unless it was seen before; three follow.
        for stop in [3, 4, 0, 1, 2] {
            live.forget();
            let asked = std::cell::Cell::new(0);
            let stopped = live.paint_while(camera, &|| asked.replace(asked.get() + 1) < stop);
            assert_eq!(matches!(stopped, Err(InkError::Stopped)), asked.get() > stop, "{what}: {stop}");
            assert!(stop > 2 || stopped.is_err(), "{what}: {stop}");
        }
        live.forget();
        live.paint(camera).expect("it can be painted");
        let image = live.image(true).expect("it can be read").data;
        assert_eq!(image, anew(scene, camera, style), "{what}");
        assert_ne!(image, before, "{what} is not seen");
        before = image;
    }
    // Tables of what the scene does not have change nothing, and are told.
    let _ = live.restyle(style("[object.bal]\nink = 1\n[material.wood]\nwash = 0"));
    let said = live.unmet_names();
    assert!(said.len() == 2 && said[1].contains("did you mean 'ball'?"), "{said:?}");
    let _ = live.restyle(styles[0].clone());
    live.forget();
    let painting = live.paint(&small).expect("it can be painted");
    assert_eq!(live.image(true).expect("it can be read").data, before);
    // Each stroke is found where it is, and nothing where none is near.
    let [w, h] = [80.0, 60.0];
    for stroke in &painting.strokes {
        let middle = stroke.points[stroke.points.len() / 2].pixel;
        let found = painting.stroke_at(middle, 1.0).expect("there is one");
        assert!(found.distance(middle) <= 0.0, "{}", found.distance(middle));
    }
    assert!(painting.stroke_at(Vec2::new(-w, -h), 5.0).is_none() && !painting.strokes.is_empty());
}

/// A fire beside a wall: from one twelfth of a second to the next the wash changes as little as the mean of its light does.
#[test]
fn a_wash_does_not_flicker_as_fires_do() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let wall = Mat4::from_translation(Vec3::new(0.0, 0.0, -2.0)) * Mat4::from_scale(Vec3::splat(2.0));
    let mut scene = scene(vec![Shape::new("wall", Geometry::Rectangle, wall, 0)]);
    scene.lights.clear();
    let fire = Fire { foot: Vec3::new(-1.5, -1.0, 0.0), ..Fire::default() };
    scene.add_fire("west", &fire, Some(0.06), 0.0).expect("it burns");
    let view = camera(Vec3::new(0.0, 0.0, 3.0));
    let change = |flicker: f32| {
        let mut style = Style::default();
        style.controls.set("flicker", flicker).expect("within its range");
        let mut painter = Painter::new(&gpu.device, &gpu.queue, &scene, &view, style, 2).expect("it can be");
        let mut scene = scene.clone();
        let mut frames = Vec::new();
        for k in 0..6 {
            scene.pose(None, 1.0 + k as f32 / 12.0).expect("it burns");
            painter.pose(&scene).expect("the same scene");
            painter.paint(&view).expect("it can be painted");
            frames.push(painter.image(false).expect("it can be read").data);
        }
        let off = |w: &[Vec<f32>]| w[0].iter().zip(&w[1]).map(|(a, b)| (a - b).abs()).sum::<f32>();
        frames.windows(2).map(off).sum::<f32>() / (5 * frames[0].len()) as f32
    };
    let [steady, half, all] = [0.0, 0.5, 1.0].map(change);
    // What changes while somebody looks is seen once a pose is taken over.
    let style = |flicker: f32| {
        let mut style = Style::default();
        style.controls.set("flicker", flicker).expect("within its range");
        style
    };
    let new =
        |flicker| Painter::new(&gpu.device, &gpu.queue, &scene, &view, style(flicker), 2).expect("it can be");
    let picture = |painter: &mut Painter| {
        painter.paint(&view).expect("it can be painted");
        painter.image(false).expect("it can be read").data
    };
    let mut live = new(1.0);
    let burning = picture(&mut live);
    assert!(live.restyle(style(0.0)) && !live.restyle(style(0.0)));
    live.pose(&scene).expect("the same scene");
    live.forget();
    let calm = picture(&mut live);
    assert!(calm == picture(&mut new(0.0)) && calm != burning);
    println!("{steady} {half} {all}");
    // Measured .0023, .0023 and .0060: what is left is the noise of the light.
    assert!(steady < 0.6 * all && half < 0.6 * all, "{steady} {half} {all}");
}

/// A dark wall of two triangles and of 45 000 has the same wash.
#[test]
fn a_wash_does_not_depend_on_triangles() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let view = camera(Vec3::new(0.0, 0.0, 3.0));
    let [coarse, fine] = [1, 150].map(|n: u32| {
        let at = |i: u32| 2.0 * i as f32 / n as f32 - 1.0;
        let corners = (0..=n).flat_map(|y| (0..=n).map(move |x| [x, y]));
        let cells = (0..n).flat_map(|y| (0..n).map(move |x| y * (n + 1) + x));
        let mesh = Mesh {
            positions: corners.map(|[x, y]| Vec3::new(at(x), at(y), 0.0)).collect(),
            triangles: cells.flat_map(|a| [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]).collect(),
            ..Mesh::default()
        };
        let mut scene = scene(vec![shape(mesh, Mat4::IDENTITY)]);
        // Something white beside it, so that it is dark.
        scene.materials.push(Material::lambert(Value::Rgb(Vec3::splat(0.95))));
        scene.materials[0] = Material::lambert(Value::Rgb(Vec3::splat(0.1)));
        let behind = Mat4::from_translation(Vec3::new(0.0, 0.0, -1.0)) * Mat4::from_scale(Vec3::splat(9.0));
        scene.shapes.push(Shape::new("white", Geometry::Rectangle, behind, 1));
        let mut style = Style::default();
        style.controls.set("wrinkle", 0.0).expect("within its range");
        let mut painter = Painter::new(&gpu.device, &gpu.queue, &scene, &view, style, 2).expect("it can be");
        painter.paint(&view).expect("it can be painted");
        let image = painter.image(false).expect("it can be read");
        let middle = (50..70).flat_map(|y| (70..90).map(move |x| [x, y]));
        middle.map(|[x, y]| image.pixel(x, y)[1]).sum::<f32>() / 400.0
    });
    println!("{coarse} {fine}");
    // Measured .479 both; paper is .9.
    assert!(coarse < 0.6 && (coarse - fine).abs() < 0.05, "{coarse} {fine}");
}
