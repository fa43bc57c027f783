//! Small scenes, against what Mitsuba makes of them.

use super::*;
use glam::{Vec2, Vec3, Vec4Swizzles};
use yugen_scene::{Geometry, Light, Material, Projection, Texture, Value};

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
    // What a mirroring `to_world` does to the normals is for whoever looks at the shape.
    assert_eq!(
        scene.shapes.iter().map(|s| s.flip_normals).collect::<Vec<_>>(),
        [false, false, false, true, false]
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
