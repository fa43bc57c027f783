//! Scenes as others wrote them, against numbers of Mitsuba 3.9.1 (`scalar_rgb`: `shape.bbox()`,
//! `sensor.sample_ray`), and mistakes against their messages.

use super::*;
use crate::formats::load_scene;
use crate::scene::{Filter, Geometry, Light, Material, Projection, Shape, Texture, Value};
use glam::{Vec2, Vec3, Vec4Swizzles};
use std::collections::BTreeMap;
use std::sync::Mutex;

/// The folder of real scenes; without it a test says so and ends, except where it must be there.
fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("YUGEN_DATA").map(|d| PathBuf::from(d).join("mitsuba"));
    if folder.is_none() {
        assert!(std::env::var_os("CI").is_none(), "YUGEN_DATA must name the folder of test data");
        eprintln!("skipped: YUGEN_DATA is not set");
    }
    folder
}

/// A scene of the folder, read once for all tests.
fn load(file: &str) -> Option<Arc<Scene>> {
    static SCENES: Mutex<BTreeMap<String, Arc<Scene>>> = Mutex::new(BTreeMap::new());
    let path = data()?.join(file);
    let mut scenes = SCENES.lock().unwrap_or_else(|e| e.into_inner());
    let read = || Arc::new(load_scene(&path, &Options::default()).unwrap_or_else(|e| panic!("{e}")));
    Some(scenes.entry(file.to_string()).or_insert_with(read).clone())
}

/// Corners of everything a shape reaches in the world.
fn bounds(s: &Shape) -> (Vec3, Vec3) {
    let m = s.to_world;
    match &s.geometry {
        Geometry::Mesh(mesh) => {
            let points = mesh.positions.iter().map(|p| m.transform_point3(*p));
            points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)))
        }
        Geometry::Sphere => {
            let r = Vec3::from_array(std::array::from_fn(|i| m.row(i).xyz().length()));
            (m.w_axis.xyz() - r, m.w_axis.xyz() + r)
        }
        Geometry::Rectangle => {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
                .map(|(x, y)| m.transform_point3(Vec3::new(x, y, 0.0)));
            (corners.into_iter().reduce(Vec3::min).unwrap(), corners.into_iter().reduce(Vec3::max).unwrap())
        }
        other => panic!("no bounds of {other:?} are asked for here"),
    }
}

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

fn assert_near(a: Vec3, b: [f32; 3], what: &str) {
    let b = Vec3::from(b);
    // Single precision on both sides.
    let scale = 1.0 + b.abs().max_element();
    assert!((a - b).abs().max_element() < 4e-6 * scale, "{what}: {a}, Mitsuba {b}");
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

/// A scene with a camera and `body` from the second line on.
fn parse_with(body: &str, options: &Options) -> Result<Scene, String> {
    let text = format!("<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\n{body}</scene>");
    read(text.as_bytes(), Path::new("nowhere/a.xml"), options).map_err(|e| e.to_string())
}

fn parse(body: &str) -> Result<Scene, String> {
    parse_with(body, &Options::default())
}

#[test]
fn mistakes_are_named_with_file_line_column_and_the_nearest_word() {
    let mut wrong = String::new();
    for (body, message) in [
        (
            "<bsdf type=\"roughcondutor\"/>",
            "2:13: unknown bsdf plugin 'roughcondutor'; did you mean 'roughconductor'?",
        ),
        (
            "<bsdf type=\"diffuse\">\n  <rgb name=\"reflectence\" value=\"1\"/></bsdf>",
            "3:3: unknown property 'reflectence'; did you mean 'reflectance'?",
        ),
        ("<shpae type=\"sphere\"/>", "2:1: unknown element 'shpae'; did you mean 'shape'?"),
        ("<shape typ=\"sphere\"/>", "2:8: unknown attribute 'typ'; did you mean 'type'?"),
        ("<shape/>", "2:1: expected the attribute 'type' in <shape>"),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"1,5\"/></shape>",
            "2:50: expected a finite number, found '1,5'",
        ),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"inf\"/></shape>",
            "2:50: expected a finite number, found 'inf'",
        ),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"-1\"/></shape>",
            "2:22: 'radius' is -1; expected more than 0",
        ),
        (
            "<shape type=\"sphere\"><string name=\"radius\" value=\"1\"/></shape>",
            "2:22: expected a float as 'radius', found a string",
        ),
        (
            "<shape type=\"sphere\"><integer name=\"radius\" value=\"1.5\"/></shape>",
            "2:52: expected a whole number, found '1.5'",
        ),
        (
            "<shape type=\"sphere\"><boolean name=\"flip_normals\" value=\"yes\"/></shape>",
            "2:58: expected 'true' or 'false', found 'yes'",
        ),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"1\"/><float name=\"radius\" value=\"2\"/></shape>",
            "2:54: the property 'radius' is given twice",
        ),
        (
            "<shape type=\"sphere\"><ref id=\"gren\"/></shape><bsdf type=\"diffuse\" id=\"green\"/>",
            "2:22: unknown id 'gren'; did you mean 'green'?",
        ),
        (
            "<bsdf type=\"diffuse\" id=\"a\"/>\n<bsdf type=\"diffuse\" id=\"a\"/>",
            "3:26: the id 'a' is taken already, at nowhere/a.xml:2:13",
        ),
        ("<bsdf type=\"mask\" id=\"a\"><ref id=\"a\"/></bsdf>", "2:26: the object 'a' contains itself"),
        (
            "<bsdf type=\"mask\" id=\"a\"><bsdf type=\"mask\"><ref id=\"b\"/></bsdf></bsdf><bsdf type=\"mask\" id=\"b\"><ref id=\"a\"/></bsdf>",
            "contains itself",
        ),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"$radius\"/></shape>",
            "2:50: unknown parameter 'radius'",
        ),
        (
            "<default name=\"radius\" value=\"1\"/><shape type=\"sphere\"><float name=\"radius\" value=\"$raduis\"/></shape>",
            "unknown parameter 'raduis'; did you mean 'radius'?",
        ),
        ("<translate x=\"1\"/>", "2:1: <translate> can only stand in a <transform>"),
        (
            "<shape type=\"sphere\"><transform name=\"to_world\"><rotat x=\"1\" angle=\"3\"/></transform></shape>",
            "2:49: unknown step of a transform 'rotat'; did you mean 'rotate'?",
        ),
        (
            "<shape type=\"sphere\"><transform name=\"to_world\"><rotate angle=\"3\"/></transform></shape>",
            "2:49: the axis of a rotation cannot be zero",
        ),
        (
            "<shape type=\"sphere\"><transform name=\"to_world\"><lookat origin=\"0,0,0\" target=\"0,0,0\"/></transform></shape>",
            "2:49: 'target' must differ from 'origin'",
        ),
        (
            "<shape type=\"sphere\"><transform name=\"to_world\"><matrix value=\"1 2 3\"/></transform></shape>",
            "2:64: a matrix has 9 or 16 numbers, this one has 3",
        ),
        (
            "<shape type=\"sphere\"><transform name=\"to_world\"><scale value=\"0\"/></transform></shape>",
            "2:22: 'to_world' cannot be inverted",
        ),
        (
            "<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"1 2\"/></bsdf>",
            "2:53: a colour has one or three numbers, this one has 2",
        ),
        (
            "<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0 2 0\"/></bsdf>",
            "2:22: the colour 0, 2, 0 of a surface must lie within 0 and 1",
        ),
        (
            "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"400:1\"/></bsdf>",
            "2:58: expected one number, or at least two pairs",
        ),
        ("<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"700:1, 400:1\"/></bsdf>", "2:22: "),
        (
            "<bsdf type=\"diffuse\"><vector name=\"reflectance\" x=\"1\" y=\"1\" z=\"1\"/></bsdf>",
            "2:22: expected a number, colour, spectrum or texture as 'reflectance', found a point or vector",
        ),
        (
            "<bsdf type=\"conductor\"><string name=\"material\" value=\"Agg\"/></bsdf>",
            "2:24: unknown metal 'Agg'; did you mean 'Ag'?",
        ),
        (
            "<bsdf type=\"dielectric\"><string name=\"int_ior\" value=\"watter\"/></bsdf>",
            "2:25: unknown dielectric material 'watter'; did you mean 'water'?",
        ),
        (
            "<bsdf type=\"roughconductor\"><string name=\"distribution\" value=\"phong\"/></bsdf>",
            "2:29: unknown choice 'phong'; expected one of beckmann, ggx",
        ),
        (
            "<bsdf type=\"roughconductor\"><float name=\"alpha_u\" value=\"0.1\"/></bsdf>",
            "2:13: bsdf 'roughconductor' needs the property 'alpha_v'",
        ),
        ("<bsdf type=\"twosided\"/>", "2:13: 'twosided' needs one or two BSDFs inside, found 0"),
        (
            "<bsdf type=\"bumpmap\"><bsdf type=\"diffuse\"/></bsdf>",
            "2:13: 'bumpmap' needs a <texture> inside",
        ),
        (
            "<bsdf type=\"diffuse\"><bsdf type=\"diffuse\"/></bsdf>",
            "2:22: bsdf 'diffuse' has no use for the bsdf 'diffuse'",
        ),
        (
            "<shape type=\"sphere\"><bsdf type=\"diffuse\"/><bsdf type=\"diffuse\"/></shape>",
            "2:56: shape 'sphere' takes only one bsdf, this is the second",
        ),
        ("<emitter type=\"area\"/>", "2:16: an area emitter belongs inside a <shape>"),
        ("<emitter type=\"sunsky\"/>", "2:16: unknown emitter plugin 'sunsky'; expected one of area, point"),
        (
            "<integrator type=\"path\"><integer name=\"max_depth\" value=\"-2\"/></integrator>",
            "2:25: 'max_depth' is -2; expected -1 for no limit, or 0 and more",
        ),
        (
            "<integrator type=\"aov\"><string name=\"aovs\" value=\"x:dept\"/></integrator>",
            "2:24: unknown AOV 'dept'; did you mean 'depth'?",
        ),
        ("<shape type=\"instance\"/>", "2:14: an instance needs a <ref> to a shape of type 'shapegroup'"),
        ("<shape type=\"obj\"/>", "2:14: shape 'obj' needs the property 'filename'"),
        ("<scene version=\"3.0.0\"/>", "2:1: <scene> can only be the outermost element"),
        ("<phase type=\"hg\"/>", "2:1: <scene> has no use for the phase 'hg'"),
        (
            "<bsdf type=\"measured\"><string name=\"filename\" value=\"a.bsdf\"/></bsdf>",
            "2:23: there is no file 'a.bsdf'",
        ),
        (
            "<bsdf type=\"principled\"><float name=\"eta\" value=\"1.3\"/><float name=\"specular\" value=\"0.3\"/></bsdf>",
            "2:13: 'eta' and 'specular' cannot both be given",
        ),
        ("hello", "2:1: expected elements, found text"),
        ("<shape type=\"sphere\"", "not well-formed XML"),
        (
            "<float name=\"x\" value=\"1\"><float name=\"y\" value=\"1\"/></float>",
            "2:27: <float> cannot have elements inside",
        ),
        ("<shape type=\"sphere\"><interior/></shape>", "2:22: unknown element 'interior'"),
    ] {
        let Err(e) = parse(body) else { panic!("no error for {body}") };
        let wanted = if message.starts_with(|c: char| c.is_ascii_digit()) {
            format!("nowhere/a.xml:{message}")
        } else {
            message.to_string()
        };
        if !e.contains(&wanted) {
            wrong += &format!("{body}\n  is    {e}\n  wants {wanted}\n");
        }
    }
    assert_eq!(wrong, "");
    let whole =
        |text: &str| read(text.as_bytes(), Path::new("a.xml"), &Options::default()).unwrap_err().to_string();
    assert_eq!(whole("<scene/>"), "a.xml:1:1: expected the attribute version=\"3.0.0\" in <scene>");
    assert_eq!(
        whole("<scene version=\"9.0.0\"/>"),
        "a.xml:1:1: the file is of version 9.0.0; versions up to 3 are read"
    );
    assert_eq!(whole("<scene version=\"3.0.0\"/>"), "a.xml:1:1: the scene has no camera; add a <sensor>");
    assert_eq!(
        whole("<shape version=\"3.0.0\" type=\"sphere\"/>"),
        "a.xml:1:1: expected <scene> as the outermost element, found <shape>"
    );
    let latin = read(b"<scene version=\"3.0.0\">\n\xe9</scene>", Path::new("a.xml"), &Options::default())
        .unwrap_err();
    assert_eq!(latin.to_string(), "a.xml, byte 24: expected UTF-8 text; convert the file to UTF-8");
}

#[test]
fn sensors_and_films_keep_to_their_ranges() {
    for (inside, message) in [
        ("<float name=\"fov\" value=\"180\"/>", "'fov' is 180; expected degrees between 0 and 180"),
        ("<float name=\"fov\" value=\"40\"/><string name=\"fov_axis\" value=\"z\"/>", "unknown choice 'z'"),
        (
            "<string name=\"focal_length\" value=\"long\"/>",
            "expected a focal length such as '50mm', found 'long'",
        ),
        ("<float name=\"near_clip\" value=\"0\"/>", "'near_clip' is 0; expected more than 0"),
        (
            "<float name=\"far_clip\" value=\"0.01\"/>",
            "'far_clip' is 0.01; expected more than near_clip, which is 0.01",
        ),
        (
            "<film type=\"hdrfilm\"><integer name=\"width\" value=\"0\"/></film>",
            "'width' is 0; expected 1 to 65536",
        ),
        (
            "<film type=\"hdrfilm\"><integer name=\"crop_offset_x\" value=\"1\"/></film>",
            "the crop 768 x 576 at (1, 0) reaches out of the picture of 768 x 576",
        ),
        (
            "<film type=\"hdrfilm\"><rfilter type=\"gausian\"/></film>",
            "unknown rfilter plugin 'gausian'; did you mean 'gaussian'?",
        ),
        ("<film type=\"ldrfilm\"/>", "unknown film plugin 'ldrfilm'; did you mean 'hdrfilm'?"),
        (
            "<sampler type=\"any\"><integer name=\"sample_count\" value=\"0\"/></sampler>",
            "'sample_count' is 0",
        ),
    ] {
        let text = format!("<scene version=\"3.0.0\"><sensor type=\"perspective\">{inside}</sensor></scene>");
        let e = read(text.as_bytes(), Path::new("a.xml"), &Options::default()).unwrap_err().to_string();
        assert!(e.contains(message), "{e}\n{message}");
    }
}

#[test]
fn bombs_and_loops_end_early() {
    let nested = |n: usize| "<bsdf type=\"twosided\">".repeat(n) + &"</bsdf>".repeat(n);
    assert!(parse(&nested(100)).unwrap_err().contains("the depth of nested elements is 65"));
    // Far deeper than any stack: what must not happen is a crash.
    assert!(parse(&nested(200_000)).is_err());
    let entities = "<!DOCTYPE lolz [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;\">]><scene version=\"3.0.0\">&b;</scene>";
    let e = read(entities.as_bytes(), Path::new("a.xml"), &Options::default()).unwrap_err().to_string();
    assert_eq!(e, "a.xml: document types and entities are not allowed in a scene; remove <!DOCTYPE …>");
    // Parameters that double each other: 2⁴⁰ bytes if nobody counted.
    let mut body = String::from("<default name=\"a0\" value=\"0123456789\"/>");
    for i in 1..40 {
        body += &format!("<default name=\"a{i}\" value=\"$a{0} $a{0}\"/>", i - 1);
    }
    let e = parse(&body).unwrap_err();
    assert!(e.contains("the text that parameters put in, in bytes, is"), "{e}");
    // A long chain of references.
    let chain: String = (0..5000)
        .map(|i| format!("<bsdf type=\"twosided\" id=\"b{i}\"><ref id=\"b{}\"/></bsdf>", i + 1))
        .collect();
    let e = parse(&(chain + "<bsdf type=\"diffuse\" id=\"b5000\"/>")).unwrap_err();
    assert!(e.contains("the depth of nested and referenced objects is"), "{e}");
}

/// A folder that goes away.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str, files: &[(&str, &str)]) -> Self {
        let folder = std::env::temp_dir().join(format!("yugen-mitsuba-{name}-{}", std::process::id()));
        for (file, text) in files {
            let path = folder.join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        Self(folder)
    }

    fn load(&self, file: &str, options: &Options) -> Result<Scene, String> {
        load_scene(&self.0.join(file), options)
            .map_err(|e| e.to_string().replace(&*self.0.to_string_lossy(), "DIR"))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn with_sensor(body: &str) -> String {
    format!("<scene version=\"3.0.0\"><sensor type=\"perspective\"/>{body}</scene>")
}

#[test]
fn a_scene_reaches_only_into_its_folders() {
    let shape =
        |name: &str| format!("<shape type=\"obj\"><string name=\"filename\" value=\"{name}\"/></shape>");
    let f = Folder::new(
        "folders",
        &[
            ("outside.obj", TRIANGLE),
            ("shared/there.obj", TRIANGLE),
            ("scene/below/here.obj", TRIANGLE),
            ("scene/good.xml", &with_sensor(&shape("below/../below/here.obj"))),
            ("scene/climbs.xml", &with_sensor(&shape("../outside.obj"))),
            ("scene/path.xml", &with_sensor(&format!("<path value=\"../shared\"/>{}", shape("there.obj")))),
            (
                "scene/path_climbs.xml",
                &with_sensor(&format!("<path value=\"../shared\"/>{}", shape("../outside.obj"))),
            ),
            ("scene/missing.xml", &with_sensor(&shape("none.obj"))),
            ("scene/no_folder.xml", &with_sensor("<path value=\"../none\"/>")),
            ("scene/absolute.xml", &with_sensor("<path value=\"/tmp\"/>")),
            ("scene/root.xml", &with_sensor("<path value=\"../../../../../../../../../../../../../..\"/>")),
            ("scene/broken.obj", "v 0 0 0\nf 1 2 3\n"),
            ("scene/broken.xml", &with_sensor(&shape("broken.obj"))),
        ],
    );
    let none = Options::default();
    assert_eq!(f.load("scene/good.xml", &none).unwrap().shapes[0].name, "here");
    assert_eq!(f.load("scene/path.xml", &none).unwrap().shapes[0].name, "there");
    let climbs = f.load("scene/climbs.xml", &none).unwrap_err();
    assert!(climbs.contains("the file '../outside.obj' lies outside the folders of this scene"), "{climbs}");
    assert!(climbs.starts_with("DIR/scene/climbs.xml:1:"), "{climbs}");
    // A file that is not there gets the same answer: nobody learns what lies outside.
    let secret = climbs.replace("outside.obj", "secret.obj");
    std::fs::write(f.0.join("scene/climbs.xml"), with_sensor(&shape("../secret.obj"))).unwrap();
    assert_eq!(f.load("scene/climbs.xml", &none).unwrap_err(), secret);
    assert!(f.load("scene/path_climbs.xml", &none).unwrap_err().contains("lies outside"));
    let absolute = with_sensor(&shape(&f.0.join("outside.obj").to_string_lossy()));
    std::fs::write(f.0.join("scene/climbs.xml"), absolute).unwrap();
    assert!(f.load("scene/climbs.xml", &none).unwrap_err().contains("lies outside"));
    let allowed = Options { folders: vec![f.0.clone()], ..Options::default() };
    assert!(f.load("scene/climbs.xml", &allowed).is_ok());
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(f.0.join("outside.obj"), f.0.join("scene/link.obj")).unwrap();
        std::fs::write(f.0.join("scene/link.xml"), with_sensor(&shape("link.obj"))).unwrap();
        assert!(f.load("scene/link.xml", &none).unwrap_err().contains("lies outside"));
    }
    let missing = f.load("scene/missing.xml", &none).unwrap_err();
    assert!(missing.contains("there is no file 'none.obj' (looked in DIR/scene)"), "{missing}");
    assert!(f.load("scene/no_folder.xml", &none).unwrap_err().contains("there is no folder '../none'"));
    assert!(f.load("scene/absolute.xml", &none).unwrap_err().contains("the folder '/tmp' is absolute"));
    assert!(f.load("scene/root.xml", &none).unwrap_err().contains("the root of the file system"));
    let broken = f.load("scene/broken.xml", &none).unwrap_err();
    assert_eq!(
        broken,
        "DIR/scene/broken.obj:2:5: vertex 2 does not exist; there are 1 so far, counted from 1"
    );
    assert!(f.load("scene/none.xml", &none).unwrap_err().contains("there is nothing of this name"));
    assert!(f.load("scene/none.xmk", &none).unwrap_err().contains("unknown scene file extension 'xmk'"));
}

#[test]
fn includes_share_parameters_and_end_where_they_loop() {
    let sphere = "<shape type=\"sphere\"><float name=\"radius\" value=\"$r\"/></shape>";
    let f = Folder::new(
        "includes",
        &[
            (
                "main.xml",
                &with_sensor("<default name=\"r\" value=\"2\"/><include filename=\"parts/a.xml\"/>"),
            ),
            (
                "parts/a.xml",
                "<scene version=\"3.0.0\"><default name=\"r\" value=\"3\"/><include filename=\"b.xml\"/></scene>",
            ),
            ("parts/b.xml", &format!("<scene version=\"3.0.0\">{sphere}</scene>")),
            (
                "one.xml",
                &with_sensor("<shape type=\"sphere\"><include filename=\"parts/bsdf.xml\"/></shape>"),
            ),
            ("parts/bsdf.xml", "<bsdf version=\"3.0.0\" type=\"null\"/>"),
            ("loop.xml", &with_sensor("<include filename=\"parts/loop.xml\"/>")),
            ("parts/loop.xml", "<scene version=\"3.0.0\">\n<include filename=\"../loop.xml\"/></scene>"),
            ("self.xml", &with_sensor("<include filename=\"./parts/../self.xml\"/>")),
        ],
    );
    let radius = |scene: &Scene| scene.shapes[0].to_world.x_axis.x;
    let none = Options::default();
    // The first <default> counts, and what the caller says counts more.
    assert_eq!(radius(&f.load("main.xml", &none).unwrap()), 2.0);
    let define = |name: &str| Options { defines: vec![(name.into(), "7".into())], ..Options::default() };
    assert_eq!(radius(&f.load("main.xml", &define("r")).unwrap()), 7.0);
    let e = f.load("main.xml", &define("rr")).unwrap_err();
    assert!(e.starts_with("DIR/main.xml: unknown parameter 'rr'"), "{e}");
    let one = f.load("one.xml", &none).unwrap();
    assert!(matches!(one.materials[one.shapes[0].material], Material::Null));
    let e = f.load("loop.xml", &none).unwrap_err();
    assert_eq!(e, "DIR/parts/loop.xml:2:20: the file '../loop.xml' includes itself");
    let e = f.load("self.xml", &none).unwrap_err();
    assert!(e.ends_with("the file './parts/../self.xml' includes itself"), "{e}");
}

#[test]
fn old_files_are_understood() {
    let text = "<scene version=\"0.6.0\"><sensor type=\"perspective\"><float name=\"nearClip\" value=\"3\"/>\
        <transform name=\"toWorld\"><lookAt origin=\"1,2,3\" target=\"2,5,-1\"/></transform>\
        <sampler type=\"ldsampler\"><integer name=\"sampleCount\" value=\"7\"/></sampler></sensor>\
        <bsdf type=\"diffuse\"><texture name=\"diffuseReflectance\" type=\"checkerboard\"><float name=\"uscale\" value=\"4\"/>\
        <float name=\"voffset\" value=\"0.5\"/></texture></bsdf></scene>";
    let scene = read(text.as_bytes(), Path::new("a.xml"), &Options::default()).unwrap();
    let c = &scene.cameras[0];
    assert_eq!((c.samples_per_pixel, c.near_far[0]), (7, 3.0));
    // Mitsuba 3.9.1 for the same <lookat> without 'up'.
    assert_near(c.to_world.x_axis.xyz(), [-0.0646606, 0.806018, 0.588348], "x");
    assert_near(c.to_world.y_axis.xyz(), [0.978446, -0.0646606, 0.196116], "y");
    assert_near(c.to_world.z_axis.xyz(), [0.196116, 0.588348, -0.784465], "z");
    let Texture::Checkerboard { to_uv, .. } = scene.textures[0] else { panic!() };
    assert_eq!(to_uv.transform_point2(Vec2::new(1.0, 1.0)), Vec2::new(4.0, 1.5));
}

/// The scene of one sensor.
fn with_camera(inside: &str, width: u32, height: u32) -> Scene {
    let text = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\">{inside}<film type=\"hdrfilm\">\
         <integer name=\"width\" value=\"{width}\"/><integer name=\"height\" value=\"{height}\"/></film></sensor></scene>"
    );
    read(text.as_bytes(), Path::new("a.xml"), &Options::default()).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn fields_of_view_are_those_of_mitsuba() {
    let axis = |name: &str| {
        format!("<float name=\"fov\" value=\"40\"/><string name=\"fov_axis\" value=\"{name}\"/>")
    };
    let lens = |text: &str| format!("<string name=\"focal_length\" value=\"{text}\"/>");
    // `x_fov` of the sensor in Mitsuba 3.9.1, for 300 x 200 and for 200 x 300 pixels.
    for (inside, wide, tall) in [
        (axis("x"), 40.0, 40.0),
        (axis("y"), 57.265140533447266, 27.278078079223633),
        (axis("diagonal"), 33.696983337402344, 22.82851791381836),
        (axis("larger"), 40.0, 27.278078079223633),
        (axis("smaller"), 57.265140533447266, 40.0),
        (lens("35mm"), 54.43222427368164, 37.84928894042969),
        (lens("50"), 39.59775161743164, 26.991466522216797),
        (String::new(), 39.59775161743164, 26.991466522216797),
    ] {
        for (width, height, fov) in [(300, 200, wide), (200, 300, tall)] {
            let camera = with_camera(&inside, width, height).cameras[0].clone();
            // The same whether the file says the size or whoever renders it.
            for (w, h) in [(width, height), (640, 360), (30, 450), (77, 77)] {
                let mut resized = with_camera(&inside, w, h).cameras[0].clone();
                resized.resize(width, height);
                let Projection::Perspective { fov_x, .. } = resized.projection else { panic!() };
                let fov_x = fov_x.to_degrees();
                assert!((fov_x - fov).abs() < 2e-5, "{inside} {w} x {h} to {width} x {height}: {fov_x}");
                assert_eq!(resized.film, camera.film);
            }
        }
    }
}

#[test]
fn shapes_stand_where_mitsuba_puts_them() {
    let scene = parse(
        "<shape type=\"sphere\"><point name=\"center\" value=\"1,2,3\"/><float name=\"radius\" value=\"2\"/>\
         <transform name=\"to_world\"><scale value=\"2\"/><rotate z=\"1\" angle=\"30\"/><translate x=\"1\"/></transform></shape>\
         <shape type=\"cylinder\"><point name=\"p0\" value=\"1,2,3\"/><point name=\"p1\" value=\"3,1,5\"/><float name=\"radius\" value=\"0.5\"/>\
         <transform name=\"to_world\"><translate x=\"1\"/></transform></shape>\
         <shape type=\"sphere\"><transform name=\"to_world\"><scale x=\"-1\"/></transform></shape>\
         <shape type=\"disk\"><boolean name=\"flip_normals\" value=\"true\"/><transform name=\"to_world\"><scale value=\"-1\"/></transform></shape>\
         <shape type=\"shapegroup\" id=\"g\"><shape type=\"cube\"/><shape type=\"sphere\"/></shape>\
         <shape type=\"instance\"><ref id=\"g\"/><transform name=\"to_world\"><matrix value=\"1 2 0 4 0 1 0 5 0 0 3 6 0 0 0 1\"/></transform></shape>",
    )
    .unwrap();
    // shape.bbox(), to_world and the normals of ray_intersect in Mitsuba 3.9.1.
    let (low, high) = bounds(&scene.shapes[0]);
    assert_near(low, [-3.26795, 0.464102, 2.0], "sphere");
    assert_near(high, [4.73205, 8.4641, 10.0], "sphere");
    let m = scene.shapes[1].to_world;
    assert_near(m.x_axis.xyz(), [0.366667, 0.0666667, -0.333333], "cylinder, x");
    assert_near(m.y_axis.xyz(), [0.0666667, 0.466667, 0.166667], "cylinder, y");
    assert_near(m.z_axis.xyz(), [2.0, -1.0, 2.0], "cylinder, z");
    assert_near(m.w_axis.xyz(), [2.0, 2.0, 3.0], "cylinder, origin");
    assert_eq!(
        scene.shapes.iter().map(|s| s.flip_normals).collect::<Vec<_>>(),
        [false, false, true, true, false]
    );
    let Geometry::Instance(group) = scene.shapes[4].geometry else { panic!() };
    let mut cube = scene.groups[group][0].clone();
    cube.to_world = scene.shapes[4].to_world;
    let (low, high) = bounds(&cube);
    assert_eq!((low, high), (Vec3::new(1.0, 4.0, 3.0), Vec3::new(7.0, 6.0, 9.0)));
    let Geometry::Mesh(cube) = &cube.geometry else { panic!() };
    // Outwards, whatever the order in which the sides are listed.
    for t in &cube.triangles {
        let [a, b, c] = t.map(|i| cube.positions[i as usize]);
        assert!((b - a).cross(c - a).dot(cube.normals[t[0] as usize]) > 0.0);
    }
    // One corner of two sides: position and (u, v) from mi.traverse of a cube.
    assert_eq!((cube.positions[1], cube.uvs[1]), (Vec3::new(1.0, -1.0, 1.0), Vec2::new(1.0, 1.0)));
    assert_eq!((cube.positions[20], cube.uvs[20]), (Vec3::new(1.0, 1.0, -1.0), Vec2::new(0.0, 1.0)));
}

#[test]
fn normals_that_a_file_lacks_are_those_of_mitsuba() {
    let shape = |t: &str| {
        with_sensor(&format!(
            "<shape type=\"obj\"><string name=\"filename\" value=\"n.obj\"/><transform name=\"to_world\">{t}</transform></shape>"
        ))
    };
    let f = Folder::new(
        "normals",
        &[
            ("n.obj", "v 0 0 0\nv 1 0 0.3\nv 0 1 0.2\nv 1 1.2 -0.5\nf 1 2 3\nf 3 2 4\n"),
            ("scale.xml", &shape("<scale x=\"2\" y=\"0.5\" z=\"3\"/>")),
            ("mirror.xml", &shape("<scale x=\"-1\"/>")),
            ("turn.xml", &shape("<rotate x=\"1\" angle=\"40\"/>")),
            (
                "flat.xml",
                &with_sensor(
                    "<shape type=\"obj\"><string name=\"filename\" value=\"n.obj\"/><boolean name=\"face_normals\" value=\"true\"/></shape>",
                ),
            ),
        ],
    );
    // `vertex_normals` of the mesh in Mitsuba 3.9.1, first and last vertex, in the world.
    for (file, first, last) in [
        ("scale.xml", [-0.27682483, -0.7381996, 0.61516625], [0.20190936, 0.9501617, 0.23754044]),
        ("mirror.xml", [-0.28221628, 0.18814418, -0.94072086], [0.42646846, -0.50172764, -0.7525915]),
        ("turn.xml", [-0.28221634, -0.7488106, 0.59969723], [0.42646852, -0.09941083, 0.89902282]),
    ] {
        let scene = f.load(file, &Options::default()).unwrap();
        let s = &scene.shapes[0];
        let Geometry::Mesh(m) = &s.geometry else { panic!() };
        let world = |n: Vec3| s.to_world.inverse().transpose().transform_vector3(n).normalize();
        assert_near(world(m.normals[0]), first, file);
        assert_near(world(m.normals[3]), last, file);
    }
    let flat = f.load("flat.xml", &Options::default()).unwrap();
    assert!(flat.shapes[0].face_normals);
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

#[test]
fn colours_and_materials_are_those_of_mitsuba() {
    // mi.traverse and emitter.eval in Mitsuba 3.9.1, scalar_rgb.
    let light = |inside: &str| {
        let scene = parse(&format!("<emitter type=\"constant\">{inside}</emitter>")).unwrap();
        let Light::Constant { radiance } = scene.lights[0] else { panic!() };
        radiance
    };
    assert_near(light(""), [1.0, 1.0, 1.0], "default");
    assert_near(light("<float name=\"radiance\" value=\"2\"/>"), [2.0, 2.0, 2.0], "float");
    assert_near(light("<spectrum name=\"radiance\" value=\"2\"/>"), [2.40959, 1.89658, 1.81783], "uniform");
    assert_near(
        light("<spectrum type=\"uniform\" name=\"radiance\"><float name=\"value\" value=\"2\"/></spectrum>"),
        [2.0, 2.0, 2.0],
        "plugin",
    );
    assert_near(
        light("<spectrum name=\"radiance\" value=\"400:1, 550:2, 700:3\"/>"),
        [3.08031, 1.85896, 1.13084],
        "list",
    );
    assert_near(
        light(
            "<spectrum type=\"d65\" name=\"radiance\"><float name=\"scale\" value=\"2\"/><rgb name=\"color\" value=\"1 2 3\"/></spectrum>",
        ),
        [2.0, 4.0, 6.0],
        "d65",
    );
    let material = |text: &str, param: &str| {
        let scene = parse(text).unwrap();
        let Material::Model { kind, params, .. } = &scene.materials[0] else { panic!() };
        let i = kind.params().iter().position(|p| p.name == param).unwrap();
        match params[i] {
            Value::Rgb(c) => c,
            Value::Number(v) => Vec3::splat(v),
            Value::Texture(_) => panic!(),
        }
    };
    let list =
        "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"400:0.1, 550:0.2, 700:0.3\"/></bsdf>";
    assert_near(material(list, "reflectance"), [0.260364, 0.195267, 0.126699], "reflectance");
    let metal = "<bsdf type=\"conductor\"><spectrum name=\"eta\" value=\"400:1, 500:2, 700:3\"/><spectrum name=\"k\" value=\"2.5\"/></bsdf>";
    assert_near(material(metal, "eta"), [2.68502, 2.23359, 1.43877], "eta");
    assert_near(material(metal, "k"), [2.5, 2.5, 2.5], "k");
    assert_near(material("<bsdf type=\"conductor\"/>", "eta"), [0.0, 0.0, 0.0], "mirror");
    let gold = "<bsdf type=\"roughconductor\"><string name=\"material\" value=\"Au\"/><float name=\"alpha\" value=\"0.0005\"/></bsdf>";
    // Both the table of metals and this print have six digits, so the last may differ by one.
    let gold_eta = material(gold, "eta") - Vec3::new(0.143036, 0.375307, 1.44205);
    assert!(gold_eta.abs().max_element() < 1.5e-5, "{gold_eta}");
    // Below what our table of parameters calls sensible, and taken all the same.
    assert_near(material(gold, "alpha_y"), [0.0005; 3], "alpha");
    // F0 = 0.04 by default: 1.5 to the rounding of the formula.
    let disney = "<bsdf type=\"principled\"><rgb name=\"base_color\" value=\"1 0.5 0\"/><float name=\"metallic\" value=\"0.5\"/></bsdf>";
    assert_near(material(disney, "base_color"), [1.0, 0.5, 0.0], "base colour");
    assert_near(material(disney, "eta"), [1.5; 3], "eta");
    // The ratio is what Mitsuba shows: 1.4895873 and 1.5041833.
    for (bsdf, ratio) in [("plastic", 1.4895873), ("dielectric", 1.5041833)] {
        let text = format!("<bsdf type=\"{bsdf}\"/>");
        let eta = material(&text, "int_ior").x / material(&text, "ext_ior").x;
        assert!((eta - ratio).abs() < 1e-6, "{bsdf}: {eta}");
    }
}

#[test]
fn textures_are_laid_as_mitsuba_lays_them() {
    let texture = |inside: &str| {
        let text = format!(
            "<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"checkerboard\"><transform name=\"to_uv\">{inside}</transform></texture></bsdf>"
        );
        let scene = parse(&text).unwrap();
        let Texture::Checkerboard { to_uv, .. } = scene.textures[0] else { panic!() };
        to_uv.transform_point2(Vec2::new(0.05, 0.15))
    };
    // From the texel that Mitsuba 3.9.1 shows at this (u, v) on a rectangle.
    let near = |a: Vec2, x: f32, y: f32| assert!((a - Vec2::new(x, y)).length() < 1e-6, "{a}");
    near(texture("<scale x=\"2\" y=\"3\"/>"), 0.1, 0.45);
    near(texture("<translate x=\"0.25\"/>"), 0.3, 0.15);
    near(texture("<rotate z=\"1\" angle=\"90\"/>"), -0.15, 0.05);
    near(texture("<scale value=\"2\"/><translate x=\"0.25\" y=\"0.5\"/>"), 0.35, 0.8);
    near(texture("<matrix value=\"0 1 0.25 1 0 0.5 0 0 1\"/>"), 0.15, 0.05);
    // Where a number is wanted, the program swaps the two values.
    let scene = parse(
        "<texture type=\"checkerboard\" id=\"t\"/><bsdf type=\"diffuse\"><ref name=\"reflectance\" id=\"t\"/></bsdf>\
         <bsdf type=\"roughconductor\"><ref name=\"alpha\" id=\"t\"/></bsdf>",
    )
    .unwrap();
    let even = |i: usize| match &scene.textures[i] {
        Texture::Checkerboard { even: Value::Number(v), .. } => *v,
        t => panic!("{t:?}"),
    };
    assert_eq!((scene.textures.len(), even(0), even(1)), (2, 0.4, 0.2));
}

#[test]
fn nested_integrators_add_up() {
    let integrator = |text: &str| parse(text).unwrap().integrator;
    let aov = integrator(
        "<integrator type=\"aov\"><string name=\"aovs\" value=\"dd:depth, nn:sh_normal\"/><integrator type=\"direct\">\
         <integer name=\"shading_samples\" value=\"3\"/><boolean name=\"hide_emitters\" value=\"true\"/></integrator></integrator>",
    );
    assert_eq!(aov.kind, IntegratorKind::Direct);
    assert_eq!((aov.aovs, aov.hide_emitters), (vec![Aov::Depth, Aov::ShadingNormal], true));
    let moment = integrator(
        "<integrator type=\"moment\"><integrator type=\"path\"><integer name=\"max_depth\" value=\"0\"/></integrator></integrator>",
    );
    assert_eq!((moment.aovs, moment.max_depth, moment.rr_depth), (vec![Aov::Variance], Some(0), 5));
    assert_eq!(integrator("<integrator type=\"path\"/>").max_depth, None);
    let volume = "<integrator type=\"volpath\"><integer name=\"max_depth\" value=\"4\"/></integrator>";
    assert_eq!((integrator(volume).kind, integrator(volume).max_depth), (IntegratorKind::Path, Some(4)));
    assert_eq!(integrator("<integrator type=\"depth\"/>").kind, IntegratorKind::Depth);
}

#[test]
fn a_projector_throws_a_plain_colour_as_a_square() {
    let scene = parse(
        "<emitter type=\"projector\"><float name=\"fov\" value=\"60\"/><string name=\"fov_axis\" value=\"y\"/>\
         <rgb name=\"irradiance\" value=\"1 2 3\"/></emitter><sampler type=\"ldsampler\" id=\"s\"/>",
    )
    .unwrap();
    let Light::Projector { texture, fov_x, .. } = scene.lights[0] else { panic!() };
    assert!((fov_x.to_degrees() - 60.0).abs() < 1e-4);
    let Texture::Image { image, .. } = &scene.textures[texture] else { panic!() };
    assert_eq!((image.width, image.height, &image.data[..]), (1, 1, &[1.0, 2.0, 3.0][..]));
}
