//! `yugen brdf plot`: what a figure holds, and that nothing of it is cut.

use crate::brdf::{bad, good, png_size, scratch};

#[test]
fn plot_draws_every_kind_as_svg_and_png() {
    for kind in ["polar", "cartesian", "lobe", "sphere", "slice", "albedo"] {
        for (extension, size) in [("svg", "64"), ("png", "100")] {
            let file = scratch(&format!("{kind}.{extension}"));
            let _ = std::fs::remove_file(&file);
            let name = file.to_str().unwrap();
            good(&["plot", "blinn_phong", "--kind", kind, "--size", size, "-o", name]);
            if extension == "png" {
                let (width, height) = png_size(&file);
                assert!(width == 100 && (40..200).contains(&height), "{kind}: {width} x {height}");
            } else {
                let text = std::fs::read_to_string(&file).unwrap();
                assert!(text.starts_with("<svg ") && text.ends_with("</svg>\n"));
                let mut drawn = text.split('"').filter(|w| !w.starts_with("data:"));
                assert!(!drawn.any(|w| w.contains("NaN") || w.contains("inf")), "{kind}");
                assert!(
                    text.contains(if kind == "sphere" { "<image" } else { "blinn_phong</text>" }),
                    "{kind}"
                );
            }
        }
    }
    // A mirror has no lobe, but a picture.
    let file = scratch("mirror.png");
    let name = file.to_str().unwrap();
    assert!(bad(&["plot", "conductor", "-o", name]).contains("--kind sphere"));
    good(&["plot", "conductor", "--kind", "sphere", "--size", "64", "-o", name]);
    assert_eq!(png_size(&file), (64, 64));
    assert!(bad(&["plot", "lambert", "-o", "a.gif"]).contains("expected the name of an .svg or a .png"));
    assert!(bad(&["plot", "lambert", "--angle", "95", "-o", name]).contains("0 to less than 90 degrees"));
    let idle = ["plot", "lambert", "--angle", "30", "--kind", "albedo", "-o", name];
    assert!(bad(&idle).contains("--angle is for --kind polar, cartesian, lobe and g"));
    assert!(bad(&["plot", "lambert", "-o", "/nowhere/a.svg"]).contains("/nowhere/a.svg"));
}

/// The figure as SVG.
fn svg(name: &str, args: &[&str]) -> String {
    let file = scratch(&format!("{name}.svg"));
    good(&[&["plot"], args, &["-o", file.to_str().unwrap()]].concat());
    std::fs::read_to_string(&file).unwrap()
}

/// The texts of a figure.
fn texts(svg: &str) -> Vec<&str> {
    let all = svg.split("<text ").skip(1);
    all.map(|t| t.split_once('>').unwrap().1.split_once("</text>").unwrap().0).collect()
}

/// Looks of lines that are wider than a rule: curves, and their samples in the legend; with the points of each.
fn curves(svg: &str) -> Vec<(String, usize)> {
    let attribute = |line: &str, name: &str| -> String {
        let from = line.split_once(&format!(" {name}=\"")).map_or("", |l| l.1);
        from.split_once('"').map_or("", |l| l.0).to_string()
    };
    svg.lines()
        .filter(|l| l.starts_with("<polyline"))
        .filter(|l| attribute(l, "stroke-width").parse::<f32>().unwrap() > 2.0)
        .map(|l| {
            let look = format!("{} {}", attribute(l, "stroke"), attribute(l, "stroke-dasharray"));
            (look, attribute(l, "points").split_whitespace().count())
        })
        .collect()
}

#[test]
fn several_models_forms_and_angles_stand_in_one_figure_with_a_legend() {
    let models = ["lambert", "ward:alpha=0.1/0.3,form=gmd", "ggx:alpha=0.2,f0=0.9,0.6,0.3,label=gold GGX"];
    for kind in ["polar", "cartesian"] {
        let figure =
            svg(&format!("many_{kind}"), &[&models[..], &["--angle", "30,60", "--kind", kind]].concat());
        let (lines, samples): (Vec<_>, Vec<_>) = curves(&figure).into_iter().partition(|c| c.1 > 2);
        let looks = |of: &[(String, usize)]| {
            let mut all: Vec<String> = of.iter().map(|(look, _)| look.clone()).collect();
            all.sort();
            all.dedup();
            all
        };
        // Four models at two angles: each has a look of its own, and the legend the same ones.
        assert_eq!((lines.len(), samples.len()), (8, 8), "{kind}");
        assert_eq!(looks(&lines).len(), 8);
        assert_eq!(looks(&lines), looks(&samples));
        let texts = texts(&figure);
        for name in [
            "lambert, light at 30°",
            "ward alpha=0.1 form=gmd, light at 60°, peak at ",
            "ward alpha=0.3 form=gmd, light at 30°, peak at ",
            "gold GGX, light at 60°, peak at ",
        ] {
            assert!(texts.iter().any(|t| t.starts_with(name)), "{kind}: {name}: {texts:?}");
        }
        // A constant has no peak.
        assert!(texts.contains(&"lambert, light at 30°"));
    }
    // Every form of a model by one word.
    let figure = svg("forms", &["ward:form=all", "--kind", "cartesian", "--scale", "log"]);
    assert!(texts(&figure).iter().filter(|t| t.starts_with("ward form=")).count() >= 3);
}

#[test]
fn the_off_specular_peak_is_marked_with_its_angle() {
    for kind in ["polar", "cartesian"] {
        let figure = svg("off_specular", &["torrance_sparrow", "--angle", "45", "--kind", kind]);
        let texts = texts(&figure);
        assert!(texts.contains(&"light at 45°, peak at 47.0°"), "{texts:?}");
        // Beside the dot.
        assert!(texts.contains(&"47.0°"), "{texts:?}");
    }
}

#[test]
fn terms_of_microfacets_are_curves_of_their_own() {
    let lecture = ["torrance_sparrow:distribution=all,label=D1/D2/D3/D4", "--kind", "d", "--relative"];
    let figure = svg("d", &lecture);
    let all = texts(&figure);
    for name in ["D1", "D2", "D3", "D4"] {
        assert!(all.contains(&name), "{all:?}");
    }
    assert_eq!(curves(&figure).len(), 8);
    let g = svg("g", &["torrance_sparrow", "ggx:alpha=0.5", "--kind", "g", "--angle", "45,75"]);
    assert_eq!(curves(&g).len(), 8);
    // Gold's F is coloured.
    let f = svg("f", &["rough_conductor", "--kind", "f"]);
    assert!(["red", "green", "blue"].iter().all(|c| texts(&f).contains(c)));
    let name = scratch("none.png");
    let error = bad(&["plot", "lambert", "--kind", "d", "-o", name.to_str().unwrap()]);
    assert!(
        error.contains("lambert is not made of D, G and F") && error.contains("cook_torrance"),
        "{error}"
    );
}

#[test]
fn slices_have_a_bar_that_says_what_is_how_bright() {
    for (name, models) in
        [("slice_one", &["ggx:alpha=0.3"][..]), ("slice_two", &["lambert", "ggx:alpha=0.3"])]
    {
        let figure = svg(name, &[models, &["--kind", "slice", "--size", "128"]].concat());
        assert_eq!(figure.matches("<image").count(), models.len() + 1);
        assert!(texts(&figure).contains(&"f, 1/sr"));
    }
}

/// Nothing comes near the edge of the paper: what is cut would.
#[test]
fn no_label_is_cut() {
    use yugen_archive::formats::image::{self, ReadOptions};
    let long = "ggx:alpha=0.1/0.2/0.3/0.4,f0=0.125,0.25,0.5,multiple_scattering=on";
    let words = "label=a rather long name for a mirror of gold that is hardly rough at all in any direction";
    let mirror = format!("ggx:alpha=0.001,f0=0.123456,0.2345678,0.345678901,{words}");
    let brushed = "ward:alpha_x=0.123456,alpha_y=0.345678,diffuse=0.123456,0.234567,0.345678";
    for (name, args) in [
        ("cut_polar", &["microcylinder:preset=linen_plain", "--angle", "0,20,40,60,80"][..]),
        ("cut_long", &[long, "ward:form=all", "--kind", "polar"]),
        ("cut_cartesian", &[long, "--kind", "cartesian", "--angle", "85"]),
        ("cut_log", &[long, "--kind", "cartesian", "--scale", "log", "--angle", "10,80"]),
        ("cut_albedo", &[long, "--kind", "albedo"]),
        ("cut_d", &[long, "--kind", "d"]),
        ("cut_g", &[long, "--kind", "g"]),
        ("cut_f", &[long, "--kind", "f"]),
        ("cut_slice", &[long, "--kind", "slice"]),
        ("cut_one_slice", &[mirror.as_str(), "--kind", "slice"]),
        ("cut_lobe", &[brushed, "--kind", "lobe"]),
    ] {
        let file = scratch(&format!("{name}.png"));
        good(&[&["plot"], args, &["--size", "360", "-o", file.to_str().unwrap()]].concat());
        let picture = image::read(&file, &ReadOptions::default()).unwrap();
        let (w, h) = (picture.width, picture.height);
        assert!(w == 360 && h < 1200, "{name}: {w} x {h}");
        let mut ink = 0;
        for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
            let white = picture.pixel(x, y).iter().all(|v| *v > 0.99);
            ink += usize::from(!white);
            let rim = x < 3 || y < 3 || x >= w - 3 || y >= h - 3;
            assert!(white || !rim, "{name}: ink at {x}, {y} of {w} x {h}");
        }
        assert!(ink > 1000, "{name}");
    }
}

#[test]
fn a_plot_of_what_is_not_there_is_refused_in_words() {
    let name = scratch("many.png");
    let out = ["-o", name.to_str().unwrap()];
    let plot = |args: &[&str]| bad(&[&["plot"], args, &out].concat());
    assert!(
        plot(&["ward:alpha=0.1/0.2/0.3/0.4/0.5/0.6/0.7", "--angle", "1,2,3,4"]).contains("more curves than")
    );
    assert!(plot(&["lambert", "ggx", "--kind", "lobe"]).contains("one model and one angle"));
    assert!(plot(&["ggx:alfa_x=0.1"]).contains("did you mean 'alpha_x'?"));
    assert!(plot(&["ggx:alpha_x"]).contains("no reflectance model called 'ggx:alpha_x'"));
    assert!(plot(&["ggx", "phong", "-p", "alpha=0.2"]).contains("model 'phong' has no parameter 'alpha'"));
    assert!(plot(&["ggx", "--kind", "albedo", "--relative"]).contains("--relative is for"));
    let pair = ["--wi", "0,0,1", "--wo", "0,0,1"];
    let eval = bad(&[&["eval", "ward:alpha=0.1/0.2"], &pair[..]].concat());
    assert!(eval.contains("stands for 2 models; expected one"), "{eval}");
    // One model with its own parameters is read everywhere.
    let own = good(&[&["eval", "lambert:reflectance=0.2,0.4,0.6"], &pair[..]].concat());
    let flag = good(&[&["eval", "lambert", "-p", "reflectance=0.2,0.4,0.6"], &pair[..]].concat());
    assert_eq!(own, flag);
    let near = bad(&["show", "gold"]);
    assert!(near.contains("did you mean 'gold_thread'?") && near.contains("rough_conductor"), "{near}");
    assert!(bad(&["show", "xyzzy"]).contains("there are lambert, oren_nayar, phong"));
}
