//! Measured reflectance.

use crate::{FILE, assault, assault_with, mutate, peak, rewrite};
use std::path::Path;
use yugen_archive::Error;
use yugen_archive::formats::instrument::{alta, astm, utia, window, zemax};
use yugen_archive::formats::{goniometer, instrument, merl, neural_brdf, pca_basis, readings, rgl};
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

/// What every reader of instruments promises.
fn sound(read: Result<instrument::Measurement, Error>) -> bool {
    if let Ok(m) = &read {
        assert!(!m.readings.is_empty());
        for r in &m.readings {
            assert!(r.wi.is_normalized() && r.wi.z > 0.0 && r.wo.is_normalized() && r.wo.z > 0.0, "{r:?}");
            assert!(r.f.is_finite() && r.f.min_element() >= 0.0 && r.weight >= 0.0, "{r:?}");
        }
    }
    told(read)
}

#[test]
fn readings_of_instruments() {
    let path = Path::new(FILE);
    let seeds = [
        b"#DIM 3 1\n#PARAM_IN ISOTROPIC_TV_TL_DPHI\n#PARAM_OUT INV_STERADIAN\n0.1\t0.5 3.14 0.318\n0.2 0.4 1 0.2 9\n".to_vec(),
        b"people\n#DIM 6 3\n#PARAM_IN CARTESIAN\n#PARAM_OUT XYZ_COLOR\n0 0 1 .6 0 .8 .1 .2 .3\n".to_vec(),
    ];
    assault("alta", &seeds, |b| sound(alta::read(b, path, SPACE)));
    let seeds = [
        b"NUM_POINTS 2\nVARS theta_i,phi_i,theta_s,phi_s,500nm,600nm,550nm\n.5,1,.3,2,.1,.2,.3\n.5,1,.4,2,.1,.2,.3\nEND\n".to_vec(),
        b"VARS=theta_i,phi_i,theta_r,phi_r,BRDF\n45 0 30 180 .25\n".to_vec(),
    ];
    assault("astm", &seeds, |b| sound(astm::read(b, path, SPACE)));
    let head = "Source Measured\nSymmetry ASymmetrical4D\nScatterType BRDF\nSampleRotation 2\n0 90\nAngleOfIncidence 1\n30\n\
        ScatterAzimuth 2\n0 180\nScatterRadial 2\n0 9\n\n";
    let block = |name: &str| format!("{name}\nDataBegin\nTIS .1\n1 2\n3 4\nTIS .1\n5 6\n7 8.5E-1\nDataEnd\n");
    let seeds = [
        (head.to_string() + &block("Monochrome")).into_bytes(),
        (head.to_string() + &["TristimulusX", "TristimulusY", "TristimulusZ"].map(block).concat())
            .into_bytes(),
    ];
    assault("zemax", &seeds, |b| sound(zemax::read(b, path, SPACE)));
}

#[test]
fn window_files() {
    let file = |structure: &str, basis: &str, data: &str| {
        let block = |range: &str| {
            format!(
                "<WavelengthData>\n<Wavelength unit=\"Integral\">{range}</Wavelength>\n<WavelengthDataBlock>\n\
                 <WavelengthDataDirection>Reflection Front</WavelengthDataDirection>\n<ColumnAngleBasis>{basis}\
                 </ColumnAngleBasis>\n<RowAngleBasis>{basis}</RowAngleBasis>\n<AngleBasis>{basis}</AngleBasis>\n\
                 <ScatteringData>{data}</ScatteringData>\n</WavelengthDataBlock>\n</WavelengthData>\n"
            )
        };
        let ring = |low: u8, high: u8, n: u8| {
            format!(
                "<AngleBasisBlock><nPhis>{n}</nPhis><ThetaBounds><LowerTheta>{low}</LowerTheta>\n<UpperTheta>{high}\
                 </UpperTheta></ThetaBounds></AngleBasisBlock>\n"
            )
        };
        format!(
            "<WindowElement xmlns=\"http://windows.lbl.gov\"><Optical><Layer>\n<DataDefinition><IncidentDataStructure>\
             {structure}</IncidentDataStructure>\n<AngleBasis><AngleBasisName>mine</AngleBasisName>\n{}{}</AngleBasis>\n\
             </DataDefinition>\n{}{}</Layer></Optical></WindowElement>\n",
            ring(0, 20, 1),
            ring(20, 80, 3),
            block("Visible"),
            block("CIE-u"),
        )
        .into_bytes()
    };
    let seeds = [
        file("Columns", "mine", "1, 2, 3, 4\n5, 6, 7, 8\n1 2 3 4\n5 6 7 8"),
        file("TensorTree3", "LBNL/Shirley-Chiu", "{{1}{2}{3}{4}\n{5 6 7 8 1 2 3 4}{6}{7}{8}}"),
        file("TensorTree4", "LBNL/Shirley-Chiu", "{0.3}"),
    ];
    let read = |b: &[u8]| sound(window::read(b, Path::new(FILE), SPACE));
    assault_with("window", &seeds, 6_000, mutate, read);
    assault_with("window rewritten", &seeds, 2_000, |seed, _, rng| rewrite(seed, rng), read);
}

#[test]
fn utia_files() {
    // Two megabytes of numbers, any of which will do but those that are none.
    let seed: Vec<u8> = (0..utia::BYTES / 8).flat_map(|i| (0.1 + (i % 7) as f64).to_le_bytes()).collect();
    let mut rng = Pcg32::new(3, 1);
    let read = |b: &[u8]| sound(utia::read(b, Path::new(FILE), SPACE));
    assert!(read(&seed));
    let mut good = 0;
    for _ in 0..60 {
        let bytes = mutate(&seed, &seed, &mut rng);
        let held = peak(|| good += usize::from(read(&bytes)));
        assert!(held < 8 << 20, "{held}");
    }
    assert!(good > 0 && good < 60, "{good}");
}
