use super::*;
use yugen_optics::random::Pcg32;
use yugen_optics::warp;

struct Soup(Vec<[Vec3; 3]>);

impl Source for Soup {
    fn triangle(&self, _: u32, primitive: u32) -> [Vec3; 3] {
        self.0[primitive as usize]
    }
}

struct NoOthers;

impl Others for NoOthers {
    fn intersect(&self, _: u32, _: &Ray, _: &mut Option<Hit>) {}
    fn occluded(&self, _: u32, _: &Ray) -> bool {
        false
    }
}

impl Soup {
    fn tree(&self, threads: usize) -> Tree {
        let items = self.0.iter().enumerate().map(|(i, &t)| Item::triangle(t, 0, i as u32)).collect();
        Tree::build(self, items, threads)
    }

    /// Triangles of about `size` in the unit cube.
    fn random(count: usize, size: f32, seed: u64) -> Self {
        let mut rng = Pcg32::new(seed, 7);
        Self(
            (0..count)
                .map(|_| {
                    let centre = rng.next_vec3();
                    [0; 3].map(|_| centre + (rng.next_vec3() - 0.5) * size)
                })
                .collect(),
        )
    }

    /// Möller and Trumbore 1997 in double precision, over everything.
    fn brute_force(&self, ray: &Ray) -> Option<(f64, usize)> {
        let (o, d) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        let mut best: Option<(f64, usize)> = None;
        for (i, t) in self.0.iter().enumerate() {
            let [a, b, c] = t.map(|p| p.as_dvec3());
            let (e1, e2) = (b - a, c - a);
            let p = d.cross(e2);
            let det = e1.dot(p);
            let s = o - a;
            let q = s.cross(e1);
            let (u, v, t) = (s.dot(p) / det, d.dot(q) / det, e2.dot(q) / det);
            if u >= 0.0
                && v >= 0.0
                && u + v <= 1.0
                && t > f64::from(ray.t_min)
                && best.is_none_or(|b| t < b.0)
            {
                best = Some((t, i));
            }
        }
        best
    }
}

fn random_ray(rng: &mut Pcg32) -> Ray {
    let origin = rng.next_vec3() * 3.0 - 1.0;
    let to = rng.next_vec3();
    Ray::new(origin, to - origin)
}

#[test]
fn a_tree_finds_what_brute_force_finds() {
    for (count, size) in [(1, 1.0), (2, 1.0), (9, 0.5), (100, 0.3), (1000, 0.1), (300, 3.0)] {
        let soup = Soup::random(count, size, count as u64);
        let tree = soup.tree(1);
        let stats = tree.validate().unwrap();
        assert_eq!(stats.triangles, count);
        let mut rng = Pcg32::new(3, count as u64);
        let mut hits = 0;
        for _ in 0..3000 {
            let ray = random_ray(&mut rng);
            let found = tree.closest(&ray, &NoOthers);
            assert_eq!(found.is_some(), tree.any(&ray, &NoOthers));
            match (found, soup.brute_force(&ray)) {
                (None, None) => {}
                (Some(hit), Some((t, i))) => {
                    hits += 1;
                    // Double against single precision; worst seen 2e-6, at a grazing hit.
                    assert!((f64::from(hit.t) - t).abs() < 1e-5 * t.max(1.0), "{hit:?} {t} {i}");
                    assert!(hit.primitive as usize == i || (f64::from(hit.t) - t).abs() < 1e-6);
                }
                // On an edge, within rounding, the two may differ; none does for these seeds.
                other => panic!("{ray:?}: {other:?}"),
            }
        }
        assert!(hits > 50, "{count}: only {hits} hits");
    }
}

#[test]
fn both_kernels_agree_to_the_bit() {
    for size in [0.05, 0.5] {
        let soup = Soup::random(2000, size, 11);
        let tree = soup.tree(1);
        let mut rng = Pcg32::new(5, 5);
        for i in 0..4000 {
            let mut ray = random_ray(&mut rng);
            match i % 4 {
                0 => ray.dir.x = 0.0,
                1 => ray.dir = Vec3::Y,
                _ => {}
            }
            let bits = |h: Option<Hit>| h.map(|h| (h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.primitive));
            let (hit, any) = tree.portable(&ray, &NoOthers);
            assert_eq!(bits(tree.closest(&ray, &NoOthers)), bits(hit));
            assert_eq!(tree.any(&ray, &NoOthers), any);
        }
    }
}

#[test]
fn the_tree_does_not_depend_on_threads() {
    let soup = Soup::random(60_000, 0.02, 2);
    let (one, three) = (soup.tree(1), soup.tree(3));
    one.validate().unwrap();
    assert_eq!(one.nodes.len(), three.nodes.len());
    for (a, b) in one.nodes.iter().zip(&three.nodes) {
        assert_eq!((a.bounds, a.children), (b.bounds, b.children));
    }
    for (a, b) in one.blocks.iter().zip(&three.blocks) {
        assert_eq!(a.primitive, b.primitive);
    }
}

#[test]
fn degenerate_input_is_harmless() {
    let empty = Soup(vec![]).tree(2);
    assert_eq!(empty.validate().unwrap(), TreeStats::default());
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    assert_eq!(empty.closest(&ray, &NoOthers), None);
    assert!(!empty.any(&ray, &NoOthers));

    // Twenty thousand triangles in one place: no plane parts them.
    let same =
        Soup(vec![[Vec3::new(-1.0, -1.0, 1.0), Vec3::new(1.0, -1.0, 1.0), Vec3::new(0.0, 1.0, 1.0)]; 20_000]);
    let tree = same.tree(2);
    assert_eq!(tree.validate().unwrap().triangles, 20_000);
    let hit = tree.closest(&ray, &NoOthers).unwrap();
    assert_eq!((hit.t, hit.primitive), (1.0, 0), "of equals the first wins");

    // Ever smaller towards a corner: bins put nearly everything on one side.
    let shrinking =
        Soup((0..3000).map(|i| Soup::random(1, 1.0, i).0[0].map(|p| p * 0.97f32.powi(i as i32))).collect());
    assert_eq!(shrinking.tree(1).validate().unwrap().triangles, 3000);

    // Lines and points do no harm, and are not met.
    let flat = Soup(vec![[Vec3::Z; 3], [Vec3::Z, Vec3::Z, Vec3::new(1.0, 0.0, 1.0)]]).tree(1);
    assert_eq!(flat.closest(&ray, &NoOthers), None);

    for bad in [Vec3::NAN, Vec3::ZERO, Vec3::INFINITY] {
        assert_eq!(tree.closest(&Ray::new(Vec3::ZERO, bad), &NoOthers), None);
        assert!(!tree.any(&Ray::new(Vec3::NAN, Vec3::Z), &NoOthers));
    }
}

#[test]
fn a_ray_ends_where_it_ends() {
    let tree =
        Soup(vec![[Vec3::new(-1.0, -1.0, 2.0), Vec3::new(1.0, -1.0, 2.0), Vec3::new(0.0, 1.0, 2.0)]]).tree(1);
    for (t_min, t_max, met) in
        [(0.0, 1.9, false), (0.0, 2.0, true), (2.0, 3.0, false), (1.9, 3.0, true), (2.1, 9.0, false)]
    {
        let ray = Ray { t_min, t_max, ..Ray::new(Vec3::ZERO, Vec3::Z) };
        assert_eq!(tree.any(&ray, &NoOthers), met);
        assert_eq!(tree.closest(&ray, &NoOthers).is_some(), met);
    }
}

/// A closed surface: a sphere of latitude and longitude, bumpy so that nothing lies on a grid.
fn closed(n: u32, scale: f32, centre: Vec3) -> Soup {
    let point = |i: u32, j: u32| {
        let (theta, phi) =
            (std::f32::consts::PI * i as f32 / n as f32, std::f32::consts::TAU * (j % n) as f32 / n as f32);
        let r = if i == 0 || i == n { 1.0 } else { 1.0 + 0.1 * (7.0 * theta).sin() * (5.0 * phi).cos() };
        centre
            + scale
                * r
                * if i == n {
                    -Vec3::Z
                } else if i == 0 {
                    Vec3::Z
                } else {
                    yugen_optics::frame::spherical(theta, phi)
                }
    };
    let mut triangles = Vec::new();
    for i in 0..n {
        for j in 0..n {
            let (a, b, c, d) = (point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    Soup(triangles)
}

#[test]
fn nothing_leaks_out_of_a_closed_surface() {
    for (scale, centre) in
        [(1.0, Vec3::ZERO), (1.0, Vec3::new(300.0, -20.0, 7.0)), (1e-3, Vec3::ONE), (1e4, Vec3::ZERO)]
    {
        let soup = closed(60, scale, centre);
        let tree = soup.tree(1);
        let mut rng = Pcg32::new(9, 1);
        for i in 0..150_000 {
            let origin = centre + (rng.next_vec3() - 0.5) * scale;
            // Half of them aimed at edges and corners, the rest anywhere.
            let dir = if i % 2 == 0 {
                let t = soup.0[(rng.next_u32() as usize) % soup.0.len()];
                let s = if i % 4 == 0 { 0.0 } else { rng.next_f32() };
                t[0] * (1.0 - s) + t[1] * s - origin
            } else {
                warp::uniform_sphere(glam::Vec2::new(rng.next_f32(), rng.next_f32()))
            };
            let ray = Ray::new(origin, dir);
            assert!(tree.any(&ray, &NoOthers), "{scale} {ray:?}");
            assert!(tree.closest(&ray, &NoOthers).is_some(), "{scale} {ray:?}");
        }
    }
}
