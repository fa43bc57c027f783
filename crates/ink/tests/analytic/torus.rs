//! Contours of a torus, whose zero set is known as exactly as one likes.

use crate::surfaces::{Cells, MAJOR, MINOR, camera, point, scene, torus};
use glam::{DVec2, DVec3, Vec2};
use std::f64::consts::TAU;
use yugen_ink::contour::{LineKind, Surface, to_world};
use yugen_ink::literal;
use yugen_ink::projection::Projection;
use yugen_ink::topology::{Creases, Topology};
use yugen_ink::visibility::{Cleaning, DepthMap, SampledLine, sample};
use yugen_realtime::{Gpu, Options, Stage};
use yugen_scene::prepared::Rows;
use yugen_scene::{Aov, Filter, Scene};

/// The zero set of N · (eye − P) by bisection along every circle of the tube: points in the world.
fn zero_set(projection: &Projection, circles: u32) -> Vec<DVec3> {
    let mut zeros = Vec::new();
    for i in 0..circles {
        let u = TAU * f64::from(i) / f64::from(circles);
        let g = |v: f64| {
            let (p, n) = point(u, v);
            n.dot(projection.to_eye(p))
        };
        let steps = 720;
        for j in 0..steps {
            let [mut a, mut b] = [j, j + 1].map(|k| TAU * f64::from(k) / f64::from(steps));
            if (g(a) >= 0.0) == (g(b) >= 0.0) {
                continue;
            }
            for _ in 0..50 {
                let m = 0.5 * (a + b);
                if (g(a) >= 0.0) == (g(m) >= 0.0) { a = m } else { b = m }
            }
            zeros.push(point(u, a).0);
        }
    }
    zeros
}

struct Placed {
    rows: Rows,
    topology: Topology,
}

impl Placed {
    fn new(scene: &Scene) -> Self {
        let rows = Rows::new(scene).unwrap();
        let topology = Topology::new(&rows.vertices, &rows.triangles, 0, &Creases::default(), true);
        Self { rows, topology }
    }

    fn with<T>(&self, f: impl FnOnce(&Surface) -> T) -> T {
        let world = to_world(&self.rows.draws[0]);
        let place = |v: u32| world(DVec3::from_array(self.rows.vertices[v as usize].position.map(f64::from)));
        f(&Surface::new(&self.topology, &self.rows.vertices, &self.rows.draws[0], &place))
    }
}

/// Root mean square distance in pixels to the zero set of contours by a view vector of each vertex, and by one for all.
fn errors(across: u32, distance: f64) -> [f64; 2] {
    let projection = Projection::new(&camera(distance, [1920, 1080])).unwrap();
    let placed = Placed::new(&scene(torus(across)));
    let exact = zero_set(&projection, 20_000);
    let cells = Cells::new(exact.iter().filter_map(|p| projection.project(*p)).map(|p| p.pixel));
    let rms = |points: Vec<DVec3>| {
        assert!(points.len() > 100);
        let squares =
            points.iter().filter_map(|p| projection.project(*p)).map(|p| cells.nearest(p.pixel).powi(2));
        (squares.sum::<f64>() / points.len() as f64).sqrt()
    };
    placed.with(|surface| {
        let lines = surface.contours(&|p| projection.to_eye(p), 0);
        let ours = lines.iter().flat_map(|l| l.points.iter().map(|p| p.position)).collect();
        let v = projection.to_eye(DVec3::ZERO);
        let literal = literal::silhouettes(surface, &placed.topology, v, |_, _| 0.0);
        [rms(ours), rms(literal.iter().flat_map(|s| s.map(|e| e.0)).collect())]
    })
}

/// The slides' single view vector is that of parallel rays and stays wrong however fine the mesh is; ours converges.
#[test]
fn contours_are_right_under_perspective() {
    // Measured: ours 1.63 and .115, theirs 14.1 and 13.3; from other heights 1.6 to 1.9, .12, and 8 to 15. A mesh that is
    // sixteen times as fine is sixteen times as near, once.
    for (across, ours_most) in [(24, 3.0), (96, 0.25)] {
        let [ours, theirs] = errors(across, 4.5);
        println!("{} triangles: ours {ours:.3} px, one view vector {theirs:.2} px", 4 * across * across);
        assert!(ours < ours_most && theirs > 7.0);
    }
    let [far_ours, far_theirs] = errors(96, 12.4);
    println!("far: {far_ours:.3} {far_theirs:.3}");
    assert!(far_ours < 0.15 && far_theirs > 2.0 * far_ours);
}

#[test]
fn contours_of_a_closed_surface_are_closed_loops_without_gaps() {
    let projection = Projection::new(&camera(4.5, [960, 540])).unwrap();
    let placed = Placed::new(&scene(torus(48)));
    placed.with(|surface| {
        let lines = surface.lines(&projection, 0);
        assert!(!lines.is_empty() && lines.iter().all(|l| l.closed && l.kind == LineKind::Contour));
        // The outline and the hole's rim with its folds.
        assert!(lines.len() <= 4, "{}", lines.len());
        // A point in each edge that is crossed, once.
        let mut anchors: Vec<[u32; 2]> =
            lines.iter().flat_map(|l| l.points.iter().map(|p| p.anchor.vertices)).collect();
        let count = anchors.len();
        anchors.sort_unstable();
        anchors.dedup();
        assert_eq!(anchors.len(), count);
        // The surface lies on the other side of `outward` at the outline.
        for p in lines.iter().flat_map(|l| &l.points).filter(|p| p.possible) {
            let there = p.position + p.outward.normalize() * 0.05;
            let ring = DVec2::new(there.x, there.y).length() - MAJOR;
            assert!(DVec2::new(ring, there.z).length() > MINOR);
        }
    });
}

/// A vertex on the contour, and every vertex on it: nothing is divided by zero.
#[test]
fn vertices_on_the_contour_do_no_harm() {
    let placed = Placed::new(&scene(torus(12)));
    placed.with(|surface| {
        for eye in
            [DVec3::new(0.0, 0.0, 9.0), DVec3::new(9.0, 0.0, 0.0), DVec3::ZERO, DVec3::new(1.4, 0.0, 0.0)]
        {
            for line in surface.contours(&|p| eye - p, 0) {
                assert!(line.points.iter().all(|p| p.position.is_finite() && p.outward.is_finite()));
            }
        }
        assert!(surface.contours(&|_| DVec3::ZERO, 0).is_empty());
        assert!(surface.contours(&|_| DVec3::NAN, 0).is_empty());
    });
}

/// Distance from the surface.
fn distance(p: DVec3) -> f64 {
    DVec2::new(DVec2::new(p.x, p.y).length() - MAJOR, p.z).length() - MINOR
}

/// Whether a point on the surface is seen: the ray from the eye meets nothing before the last `skip` of it. By marching
/// through the distance, which is exact for a torus.
fn is_seen(eye: DVec3, p: DVec3, skip: f64) -> bool {
    let way = p - eye;
    let (length, direction) = (way.length(), way.normalize());
    let mut t = 0.0;
    while t < length * (1.0 - skip) {
        let d = distance(eye + direction * t);
        if d < 1e-6 {
            return false;
        }
        t += d.max(1e-5);
    }
    true
}

/// Points truly seen that are hidden, and points truly hidden that are shown, as parts of either.
#[test]
fn what_is_seen_of_contours_is_what_rays_see() {
    let Some(gpu) = Gpu::for_tests() else { return };
    // Measured .3 % hidden and none shown, at both; the bar of the literature is 1 % and 5 %.
    for (across, most_hidden, most_shown) in [(24, 0.01, 0.02), (48, 0.01, 0.02)] {
        let size = [960, 540];
        let view = camera(5.8, size);
        let projection = Projection::new(&view).unwrap();
        let scene = scene(torus(across));
        let placed = Placed::new(&scene);
        let options = Options {
            size,
            filter: Filter::Box,
            aovs: vec![Aov::Depth, Aov::Id],
            trace_camera: false,
            threads: 2,
            bounces: None,
            hide_emitters: false,
            lighting: Default::default(),
            seed: 0,
        };
        let mut stage = Stage::new(&gpu.device, &gpu.queue, &placed.rows, &options).unwrap();
        stage.frame(&view).unwrap();
        let map = DepthMap::new(&stage.image().unwrap(), &projection).unwrap();
        let eye = view.to_world.w_axis.truncate().as_dvec3();
        let lines = placed.with(|surface| surface.lines(&projection, 0));
        let mut sampled: Vec<SampledLine> =
            lines.iter().flat_map(|l| sample(l, 1, &projection, &map)).collect();
        sampled.iter_mut().for_each(|l| l.clean(&Cleaning::default()));

        // Truth is that of the nearest point of the exact zero set in the picture and in depth.
        let exact = zero_set(&projection, 4_000);
        let exact: Vec<(Vec2, f32, bool)> = exact
            .iter()
            .filter_map(|p| {
                let at = projection.project(*p)?;
                Some((at.pixel.as_vec2(), at.depth as f32, is_seen(eye, *p, 0.03)))
            })
            .collect();
        let (mut seen, mut hidden, mut wrongly_hidden, mut wrongly_shown) = (0.0, 0.0, 0.0, 0.0);
        let inside = |p: Vec2| p.cmpge(Vec2::ZERO).all() && p.x < size[0] as f32 && p.y < size[1] as f32;
        for s in sampled.iter().flat_map(|l| &l.samples).filter(|s| inside(s.pixel)) {
            let nearest = exact
                .iter()
                .min_by(|a, b| {
                    let far = |e: &(Vec2, f32, bool)| e.0.distance(s.pixel) + 300.0 * (e.1 - s.depth).abs();
                    far(a).total_cmp(&far(b))
                })
                .unwrap();
            if nearest.2 {
                seen += 1.0;
                wrongly_hidden += f64::from(u8::from(!s.visible));
            } else {
                hidden += 1.0;
                wrongly_shown += f64::from(u8::from(s.visible));
            }
        }
        let [fh, fv] = [wrongly_hidden / seen, wrongly_shown / hidden];
        println!(
            "{} triangles: {:.1} % hidden wrongly, {:.1} % shown wrongly",
            4 * across * across,
            100.0 * fh,
            100.0 * fv
        );
        assert!(seen > 100.0 && hidden > 30.0, "{seen} {hidden}");
        assert!(fh <= most_hidden && fv <= most_shown, "{fh} {fv}");
    }
}
