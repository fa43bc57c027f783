//! Measured reflectance.

use crate::{FILE, assault, assault_with, mutate, peak};
use std::path::Path;
use yugen_archive::Error;
use yugen_archive::formats::{goniometer, merl, neural_brdf, pca_basis, readings, rgl};
use yugen_optics::ColourSpace;
use yugen_optics::random::Pcg32;
use yugen_reflectance::rgl::{Measurement, Sweep};

const SPACE: ColourSpace = ColourSpace::LinearSrgb;

/// Whether it was read; what was not must be told with the name of the file.
fn told<T>(read: Result<T, Error>) -> bool {
    if let Err(e) = &read {
        assert!(e.to_string().contains(FILE), "{e}");
    }
    read.is_ok()
}

#[test]
fn merl_headers() {
    // The smallest whole file has 35 MB, so this is only about what a header may say.
    let mut rng = Pcg32::new(3, 1);
    let seed: Vec<u8> = [90, 90, 180i32].iter().flat_map(|v| v.to_le_bytes()).chain([0; 64]).collect();
    let worst = (0..3000).map(|_| {
        let bytes = mutate(&seed, &seed, &mut rng);
        peak(|| {
            let error = merl::read(&bytes, Path::new(FILE), ColourSpace::LinearSrgb).unwrap_err();
            assert!(error.to_string().contains(FILE), "{error}");
        })
    });
    assert!(worst.max().unwrap() < 1 << 16);
}

#[test]
fn goniometer_tables() {
    let seed =
        b"yugen-goniometer 1 # seed\n\nchannels grey\ntheta_o 0 60\nphi_o 0\ntheta_i 0 45 80\nphi_d 0 180\n\
        values\n0.1 0.2 0.3 - 0.5 0.6\n1 2 3 4 5 6\n";
    let path = Path::new(FILE);
    assault("goniometer", &[seed.to_vec()], |b| told(goniometer::read(b, path, SPACE)));
}

#[test]
fn rgl_measurements() {
    let seed = |sweep, widths| {
        let measurement = Measurement::of(|wo, wi| 0.1 + wo * wi, widths, sweep, 4, 4, 4);
        rgl::write(&measurement, "a seed", SPACE)
    };
    let seeds = [seed(Sweep::None, (0.3, 0.3)), seed(Sweep::Quarter(3), (0.3, 0.5))];
    assault("rgl", &seeds, |b| told(rgl::read(b, Path::new(FILE), SPACE)));
}

#[test]
fn readings_of_a_brdf() {
    let seeds = [
        b"wi,wo,rgb\n0 0 1 0 .6 .8\n1,0,1; 0,0,1 .1 .2 .3 # one\n".to_vec(),
        b"0 0 1 0 0 1 1e-3 2 3 0.5\n\n0 0.1 1 0 0 9 0 0 0 1\n".to_vec(),
    ];
    assault("readings", &seeds, |b| told(readings::read(b, Path::new(FILE))));
}

#[test]
fn neural_encodings() {
    let seed: Vec<u8> =
        (0..neural_brdf::WEIGHTS).flat_map(|i| (0.1 * (i as f32).sin()).to_le_bytes()).collect();
    assault("neural_brdf", &[seed], |b| match neural_brdf::read(b, Path::new(FILE)) {
        Ok(all) => all.iter().all(|m| m.eval(0.3, 0.4, 1.0).min_element() >= 0.0),
        refused => told(refused),
    });
}

/// Accidents before and behind the mask, which is nearly all of a basis and bears none.
fn ends(seed: &[u8], _: &[u8], rng: &mut Pcg32) -> Vec<u8> {
    let (head, rest) = seed.split_at(44);
    let (mask, tail) = rest.split_at(rest.len() - 48);
    match rng.next_u32() % 2 {
        0 => [&mutate(head, head, rng)[..], rest].concat(),
        _ => [head, mask, &mutate(tail, tail, rng)[..]].concat(),
    }
}

#[test]
fn bases_of_reconstruction() {
    let basis = pca_basis::Basis {
        names: vec!["gold".into(), "silk".into()],
        singular: vec![3.0, 2.0, 0.5],
        bins: vec![0, 7, 8, 1_457_999],
        mean: vec![-1.0, -2.0, -3.0, 0.5],
        components: 2,
        q: (0..8).map(|i| i as f32).collect(),
    };
    let seed = pca_basis::write(&basis);
    assault_with("pca_basis", &[seed], 400, ends, |b| told(pca_basis::read(b, Path::new(FILE))));
}
