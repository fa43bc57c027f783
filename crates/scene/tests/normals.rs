//! Shading normals turned by maps: what is drawn is what is evaluated, and no light is made.

use std::sync::Arc;
use yugen_optics::random::Pcg32;
use yugen_optics::warp::uniform_sphere;
use yugen_optics::{ColourSpace, Frame, Image, Vec2, Vec3};
use yugen_proof::{ChiSquare, Subject, chi_square, furnace, sampling};
use yugen_reflectance::btf::{Btf, Texel};
use yugen_reflectance::{Choice, Kind, Laws, Sample};
use yugen_scene::prepared::{Lookup, Materials, Shading, ShadingPoint, Textures, scratch};
use yugen_scene::{Material, Scene, Texture, TextureFilter, TurnedNormals, Value, Wrap};

fn model(name: &str, set: &[(&str, f32)]) -> Material {
    let kind = Kind::from_name(name).expect("a model");
    let mut slots = kind.defaults();
    let mut params: Vec<Value> = kind
        .params()
        .iter()
        .map(|p| match p.default_slots() {
            [r, g, b] => Value::Rgb(Vec3::new(*r, *g, *b)),
            slots => Value::Number(slots[0]),
        })
        .collect();
    for (name, value) in set {
        let (at, p) = kind.param(name).expect("a parameter");
        slots[at..at + p.width()].fill(*value);
        let index = kind.params().iter().position(|q| q.name == *name).expect("its index");
        params[index] = Value::Number(*value);
    }
    let table: Arc<[f32]> = kind.bake(&slots, &[]).expect("a table").into();
    Material::Model { kind, params, table }
}

fn picture(image: Image) -> Texture {
    Texture::Image {
        image: Arc::new(image),
        filter: TextureFilter::Bilinear,
        wrap: [Wrap::Repeat; 2],
        to_uv: glam::Affine2::IDENTITY,
        channel: None,
    }
}

/// The last of `materials` on a plane z = 0, looked up at the middle of its textures.
struct Surface {
    materials: Materials,
    textures: Textures,
    last: usize,
}

impl Surface {
    /// Over `base`, which stands at 0; texture 0 is a normal, 1 are heights, 2 a cloth.
    fn new(normal: Vec3, materials: Vec<Material>) -> Self {
        let mut one = Image::rgb(1, 1);
        one.data = (normal * 0.5 + 0.5).to_array().to_vec();
        let mut heights = Image::new(2, 2, &["Y"]);
        heights.data = vec![0.0, 0.9, 0.3, 1.0];
        let thread = Texel {
            diffuse: Vec3::splat(0.3),
            specular: Vec3::splat(0.4),
            normal,
            tangent: Frame::from_normal_tangent(normal, Vec3::Y).s,
            sigma: Vec2::new(0.4, 0.2),
            confidence: 1.0,
        };
        let maps = Btf { width: 1, height: 1, colour_space: ColourSpace::LinearSrgb, texels: vec![thread] };
        let cloth =
            Texture::Cloth { maps: Arc::new(maps), wrap: Wrap::Repeat, to_uv: glam::Affine2::IDENTITY };
        let textures = vec![picture(one), picture(heights), cloth];
        let last = materials.len() - 1;
        let scene = Scene { working_space: ColourSpace::LinearSrgb, textures, materials, ..Scene::default() };
        let materials = Materials::new(&scene).expect("good materials");
        Self { materials, textures: Textures::new(&scene), last }
    }

    fn with<R>(&self, wo: Vec3, f: impl FnOnce(&Shading) -> R) -> R {
        let point = ShadingPoint {
            frame: Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::Z },
            handedness: 1.0,
            normal: Vec3::Z,
            dp: [Vec3::X, Vec3::new(0.2, 1.5, 0.0)],
            lookup: Lookup { uv: Vec2::new(0.45, 0.6), footprint: 0.0, place: None },
        };
        let mut room = scratch();
        f(&self.materials.shade(&self.textures, self.last, &point, wo, &mut room))
    }
}

impl Subject for Surface {
    fn laws(&self) -> Laws {
        // Both sides are looked at.
        Laws { transmits: true, ..Laws::PHYSICAL }
    }

    fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        self.with(wo, |s| s.eval_pdf(wi).0 / wi.z.abs().max(1e-9))
    }

    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.with(wo, |s| s.eval_pdf(wi).1)
    }

    fn sample(&self, wo: Vec3, u: Vec3) -> Option<Sample> {
        self.with(wo, |s| s.sample([u.x, u.y, u.z, 0.5], wo)).map(|s| Sample {
            wi: s.wi,
            weight: s.weight,
            pdf: s.pdf,
            delta: s.delta,
            eta: s.eta,
        })
    }
}

fn surfaces() -> Vec<(String, Surface)> {
    let off = TurnedNormals { flip_invalid_normals: false, use_shadowing_function: false };
    let mut all = Vec::new();
    for (named, normal) in
        [("steep", Vec3::new(0.8, -0.3, 0.35).normalize()), ("mild", Vec3::new(0.2, 0.3, 1.0).normalize())]
    {
        for (base, material) in [
            ("matt", model("lambert", &[("reflectance", 1.0)])),
            ("metal", model("rough_conductor", &[("alpha_x", 0.5), ("alpha_y", 0.25)])),
        ] {
            for (how, turned) in [("on", TurnedNormals::default()), ("off", off)] {
                let normal_map = |base| Material::NormalMap { texture: 0, scale: 1.0, turned, base };
                let bump_map = |base| Material::BumpMap { texture: 1, scale: 1.5, turned, base };
                let both = |id| Material::TwoSided { front: id, back: id };
                let second = model("lambert", &[("reflectance", 0.5)]);
                for (what, materials) in [
                    ("normal map", vec![material.clone(), normal_map(0)]),
                    ("both sides of a normal map", vec![material.clone(), normal_map(0), both(1)]),
                    ("normal map of both sides", vec![material.clone(), both(0), normal_map(1)]),
                    ("bump map", vec![material.clone(), bump_map(0), both(1)]),
                    ("bump over normal map", vec![material.clone(), normal_map(0), bump_map(1), both(2)]),
                    (
                        "blend",
                        vec![
                            material.clone(),
                            second.clone(),
                            normal_map(0),
                            Material::Blend { weight: Value::Number(0.4), first: 2, second: 1 },
                            both(3),
                        ],
                    ),
                ] {
                    all.push((format!("{what}, {named}, {base}, {how}"), Surface::new(normal, materials)));
                }
            }
        }
        let cloth = Material::Cloth { texture: 2, form: Choice(0.0) };
        let materials = vec![cloth, Material::TwoSided { front: 0, back: 0 }];
        all.push((format!("cloth, {named}"), Surface::new(normal, materials)));
    }
    all
}

const EYES: [Vec3; 4] = [
    Vec3::new(0.1, 0.2, 0.974_679_4),
    // The steep normal looks away.
    Vec3::new(-0.9, 0.3, 0.316_227_77),
    Vec3::new(0.6, 0.0, -0.8),
    Vec3::new(-0.95, 0.2, -0.239_791_58),
];

#[test]
fn turned_lobes_are_drawn_as_they_are_evaluated() {
    let mut tested = 0;
    for (name, surface) in surfaces() {
        for wo in EYES {
            let finding = sampling(&surface, wo, 2000, 3);
            assert!(finding.holds(), "{name}, {wo}: {finding:?}");
            let settings = ChiSquare { samples: 50_000, seed: 5, cells: 200 };
            let result = chi_square(&surface, wo, &settings);
            // Of some 200 tests, the worst by chance is near 1/200.
            assert!(result.fault.is_none() && result.p_value > 1e-5, "{name}, {wo}: {result:?}");
            tested += usize::from(result.hit_rate > 0.0);
        }
    }
    assert!(tested > 100, "{tested} only");
}

#[test]
fn turned_normals_make_no_light() {
    for (name, surface) in surfaces() {
        for wo in EYES {
            let albedo = furnace(&surface, wo).max_element();
            assert!(albedo <= 1.001, "{name}, {wo}: {albedo}");
        }
    }
}

/// Where the normal looks away from the eye, the surface is black as it is given and lit once it is mirrored; from
/// behind as from the front.
#[test]
fn no_black_holes() {
    let normal = Vec3::new(0.8, -0.3, 0.35).normalize();
    let lit = |turned, wo| {
        let map = Material::NormalMap { texture: 0, scale: 1.0, turned, base: 0 };
        let white = model("lambert", &[("reflectance", 1.0)]);
        let both = Material::TwoSided { front: 1, back: 1 };
        furnace(&Surface::new(normal, vec![white, map, both]), wo).x
    };
    let off = TurnedNormals { flip_invalid_normals: false, use_shadowing_function: false };
    for wo in [EYES[1], Vec3::new(EYES[1].x, EYES[1].y, -EYES[1].z)] {
        assert_eq!(lit(off, wo), 0.0);
        assert!(lit(TurnedNormals::default(), wo) > 0.4, "{}", lit(TurnedNormals::default(), wo));
    }
    let cloth = Material::Cloth { texture: 2, form: Choice(0.0) };
    assert!(furnace(&Surface::new(normal, vec![cloth]), EYES[1]).x > 0.1);
}

/// A path end is shared only among eyes that see the same side of the same mirror image of a normal; f towards them is then that of a
/// surface resolved for them.
#[test]
fn what_is_shared_is_turned_alike() {
    let mut rng = Pcg32::new(11, 1);
    let mut seen = [0; 2];
    for (name, surface) in surfaces() {
        for _ in 0..40 {
            let mut direction = || uniform_sphere(Vec2::new(rng.next_f32(), rng.next_f32()));
            let (eye, mut other, wi) = (direction(), direction(), direction());
            if eye.z * other.z < 0.0 {
                other.z = -other.z;
            }
            let (alike, from) = surface.with(eye, |s| (s.turned_alike(eye, other), s.eval_from(other, wi)));
            seen[usize::from(alike)] += 1;
            if alike {
                let own = surface.with(other, |s| s.eval_pdf(wi).0);
                let off = (from - own).abs().max_element();
                assert!(
                    off <= 1e-3 * (1.0 + own.max_element()),
                    "{name}, {eye}, {other}, {wi}: {from} {own}"
                );
            }
        }
    }
    assert!(seen[0] > 50 && seen[1] > 500, "{seen:?}");
}
