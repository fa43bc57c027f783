use super::*;
use yugen_reflectance::Kind;
use yugen_scene::{Geometry, Shape, Value, Wrap};

fn load(text: &str) -> Result<Scene, Error> {
    read(text.as_bytes(), "scene.toml".as_ref(), &Options::default())
}

fn refuse(text: &str) -> String {
    load(text).expect_err(text).to_string()
}

/// The TOML blocks of the manual.
fn manual() -> Vec<&'static str> {
    let text = include_str!("../../../../../docs/scene.md");
    text.split("```toml\n").skip(1).map(|block| block.split("```").next().unwrap()).collect()
}

#[test]
fn the_examples_of_the_manual_are_scenes() {
    let [ball, cloth] = manual()[..] else { panic!("two examples") };
    let lines = ball.lines().filter(|l| !l.trim().is_empty()).count();
    assert!(lines <= 30, "the first example is to stay short: {lines} lines");
    let scene = load(ball).unwrap();
    assert_eq!((scene.shapes.len(), scene.cameras.len(), scene.lights.len()), (3, 1, 0));
    assert_eq!(scene.working_space, ColourSpace::LinearRec2020);
    // The desk faces up, the ball lies on it, the lamp shines down.
    let normal = |s: &Shape| s.to_world.transform_vector3(Vec3::Z).normalize();
    assert!((normal(&scene.shapes[0]) - Vec3::Y).length() < 1e-6);
    assert_eq!(scene.shapes[1].to_world.transform_point3(Vec3::Y), Vec3::new(0.0, 0.8, 0.0));
    assert!(normal(&scene.shapes[2]).y < -0.5);
    let Some(Value::Rgb(light)) = scene.shapes[2].emission else { panic!("it shines") };
    assert!(
        (scene.working_space.luminance(light) - 12.0).abs() < 1e-3 && light.x > light.y && light.y > light.z
    );
    let Projection::Perspective { fov_x, focus_distance, .. } = scene.cameras[0].projection else { panic!() };
    assert!((fov_x.to_degrees() - 35.0).abs() < 1e-4 && (focus_distance - 3.1048).abs() < 1e-3);

    let scene = load(cloth).unwrap();
    assert_eq!((scene.shapes.len(), scene.groups.len(), scene.cameras[0].samples_per_pixel), (3, 1, 256));
    let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("cloth is a mesh") };
    assert_eq!((mesh.positions.len(), mesh.tangents.len()), (625, 625));
    assert!(matches!(scene.shapes[1].geometry, Geometry::Instance(0)));
    let Material::TwoSided { front, back } = scene.materials[scene.shapes[0].material] else {
        panic!("two-sided")
    };
    let Material::Blend { weight: Value::Texture(_), first, second } = scene.materials[front] else {
        panic!("a blend")
    };
    assert_eq!(front, back);
    let kind = |id: usize| match &scene.materials[id] {
        Material::Model { kind, .. } => kind.name(),
        _ => "",
    };
    assert_eq!((kind(first), kind(second)), ("ward", "rough_conductor"));
    let gold = scene.materials.iter().find_map(|m| match m {
        Material::Model { kind, params, .. } if kind.name() == "rough_conductor" => Some((*kind, params)),
        _ => None,
    });
    let (kind, params) = gold.unwrap();
    let at = |name| &params[kind.params().iter().position(|p| p.name == name).unwrap()];
    assert_eq!((at("alpha_x"), at("alpha_y")), (&Value::Number(0.15), &Value::Number(0.15)));
    // Gold reflects red and not blue: less extinction and a larger index there.
    let (Value::Rgb(eta), Value::Rgb(k)) = (at("eta"), at("k")) else { panic!("constants of a metal") };
    assert!(eta.z > 1.0 && eta.x < 0.3 && k.x > 3.0, "{eta} {k}");
}

#[test]
fn mistakes_name_line_column_and_the_nearest_word() {
    assert_eq!(refuse("[camra]\n"), "scene.toml:1:2: unknown key 'camra'; did you mean 'camera'?");
    let ball = "[[shape]]\ntype = \"sphere\"\n";
    for (text, words) in [
        ("radios = 2", ":3:1: unknown key 'radios'; did you mean 'radius'?"),
        ("radius = \"big\"", ":3:10: 'radius' is 'big'; expected a number"),
        ("radius = 0", ":3:10: 'radius' is 0; expected a number from"),
        ("at = [0, 1]", ":3:6: 'at' is [0, 1]; expected 3 numbers in brackets"),
        ("material = \"red\"", ":3:12: unknown material 'red'"),
        ("scale = 0", ":1:1: shape 'sphere' is squeezed flat"),
        ("scale = 1e300", ":3:9"),
        ("facing = [0, 0, 0]", "has no direction"),
        ("facing = [0, 0, 1]\nrotate = [1, 0, 0]", "one of 'facing' and 'rotate'"),
        ("emission = \"#12345\"", "six hexadecimal digits"),
        ("emission = \"#1234é\"", "six hexadecimal digits"),
        ("emission = { blackbody = 1 }", "from 500 to 50000"),
        ("emission = { blackbody = 2000, rgb = [1, 1, 1] }", "one way"),
        ("emission = { metal = \"gild\" }", "unknown metal 'gild'; did you mean 'gold'?"),
        ("emission = { wavelengths = [500, 400], values = [1, 1] }", ":3:28"),
        ("emission = { checker = [\"a\", 1] }", "unknown texture 'a'"),
        ("matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]", "four rows"),
        ("name = 1", "a text in quotes"),
    ] {
        let error = refuse(&format!("{ball}{text}\n"));
        assert!(error.starts_with("scene.toml:") && error.contains(words), "{text}: {error}");
    }
    for (text, words) in [
        ("[[shape]]\ntype = \"shere\"", ":2:8: unknown shape 'shere'; did you mean 'sphere'?"),
        ("[[shape]]\nradius = 1", "shape lacks 'type'"),
        ("[[shape]]\ntype = \"file\"\nfile = \"../../etc/passwd.obj\"", "lies outside the folders"),
        ("[[shape]]\ntype = \"file\"\nfile = \"no.obj\"", "no file 'no.obj'"),
        ("[[shape]]\ntype = \"instance\"\ngroup = \"g\"", "unknown group 'g'"),
        ("[[shape]]\ntype = \"ball\"\nsegments = 1000000", "whole number from 1 to 1448"),
        ("[[shape]]\ntype = \"drape\"\nover = { at = [0, 0, 0] }", "one of 'ball'"),
        (
            "[material.a]\nmodel = \"lambart\"",
            ":2:9: unknown reflectance model 'lambart'; did you mean 'lambert'?",
        ),
        ("[material.a]\nmodel = \"lambert\"\nreflectanse = 1", "did you mean 'reflectance'?"),
        (
            "[material.a]\nmodel = \"lambert\"\nreflectance = 2",
            ":3:15: parameter 'reflectance' of model 'lambert' is 2; expected 0 to 1",
        ),
        ("[material.a]\nmodel = \"oren_nayar\"\nform = \"ful\"", "unknown form 'ful'; did you mean 'full'?"),
        ("[material.a]\nmodel = \"merl\"\npreset = \"red_plastik\"", "did you mean 'red_plastic'?"),
        ("[material.a]\nmodel = \"lambert\"\ndata = \"x\"", "no file 'x'"),
        ("[material.a]\nmodel = \"merl\"", "needs"),
        ("[material.a]\nblend = [\"a\", \"a\"]\nweight = 0.5", "material 'a' contains itself"),
        (
            "[material.a]\nblend = [\"b\", \"b\"]\nweight = 0.5\n[material.b]\nsum = [\"a\"]",
            "contains itself",
        ),
        ("[material.a]\nnormal_scale = 2\nmodel = \"lambert\"", "needs a 'normal_map'"),
        ("[material.a]\n", "needs one of 'model'"),
        ("[texture.t]\nchecker = [\"t\", 1]", "texture 't' contains itself"),
        ("[texture.t]\n", "a texture needs one of"),
        ("[camera]\nfrom = [0, 1, 0]\nto = [0, 0, 0]", "look somewhere"),
        ("[camera]\nfrom = [0, 1, 1]\nto = [0, 0, 0]\nfov = 20\nfov_y = 20", "one of 'fov'"),
        ("[film]\nsize = [0, 10]", "whole number from 1 to 65536"),
        ("[film]\nsize = [10, 10]\ncrop = [5, 5, 6, 5]", "a part of the picture"),
        ("[film]\nfilter = \"box\"\nfilter_width = 2", "have a width"),
        ("[render]\naovs = [\"albedu\"]", "did you mean 'albedo'?"),
        ("[[light]]\ntype = \"spot\"\nat = [0, 0, 0]", "one of 'towards'"),
        (
            "[[light]]\ntype = \"point\"\nat = [0, 0, 0]\nintensity = { checker = [0, 1] }",
            "expected a colour",
        ),
        ("light = 3", ":1:9: 'light' is 3; expected a list"),
        ("a = ", "scene.toml:1:"),
        ("a = 1\na = 2", "scene.toml:2:"),
    ] {
        let error = refuse(text);
        assert!(error.contains("scene.toml:") && error.contains(words), "{text}: {error}");
    }
    let error = read(b"a = '\xff'", "scene.toml".as_ref(), &Options::default()).unwrap_err().to_string();
    assert!(error.starts_with("scene.toml, byte 5: "), "{error}");
    // Depth does no harm.
    let deep = format!("a = {}1{}", "[".repeat(100_000), "]".repeat(100_000));
    assert!(load(&deep).is_err());
}

#[test]
fn every_form_of_a_colour_arrives_in_the_working_space() {
    let emission = |value: &str, head: &str| {
        let scene = load(&format!("{head}\n[[shape]]\ntype = \"sphere\"\nemission = {value}\n")).unwrap();
        match scene.shapes[0].emission.clone().unwrap() {
            Value::Rgb(c) => c,
            Value::Number(v) => Vec3::splat(v),
            Value::Texture(_) => panic!("a colour"),
        }
    };
    let near = |a: Vec3, b: [f32; 3]| assert!((a - Vec3::from(b)).abs().max_element() < 2e-4, "{a} {b:?}");
    let srgb = "[scene]\nworking_space = \"srgb\"";
    near(emission("[0.1, 0.2, 3]", srgb), [0.1, 0.2, 3.0]);
    near(emission("7", srgb), [7.0; 3]);
    near(emission("\"#ff8000\"", srgb), [1.0, 0.2158605, 0.0]);
    // ITU-R BT.2087-0: BT.709 red in BT.2020.
    near(emission("[1, 0, 0]", ""), [0.6274, 0.0691, 0.0164]);
    near(emission("[1, 0, 0]", "[scene]\ncolours = \"rec2020\""), [1.0, 0.0, 0.0]);
    near(emission("{ rgb = [1, 0, 0], space = \"rec2020\", scale = 2 }", ""), [2.0, 0.0, 0.0]);
    // White of D65 is what a black body of 6500 K nearly is.
    let sun = emission("{ blackbody = 6500 }", srgb);
    assert!((sun - Vec3::ONE).abs().max_element() < 0.05, "{sun}");
    let fire = emission("{ blackbody = 1900, scale = 5 }", "");
    assert!(
        (ColourSpace::LinearRec2020.luminance(fire) - 5.0).abs() < 1e-3 && fire.min_element() > 0.0,
        "{fire}"
    );
    // Mitsuba 3.9.1, scalar_rgb, conductor Au: F0 of its eta and k.
    let gold = emission("{ metal = \"gold\" }", srgb);
    assert!(gold.x > 0.95 && (0.7..0.85).contains(&gold.y) && (0.25..0.45).contains(&gold.z), "{gold}");
    near(
        emission("{ wavelengths = [300, 900], values = [0.5, 0.5], scale = 2 }", srgb)
            .map(|v| v / emission("{ wavelengths = [300, 900], values = [1, 1] }", srgb).x),
        {
            let one = emission("{ wavelengths = [300, 900], values = [1, 1] }", srgb);
            (one / one.x).to_array()
        },
    );
}

#[test]
fn files_textures_and_transforms() {
    let folder = std::env::temp_dir().join(format!("yugen-toml-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut picture = Image::rgb(4, 2);
    picture.data.fill(0.5);
    let written = super::super::image::WriteOptions::from(ColourSpace::LinearSrgb);
    super::super::image::write(&folder.join("p.exr"), &picture, &written).unwrap();
    std::fs::write(folder.join("t.mtl"), "newmtl skin\nKd 1 0 0\nKs 0.2 0.2 0.2\nNs 30\nd 0.5\n").unwrap();
    std::fs::write(folder.join("t.obj"), "mtllib t.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl skin\nf 1 2 3\n")
        .unwrap();
    let text = r#"
        [texture.paper]
        image = "p.exr"
        tint = 0.5
        scale = [2, 3]
        offset = [0.5, 0]
        [material.paper]
        model = "lambert"
        reflectance = "paper"
        opacity = { image = "p.exr", channel = "G" }
        bump_map = { image = "p.exr" }
        bump_scale = 0.1
        [[shape]]
        type = "file"
        file = "t.obj"
        rotate = [90, 0, 0]
        scale = 2
        at = [0, 0, 5]
        [[shape]]
        type = "file"
        file = "t.obj"
        material = "paper"
        [[light]]
        type = "environment"
        image = "p.exr"
        rotate = [0, 90, 0]
        [[light]]
        type = "spot"
        at = [0, 2, 0]
        towards = [0, 0, 1]
        angle = 20
    "#;
    let scene = read(text.as_bytes(), &folder.join("s.toml"), &Options::default()).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    let moved = scene.shapes[0].to_world.transform_point3(Vec3::Y);
    assert!(
        (moved - Vec3::new(0.0, 0.0, 7.0)).length() < 1e-6,
        "scaled, turned about x, then moved: {moved}"
    );
    let Material::Mask { opacity: Value::Number(d), base } = scene.materials[scene.shapes[0].material] else {
        panic!("d of the mtl")
    };
    assert_eq!(d, 0.5);
    let Material::TwoSided { front, .. } = scene.materials[base] else { panic!() };
    let Material::Blend { weight: Value::Number(ks), first, .. } = scene.materials[front] else {
        panic!("Kd and Ks")
    };
    assert!((ks - 0.2).abs() < 1e-6);
    let Material::Model { kind: Kind::Lambert, params, .. } = &scene.materials[first] else { panic!() };
    let Value::Rgb(kd) = params[0] else { panic!() };
    assert!((kd - Vec3::new(0.6274, 0.0691, 0.0164)).abs().max_element() < 2e-4);
    let Material::Mask { opacity: Value::Texture(holes), base } = scene.materials[scene.shapes[1].material]
    else {
        panic!()
    };
    assert!(matches!(scene.textures[holes], Texture::Image { channel: Some(1), .. }));
    assert!(matches!(scene.materials[base], Material::BumpMap { scale: 0.1, .. }));
    let to_uv = scene.textures.iter().find_map(|t| match t {
        Texture::Image { to_uv, channel: None, .. } => Some(*to_uv),
        _ => None,
    });
    assert_eq!(to_uv.unwrap().transform_point2(Vec2::ONE), Vec2::new(2.5, 3.0));
    assert!(scene.textures.iter().any(|t| matches!(t, Texture::Scaled { factor: Vec3 { x: 0.5, .. }, .. })));
    let Light::Spot { to_world, cutoff, beam, .. } = scene.lights[1] else { panic!("a spot") };
    let axis = to_world.transform_vector3(Vec3::Z);
    assert!((axis - Vec3::new(0.0, -2.0, 1.0).normalize()).length() < 1e-6 && beam < cutoff);
    // No camera in the file: one that sees everything.
    assert_eq!(scene.cameras[0].name, "framing");
}

#[test]
fn a_mesh_of_a_file_goes_by_the_name_it_is_given() {
    let folder = std::env::temp_dir().join(format!("yugen-toml-name-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("t.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let name = |keys: &str| {
        let text = format!("[[shape]]\ntype = \"file\"\nfile = \"t.obj\"\n{keys}\n");
        let scene = super::read(text.as_bytes(), &folder.join("s.toml"), &Options::default()).unwrap();
        scene.shapes[0].name.clone()
    };
    assert_eq!((&*name("name = \"pillar\""), &*name("")), ("pillar", "t"));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_fire_burns_where_and_when_it_is_said_to() {
    let read = |keys: &str| {
        let text = format!("[[shape]]\ntype = \"sphere\"\n[[light]]\ntype = \"fire\"\ncell = 0.1\n{keys}\n");
        super::read(text.as_bytes(), Path::new("f.toml"), &Options::default())
    };
    let scene = read(
        "name = \"west\"\nat = [3, 1, 0]\npower = 30\nseed = 4\nflicker = \"reduced\"\nwind = [1, 0, 0]",
    )
    .unwrap();
    let fire = scene.fires[0].fire();
    assert_eq!((fire.foot, fire.power, fire.seed, fire.wind), (Vec3::new(3.0, 1.0, 0.0), 30.0, 4, Vec3::X));
    assert_eq!((fire.diameter, fire.flicker.name()), (0.45, "reduced"));
    let Light::Volume { grid, .. } = &scene.lights[0] else { panic!("a volume") };
    assert!(grid.lower.x < 3.0 && grid.upper.x > 3.0 && grid.upper.y > 1.3 && grid.lower.y > 0.5);
    assert_eq!((scene.light_name(0), scene.shapes.len(), &*scene.shapes[1].name), ("west", 3, "west logs"));
    // Another moment, another flame.
    let Light::Volume { grid: first, .. } = &read("").unwrap().lights[0] else { panic!("a volume") };
    let Light::Volume { grid: later, .. } = &read("seconds = 1").unwrap().lights[0] else {
        panic!("a volume")
    };
    assert!(first.data != later.data);
    for (keys, says) in [
        ("power = 0", "2"),
        ("power = nan", "power"),
        ("wind = [0, 0, 40]", "the wind of a fire is 40 m/s"),
        ("flicker = \"ful\"", "did you mean 'full'"),
        ("diameter = 0.1\npower = 1000", "m"),
        ("candle = 3", "candela"),
        ("seconds = 1e9", "1000000"),
    ] {
        let said = read(keys).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(said.contains(says) && said.contains("f.toml"), "{keys}: {said}");
    }
}

#[test]
fn maps_of_a_cloth_are_a_material() {
    use crate::formats::btf;
    use yugen_reflectance::btf::Btf;
    let folder = std::env::temp_dir().join(format!("yugen-toml-btf-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let texels = vec![btf::NOTHING; 6];
    let maps = Btf { width: 3, height: 2, colour_space: ColourSpace::LinearSrgb, texels };
    btf::save(&folder.join("c.btf"), &maps, &btf::About::default()).unwrap();
    let read = |material: &str| {
        let text = format!("[material.m]\n{material}\n[[shape]]\ntype = \"sphere\"\nmaterial = \"m\"\n");
        read(text.as_bytes(), &folder.join("s.toml"), &Options::default())
    };
    let scene = read("btf = \"c.btf\"\nform = \"ggx\"\nscale = 4\nwrap = \"mirror\"").unwrap();
    let Material::Cloth { texture, form } = scene.materials[scene.shapes[0].material] else {
        panic!("a cloth")
    };
    assert_eq!(form.index(), 5);
    let Texture::Cloth { maps, wrap: Wrap::Mirror, to_uv } = &scene.textures[texture] else { panic!("maps") };
    assert_eq!((maps.width, maps.height, maps.colour_space), (3, 2, scene.working_space));
    assert_eq!(to_uv.transform_point2(Vec2::ONE), Vec2::splat(4.0));
    let say = |material: &str| read(material).unwrap_err().to_string();
    assert!(say("btf = \"c.btf\"\nform = \"ashikhmin2000\"").contains("form for maps 'ashikhmin2000'"));
    assert!(say("btf = \"c.btf\"\nmodel = \"noh\"").contains("takes the place of a model"));
    assert!(say("btf = \"d.btf\"").contains("d.btf"));
    assert!(say("btf = \"c.btf\"\nroughness = 1").contains("roughness"));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn shapes_follow_joints_and_caches_and_are_written_so() {
    use crate::formats::labels::Labels;
    use crate::formats::pc2::PointCache;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(
        at("arm.bvh"),
        "HIERARCHY\nROOT hip\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation \
         Yrotation\nJOINT hand\n{\nOFFSET 100 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 50 \
         0 0\n}\n}\n}\nMOTION\nFrames: 2\nFrame Time: 0.5\n0 100 0 0 0 0 0 0 0\n0 100 0 90 0 0 0 0 0\n",
    )
    .unwrap();
    std::fs::write(at("flag.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let flat = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    let up: Vec<Vec3> = flat.iter().map(|p| *p + Vec3::Z).collect();
    PointCache { start: 0.0, rate: 1.0, samples: vec![flat, up] }.write(&at("flag.pc2")).unwrap();
    let figure = "[[figure]]\nname = \"player\"\nmotion = \"arm.bvh\"\nunit = \"cm\"\nup = \"y\"\n";
    let read = |shapes: &str| {
        let text = format!("{figure}{shapes}");
        super::read(text.as_bytes(), &at("s.toml"), &Options::default())
    };
    let mut scene = read(
        "[[shape]]\ntype = \"sphere\"\nname = \"fist\"\nfigure = \"player\"\njoint = \"hand\"\nat = [0.1, 0, 0]\n\
         [[shape]]\ntype = \"file\"\nname = \"flag\"\nfile = \"flag.obj\"\nat = [0, 5, 0]\n\
         cache = { file = \"flag.pc2\", fps = 2 }\n",
    )
    .unwrap();
    let places = |scene: &Scene| {
        let Geometry::Mesh(mesh) = &scene.shapes[1].geometry else { panic!("a mesh") };
        let flag = scene.shapes[1].to_world.transform_point3(mesh.positions[1]);
        [scene.shapes[0].to_world.w_axis.truncate(), flag]
    };
    let near = |scene: &Scene, fist: Vec3, flag: Vec3| {
        let [f, g] = places(scene);
        assert!(f.distance(fist) < 1e-5 && g.distance(flag) < 1e-5, "{f} {g}");
    };
    near(&scene, Vec3::new(1.1, 1.0, 0.0), Vec3::X);
    scene.pose(None, 0.5).unwrap();
    near(&scene, Vec3::new(0.0, 2.1, 0.0), Vec3::new(1.0, 0.0, 1.0));
    // Written and read again it moves alike.
    let labels = Labels { materials: vec!["grey".into()], ..Labels::default() };
    super::write(&at("again.toml"), &scene, &labels).unwrap();
    let bytes = std::fs::read(at("again.toml")).unwrap();
    let mut again = super::read(&bytes, &at("again.toml"), &Options::default()).unwrap();
    near(&again, Vec3::new(1.1, 1.0, 0.0), Vec3::X);
    again.pose(None, 0.25).unwrap();
    scene.pose(None, 0.25).unwrap();
    let [fist, flag] = places(&scene);
    near(&again, fist, flag);
    assert_eq!(again.clips(), scene.clips());
    for (shape, says) in [
        ("figure = \"plaer\"\njoint = \"hand\"", "did you mean 'player'"),
        ("figure = \"player\"\njoint = \"hant\"", "did you mean 'hand'"),
        ("figure = \"player\"", "give also 'joint'"),
        ("joint = \"hand\"", "give also 'figure'"),
        ("cache = \"flag.pc2\"", "is no mesh"),
        ("figure = \"player\"\njoint = \"hand\"\ncache = \"flag.pc2\"", "not both"),
        ("cache = { file = \"flag.pc2\", space = \"wrld\" }", "did you mean 'world'"),
        ("cache = \"arm.bvh\"", "another file"),
    ] {
        let said = read(&format!("[[shape]]\ntype = \"sphere\"\n{shape}\n")).unwrap_err().to_string();
        assert!(said.contains(says), "{shape}: {said}");
    }
    // So is how it is shown.
    scene.display = yugen_scene::Display { exposure: -5.5, curve: Curve::AgX, adaptation: Adaptation::Eye };
    super::write(&at("shown.toml"), &scene, &labels).unwrap();
    let bytes = std::fs::read(at("shown.toml")).unwrap();
    assert_eq!(super::read(&bytes, &at("shown.toml"), &Options::default()).unwrap().display, scene.display);
    let group = "[[group.g]]\ntype = \"file\"\nfile = \"flag.obj\"\ncache = \"flag.pc2\"\n";
    assert!(read(group).unwrap_err().to_string().contains("stands still"));
}
