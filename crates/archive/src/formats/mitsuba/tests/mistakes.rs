//! What is wrong in a file, and where files may lead.

use super::*;
use yugen_scene::Material;

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
        (
            "<texture type=\"blackbody\" id=\"t\"/>",
            "2:16: the texture 'blackbody' is not read: write the colour as rgb",
        ),
        (
            "<shape type=\"sphere\"><medium type=\"homogeneous\" name=\"interior\"/></shape>",
            "2:36: the medium 'homogeneous' is not read: no participating media; remove the medium",
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
            "2:50: the parameter 'radius' has no value; give it one with -D radius=VALUE",
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
        (
            "<emitter type=\"sunsky\"/>",
            "2:16: the emitter 'sunsky' is not read: no model of the sky; bake it to a picture and use envmap",
        ),
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
        ("<film type=\"ldfilm\"/>", "unknown film plugin 'ldfilm'; did you mean 'ldrfilm'?"),
        (
            "<sampler type=\"independent\"><integer name=\"sample_count\" value=\"0\"/></sampler>",
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
    // `<path>` may climb, and so may a name.
    assert_eq!(f.load("scene/climbs.xml", &none).unwrap().shapes[0].name, "outside");
    assert_eq!(f.load("scene/path_climbs.xml", &none).unwrap().shapes[0].name, "outside");
    let root = with_sensor(&shape("../../../../../../../../../../../../../../etc/hostname"));
    std::fs::write(f.0.join("scene/climbs.xml"), root).unwrap();
    assert!(f.load("scene/climbs.xml", &none).unwrap_err().contains("lies outside"));
    let absolute = with_sensor(&shape(&f.0.join("outside.obj").to_string_lossy()));
    std::fs::write(f.0.join("scene/climbs.xml"), absolute).unwrap();
    assert!(f.load("scene/climbs.xml", &none).unwrap_err().contains("lies outside"));
    let allowed = Options { folders: vec![f.0.clone()], ..Options::default() };
    assert!(f.load("scene/climbs.xml", &allowed).is_ok());
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(f.0.join("outside.obj"), f.0.join("scene/link.obj")).unwrap();
        std::fs::write(f.0.join("scene/link.xml"), with_sensor(&shape("link.obj"))).unwrap();
        assert!(f.load("scene/link.xml", &none).unwrap_err().contains("is a link that leads outside"));
    }
    let missing = f.load("scene/missing.xml", &none).unwrap_err();
    assert!(missing.contains("there is no file 'none.obj' (looked in DIR/scene)"), "{missing}");
    assert!(f.load("scene/no_folder.xml", &none).unwrap_err().contains("there is no folder '../none'"));
    assert!(f.load("scene/absolute.xml", &none).unwrap_err().contains("the folder '/tmp' is absolute"));
    // The cure that it names is one.
    let below =
        with_sensor(&format!("<path value=\"{}\"/>{}", f.0.join("shared").display(), shape("there.obj")));
    std::fs::write(f.0.join("scene/absolute.xml"), below).unwrap();
    assert!(f.load("scene/absolute.xml", &none).unwrap_err().contains("is absolute"));
    assert_eq!(f.load("scene/absolute.xml", &allowed).unwrap().shapes[0].name, "there");
    assert!(f.load("scene/root.xml", &none).unwrap_err().contains("the root of the file system"));
    let broken = f.load("scene/broken.xml", &none).unwrap_err();
    assert_eq!(broken, "DIR/scene/broken.obj:2:7: vertex 3 does not exist; there are 1, counted from 1");
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
