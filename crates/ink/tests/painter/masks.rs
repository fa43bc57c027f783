//! Masks: on the picture and on surfaces, for each kind of stroke, in pictures and films.

use super::{camera, scene, shape};
use glam::{Mat4, Vec2, Vec3};
use yugen_ink::painter::{Painter, Style};
use yugen_ink::preset;
use yugen_optics::Image;
use yugen_realtime::Gpu;
use yugen_scene::{Camera, Geometry, Material, Scene, Shape, Value, primitives};

/// What a mask is called, and what it is: white at a place in parts of it across and down, or not.
type Draw = fn(f32, f32) -> bool;

const MASKS: [(&str, Draw); 4] =
    [("white", |_, _| true), ("black", |_, _| false), ("right", |x, _| x > 0.5), ("left", |x, _| x < 0.5)];

fn style(text: &str) -> Style {
    let open = |name: &str| {
        let (_, white) = MASKS.iter().find(|m| m.0 == name).ok_or("no such mask")?;
        let n = 64;
        let mut image = Image::rgb(n, n);
        for (i, pixel) in image.data.chunks_exact_mut(3).enumerate() {
            let at = [i % n, i / n].map(|k| (k as f32 + 0.5) / n as f32);
            pixel.fill(f32::from(u8::from(white(at[0], at[1]))));
        }
        Ok((name.into(), image))
    };
    preset::read(text, "own", &open).unwrap_or_else(|e| panic!("{e}")).style
}

/// A ball on a table, and a row of pebbles before it that are dots.
fn still_life() -> (Scene, Camera) {
    let mut shapes = vec![
        Shape::new("ball", Geometry::Sphere, Mat4::from_translation(Vec3::new(0.0, 0.6, 0.0)), 0),
        shape(
            primitives::grid(5.0, 5.0, [6, 6]),
            Mat4::from_translation(Vec3::Y * -0.4) * Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2),
        ),
    ];
    for i in 0..24 {
        let at = Vec3::new(-1.2 + 0.105 * i as f32, -0.35, 1.8);
        let to_world = Mat4::from_translation(at) * Mat4::from_scale(Vec3::splat(0.008));
        shapes.push(Shape::new("pebble", Geometry::Mesh(primitives::ball(8).into()), to_world, 0));
    }
    let mut scene = scene(shapes);
    scene.materials[0] = Material::lambert(Value::Rgb(Vec3::splat(0.3)));
    let mut view = camera(Vec3::new(0.0, 1.2, 4.6));
    view.resize(320, 240);
    (scene, view)
}

fn paint(gpu: &Gpu, scene: &Scene, view: &Camera, style: &Style) -> Image {
    let mut painter =
        Painter::new(&gpu.device, &gpu.queue, scene, view, style.clone(), 2).expect("it can be");
    assert_eq!(painter.unmet_names(), Vec::<String>::new());
    painter.paint(view).expect("it can be painted");
    painter.image(true).expect("it can be read")
}

/// Ink of a layer in columns of the picture: the sum of its alpha.
fn ink(image: &Image, layer: &str, columns: std::ops::Range<usize>) -> f32 {
    let alpha = image.channel(&format!("{layer}.A")).expect("a layer");
    let rows = 0..image.height;
    rows.flat_map(|y| columns.clone().map(move |x| (x, y))).map(|(x, y)| image.pixel(x, y)[alpha]).sum()
}

/// All that a table can say, for all kinds of strokes.
const ALL: &str = "ink = 0.5\nwater = 0.9\ndryness = 0.8\nsize = 1.6\ncontrast = 0.1\ndetail = 0.2\ndistance = 0.9\nmist = 0.2\n\
                   wash = 0.6\nwrinkle = 1.7\nrub = 1.5\nsuggestive = 0.5\ndot = 0.4\ncontour = 0.7\n";

/// A white mask is what a table of all objects is, to the bit; a black one is none.
#[test]
fn a_white_mask_is_a_table_and_a_black_one_is_none() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let (scene, view) = still_life();
    let of = |text: &str| paint(&gpu, &scene, &view, &style(text)).data;
    let (plain, table) = (of(""), of(&format!("[object.\"*\"]\n{ALL}")));
    assert_ne!(plain, table);
    for on in ["picture", "object.*"] {
        let mask = |image: &str| of(&format!("[mask.m]\nimage = '{image}'\non = '{on}'\n{ALL}"));
        assert!(mask("white") == table, "{on}");
        assert!(mask("black") == plain, "{on}");
    }
    // Without ink there is no stroke, whoever says so, and none gives way to it.
    let strokes = |text: &str| -> Vec<u32> {
        let made = Painter::new(&gpu.device, &gpu.queue, &scene, &view, style(text), 2);
        let painting = made.and_then(|mut painter| painter.paint(&view)).expect("it can be painted");
        painting.strokes.iter().map(|s| s.id).collect()
    };
    let by_table = strokes("[object.ball]\nink = 0");
    assert_eq!(strokes("[mask.m]\nimage = 'white'\non = 'object.ball'\nink = 0"), by_table);
    assert!(!by_table.is_empty() && by_table.len() < strokes("").len());
    // A later one changes what an earlier one has made, and both what a table has.
    let both = "[object.\"*\"]\nink = 1.2\n[mask.a]\nimage = 'white'\nink = 0.1\nwash = 0.2\n[mask.b]\nimage = 'white'\nink = 0.6";
    assert!(of(both) == of("[object.\"*\"]\nink = 0.6\nwash = 0.2"));
}

/// Where a mask on the picture is black nothing changes, and every layer has less ink where it is white.
#[test]
fn half_a_mask_changes_half_of_the_picture() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let (scene, view) = still_life();
    let base = "rub = 2\nlight = 0.3\n";
    let plain = paint(&gpu, &scene, &view, &style(base));
    let half = paint(&gpu, &scene, &view, &style(&format!("{base}[mask.m]\nimage = 'right'\nink = 0.1")));
    let (w, n) = (plain.width, plain.channels.len());
    // As far as water flows in 33 steps of a pixel, from where a print of a wash reaches.
    let margin = 40;
    let same = |x: usize| (0..plain.height).all(|y| plain.pixel(x, y) == half.pixel(x, y));
    let first = (0..w).find(|x| !same(*x)).expect("something changes");
    assert!(first + margin > w / 2, "{first}");
    assert!(n > 3 + 4 * 4);
    for layer in ["ran", "cun", "ca", "gou", "dian"] {
        let of = |image: &Image| ink(image, layer, w / 2 + margin..w);
        let (before, after) = (of(&plain), of(&half));
        assert!(before > 3.0 && after < 0.6 * before, "{layer}: {after} of {before}");
    }
    // A corner that is left blank: no ink, and strokes end at it.
    let text = format!("{base}[mask.m]\nimage = 'right'\nink = 0");
    let blank = paint(&gpu, &scene, &view, &style(&text));
    for layer in ["ran", "cun", "ca", "gou", "dian"] {
        let left = ink(&blank, layer, w / 2 + margin..w);
        let [before, after] = [&plain, &blank].map(|image| ink(image, layer, 0..w / 2 - margin));
        assert!(left < 1e-3 && after > 0.8 * before && before > 0.5, "{layer}: {left}, {after} of {before}");
    }
}

/// Texture coordinates of the unit ball at a point of it.
fn uv(p: Vec3) -> Vec2 {
    let turn = p.y.atan2(p.x) / std::f32::consts::TAU;
    Vec2::new(turn.rem_euclid(1.0), p.z.clamp(-1.0, 1.0).acos() / std::f32::consts::PI)
}

/// A ball that turns about its axis, of which one side is masked: in every frame strokes and washes are on the other side alone,
/// wherever the seam of its texture is.
#[test]
fn a_mask_on_a_surface_moves_with_it() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut view = camera(Vec3::new(0.0, 2.2, 3.4));
    view.resize(320, 240);
    // Its axis upright, so that its outline goes through all u.
    let upright = Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let turned = |i: u32| Mat4::from_rotation_y(0.7 * i as f32) * upright;
    let mut ball = scene(vec![Shape::new("ball", Geometry::Sphere, turned(0), 0)]);
    ball.name_material(0, "wet clay");
    let bare = "wrinkle = 2\nrub = 2\nlight = 0.3\nbleed = 0\n";
    for on in ["", "object.ball", "material.wet*"] {
        let mask = match on {
            "" => String::new(),
            _ => format!("[mask.m]\nimage = 'left'\non = '{on}'\nink = 0"),
        };
        let text = [bare, &mask].concat();
        let mut painter = Painter::new(&gpu.device, &gpu.queue, &ball, &view, style(&text), 2).unwrap();
        let eye = view.to_world.w_axis.truncate();
        let mut seen = [[0; 2]; 2];
        for frame in 0..9 {
            ball.shapes[0].to_world = turned(frame);
            painter.pose(&ball).unwrap();
            let painting = painter.paint(&view).unwrap();
            let image = painter.image(true).unwrap();
            let projection = yugen_ink::projection::Projection::new(&view).unwrap();
            // The point of the ball that a pixel shows, or that is nearest to what it does.
            let at = |pixel: Vec2| -> Vec3 {
                let way = -projection.to_eye_at(pixel.as_dvec2()).as_vec3();
                let b = eye.dot(way);
                let inside = b * b - eye.length_squared() + 1.0;
                (eye + way * (-b - inside.max(0.0).sqrt())).normalize()
            };
            let own = turned(frame).inverse();
            let side = |pixel: Vec2| uv(own.transform_vector3(at(pixel))).x;
            for stroke in painting.strokes.iter().filter(|s| !s.fading) {
                for point in &stroke.points {
                    let u = side(point.pixel);
                    // Strokes stray by pixels, and hidden runs shorter than six are bridged.
                    seen[0][usize::from(u < 0.5)] += 1;
                    let is_masked = !on.is_empty() && (0.06..0.44).contains(&u);
                    assert!(!is_masked, "{on}, frame {frame}: {u} at {}", point.pixel);
                }
            }
            let alpha = ["ran", "cun", "ca"].map(|l| image.channel(&format!("{l}.A")).unwrap());
            for y in 0..image.height {
                for x in 0..image.width {
                    let pixel = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                    let point = at(pixel);
                    // Well within the ball, where a print of a few pixels is a small part of a turn; not at its pole.
                    let facing = point.dot((eye - point).normalize());
                    if facing < 0.35 || own.transform_vector3(point).z.abs() > 0.8 {
                        continue;
                    }
                    let u = side(pixel);
                    let inked = alpha.iter().any(|a| image.pixel(x, y)[*a] > 0.02);
                    seen[1][usize::from(u < 0.5)] += usize::from(inked);
                }
            }
        }
        println!("{on}: {seen:?}");
        if on.is_empty() {
            // Both sides have as much.
            assert!(seen.iter().all(|[a, b]| 2 * a > *b && 2 * b > *a), "{seen:?}");
            continue;
        }
        // Measured 3017 points of strokes and 94 953 pixels of the other side, 50 and 3698 of the masked one, at its edges.
        assert!(seen[0][0] > 500 && 8 * seen[0][1] < seen[0][0], "{seen:?}");
        assert!(seen[1][0] > 20_000 && 10 * seen[1][1] < seen[1][0], "{seen:?}");
    }
}

/// What no mask can lie on is told, and painted as it would be; a mask that comes and goes while somebody looks is seen.
#[test]
fn masks_come_and_go_and_those_that_lie_nowhere_are_told() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let (mut scene, view) = still_life();
    let mut bare = primitives::ball(24);
    bare.uvs.clear();
    scene.shapes[0] = Shape::new("bare", Geometry::Mesh(bare.into()), Mat4::IDENTITY, 0);
    let mask = |on: &str| style(&format!("[mask.m]\nimage = 'left'\non = '{on}'\nink = 0.1\nwrinkle = 0"));
    let mut painter = Painter::new(&gpu.device, &gpu.queue, &scene, &view, Style::default(), 2).unwrap();
    let mut paint = |style: Style| {
        assert!(!painter.restyle(style));
        painter.forget();
        painter.paint(&view).unwrap();
        (painter.image(true).unwrap().data, painter.unmet_names())
    };
    let plain = paint(Style::default());
    let (image, said) = paint(mask("object.bare"));
    assert!(image == plain.0 && said.len() == 1, "{said:?}");
    assert!(said[0].contains("[mask.m] changes nothing: the mesh of object.bare has no texture"), "{said:?}");
    let (image, said) = paint(mask("material.bronze"));
    assert!(image == plain.0 && said.len() == 1 && said[0].contains("no material 'bronze'"), "{said:?}");
    let (pebbles, said) = paint(mask("object.peb*"));
    assert!(pebbles != plain.0 && said.is_empty(), "{said:?}");
    let (image, _) = paint(mask("object.it"));
    assert!(image != plain.0 && image != pebbles);
    assert!(paint(Style::default()) == plain);
}
