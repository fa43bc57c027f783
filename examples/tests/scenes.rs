//! Every scene of `examples/scenes` renders as it stands.

use std::path::PathBuf;
use yugen_archive::formats::{Options as LoadOptions, load_scene};
use yugen_transport::render::{Action, Budget, Job, Options};

#[test]
fn every_scene_renders_as_it_stands() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|f| f.unwrap().path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "toml"));
    files.sort();
    assert!(files.len() >= 9, "{files:?}");
    for file in files {
        let scene = load_scene(&file, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let options =
            Options { size: Some([40, 40]), budget: Some(Budget::Samples(8)), ..Options::default() };
        let job = Job::new(&scene, &options).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        job.run(|_, _| Action::Continue);
        let rgb = job.image().select(&["R", "G", "B"]).unwrap();
        assert!(rgb.data.iter().all(|v| v.is_finite()), "{}", file.display());
        let mean = rgb.data.iter().sum::<f32>() / rgb.data.len() as f32;
        let brightest = rgb.data.iter().fold(0.0f32, |a, v| a.max(*v));
        // Neither black nor burnt out, and something is to be seen: brighter and darker parts.
        assert!(
            (0.02..1.5).contains(&mean) && brightest > 2.0 * mean,
            "{}: {mean} {brightest}",
            file.display()
        );
    }
}
