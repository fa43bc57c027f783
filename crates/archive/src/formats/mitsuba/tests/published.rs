//! What the published scenes say, against Mitsuba.

use super::*;
use glam::{Vec2, Vec3};
use yugen_scene::{Filter, Geometry, Light, Material, Projection, Texture, Value};

/// Origin on the near plane and direction through (x, y) of the picture, both from the upper left in [0, 1].
fn ray(scene: &Scene, x: f32, y: f32) -> (Vec3, Vec3) {
    let c = &scene.cameras[0];
    let aspect = c.film.width as f32 / c.film.height as f32;
    // +x of the frame is to the left.
    let (sx, sy) = (1.0 - 2.0 * x, (1.0 - 2.0 * y) / aspect);
    match c.projection {
        Projection::Perspective { fov_x, .. } => {
            let t = (0.5 * fov_x).tan();
            let d = Vec3::new(sx * t, sy * t, 1.0);
            (c.to_world.transform_point3(d * c.near_far[0]), c.to_world.transform_vector3(d).normalize())
        }
        Projection::Orthographic => (
            c.to_world.transform_point3(Vec3::new(sx, sy, c.near_far[0])),
            c.to_world.transform_vector3(Vec3::Z).normalize(),
        ),
    }
}

type Ray = ([f32; 2], [f32; 3], [f32; 3]);

fn assert_rays(file: &str, rays: &[Ray]) {
    let Some(scene) = load(file) else { return };
    for &([x, y], o, d) in rays {
        let (origin, direction) = ray(&scene, x, y);
        assert_near(origin, o, &format!("{file}: origin at {x}, {y}"));
        assert_near(direction, d, &format!("{file}: direction at {x}, {y}"));
    }
}

#[test]
fn camera_rays_of_all_scenes_are_those_of_mitsuba() {
    let cbox: &[Ray] = &[
        ([0.5, 0.5], [278.0, 273.0, -790.0], [0.0, 0.0, 1.0]),
        ([0.0, 0.0], [281.571, 276.571, -790.0], [0.318789, 0.318789, 0.892607]),
        ([0.25, 0.75], [279.786, 271.214, -790.0], [0.173136, -0.173136, 0.969561]),
    ];
    assert_rays("scenes/cbox/cbox.xml", cbox);
    assert_rays("scenes/cbox/cbox-rgb.xml", cbox);
    let matpreview: &[Ray] = &[
        ([0.5, 0.5], [3.68903, -3.45632, 3.25018], [-0.654861, 0.610671, -0.44524]),
        ([0.0, 0.0], [3.68586, -3.45801, 3.25252], [-0.893068, 0.405845, -0.194216]),
        ([0.25, 0.75], [3.68826, -3.45797, 3.24905], [-0.715396, 0.435865, -0.546105]),
    ];
    assert_rays("docs/scenes/bsdf_conductor_gold.xml", matpreview);
    assert_rays("docs/scenes/bsdf_roughconductor_anisotropic_aluminium.xml", matpreview);
    assert_rays(
        "docs/scenes/integrator_direct_both.xml",
        &[
            ([0.5, 0.5], [0.0, 1.99695, 14.9905], [0.0, -0.304776, -0.952424]),
            ([0.0, 0.0], [-0.00373992, 1.99933, 14.9897], [-0.341117, -0.0613931, -0.938014]),
            ([0.25, 0.75], [-0.00186996, 1.99576, 14.9909], [-0.182445, -0.413202, -0.892176]),
        ],
    );
    let grid: &[Ray] = &[
        ([0.0, 0.0], [-23.0, 0.305941, 0.305941], [0.917779, 0.280786, 0.280786]),
        ([0.25, 0.75], [-23.0, 0.152971, -0.152971], [0.977391, 0.149512, -0.149512]),
    ];
    for file in ["arealight", "constant", "pointlight"] {
        assert_rays(&format!("tests/scenes/bsdf_spheres/test_{file}_path.xml"), grid);
    }
    assert_rays(
        "tests/scenes/bsdf_spheres/test_textured_diffuse_path.xml",
        &[([0.25, 0.75], [-3.0, 0.152971, -0.152971], [0.977391, 0.149512, -0.149512])],
    );
    assert_rays(
        "tests/scenes/floating_sphere/test_directional_direct.xml",
        &[
            ([0.0, 0.0], [-0.00305941, -4.98975, 1.00205], [-0.280786, 0.941163, 0.18807]),
            ([0.25, 0.75], [-0.00152971, -4.9902, 0.997483], [-0.149512, 0.957663, -0.246024]),
        ],
    );
    assert_rays(
        "tests/scenes/orthographic_sensor/test_orthographic_path.xml",
        &[
            ([0.5, 0.5], [-4.07152, 0.0, 2.62861], [0.928477, 0.0, -0.371391]),
            ([0.0, 0.0], [-3.73727, 1.5, 3.46424], [0.928477, 0.0, -0.371391]),
            ([0.25, 0.75], [-4.23865, 0.75, 2.2108], [0.928477, 0.0, -0.371391]),
        ],
    );
}

#[test]
fn bounding_boxes_are_those_of_mitsuba() {
    let check = |file: &str, shape: usize, low: [f32; 3], high: [f32; 3], count: (usize, usize)| {
        let Some(scene) = load(file) else { return };
        let s = &scene.shapes[shape];
        let (a, b) = bounds(s);
        assert_near(a, low, &format!("{file}, {}", s.name));
        assert_near(b, high, &format!("{file}, {}", s.name));
        if let Geometry::Mesh(m) = &s.geometry {
            assert_eq!((m.positions.len(), m.triangles.len()), count, "{file}, {}", s.name);
            assert_eq!(m.normals.len(), m.positions.len());
        }
    };
    let gold = "docs/scenes/bsdf_conductor_gold.xml";
    check(gold, 0, [-1.05939, -1.08033, 0.01403], [1.08033, 1.05939, 1.91551], (29439, 57152));
    check(gold, 1, [-0.927272, -0.927272, -0.0058961], [0.927272, 0.927272, 1.71208], (2078, 3936));
    check(gold, 2, [-7.19786, -5.46007, -0.0120714], [5.14732, 7.94973, 6.84708], (289, 512));
    let veach = "docs/scenes/integrator_direct_both.xml";
    check(veach, 0, [9.5, 9.5, 3.5], [10.5, 10.5, 4.5], (0, 0));
    check(veach, 2, [-3.78333, -0.03333, -0.03333], [-3.71667, 0.03333, 0.03333], (0, 0));
    check(veach, 5, [-4.0, -2.70651, -0.526323], [4.0, -2.08375, 0.25609], (6, 2));
    check(veach, 9, [-10.0, -10.0, -10.0], [10.0, 10.0, 10.0], (12, 4));
    for file in ["scenes/cbox/cbox.xml", "scenes/cbox/cbox-rgb.xml"] {
        check(file, 0, [213.0, 548.3, 227.0], [343.0, 548.3, 332.0], (4, 2));
    }
    let sphere = "tests/scenes/bsdf_spheres/test_arealight_path.xml";
    check(sphere, 0, [-5.0, -2.0, 4.26795], [-3.0, 2.0, 7.73205], (4, 2));
    check(sphere, 1, [-1.0, -7.0, -1.0], [1.0, -5.0, 1.0], (16639, 32512));
    check(sphere, 11, [0.0, -7.0, -4.0], [0.0, -5.0, -2.0], (4, 2));
    check(
        "tests/scenes/orthographic_sensor/test_orthographic_path.xml",
        0,
        [-1.0, -1.0, 1.0],
        [1.0, 1.0, 1.0],
        (0, 0),
    );
}

#[test]
fn what_the_scenes_say_arrives() {
    let Some(cbox) = load("scenes/cbox/cbox.xml") else { return };
    assert_eq!(cbox.working_space, ColourSpace::LinearSrgb);
    assert_eq!(
        (cbox.shapes.len(), cbox.cameras[0].samples_per_pixel, cbox.integrator.max_depth),
        (8, 128, Some(6))
    );
    assert_eq!(cbox.cameras[0].film.filter, Filter::Gaussian { stddev: 0.5 });
    assert_eq!(cbox.cameras[0].near_far, [10.0, 2800.0]);
    // The colours of mi.traverse(scene) in Mitsuba 3.9.1, scalar_rgb.
    let Some(Value::Rgb(radiance)) = cbox.shapes[0].emission else { panic!("{:?}", cbox.shapes[0].emission) };
    assert_near(radiance, [20.7108, 10.8546, 2.77115], "light of the Cornell box");
    let colour = |shape: usize| match &cbox.materials[cbox.shapes[shape].material] {
        Material::Model { kind, params, .. } if kind.name() == "lambert" => match params[0] {
            Value::Rgb(c) => c,
            ref v => panic!("{v:?}"),
        },
        m => panic!("{m:?}"),
    };
    assert_near(colour(1), [0.735013, 0.735625, 0.736264], "white");
    assert_near(colour(4), [0.0682825, 0.39776, 0.0862909], "green");
    assert_near(colour(5), [0.49132, 0.0492281, 0.0509219], "red");
    let rgb = load("scenes/cbox/cbox-rgb.xml").unwrap();
    assert_eq!(rgb.shapes[0].emission, Some(Value::Rgb(Vec3::new(18.387, 10.9873, 2.75357))));

    let ortho = load("tests/scenes/orthographic_sensor/test_orthographic_path.xml").unwrap();
    assert_eq!(ortho.integrator.aovs, [Aov::Variance]);
    assert_eq!(ortho.integrator.max_depth, Some(2));
    assert_eq!(ortho.cameras[0].film.filter, Filter::Box);
    assert!(matches!(ortho.lights[..], [Light::Constant { radiance: Vec3::ONE }]));
    assert!(
        matches!(ortho.textures[0], Texture::Checkerboard { to_uv, .. } if to_uv.transform_vector2(Vec2::ONE) == Vec2::splat(5.0))
    );

    let gold = load("docs/scenes/bsdf_conductor_gold.xml").unwrap();
    let Light::Environment { image, scale, .. } = &gold.lights[0] else { panic!("{:?}", gold.lights) };
    assert_eq!((image.channels.len(), *scale), (3, 3.0));

    let spheres = load("tests/scenes/bsdf_spheres/test_constant_path.xml").unwrap();
    // Ten spheres and two squares share two meshes.
    let meshes: std::collections::HashSet<_> = spheres
        .shapes
        .iter()
        .map(|s| match &s.geometry {
            Geometry::Mesh(m) => Arc::as_ptr(m),
            g => panic!("{g:?}"),
        })
        .collect();
    assert_eq!((spheres.shapes.len(), meshes.len()), (12, 2));
    let Light::Point { position, intensity } =
        load("tests/scenes/bsdf_spheres/test_pointlight_path.xml").unwrap().lights[0]
    else {
        panic!()
    };
    assert_eq!((position, intensity), (Vec3::new(-4.0, 0.0, 6.0), Vec3::splat(300.0)));
    let Light::Directional { direction, .. } =
        load("tests/scenes/floating_sphere/test_directional_direct.xml").unwrap().lights[0]
    else {
        panic!()
    };
    assert_eq!(direction, Vec3::NEG_Z);
}

#[test]
fn the_bunny_is_that_of_mitsuba() {
    let Some(folder) = data() else { return };
    let file = folder.join("common/meshes/bunny.ply");
    let mut m = crate::formats::ply::read(&std::fs::read(&file).unwrap(), &file).unwrap();
    assert_eq!((m.positions.len(), m.triangles.len()), (35947, 69451));
    let low = m.positions.iter().copied().reduce(Vec3::min).unwrap();
    assert_near(low, [-0.0946899, 0.0329874, -0.0618736], "lower corner");
    m.complete_normals(glam::Mat3::IDENTITY);
    assert_near(m.normals[0], [0.19486819, 0.97272706, -0.12581062], "first normal");
    assert_near(m.normals[1], [0.21520539, 0.94943833, -0.22859003], "second normal");
    // The file has vertices that no face uses; they get a unit normal like everyone.
    assert!(m.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
}
