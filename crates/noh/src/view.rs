//! The stage as a scene: materials, seats, and the light of a night or of dusk.

use crate::layout::{BEAM, TIE};
use crate::part::Finish;
use crate::pattern::Surface;
use crate::{FireStand, Robe, Stage};
use glam::{Mat4, Vec2, Vec3};
use std::collections::BTreeMap;
use std::f32::consts::{PI, TAU};
use std::sync::Arc;
use yugen_motion::SkeletonError;
use yugen_motion::fire::FireError;
use yugen_optics::parallel::{parallel, threads};
use yugen_optics::spectrum::{blackbody, emission_rgb};
use yugen_optics::tonemap::Curve;
use yugen_optics::{ColourSpace, Image};
use yugen_reflectance::{Kind, ModelError};
use yugen_scene::{
    CacheError, Camera, Display, Film, FovAxis, Geometry, Light, Material, MaterialId, ModelBuilder,
    PoseError, Projection, Scene, Shape, Texture, TextureFilter, TurnedNormals, Value, Wrap, look_along,
};

/// When it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hour {
    /// A clear night with a moon.
    #[default]
    Night,
    /// Half an hour after sunset, when the fires are lit.
    Dusk,
}

/// How fires shine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FireLight {
    /// As flames, with logs that glow and sparks.
    #[default]
    Flames,
    /// Balls that can be seen, as wide as the flame's core: for renderers without volumes.
    Balls,
    /// Points, which every glTF viewer knows.
    Points,
    /// Not at all: whoever puts flames there.
    Out,
}

/// Why there is no scene of a stage.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SceneError {
    /// A material.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A fire.
    #[error(transparent)]
    Fire(#[from] FireError),
    /// Nobody to wear a robe, or to move.
    #[error("the stage has no player: make it with one")]
    NoPlayer,
    /// A dance of another skeleton.
    #[error("the dance has no joint '{0}', which carries a part of the player")]
    NoJoint(String),
    /// A robe that moves.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// A player who moves.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// A dance with joints at no place.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
}

/// Of a wood fire's soot, kelvin: 1700 to 1900 are usual; assumed.
pub const FIRE_KELVIN: f64 = 1800.0;
/// Luminous intensity around a fire of 100 kW, candela: 1500 to 2500 by its soot's efficacy.
pub const FIRE_CANDELA: f32 = 2000.0;
/// How the stage by its fires is shown, stops.
pub const EXPOSURE: f32 = -5.0;
/// Illuminance of a full moon high in a clear sky, lux.
const MOON_LUX: f32 = 0.25;

/// Colour of a black body with luminance 1.
fn blackbody_colour(space: ColourSpace, kelvin: f64) -> Vec3 {
    // Relative to its peak by Wien's law, so that nothing overflows.
    let peak = blackbody(2.897_771_955e6 / kelvin, kelvin);
    let rgb = emission_rgb(space, |l| blackbody(l, kelvin) / peak);
    rgb / space.luminance(rgb)
}

impl Stage {
    /// The stage with its materials, cameras and lights. Shapes are the parts in their order, first, then those of the player,
    /// in the coordinates of their joints; those of fires come after them. Each of [`Stage::finishes`] has [`Finish::materials`], in that order.
    pub fn scene(&self, hour: Hour, fire_light: FireLight) -> Result<Scene, SceneError> {
        let mut scene = Scene { working_space: ColourSpace::default(), ..Scene::default() };
        let mut materials: BTreeMap<Finish, MaterialId> = BTreeMap::new();
        let mut surfaces = self.surfaces();
        fit(&mut surfaces, self.robe().map_or(0, Robe::bytes));
        for (finish, surface) in surfaces {
            materials.insert(finish, scene.materials.len());
            scene.name_material(scene.materials.len(), finish.name());
            match (surface, self.robe()) {
                (Some(surface), _) => material(&mut scene, finish, &surface)?,
                (None, Some(robe)) => robe.material(&mut scene),
                (None, None) => {}
            }
        }
        for part in self.parts().iter().chain(self.player().iter().map(|p| &p.part)) {
            let geometry = Geometry::Mesh(part.mesh.clone());
            let material = materials.get(&part.finish).copied().unwrap_or_default();
            scene.shapes.push(Shape::new(part.id.clone(), geometry, Mat4::IDENTITY, material));
        }
        let colour = blackbody_colour(scene.working_space, FIRE_KELVIN);
        for (i, fire) in self.fires().iter().enumerate() {
            let name = format!("fire-{}", i + 1);
            let (at, radius) = core(fire);
            match fire_light {
                FireLight::Out => {}
                FireLight::Flames => {
                    let (foot, diameter, seed) = (fire.foot, fire.diameter, i as u32 + 1);
                    let flames = yugen_motion::fire::Fire { foot, diameter, seed, ..Default::default() };
                    scene.add_fire(&name, &flames, None, 0.0)?;
                }
                FireLight::Points => {
                    scene.add_light(&name, Light::Point { position: at, intensity: colour * FIRE_CANDELA });
                }
                FireLight::Balls => {
                    let place = Mat4::from_translation(at) * Mat4::from_scale(Vec3::splat(radius));
                    let mut shape = Shape::new(name, Geometry::Sphere, place, 0);
                    shape.emission = Some(Value::Rgb(colour * (FIRE_CANDELA / (PI * radius * radius))));
                    scene.shapes.push(shape);
                }
            }
        }
        self.sky(&mut scene, hour);
        scene.cameras = self.cameras();
        // Photometric numbers by firelight and by the last of the day are far above a display's white; by the moon they are not.
        if fire_light != FireLight::Out || hour == Hour::Dusk {
            scene.display = Display { exposure: EXPOSURE, curve: Curve::AgX, ..Display::default() };
        }
        Ok(scene)
    }

    /// What its parts are made of, each once, in a fixed order.
    pub fn finishes(&self) -> Vec<Finish> {
        let all = || self.parts().iter().chain(self.player().iter().map(|p| &p.part));
        // Of what a robe is that somebody wears.
        let worn = |f: Finish| [Finish::Cloth, Finish::Lining].contains(&f) && self.robe().is_some();
        Finish::ALL.into_iter().filter(|f| worn(*f) || all().any(|p| p.finish == *f)).collect()
    }

    /// The material of a finish in [`Stage::scene`].
    pub fn material_of(&self, finish: Finish) -> Option<MaterialId> {
        let all = self.finishes();
        let at = all.iter().position(|f| *f == finish)?;
        Some(all[..at].iter().map(|f| f.materials()).sum())
    }

    /// Their textures. Each is a function of nothing but itself: the same bits for any number of threads.
    fn surfaces(&self) -> Vec<(Finish, Option<Surface>)> {
        let albedo = self.layout().get("gravel_albedo");
        let finishes = self.finishes();
        let surfaces = parallel(threads(), finishes.len(), |i| finishes[i].surface(albedo), &|_| {});
        finishes.into_iter().zip(surfaces).collect()
    }

    fn sky(&self, scene: &mut Scene, hour: Hour) {
        let space = scene.working_space;
        let to_working = ColourSpace::LinearSrgb.matrix_to(space);
        // The moon stands to the left of the audience, behind it; light travels to the stage.
        let moon = Vec3::new(-0.45, 0.75, 0.5).normalize();
        let (zenith, horizon, glow, moon_lux) = match hour {
            // cd/m²: a night sky under the moon; the last light in the west.
            Hour::Night => {
                (Vec3::new(0.010, 0.014, 0.026), Vec3::new(0.022, 0.025, 0.034), Vec3::ZERO, MOON_LUX)
            }
            Hour::Dusk => {
                (Vec3::new(2.2, 3.6, 7.5), Vec3::new(9.0, 8.5, 9.5), Vec3::new(34.0, 15.0, 5.0), 0.0)
            }
        };
        let mut image = Image::rgb(256, 128);
        for y in 0..128 {
            for x in 0..256 {
                let (u, v) = ((x as f32 + 0.5) / 256.0, (y as f32 + 0.5) / 128.0);
                let (theta, phi) = (PI * v, TAU * u);
                let d = Vec3::new(phi.sin() * theta.sin(), theta.cos(), -phi.cos() * theta.sin());
                let up = d.y.max(0.0);
                let mut c = horizon + (zenith - horizon) * (1.0 - (1.0 - up).powi(3));
                // West lies behind the bridge.
                let west = d.dot(Vec3::new(-0.93, 0.0, -0.37)).max(0.0);
                c += glow * (west.powi(3) * (-6.0 * up).exp());
                // Below the horizon, the dark of trees and hills.
                if d.y < 0.0 {
                    c = horizon * 0.15;
                }
                image.pixel_mut(x, y).copy_from_slice(&(to_working * c).max(Vec3::ZERO).to_array());
            }
        }
        scene.add_light(
            "sky",
            Light::Environment { image: Arc::new(image), scale: 1.0, to_world: Mat4::IDENTITY },
        );
        if moon_lux > 0.0 {
            // Sunlight from grey stone: 4100 K.
            let irradiance = blackbody_colour(space, 4100.0) * moon_lux;
            scene.add_light("moon", Light::Directional { direction: -moon, irradiance });
        }
    }

    /// Seats and near views. The first is the front seat in the middle.
    pub fn cameras(&self) -> Vec<Camera> {
        let l = self.layout();
        // Eyes of who sits, above the ground.
        let eye = l.ground + 1.28;
        let [first, ..] = self.fires();
        let wide = l.hw.max(l.hd);
        let bridge = l.bridge(0.55 * l.get("bridge_length"), 0.0, 1.0);
        let beam = l.head() + TIE + BEAM;
        let mut views = vec![
            ("shomen", Vec3::new(0.0, eye, l.hd + 10.5), Vec3::new(-1.1, 2.35, -1.0), 58.0),
            ("waki-shomen", Vec3::new(-l.hw - 7.4, eye, 2.6), Vec3::new(0.4, 1.9, -0.6), 62.0),
            ("naka-shomen", Vec3::new(-l.hw - 5.6, eye, l.hd + 7.4), Vec3::new(-1.2, 2.1, -1.0), 62.0),
            ("whole", Vec3::new(-2.5, eye + 1.2, l.hd + 17.0), Vec3::new(-4.2, 2.0, -2.0), 55.0),
            ("above", Vec3::new(-12.0, 9.0, l.hd + 12.0), Vec3::new(-3.0, 1.2, -2.5), 50.0),
            ("bridge", l.bridge(0.2 * l.get("bridge_length"), 6.0, 0.4), bridge, 62.0),
            ("floor", Vec3::new(0.35, 0.42, 0.8), Vec3::new(0.0, 0.0, 0.05), 45.0),
            (
                "bark",
                Vec3::new(-wide - 2.6, 2.6, l.hd + 2.3),
                Vec3::new(-wide - 0.6, beam - 0.15, l.hd + 0.4),
                32.0,
            ),
            (
                "gravel",
                Vec3::new(0.9, l.ground + 0.55, l.hd + 2.0),
                Vec3::new(1.1, l.ground, l.hd + 1.2),
                40.0,
            ),
            ("old-pine", Vec3::new(0.0, 1.5, 0.6), Vec3::new(0.0, 1.6, l.rear), 62.0),
            ("basket", first.foot + Vec3::new(0.5, 0.35, 1.0), first.foot + Vec3::new(0.0, -0.18, 0.0), 42.0),
        ];
        if self.parts().iter().any(|p| p.finish == Finish::Cloth) {
            views.extend(crate::robe::views(l));
        }
        views
            .into_iter()
            .map(|(name, from, to, fov)| Camera {
                name: name.into(),
                to_world: look_along(from, to - from, Vec3::Y),
                projection: Projection::Perspective {
                    fov_x: f32::to_radians(fov),
                    fov_axis: FovAxis::X,
                    aperture_radius: 0.0,
                    focus_distance: from.distance(to),
                    principal_point: Vec2::ZERO,
                },
                near_far: [0.02, 500.0],
                film: Film { width: 1280, height: 720, ..Film::default() },
                samples_per_pixel: 64,
            })
            .collect()
    }
}

/// Most bytes of all textures with their pyramids: every WebGPU device binds 128 MiB at once, and a sky comes as well.
const MOST_BYTES: usize = 120 << 20;

/// What renderers keep of a finish: colours, normals, roughness and metal, 16 bytes a texel, with their pyramids.
fn bytes(finish: Finish, surface: &Surface) -> usize {
    let texels = surface.texels.len();
    (texels + texels / finish.relief().pow(2) + texels / 8) * 16 * 4 / 3
}

/// Makes room for so many bytes of a cloth: the largest textures become coarser, not the floor's, which it hangs above.
fn fit(surfaces: &mut [(Finish, Option<Surface>)], cloth: usize) {
    let size =
        |(finish, surface): &(Finish, Option<Surface>)| surface.as_ref().map_or(0, |s| bytes(*finish, s));
    while surfaces.iter().map(size).sum::<usize>() + cloth > MOST_BYTES {
        let others = surfaces.iter_mut().filter(|s| s.0 != Finish::Floor);
        match others.max_by_key(|s| size(s)) {
            Some((_, Some(surface))) if surface.width.min(surface.height) >= 128 => {
                *surface = surface.reduced(2)
            }
            // A cloth so large is for the reference renderer.
            _ => break,
        }
    }
}

/// Middle and radius of the brightest part of a flame over a fuel bed: about 0.18 m² seen from the side for a basket
/// of 0.45 m, whose luminance then is that of a candle's flame, 1e4 cd/m².
fn core(fire: &FireStand) -> (Vec3, f32) {
    let radius = 0.42 * fire.diameter;
    (fire.foot + Vec3::Y * (0.9 * radius), radius)
}

/// Pushes what a finish needs: a normal map, and behind it the material that it turns.
fn material(scene: &mut Scene, finish: Finish, surface: &Surface) -> Result<(), ModelError> {
    let to_working = ColourSpace::LinearSrgb.matrix_to(scene.working_space);
    let mut picture = |image: Image, channel: Option<usize>| {
        scene.textures.push(Texture::Image {
            image: Arc::new(image),
            filter: TextureFilter::Mip,
            wrap: [Wrap::Repeat; 2],
            to_uv: glam::Affine2::IDENTITY,
            channel,
        });
        scene.textures.len() - 1
    };
    let albedo = picture(surface.albedo(to_working), None);
    let normal = picture(surface.reduced(finish.relief()).normals(), None);
    let gloss = finish.gloss();
    let mut builder;
    if let Some(sigma) = gloss.matt {
        builder = ModelBuilder::new(Kind::OrenNayar);
        builder.set("reflectance", Value::Texture(albedo))?.set("sigma", Value::Number(sigma))?;
    } else if let Some([across, along]) = gloss.fibres {
        builder = ModelBuilder::new(Kind::AshikhminShirley);
        // Phong exponents of these widths.
        let exponent = |width: f32| Value::Number(2.0 / (width * width) - 1.0);
        builder
            .set("diffuse", Value::Texture(albedo))?
            .set("specular", Value::Rgb(Vec3::splat(0.046)))?
            .set("n_u", exponent(across))?
            .set("n_v", exponent(along))?;
    } else {
        let roughness = picture(surface.reduced(4).roughness_metallic(), Some(1));
        let metallic = match &scene.textures[roughness] {
            Texture::Image { image, .. } => Texture::Image {
                image: image.clone(),
                filter: TextureFilter::Mip,
                wrap: [Wrap::Repeat; 2],
                to_uv: glam::Affine2::IDENTITY,
                channel: Some(2),
            },
            other => other.clone(),
        };
        scene.textures.push(metallic);
        let metallic = scene.textures.len() - 1;
        builder = ModelBuilder::new(Kind::MetallicRoughness);
        builder
            .set("base_color", Value::Texture(albedo))?
            .set("roughness", Value::Texture(roughness))?
            .set("metallic", Value::Texture(metallic))?
            .set("specular", Value::Number(gloss.specular))?
            .set("sheen_color", Value::Rgb(to_working * gloss.sheen))?
            .set("sheen_roughness", Value::Number(gloss.sheen_roughness))?;
    }
    // The normal map stands at the place that shapes name; its base follows.
    let at = scene.materials.len();
    scene.materials.push(Material::NormalMap {
        texture: normal,
        scale: 1.0,
        turned: TurnedNormals::default(),
        base: at + 1,
    });
    scene.materials.push(builder.build()?);
    Ok(())
}
