//! `yugen brdf pca`: a basis of a few tables, from the folder to the picture.

use crate::brdf::{bad, good, png_size, scratch};

#[test]
fn pca_says_what_is_wrong_before_the_work() {
    let folder = scratch("tables");
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.to_str().unwrap();
    assert!(
        bad(&["pca", "build", path, "-o", "x.pca"])
            .contains("has 0 MERL .binary tables; a basis needs at least 2")
    );
    for name in ["a.binary", "b.binary"] {
        std::fs::write(folder.join(name), b"not a table").unwrap();
    }
    let error = bad(&["pca", "check", path]);
    assert!(error.contains("a.binary") && error.contains("34992012 bytes"), "{error}");
    std::fs::remove_dir_all(&folder).unwrap();
    let basis = scratch("no.pca");
    std::fs::write(&basis, b"nothing").unwrap();
    let basis = basis.to_str().unwrap();
    assert!(bad(&["pca", "directions", "-b", basis]).contains("is not a basis"));
    let more = ["pca", "reconstruct", "-b", basis, "-o"];
    assert!(
        bad(&[&more[..], &["o.exr", "--values", "v.csv"]].concat())
            .contains("expected the name of a .binary")
    );
    let photo = ["o.binary", "--photo", "a.exr", "--photo", "b.exr", "--light", "0,0,1"];
    assert!(bad(&[&more[..], &photo].concat()).contains("each photograph needs its --light"));
}

/// Directions, readings at them and the table that they make, as a person goes through them.
#[test]
fn readings_appended_to_directions_make_a_table() {
    let folder = scratch("grey_tables");
    std::fs::create_dir_all(&folder).unwrap();
    let models = [
        ("matte", "lambert:reflectance=0.6"),
        ("satin", "ggx:alpha=0.5,f0=0.5"),
        ("gloss", "ggx:alpha=0.25,f0=0.2"),
    ];
    for (name, model) in models {
        good(&["convert", model, folder.join(format!("{name}.binary")).to_str().unwrap(), "--space", "srgb"]);
    }
    let (tables, basis) = (folder.to_str().unwrap(), scratch("grey.pca"));
    let basis = basis.to_str().unwrap();
    let built: serde_json::Value =
        serde_json::from_str(&good(&["pca", "build", tables, "-o", basis, "--json"])).unwrap();
    // Grey: the three channels of a table are one column, and the mean takes one of three.
    assert_eq!(built["components"], 2, "{built}");
    let error = bad(&["pca", "directions", "-b", basis, "-n", "3"]);
    assert!(error.contains("2 components of 3 tables, too few for 3 readings"), "{error}");
    assert!(bad(&["pca", "directions", "-b", basis, "-n", "9"]).contains("3 tables make 8 at most"));
    assert!(bad(&["pca", "directions", "-b", basis, "--max-angle", "91"]).contains("1 to 90 degrees"));

    let lines = good(&["pca", "directions", "-b", basis, "-n", "2", "--max-angle", "60", "--apart", "12"]);
    let (file, pairs) = (scratch("grey.txt"), scratch("grey_pairs.txt"));
    std::fs::write(&pairs, &lines).unwrap();
    for (name, model) in models {
        let values = good(&["eval", model, "--pairs", pairs.to_str().unwrap(), "--space", "srgb"]);
        let mut values = values.lines();
        let mut append = |line: &str| match line.starts_with('#') {
            true => line.to_string(),
            false => format!("{line} {}", values.next().unwrap()),
        };
        std::fs::write(&file, lines.lines().map(&mut append).collect::<Vec<_>>().join("\n")).unwrap();
        assert_eq!(values.next(), None);
        let made = scratch("made.binary");
        let made = made.to_str().unwrap();
        let how = ["--values", file.to_str().unwrap(), "--ridge", "0.01", "-o", made];
        good(&[&["pca", "reconstruct", "-b", basis], &how[..]].concat());
        // Two readings tell which of the three it is.
        let at = ["--wi", "0.3,0.1,0.9", "--wo", "-0.4,0.2,0.8", "--space", "srgb"];
        let f = |model: &str| -> f32 {
            let out = good(&[&["eval", model], &at[..]].concat());
            out.split_whitespace().next().unwrap().parse().unwrap()
        };
        let (got, want) = (f(made), f(model));
        assert!((got / want - 1.0).abs() < 0.05, "{name}: {got} {want}");
    }
    for line in lines.lines().filter(|l| !l.starts_with('#')) {
        let n: Vec<f32> = line.split_whitespace().map(|v| v.parse().unwrap()).collect();
        assert!(n[2] > 0.499 && n[5] > 0.499, "{line}");
        let cosine: f32 = (0..3).map(|i| n[i] * n[i + 3]).sum();
        assert!(cosine < 12f32.to_radians().cos() + 1e-4, "{line}");
    }

    for (kind, more) in [
        ("bases", &[][..]),
        ("spheres", &["--components", "1"]),
        ("spectrum", &[]),
        ("coefficients", &["--tables", tables]),
    ] {
        let picture = scratch(&format!("pca_{kind}.png"));
        let name = picture.to_str().unwrap();
        let args = ["pca", "plot", "-b", basis, "--kind", kind, "--size", "300", "-o", name];
        good(&[&args[..], more].concat());
        assert_eq!(png_size(&picture).0, 300, "{kind}");
    }
    let picture = scratch("pca_names.svg");
    let args = ["pca", "plot", "-b", basis, "--kind", "coefficients", "--tables", tables, "-o"];
    good(&[&args[..], &[picture.to_str().unwrap()]].concat());
    let text = std::fs::read_to_string(&picture).unwrap();
    assert!(models.iter().all(|(name, _)| text.contains(&format!(">{name}</text>"))));
    let args = ["pca", "plot", "-b", basis, "-o", "a.png", "--kind"];
    assert!(bad(&[&args[..], &["coefficients"]].concat()).contains("needs --tables FOLDER"));
    assert!(bad(&[&args[..], &["bases", "--components", "5"]].concat()).contains("the basis has 2"));
    std::fs::remove_dir_all(&folder).unwrap();
}
