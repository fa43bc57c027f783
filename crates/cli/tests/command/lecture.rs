//! The page of the lecture: every command of it runs, and every picture of it is there.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Small, so that all of them take seconds.
fn small(line: &str) -> String {
    match line.split_whitespace().nth(1) {
        Some("render") => format!("{line} --size 24x24 --spp 2"),
        _ => format!("{line} --size 96"),
    }
}

#[cfg(unix)]
#[test]
fn every_command_of_the_lecture_runs_and_every_picture_is_there() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = std::fs::read_to_string(root.join("docs/lecture.md")).unwrap();
    let out = crate::scratch("lecture");
    std::fs::create_dir_all(&out).unwrap();
    let program = Path::new(env!("CARGO_BIN_EXE_yugen"));
    let path = format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap());

    let blocks = page.split("```sh\n").skip(1).map(|b| b.split("```").next().unwrap());
    let lines: Vec<&str> = blocks.flat_map(str::lines).collect();
    assert!(lines.len() >= 20 && lines.iter().all(|l| l.starts_with("yugen ")), "{lines:?}");
    let (mut drawn, mut ran) = (Vec::new(), 0);
    for line in &lines {
        let output = line.split(" -o ").nth(1).unwrap().split_whitespace().next().unwrap();
        if let Some(name) = output.strip_prefix("docs/images/lecture/") {
            drawn.push(name.to_string());
        }
        // The whole database takes minutes; its commands have tests of their own.
        if line.contains("YUGEN_DATA") || line.contains("out/lecture") {
            continue;
        }
        let line = small(&line.replace("docs/images/lecture", out.to_str().unwrap()));
        let done =
            Command::new("sh").args(["-c", &line]).current_dir(&root).env("PATH", &path).output().unwrap();
        assert!(done.status.success(), "{line}: {}", String::from_utf8_lossy(&done.stderr));
        let file = out.join(output.rsplit('/').next().unwrap());
        assert!(std::fs::metadata(&file).unwrap().len() > 300, "{}", file.display());
        ran += 1;
    }
    assert!(ran >= 20, "{ran}");

    let shown: Vec<&str> =
        page.split("](images/lecture/").skip(1).map(|l| l.split(')').next().unwrap()).collect();
    assert_eq!(shown, drawn, "the page shows what its commands draw, in their order");
    let mut kept: Vec<String> = std::fs::read_dir(root.join("docs/images/lecture"))
        .unwrap()
        .map(|f| f.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    kept.sort();
    drawn.sort();
    assert_eq!(kept, drawn, "run examples/lecture.sh to draw them anew");
}
