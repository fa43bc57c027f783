//! A sample as a scene for the reference renderer: every texel a level facet at its height, turned as its maps say.

use anyhow::{Result, bail};
use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;
use yugen_capture::{Eye, Lights};
use yugen_optics::{Mat4, Vec2, Vec3};
use yugen_reflectance::Kind;
use yugen_reflectance::btf::Btf;
use yugen_scene::Scene;
use yugen_scene::{
    Camera, Film, Filter, Geometry, Integrator, Light, Mesh, ModelBuilder, Projection, Shape, Texture, Value,
};
use yugen_transport::render::{Action, Budget, Job, Options};

/// Draws pictures of one sample.
pub struct Tracer {
    scene: Scene,
    width: usize,
    height: usize,
    top: f32,
    samples: u32,
}

impl Tracer {
    /// `samples` paths a pixel; heights in widths of a texel.
    pub fn new(btf: &Btf, heights: Option<&[f32]>, form: &str, samples: u32) -> Result<Self> {
        let (width, height) = (btf.width, btf.height);
        let at = |x: usize, y: usize| heights.map_or(0.0, |h| h[y * width + x]);
        // A corner is as high as the texels around it on average, so that the surface has no gaps.
        let corner = |x: usize, y: usize| {
            let (x0, x1) = (x.saturating_sub(1), x.min(width - 1));
            let (y0, y1) = (y.saturating_sub(1), y.min(height - 1));
            0.25 * (at(x0, y0) + at(x1, y0) + at(x0, y1) + at(x1, y1))
        };
        let centre = Vec2::new(width as f32, height as f32) * 0.5;
        let mut mesh = Mesh { name: "sample".into(), ..Mesh::default() };
        let [mut diffuse, mut specular, mut sigma_x, mut sigma_y] = [const { Vec::new() }; 4];
        for (i, texel) in btf.texels.iter().enumerate() {
            let (x, y) = (i % width, i / width);
            let first = mesh.positions.len() as u32;
            for (dx, dy) in [(0, 0), (0, 1), (1, 1), (1, 0)] {
                let (x, y) = (x + dx, y + dy);
                let flat = Vec2::new(x as f32 - centre.x, centre.y - y as f32);
                mesh.positions.push(flat.extend(corner(x, y)));
                mesh.normals.push(texel.normal);
                mesh.tangents.push(texel.tangent.extend(1.0));
                diffuse.extend(texel.diffuse.to_array());
                specular.extend(texel.specular.to_array());
                sigma_x.push(texel.sigma.x);
                sigma_y.push(texel.sigma.y);
            }
            mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
        let top = mesh.positions.iter().map(|p| p.z).fold(0.0, f32::max);
        let maps =
            [("rho_d", 3, diffuse), ("rho_s", 3, specular), ("sigma_x", 1, sigma_x), ("sigma_y", 1, sigma_y)];
        let mut scene = Scene { working_space: btf.colour_space, ..Scene::default() };
        let mut model = ModelBuilder::new(Kind::Noh);
        model.choose("form", form)?;
        for (name, channels, values) in maps {
            model.set(name, Value::Texture(scene.textures.len()))?;
            scene.textures.push(Texture::MeshAttribute { name: name.into() });
            mesh.attributes.push((name.into(), channels, values));
        }
        scene.materials.push(model.build()?);
        scene.shapes.push(Shape::new("sample", Geometry::Mesh(Arc::new(mesh)), Mat4::IDENTITY, 0));
        scene.integrator = Integrator::default();
        Ok(Self { scene, width, height, top, samples })
    }

    /// The picture that [`yugen_capture::simulate::Subject::picture`] gives, with what bounces between threads: rays from
    /// `eye`, parallel ones if it is far away, through the middles of flat texels.
    pub fn picture(&mut self, lights: &Lights, light: usize, eye: Eye, seed: u32) -> Result<Vec<Vec3>> {
        // Half the width spans the camera's [−1, 1]; its +x is to the left. The frame is sheared, not turned, so that
        // a pixel of the plane z = 0 stays the same pixel from every side.
        let half = 0.5 * self.width as f32;
        let (projection, away, position) = if eye.distance.is_finite() {
            let position = eye.toward * eye.distance * self.width as f32;
            if position.z <= self.top {
                bail!(
                    "the camera stands {:.0} widths of a texel above the sample, which is {:.0} high; raise \
                     --camera-distance",
                    position.z,
                    self.top
                );
            }
            // The tangent of half of it is one.
            (Projection::pinhole(FRAC_PI_2), -position, position)
        } else {
            let back = eye.toward / eye.toward.z;
            (Projection::Orthographic, -back, back * (self.top + 1.0))
        };
        let frame = Mat4::from_cols(
            Vec3::new(-half, 0.0, 0.0).extend(0.0),
            Vec3::new(0.0, half, 0.0).extend(0.0),
            away.extend(0.0),
            position.extend(1.0),
        );
        self.scene.cameras = vec![Camera {
            name: "machine".into(),
            to_world: frame,
            projection,
            near_far: [0.0, 1e6],
            film: Film {
                width: self.width as u32,
                height: self.height as u32,
                crop: None,
                filter: Filter::Box,
            },
            samples_per_pixel: self.samples,
        }];
        self.scene.lights = vec![match lights {
            Lights::Distant(toward) => {
                Light::Directional { direction: -toward[light], irradiance: Vec3::ONE }
            }
            Lights::Near(positions) => {
                let position = positions[light] * self.width as f32;
                Light::Point { position, intensity: Vec3::splat(position.length_squared()) }
            }
        }];
        let budget = Some(Budget::Samples(self.samples));
        let job = Job::new(&self.scene, &Options { budget, seed, ..Options::default() })?;
        job.run(|_, _| Action::Continue);
        let image = job.image();
        let channels = image.channels.len();
        let pixels = image.data.chunks_exact(channels);
        // Radiance under unit irradiance is f cos θ.
        Ok(pixels.map(|p| Vec3::new(p[0], p[1], p[2]) * std::f32::consts::PI).collect())
    }
}
