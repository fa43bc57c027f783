//! What strokes do from frame to frame: how many come and go, and how far their marks slip.

use crate::robe;
use crate::surfaces::{camera, scene, torus};
use glam::{DVec2, DVec3, Mat4, Vec2, Vec3};
use std::collections::HashSet;
use std::path::PathBuf;
use yugen_ink::contour::to_world;
use yugen_ink::depth::DepthMap;
use yugen_ink::painter::{Painter, Style};
use yugen_ink::projection::Projection;
use yugen_ink::stroke::StrokePoint;
use yugen_optics::Image;
use yugen_optics::colour::linear_to_srgb;
use yugen_realtime::{Gpu, Options, Stage};
use yugen_scene::prepared::{Rows, VertexRow};
use yugen_scene::{Aov, Camera, Scene};

/// Pixels across and down.
const SIZE: [u32; 2] = [640, 360];

const SPOT: &str = "mesh/spot/spot_triangulated.obj";

/// A scene of the folder that `YUGEN_DATA` names; without one it is said that the test is skipped, but in CI.
fn data(name: &str) -> Option<Scene> {
    let Some(folder) = std::env::var_os("YUGEN_DATA").map(PathBuf::from) else {
        assert!(
            std::env::var_os("CI").is_none(),
            "YUGEN_DATA is not set, which must name the folder of {name}"
        );
        println!("skipped: YUGEN_DATA is not set, which names the folder of {name}");
        return None;
    };
    let file = folder.join(name);
    Some(yugen_archive::formats::load_scene(&file, &Default::default()).unwrap_or_else(|e| panic!("{e}")))
}

/// A camera that goes round the origin about an axis.
fn turned(camera: &Camera, axis: Vec3, degrees: f32) -> Camera {
    let mut turned = camera.clone();
    turned.to_world = Mat4::from_axis_angle(axis, degrees.to_radians()) * camera.to_world;
    turned
}

/// Means over frames.
#[derive(Clone, Copy, Debug, Default)]
struct Measured {
    strokes: f64,
    /// Parts of the strokes that are new, and that are gone, a frame; and the same by what each frame calls its strokes alone.
    born: f64,
    died: f64,
    born_alone: f64,
    /// Pixels, mean and of the worst twentieth.
    slip: [f64; 2],
}

/// Moves a scene to a frame.
type Pose<'a> = &'a dyn Fn(&mut Scene, usize);

/// `pose`: of a scene that moves.
fn measure(gpu: &Gpu, scene: &Scene, cameras: &[Camera], pose: Option<Pose>) -> Measured {
    let mut scene = scene.clone();
    let new = |scene: &Scene| {
        Painter::new(&gpu.device, &gpu.queue, scene, &cameras[0], Style::default(), 2).unwrap()
    };
    let (mut painter, mut alone) = (new(&scene), new(&scene));
    let mut sum = Measured::default();
    let (mut before, mut before_alone): (HashSet<u32>, HashSet<u32>) = Default::default();
    for (i, camera) in cameras.iter().enumerate() {
        if let Some(pose) = pose {
            pose(&mut scene, i);
            painter.pose(&scene).unwrap();
            alone.pose(&scene).unwrap();
        }
        let (strokes, change) = painter.follow(camera).unwrap();
        let ids: HashSet<u32> = strokes.iter().filter(|s| !s.fading).map(|s| s.id).collect();
        assert_eq!(ids.len(), change.strokes, "every stroke has an identity of its own");
        alone.forget();
        let ids_alone: HashSet<u32> = alone.follow(camera).unwrap().0.iter().map(|s| s.id).collect();
        if i > 0 {
            let new = ids.difference(&before).count();
            assert_eq!(new, change.born + change.split);
            assert_eq!(before.difference(&ids).count(), change.died);
            sum.born += new as f64;
            sum.died += change.died as f64;
            sum.strokes += ids.len() as f64;
            sum.born_alone += ids_alone.difference(&before_alone).count() as f64;
            (0..2).for_each(|k| sum.slip[k] += f64::from(change.slip[k]));
        }
        (before, before_alone) = (ids, ids_alone);
    }
    let (n, all) = ((cameras.len() - 1) as f64, sum.strokes.max(1.0));
    Measured {
        strokes: sum.strokes / n,
        born: sum.born / all,
        died: sum.died / all,
        born_alone: sum.born_alone / all,
        slip: sum.slip.map(|s| s / n),
    }
}

/// The heads of the table.
fn show_heads() {
    println!(
        "| | strokes | new, % a frame | gone, % a frame | new, each frame alone | slip, px | worst twentieth |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- |");
}

fn show(name: &str, m: &Measured) {
    println!(
        "| {name} | {:.1} | {:.1} | {:.1} | {:.0} | {:.2} | {:.2} |",
        m.strokes,
        100.0 * m.born,
        100.0 * m.died,
        100.0 * m.born_alone,
        m.slip[0],
        m.slip[1]
    );
}

/// A figure of twelve meshes that walks, whose strokes its own limbs hide and show, at 24 frames a second and at 96.
#[test]
fn strokes_stay_on_a_figure_that_walks() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let Some(mage) = data("mesh/Mage.glb") else { return };
    let view = mage.look_through(None, Some(SIZE), None).unwrap();
    show_heads();
    for rate in [24.0, 96.0] {
        let pose = |scene: &mut Scene, i: usize| scene.pose(Some("Walking_A"), i as f32 / rate).unwrap();
        let m = measure(&gpu, &mage, &vec![view.clone(); 25], Some(&pose));
        show(&format!("Mage, {rate} frames a second"), &m);
        // Measured 3.2 and 4.0 % at 24 frames a second, 1.0 and 1.3 % at 96; slip .53 and .19.
        let most = if rate < 50.0 { 0.06 } else { 0.02 };
        assert!(m.strokes > 60.0 && m.born < most && m.died < most && m.slip[1] < 1.0, "{m:?}");
        assert!(m.born_alone > 4.0 * m.born, "{m:?}");
    }
}

/// Half a degree a frame, by which the literature is measured.
#[test]
fn strokes_stay_on_a_turntable() {
    let Some(gpu) = Gpu::for_tests() else { return };
    // Most that may be new a frame. Measured: none, 2.1 % (one fold that breaks, of 1.6 strokes, in 60 frames) and .8 %; asked is
    // 2 %. Slip .21, .37 and .11 pixels, of the worst twentieth .62, .67 and .38; asked is 1.
    let mut cases: Vec<(&str, f64, Scene, Vec<Camera>)> = Vec::new();
    let view = camera(4.5, SIZE);
    let about = |axis: Vec3| (0..60).map(|i| turned(&view, axis, 0.5 * i as f32)).collect::<Vec<_>>();
    cases.push(("torus about its axis", 0.01, scene(torus(48)), about(Vec3::Z)));
    cases.push(("torus across it", 0.05, scene(torus(48)), about(Vec3::X)));
    if let Some(spot) = data(SPOT) {
        let view = spot.look_through(None, Some(SIZE), None).unwrap();
        let round = (0..60).map(|i| turned(&view, Vec3::Y, 0.5 * i as f32)).collect();
        cases.push(("Spot", 0.02, spot, round));
    }
    show_heads();
    for (name, most, scene, cameras) in &cases {
        let m = measure(&gpu, scene, cameras, None);
        show(name, &m);
        assert!(m.strokes >= 1.0 && m.born <= *most && m.died <= *most, "{m:?}");
        assert!(m.slip[1] <= 1.0 && m.slip[0] <= 0.6, "{m:?}");
        // Sabotage: without a memory the names of most strokes would be others in every frame.
        assert!(m.born_alone > 0.08, "{m:?}");
    }
}

/// A picture that stands still stays, stroke by stroke; what is forgotten begins anew, and the same film is the same.
#[test]
fn nothing_changes_where_nothing_moves() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let (view, scene) = (camera(4.5, SIZE), scene(torus(24)));
    let new = || Painter::new(&gpu.device, &gpu.queue, &scene, &view, Style::default(), 2).unwrap();
    let (mut painter, mut other) = (new(), new());
    // What was drawn is more readily drawn than what was not: ends of strokes come to rest within a few frames.
    let first = (0..8).map(|_| painter.follow(&view).unwrap().0).last().unwrap();
    for _ in 0..3 {
        let (again, change) = painter.follow(&view).unwrap();
        assert_eq!((change.born, change.split, change.died), (0, 0, 0));
        assert_eq!(again.len(), first.len());
        for (a, b) in again.iter().zip(&first) {
            assert_eq!((a.id, a.seed, a.points.len()), (b.id, b.seed, b.points.len()));
            let apart = |(p, q): (&StrokePoint, &StrokePoint)| {
                p.pixel.distance(q.pixel) + (p.phase - q.phase).abs() + (p.pressure - q.pressure).abs()
            };
            let most = a.points.iter().zip(&b.points).map(apart).fold(0.0, f32::max);
            assert!(most < 0.05, "{most}");
        }
    }
    let there = turned(&view, Vec3::Z, 1.0);
    let film = |painter: &mut Painter| {
        painter.forget();
        let frames = [&view, &there, &view].map(|camera| painter.follow(camera).unwrap().0);
        frames.concat()
    };
    assert!(film(&mut painter) == film(&mut other), "the same film");
    // A cut: from the other side nothing is what it was, and everything is there at once.
    let cut = painter.follow(&turned(&view, Vec3::Y, 140.0)).unwrap();
    assert!(!cut.0.is_empty() && cut.0.iter().all(|s| !s.fading), "{:?}", cut.1);
}

/// Pixels across and down of pictures that are painted: small, for they are many.
const PAINTED: [u32; 2] = [480, 270];
/// Frames by which strokes of the robe are followed: a second.
const ROBE: usize = 25;
/// Pixels around a surface that move with it: lines are as wide.
const BAND: i32 = 6;

/// Greys of a picture as a display shows them, 0 to 255.
fn greys(image: &Image) -> Vec<f32> {
    let n = image.channels.len();
    image.data.chunks_exact(n).map(|p| 255.0 * linear_to_srgb((p[0] + p[1] + p[2]) / 3.0)).collect()
}

/// Surfaces as a camera sees them at a moment.
struct Moment {
    camera: Camera,
    map: DepthMap,
    /// Places of all vertices in the world.
    places: Vec<Vec<DVec3>>,
    /// Of each draw, as the places are counted.
    triangles: Vec<Vec<[u32; 3]>>,
}

impl Moment {
    fn new(rows: &Rows, camera: &Camera) -> Self {
        let map = DepthMap::of(rows, &Projection::new(camera).unwrap(), &|_| None, 2).expect("all is opaque");
        let mut this = Self { camera: camera.clone(), map, places: Vec::new(), triangles: Vec::new() };
        for draw in &rows.draws {
            let mesh = rows.meshes[draw.mesh as usize];
            let range = |first: u32, count: u32| first as usize..(first + count) as usize;
            let world = to_world(draw);
            let of_mesh = &rows.vertices[range(mesh.first_vertex, mesh.vertices)];
            let place = |v: &VertexRow| world(DVec3::from_array(v.position.map(f64::from)));
            this.places.push(of_mesh.iter().map(place).collect());
            let own = rows.triangles[range(draw.first_triangle, draw.triangles)].iter();
            this.triangles.push(own.map(|t| t.map(|v| v - mesh.first_vertex)).collect());
        }
        this
    }
}

/// Where each pixel was in the picture before, by what is seen there; `None` where it was not seen, and where nothing is near.
fn motion(now: &Moment, before: &Moment) -> Vec<Option<Vec2>> {
    let [p, q] = [now, before].map(|moment| Projection::new(&moment.camera).unwrap());
    let eye = p.eye();
    let [w, h] = PAINTED.map(|n| n as i32);
    let mut of_pixel: Vec<Option<Vec2>> = vec![None; (w * h) as usize];
    for ((triangles, places), were) in now.triangles.iter().zip(&now.places).zip(&before.places) {
        for t in triangles {
            let [a, b, c] = t.map(|v| places[v as usize]);
            let [Some(i), Some(j), Some(k)] = [a, b, c].map(|v| p.project(v)) else { continue };
            let [i, j, k] = [i, j, k].map(|v| v.pixel);
            let (low, high) = (i.min(j).min(k).floor(), i.max(j).max(k).ceil());
            for y in (low.y as i32).max(0)..(high.y as i32).min(h) {
                for x in (low.x as i32).max(0)..(high.x as i32).min(w) {
                    let at = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    // The eye's ray against the plane of the triangle (Möller and Trumbore 1997).
                    let (way, u, v) = (-p.to_eye_at(at), b - a, c - a);
                    let across = way.cross(v);
                    let whole = u.dot(across);
                    let s = (eye - a).dot(across) / whole;
                    let normal = (eye - a).cross(u);
                    let t_v = way.dot(normal) / whole;
                    if !(s >= -1e-6 && t_v >= -1e-6 && s + t_v <= 1.0 + 1e-6) {
                        continue;
                    }
                    let depth = p.depth(a + u * s + v * t_v);
                    let seen = f64::from(now.map.at(at.as_vec2()).0);
                    if (depth - seen).abs() > 1e-3 * seen {
                        continue;
                    }
                    let [a, b, c] = t.map(|v| were[v as usize]);
                    let Some(there) = q.project(a + (b - a) * s + (c - a) * t_v) else { continue };
                    let known = f64::from(before.map.at(there.pixel.as_vec2()).0);
                    if (known - there.depth).abs() < 0.02 * there.depth {
                        of_pixel[(y * w + x) as usize] = Some((there.pixel - at).as_vec2());
                    }
                }
            }
        }
    }
    let shape = &now.map.shape;
    (0..w * h)
        .map(|i| {
            let (x, y) = (i % w, i / w);
            let on = |x: i32, y: i32| {
                ((0..w).contains(&x) && (0..h).contains(&y) && shape[(y * w + x) as usize] > 0)
                    .then_some((y * w + x) as usize)
            };
            if let Some(own) = on(x, y) {
                return of_pixel[own];
            }
            let around = (-BAND..=BAND).flat_map(|dy| (-BAND..=BAND).map(move |dx| (dx, dy)));
            let near = around.filter_map(|(dx, dy)| Some((dx * dx + dy * dy, on(x + dx, y + dy)?)));
            near.min().and_then(|(_, own)| of_pixel[own])
        })
        .collect()
}

/// Bilinear.
fn look_up(greys: &[f32], at: Vec2) -> Option<f32> {
    let [w, h] = PAINTED.map(|n| n as usize);
    let p = at - 0.5;
    if p.x < 0.0 || p.y < 0.0 || p.x >= (w - 1) as f32 || p.y >= (h - 1) as f32 {
        return None;
    }
    let (x, y, f) = (p.x as usize, p.y as usize, p.fract());
    let row = |y: usize| greys[y * w + x] * (1.0 - f.x) + greys[y * w + x + 1] * f.x;
    Some(row(y) * (1.0 - f.y) + row(y + 1) * f.y)
}

/// Means over frames of how much a picture differs from the one before moved to it, of 255; the part of pixels that differ by
/// more than a quarter of white; and the contrast of its edges, which a blur would take away: the mean slope of the steepest
/// fiftieth of its pixels.
fn flicker(pictures: &[Vec<f32>], motions: &[Vec<Option<Vec2>>]) -> [f64; 3] {
    let [w, h] = PAINTED.map(|n| n as usize);
    let (mut sum, mut pops, mut count) = (0.0, 0.0, 0.0);
    for (pair, motion) in pictures.windows(2).zip(motions) {
        for (i, moved) in motion.iter().enumerate() {
            let at = Vec2::new((i % w) as f32 + 0.5, (i / w) as f32 + 0.5);
            let Some(before) = moved.and_then(|m| look_up(&pair[0], at + m)) else { continue };
            let off = f64::from((pair[1][i] - before).abs());
            (sum, pops, count) = (sum + off, pops + f64::from(u8::from(off > 64.0)), count + 1.0);
        }
    }
    let last = &pictures[pictures.len() - 1];
    let mut slopes: Vec<f32> = (w + 1..w * (h - 1) - 1)
        .map(|i| Vec2::new(last[i + 1] - last[i - 1], last[i + w] - last[i - w]).length() / 2.0)
        .collect();
    slopes.sort_by(f32::total_cmp);
    let steepest = &slopes[slopes.len() - slopes.len() / 50..];
    let contrast = steepest.iter().sum::<f32>() / steepest.len() as f32;
    [sum / count, pops / count, f64::from(contrast)]
}

/// What is looked at in each frame, and how what moves is posed.
struct Shot<'a> {
    name: &'static str,
    /// Most that a film may differ, and that its pixels may change by a quarter, beside the slides' method.
    most: [f64; 2],
    scene: Scene,
    cameras: Vec<Camera>,
    pose: Option<Pose<'a>>,
}

/// How much pictures of a shot flicker: as a film, each frame by itself, by the slides' method, and rendered plainly.
fn flickers(gpu: &Gpu, Shot { name, scene, cameras, pose, .. }: Shot) -> [[f64; 3]; 4] {
    let frames = cameras.len();
    let mut scene = scene;
    let mut at = |i: usize| -> Scene {
        pose.iter().for_each(|pose| pose(&mut scene, i));
        scene.clone()
    };
    let first = at(0);
    let mut rows = Rows::new(&first).unwrap();
    let options = Options { aovs: vec![Aov::Id], ..Options::new(PAINTED, Some(1)) };
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options).unwrap();
    let new = |scene: &Scene| {
        Painter::new(&gpu.device, &gpu.queue, scene, &cameras[0], Style::default(), 2).unwrap()
    };
    let (mut film, mut alone) = (new(&first), new(&first));
    let mut moments: Vec<Moment> = Vec::new();
    let mut pictures: [Vec<Vec<f32>>; 4] = Default::default();
    for (i, camera) in cameras.iter().enumerate() {
        let scene = at(i);
        if pose.is_some() {
            rows.pose(&scene).unwrap();
            assert!(stage.pose(&rows).unwrap());
            film.pose(&scene).unwrap();
            alone.pose(&scene).unwrap();
        }
        moments.push(Moment::new(&rows, camera));
        for (k, painter) in [&mut film, &mut alone].into_iter().enumerate() {
            if k == 1 {
                painter.forget();
            }
            painter.paint(camera).unwrap();
            pictures[k].push(greys(&painter.image(false).unwrap()));
        }
        pictures[2].push(greys(&alone.paint_literally(&scene, camera).unwrap()));
        for _ in 0..32 {
            stage.frame(camera).unwrap();
        }
        pictures[3].push(greys(&stage.image().unwrap().select(&["R", "G", "B"]).unwrap()));
    }
    let motions: Vec<_> = moments.windows(2).map(|pair| motion(&pair[1], &pair[0])).collect();
    let moved = motions.iter().flatten().flatten().count();
    assert!(moved > 3000 * (frames - 1), "{name}: {moved} pixels are followed");
    let ways = ["a film", "each frame alone", "the slides' method", "plain rendering"];
    let mut ways = ways.iter();
    pictures.map(|pictures| {
        let m = flicker(&pictures, &motions);
        let way = ways.next().unwrap();
        println!("| {name} | {way} | {:.2} | {:.1} | {:.0} |", m[0], 1000.0 * m[1], m[2]);
        m
    })
}

/// A film flickers less than pictures that are painted each by itself, and not by being blurred; a plain rendering, of which
/// only light and sampling change, is what is possible, the slides' method what is compared with.
#[test]
fn films_flicker_less_than_pictures_one_by_one() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut shots: Vec<Shot> = Vec::new();
    let frames = 9;
    if let Some(scene) = data(SPOT) {
        let view = scene.look_through(None, Some(PAINTED), None).unwrap();
        let cameras = (0..frames).map(|i| turned(&view, Vec3::Y, 0.5 * i as f32)).collect();
        // Measured 2.48 against 3.84, and 3.2 against 11.8.
        let (name, most) = ("Spot, turned by half a degree", [0.8, 0.5]);
        shots.push(Shot { name, most, scene, cameras, pose: None });
    }
    let walk = |scene: &mut Scene, i: usize| scene.pose(Some("Walking_A"), i as f32 / 24.0).unwrap();
    if let Some(scene) = data("mesh/Mage.glb") {
        let view = scene.look_through(None, Some(PAINTED), None).unwrap();
        // Measured 8.25 against 8.29, and 10.0 against 20.2.
        let (name, most, cameras) = ("a figure that walks", [1.05, 0.7], vec![view; frames]);
        shots.push(Shot { name, most, scene, cameras, pose: Some(&walk) });
    }
    let dance = |scene: &mut Scene, i: usize| scene.pose(None, i as f32 / 24.0).unwrap();
    // Measured 3.32 against 2.70, whose edges have three fifths of the contrast, and 6.7 against 6.9.
    let (name, most, cameras) = ("a robe that is danced in", [1.4, 1.3], vec![robe::view(PAINTED); ROBE / 2]);
    shots.push(Shot { name, most, scene: robe::robe(), cameras, pose: Some(&dance) });
    println!("| | | difference, of 255 | changed by a quarter, of 1000 | contrast of edges |");
    println!("| --- | --- | --- | --- | --- |");
    for shot in shots {
        let (name, most) = (shot.name, shot.most);
        let [film, alone, literal, _] = flickers(&gpu, shot);
        assert!(film[0] < alone[0] && film[1] < alone[1] && film[2] > 0.9 * alone[2], "{name}");
        let beside = [0, 1].map(|k| film[k] / literal[k]);
        assert!(beside[0] < most[0] && beside[1] < most[1], "{name}: {film:?} {literal:?}");
        assert!(film[0] / film[2] < literal[0] / literal[2], "{name}: {film:?} {literal:?}");
    }
}

/// A robe whose folds come and go while it is danced in, at 24 frames a second.
#[test]
fn strokes_stay_on_a_robe_that_is_danced_in() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let robe = robe::robe();
    let pose = |scene: &mut Scene, i: usize| scene.pose(None, i as f32 / 24.0).unwrap();
    let m = measure(&gpu, &robe, &vec![robe::view(SIZE); ROBE], Some(&pose));
    show_heads();
    show("robe, 24 frames a second", &m);
    // Measured 2.4 and 3.3 % of 58 strokes, 10 % where each frame is by itself; slip .12, of the worst twentieth .42.
    assert!(m.strokes > 30.0 && m.born < 0.07 && m.died < 0.08 && m.slip[1] < 1.0, "{m:?}");
    assert!(m.born_alone > 2.0 * m.born, "{m:?}");
}
