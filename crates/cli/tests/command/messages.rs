//! What the command says of mistakes, and how it says it.

use crate::{bad, good, refused, report, run, scratch, yugen_in};
use std::path::Path;
use std::process::{Command, Stdio};

const SPHERE: &str = "[[light]]\ntype = \"constant\"\n[[shape]]\ntype = \"sphere\"\n";

fn write(folder: &Path, name: &str, text: &str) {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, text).unwrap();
}

#[test]
fn every_verb_has_the_version_of_the_whole() {
    let verbs =
        ["", "render", "info", "brdf", "brdf plot", "brdf pca", "brdf pca build", "capture", "capture hdr"];
    for verb in verbs {
        let said = good(yugen_in(".".as_ref(), &format!("{verb} --version")));
        assert_eq!(said, format!("yugen {}\n", env!("CARGO_PKG_VERSION")), "{verb}");
    }
}

#[test]
fn types_are_told_in_plain_words() {
    let folder = scratch("messages/types");
    for (text, expected) in [
        ("[film]\nsize = [64.5, 64]", "a.toml:2:9: 'size' is 64.5; expected a whole number from 1 to"),
        ("[render]\nsamples = true", "'samples' is true; expected a whole number"),
        ("[render]\nsamples = [1]", "'samples' is [1]; expected a whole number"),
        ("[render]\nclamp = \"high\"", "'clamp' is 'high'; expected a number"),
        ("[render]\nclamp = 1e400", "'clamp' is 1e400, which is"),
        (
            "[render]\nclamp = 1e35",
            "'clamp' is 1e35, which is beyond what is computed with; expected a number",
        ),
        ("[[shape]]\ntype = 3", "'type' is 3; expected a text in quotes"),
        ("[[shape]]\ntype = 1979-05-27", "'type' is a date; expected"),
        ("[camera]\nname = front", "a.toml:2:8: a text needs quotes"),
        ("[film]\nsize = [64 64]", "a.toml:2:9: a text needs quotes, and the values of a list have commas"),
        ("[render]\nsamples = 1.2.3", "this is no number; expected one such as 12"),
        ("[render]\nsamples = 1\nsamples = 2", "a.toml:3:1: this key is there already"),
        ("[[light]]\ntype = \"constant", "the text does not end in its line"),
        ("[film]\nsize = [64, 64", "the list does not end; expected ]"),
        ("[film", "a heading ends with ]"),
        ("film = 3", "'film' is 3; expected a table of keys and values"),
    ] {
        write(&folder, "a.toml", text);
        refused(yugen_in(&folder, "render a.toml -o a.exr"), &[expected]);
    }
    let gltf = r#"{ "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0.5 }] }"#;
    write(&folder, "a.gltf", gltf);
    refused(
        yugen_in(&folder, "render a.gltf -o a.exr"),
        &["a.gltf:1:", "this is no glTF: found 0.5, expected a whole number, 0 or more\n"],
    );
}

#[test]
fn the_kind_of_a_file_comes_before_what_it_lacks() {
    let folder = scratch("messages/kinds");
    write(&folder, "DSC.NEF", "II*\0\x08\0\0\0\0\0");
    write(&folder, "empty.jpg", "");
    write(&folder, "page.jpg", "<!DOCTYPE html><html>not found</html>");
    write(&folder, "text.jpg", "\u{FFFD} some words");
    for (name, expected) in [
        ("DSC.NEF", "DSC.NEF: this is a camera's raw file; develop it to a 16-bit TIFF"),
        ("empty.jpg", "empty.jpg: the file is empty"),
        ("page.jpg", "page.jpg: this is a web page, no picture"),
    ] {
        refused(yugen_in(&folder, &format!("capture hdr {name} -o a.exr")), &[expected]);
        refused(
            yugen_in(&folder, &format!("capture relight . --environment {name} --light 0,0,1 -o a.exr")),
            &["cannot be used with"],
        );
    }
    // Its name says that it is a JPEG, and nothing speaks against it; what lacks comes next.
    refused(yugen_in(&folder, "capture hdr text.jpg -o a.exr"), &["text.jpg", "exposure time"]);
    write(&folder, "list.csv", "file,seconds\nDSC.NEF,1\n");
    refused(yugen_in(&folder, "capture hdr DSC.NEF --list list.csv -o a.exr"), &["a camera's raw file"]);
}

#[test]
fn near_names_are_offered_and_short_lists_told() {
    let folder = scratch("messages/names");
    write(
        &folder,
        "a.toml",
        &format!("{SPHERE}[[camera]]\nname = \"front\"\nfrom = [0, 0, 4]\nto = [0, 0, 0]\n"),
    );
    for (line, expected) in [
        ("render a.toml --camera fornt -o a.exr", "no camera called 'fornt'; did you mean 'front'?"),
        ("render a.toml --camera x -o a.exr", "no camera called 'x'; expected one of front"),
        ("brdf show gold", "no reflectance model called 'gold', but a preset of"),
        ("brdf show gold", "--preset gold"),
        ("brdf show wrad", "did you mean 'ward'?"),
        ("render a.toml --integrator pth -o a.exr", "path"),
        (
            "--log loud brdf list",
            "there is no level 'loud'; expected one of off, error, warn, info, debug, trace",
        ),
        ("--log archiv=info brdf list", "there is no room 'archiv'; did you mean 'archive'?"),
        ("--log warm brdf list", "did you mean 'warn'?"),
    ] {
        refused(yugen_in(&folder, line), &[expected]);
    }
    crate::sequence::sliding(&folder);
    for (name, expected) in [
        ("sldie", "there is no animation called 'sldie'; did you mean 'slide'?"),
        ("walk", "there is no animation called 'walk'; expected one of slide, jump"),
    ] {
        refused(yugen_in(&folder, &format!("render a.gltf --at 0 --animation {name} -o a.exr")), &[expected]);
    }
}

#[test]
fn parameters_and_what_is_suggested_for_them_agree() {
    let folder = scratch("messages/parameters");
    let scene = |more: &str| {
        format!(
            "<scene version=\"3.0.0\"><default name=\"spp\" value=\"4\"/><default name=\"unused\" value=\"1\"/>\
             <emitter type=\"constant\"/><shape type=\"sphere\"/><sensor type=\"perspective\">\
             <sampler type=\"independent\"><integer name=\"sample_count\" value=\"$spp\"/></sampler>\
             <film type=\"hdrfilm\"><integer name=\"width\" value=\"4\"/><integer name=\"height\" value=\"4\"/></film>\
             </sensor>{more}</scene>"
        )
    };
    write(&folder, "a.xml", &scene(""));
    report(yugen_in(&folder, "render a.xml --json -D spp=2 -D unused=3 -o a.exr"));
    for line in ["-D sp=2", "-D sp=2 -D spp=2", "-D SPP=2"] {
        refused(
            yugen_in(&folder, &format!("render a.xml {line} -o a.exr")),
            &["unknown parameter", "did you mean 'spp'?"],
        );
    }
    write(
        &folder,
        "b.xml",
        &scene("<shape type=\"sphere\"><float name=\"radius\" value=\"$radius\"/></shape>"),
    );
    refused(
        yugen_in(&folder, "render b.xml -o a.exr"),
        &["the parameter 'radius' has no value; give it one with -D radius=VALUE"],
    );
    report(yugen_in(&folder, "render b.xml --json -D radius=2 -o a.exr"));
    write(&folder, "c.xml", "<scene version=\"3.0.0\"><shape type=\"sphere\"/></scene>");
    refused(yugen_in(&folder, "render c.xml -D spp=2 -o a.exr"), &["the scene has no parameters, so 'spp'"]);
}

#[test]
fn a_display_is_for_display_formats() {
    let folder = scratch("messages/display");
    write(&folder, "a.toml", SPHERE);
    let said = bad(yugen_in(&folder, "render a.toml --adaptation eye -o a.png"));
    assert!(
        said.contains("--adaptation is for films (.mp4, .apng)") && said.contains("a.png is none"),
        "{said}"
    );
    let said = bad(yugen_in(&folder, "render a.toml --adaptation owl -o a.apng"));
    assert!(said.contains("owl") && said.contains("none, eye"), "{said}");
    for (option, output) in [("--curve aces", "a.exr"), ("--exposure 1", "a.hdr"), ("--curve clip", "a.hdr")]
    {
        let name = option.split(' ').next().unwrap();
        let said = bad(yugen_in(&folder, &format!("render a.toml {option} -o {output}")));
        assert!(
            said.contains(&format!("{name} is for .png, .jpg and films; {output} keeps the light as it is")),
            "{said}"
        );
        let line = format!("capture relight . --light 0,0,1 {option} -o {output}");
        refused(yugen_in(&folder, &line), &[&format!("{name} is for .png, .jpg and films")]);
    }
    report(yugen_in(&folder, "render a.toml --spp 1 --size 4x4 --json --curve aces --exposure -1 -o a.png"));
}

#[test]
fn an_empty_scene_is_an_error() {
    let folder = scratch("messages/empty");
    write(&folder, "a.toml", "# Nothing.");
    write(&folder, "b.toml", "[[light]]\ntype = \"point\"\nat = [0, 0, 0]\nintensity = 1\n");
    write(&folder, "c.xml", "<scene version=\"3.0.0\"><sensor type=\"perspective\"/></scene>");
    write(&folder, "d.gltf", r#"{ "asset": { "version": "2.0" } }"#);
    for name in ["a.toml", "b.toml", "c.xml", "d.gltf"] {
        let line = format!("render {name} -o a.exr");
        refused(yugen_in(&folder, &line), &[name, "there is nothing to be seen in this scene"]);
    }
    write(&folder, "f.gltf", "");
    refused(yugen_in(&folder, "render f.gltf -o a.exr"), &["f.gltf: the file is empty"]);
    // A sky alone can be seen.
    write(&folder, "e.toml", "[[light]]\ntype = \"constant\"\n");
    report(yugen_in(&folder, "render e.toml --spp 1 --size 4x4 --json -o a.exr"));
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_behind_standard_output_is_a_plain_error() {
    for line in ["brdf list", "brdf list --json", "brdf list --markdown", "--help", "brdf show ward"] {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let out = Command::new(env!("CARGO_BIN_EXE_yugen"))
            .args(line.split(' '))
            .stdout(full)
            .stderr(Stdio::piped())
            .output()
            .unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(1), "{line}: {said}");
        assert_eq!(
            said, "yugen: standard output: the disk is full; make room or write elsewhere\n",
            "{line}"
        );
    }
}

#[test]
fn the_log_tells_what_is_done_and_how_long_it_took_without_colours() {
    let folder = scratch("messages/log");
    write(&folder, "a.toml", SPHERE);
    let line = "render a.toml --spp 1 --size 4x4 -o a.png";
    let told = |more: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_yugen"));
        let said = run(command.args(line.split(' ')).args(more.split(' ')).current_dir(&folder));
        assert!(said.success && !said.err.contains('\x1b'), "{}", said.err);
        said.err
    };
    let info = told("--log info");
    for words in [
        "read_scene{file=a.toml}",
        "1 shapes",
        "prepare",
        "render",
        "write_picture{file=a.png}",
        "time.busy=",
    ] {
        assert!(info.contains(words), "{words}: {info}");
    }
    assert!(!info.contains("hierarchy"));
    let debug = told("--log debug");
    for words in ["a.toml: 54 bytes", "hierarchy", "textures", "materials", "lights", "round{"] {
        assert!(debug.contains(words), "{words}: {debug}");
    }
    let room = told("--log warn,archive=info");
    assert!(room.contains("read_scene") && !room.contains("prepare"), "{room}");
    assert_eq!(told("--log warn"), "");
}

#[test]
fn assets_lie_where_the_scene_or_the_caller_says() {
    let folder = scratch("messages/assets");
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    write(&folder, "shared/a.obj", mesh);
    write(&folder, "far/b.obj", mesh);
    let scene = |head: &str, file: &str| {
        format!("{head}\n[[light]]\ntype = \"constant\"\n[[shape]]\ntype = \"file\"\nfile = \"{file}\"\n")
    };
    let render = |more: &str| {
        yugen_in(&folder, &format!("render scene/s.toml --spp 1 --size 4x4 --json {more} -o a.exr"))
    };
    // By climbing, by a name in a folder of the scene's, by an absolute name.
    let absolute = folder.canonicalize().unwrap().join("far/b.obj").display().to_string();
    for (head, file, allow) in [
        ("", "../shared/a.obj", "--allow shared"),
        ("[scene]\npath = [\"../shared\"]", "a.obj", ""),
        ("[scene]\npath = \"../shared\"", "../shared/a.obj", ""),
        ("[scene]\npath = [\"../shared\", \"../far\"]", "b.obj", ""),
        ("", "a.obj", "--allow far --allow shared"),
        ("", absolute.as_str(), "--allow far"),
    ] {
        write(&folder, "scene/s.toml", &scene(head, file));
        if head.is_empty() {
            let said = bad(render(""));
            assert!(said.contains("lies outside the folders") || file == "a.obj", "{said}");
        }
        report(render(allow));
    }
    write(&folder, "scene/s.toml", &scene("", "../shared/a.obj"));
    let said = bad(render(""));
    let shared = folder.canonicalize().unwrap().join("shared").display().to_string();
    for words in ["'../shared/a.obj'", "[scene] path = [\"FOLDER\"]", &format!("--allow '{shared}'")] {
        assert!(said.contains(words), "{words}: {said}");
    }
    for (head, expected) in [
        ("[scene]\npath = [\"/tmp\"]", "the folder '/tmp' is absolute"),
        ("[scene]\npath = [\"../nowhere\"]", "there is no folder '../nowhere' beside this file"),
        ("[scene]\npath = 3", "'path' is 3; expected a list"),
    ] {
        write(&folder, "scene/s.toml", &scene(head, "a.obj"));
        refused(render(""), &["s.toml:2:", expected]);
    }
    refused(render("--allow nowhere"), &["nowhere", "nothing of this name"]);
}

/// Links inside the folder lead to where the caller allowed, and no further.
#[test]
#[cfg(unix)]
fn links_are_followed_to_allowed_folders() {
    let folder = scratch("messages/links");
    write(&folder, "shared/a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write(
        &folder,
        "scene/s.toml",
        "[[light]]\ntype = \"constant\"\n[[shape]]\ntype = \"file\"\nfile = \"l.obj\"\n",
    );
    std::os::unix::fs::symlink("../shared/a.obj", folder.join("scene/l.obj")).unwrap();
    let render = |more: &str| {
        yugen_in(&folder, &format!("render scene/s.toml --spp 1 --size 4x4 --json {more} -o a.exr"))
    };
    let shared = folder.canonicalize().unwrap().join("shared").display().to_string();
    refused(
        render(""),
        &["'l.obj' is a link that leads outside the folders of this scene", &format!("--allow '{shared}'")],
    );
    report(render("--allow shared"));
}
