use super::linear::eigen;
use super::optimal::condition;
use super::*;
use yugen_optics::Frame;
use yugen_optics::random::Pcg32;
use yugen_reflectance::microfacet::{d_ggx, v_smith_ggx_correlated};

/// Lambert under GGX: colour, strength and roughness vary.
struct Made(usize);

fn made(material: usize, wo: Vec3, wi: Vec3) -> Vec3 {
    let x = |k: f32| (0.3 + k * material as f32).fract();
    let (alpha, strength) = (0.08 + 0.4 * x(0.618), 0.03 + 0.5 * x(0.755));
    let h = (wo + wi).normalize();
    let base = Vec3::new(x(0.31), x(0.83), x(0.57)) * 0.25 + 0.01;
    base + strength * d_ggx(h, alpha, alpha) * v_smith_ggx_correlated(wo, wi, alpha, alpha)
}

impl Tables for Made {
    type Error = std::convert::Infallible;

    fn count(&self) -> usize {
        self.0
    }

    fn read(&self, material: usize, first: usize, rgb: &mut [f32]) -> Result<(), Self::Error> {
        for (i, to) in rgb.chunks_exact_mut(3).enumerate() {
            let (wo, wi) = directions_of(first + i);
            let f = if wo.z > 0.0 && wi.z > 0.0 { made(material, wo, wi) } else { Vec3::NEG_ONE };
            to.copy_from_slice(&f.to_array());
        }
        Ok(())
    }
}

fn names(n: usize) -> Vec<String> {
    (0..n).map(|i| format!("m{i}")).collect()
}

/// Twelve columns.
fn basis() -> &'static Basis {
    static BASIS: std::sync::OnceLock<Basis> = std::sync::OnceLock::new();
    BASIS.get_or_init(|| build(&Made(4), &names(4), 99, 2, &|_| {}).unwrap_or_else(|e| match e {}).unwrap())
}

fn worst(values: &[f32], material: usize) -> f32 {
    let seen = values.chunks_exact(3).enumerate().filter(|(_, v)| v[0] >= 0.0).step_by(7);
    seen.map(|(bin, v)| {
        let (wo, wi) = directions_of(bin);
        let want = made(material, wo, wi);
        ((Vec3::from_slice(v) - want) / (want + 0.05)).abs().max_element()
    })
    .fold(0.0, f32::max)
}

#[test]
fn eigenvectors_are_those_of_a_known_matrix() {
    // Eigenvalues 2 − √2, 2, 2 + √2.
    let a = [2.0, -1.0, 0.0, -1.0, 2.0, -1.0, 0.0, -1.0, 2.0];
    let (values, v) = eigen(&a, 3);
    let root = 2f64.sqrt();
    for (got, want) in values.iter().zip([2.0 + root, 2.0, 2.0 - root]) {
        assert!((got - want).abs() < 1e-13);
    }
    for j in 0..3 {
        for i in 0..3 {
            let av: f64 = (0..3).map(|k| a[i * 3 + k] * v[k * 3 + j]).sum();
            assert!((av - values[j] * v[i * 3 + j]).abs() < 1e-12);
        }
    }
}

#[test]
fn bins_and_directions_agree() {
    let mut rng = Pcg32::new(1, 3);
    for _ in 0..4000 {
        let bin = ((u64::from(rng.next_u32()) * BINS as u64) >> 32) as usize;
        // Closer to the normal single precision no longer knows φ_d to half a degree.
        if cosines(bin).is_some() && bin >= 4 * THETA_D * PHI_D {
            let (wo, wi) = directions_of(bin);
            assert_eq!(bin_of(wo, wi), bin);
            assert_eq!(bin_of(wi, wo), bin, "reciprocity");
        }
    }
}

#[test]
fn components_are_orthogonal_and_hold_the_training_tables() {
    let b = basis();
    // All that lies above the horizon; at most 11 columns, as the mean takes one of twelve.
    assert!(
        (1_088_000..1_118_000).contains(&b.bins.len()) && (8..=11).contains(&b.components),
        "{}",
        b.components
    );
    let k = b.components;
    for i in 0..k {
        for j in 0..=i {
            let dot: f64 = b.q.chunks_exact(k).map(|r| f64::from(r[i]) * f64::from(r[j])).sum();
            let (si, sj) = (f64::from(b.singular[i]), f64::from(b.singular[j]));
            let want = if i == j { 1.0 } else { 0.0 };
            // Single precision of a million rows; the last columns come from the small end of a squared spectrum.
            assert!((dot / (si * sj) - want).abs() < 1e-3, "{i} {j}: {}", dot / (si * sj));
        }
    }
    let all: Vec<Observation> = (0..b.bins.len())
        .step_by(5)
        .map(|row| {
            let (wo, wi) = directions_of(b.bins[row] as usize);
            Observation { row, f: made(2, wo, wi) }
        })
        .collect();
    let exact = worst(&reconstruct(b, &all, k, 1e-9), 2);
    assert!(exact < 2e-4, "{exact}");
    // The ridge of the paper costs a little.
    let ridged = worst(&reconstruct(b, &all, k, RIDGE), 2);
    assert!(ridged > exact && ridged < 0.2, "{ridged}");
}

#[test]
fn few_directions_or_a_photograph_tell_a_material_of_the_basis() {
    let b = basis();
    let rows = optimal_rows(b, 5, Reach::ALL, &|_| {});
    assert_eq!(rows, optimal_rows(b, 5, Reach::ALL, &|_| {}));
    let mut rng = Pcg32::new(3, 3);
    let random = (0..40)
        .map(|_| {
            let rows: Vec<usize> = (0..5).map(|_| rng.next_u32() as usize % b.bins.len()).collect();
            condition(b, &rows, 5)
        })
        .fold(f64::INFINITY, f64::min);
    assert!(condition(b, &rows, 5) < 0.7 * random, "{} {random}", condition(b, &rows, 5));

    let size = 96;
    let light = Vec3::new(0.5, 0.3, 0.7).normalize();
    let pixels: Vec<Vec3> = (0..size * size)
        .map(|i| {
            let at = |v: usize| (v as f32 + 0.5) / size as f32 * 2.0 - 1.0;
            let (x, y) = (at(i % size), -at(i / size));
            let z2 = 1.0 - x * x - y * y;
            if z2 <= 0.0 {
                return Vec3::ZERO;
            }
            let frame = Frame::from_normal(Vec3::new(x, y, z2.sqrt()));
            let (wo, wi) = (frame.to_local(Vec3::Z), frame.to_local(light));
            if wi.z > 0.0 { made(1, wo, wi) * wi.z * PI * 0.8 } else { Vec3::ZERO }
        })
        .collect();
    let half = size as f32 / 2.0;
    let photo =
        Sphere { pixels: &pixels, width: size, centre: (half, half), radius: half, light, white: 0.8 };
    let (seen, used) = photo.observations(b);
    assert!(seen.len() > 1000 && used >= seen.len());
    let mean_error = |eta: f64| {
        let table = reconstruct(b, &seen, b.components, eta);
        let (mut sum, mut count) = (0.0f64, 0);
        for (bin, v) in table.chunks_exact(3).enumerate().filter(|(_, v)| v[0] >= 0.0).step_by(11) {
            let (wo, wi) = directions_of(bin);
            let want = made(1, wo, wi);
            sum += f64::from(((Vec3::from_slice(v) - want) / (want + 0.05)).abs().max_element());
            count += 1;
        }
        sum / f64::from(count)
    };
    // A slice of the table is too little for the ridge of the paper to trust all components.
    let (trusting, ridged) = (mean_error(1e-2), mean_error(RIDGE));
    assert!(trusting < 0.1 && trusting < 0.6 * ridged && ridged < 0.5, "{trusting} {ridged}");
}

#[test]
fn leaving_one_out_gets_better_with_readings_and_does_not_depend_on_threads() {
    let run = |threads| {
        let told = std::sync::Mutex::new(0.0f64);
        let report = leave_one_out(&Made(5), &names(5), &[2, 6], threads, &|x| {
            let mut t = told.lock().unwrap();
            *t = t.max(x);
        });
        assert!((*told.lock().unwrap() - 1.0).abs() < 1e-9);
        report.unwrap_or_else(|e| match e {}).unwrap()
    };
    let (one, three) = (run(1), run(3));
    assert_eq!((&one.errors, &one.rows, &one.basis), (&three.errors, &three.rows, &three.basis));
    let mean = |n: usize| {
        let of: Vec<f64> = one.errors.iter().filter(|e| e.readings == n).map(|e| e.log_rms).collect();
        assert_eq!(of.len(), 5);
        of.iter().sum::<f64>() / 5.0
    };
    assert!(mean(2) < mean(0) && mean(6) < mean(2), "{} {} {}", mean(0), mean(2), mean(6));
}

#[test]
fn directions_stay_within_reach() {
    let b = basis();
    let reach = Reach { most: 60f32.to_radians(), apart: 10f32.to_radians() };
    let rows = optimal_rows(b, 6, reach, &|_| {});
    assert_eq!(rows.len(), 6);
    for &row in &rows {
        let (wo, wi) = directions_of(b.bins[row] as usize);
        assert!(wo.z.min(wi.z) >= 0.5 - 1e-6 && wo.angle_between(wi) >= reach.apart - 1e-6, "{wo} {wi}");
    }
    // Among all there are better ones, or as good: reach costs something, not everything.
    let free = condition(b, &optimal_rows(b, 6, Reach::ALL, &|_| {}), 6);
    let within = condition(b, &rows, 6);
    assert!(within > 0.9 * free && within < 10.0 * free, "{within} {free}");
    assert!(optimal_rows(b, 6, Reach { most: 0.001, apart: 0.0 }, &|_| {}).is_empty());
}

#[test]
fn coefficients_expand_to_the_table_that_they_were_taken_from() {
    let b = basis();
    let mut table = vec![0.0; VALUES];
    Made(4).read(1, 0, &mut table).unwrap_or_else(|e| match e {});
    let c = coefficients(b, &table);
    // Measured 1.2e-5.
    assert!(worst(&expand(b, &c), 1) < 1e-4, "{}", worst(&expand(b, &c), 1));
    let mean = expand(b, &[vec![0.0], vec![0.0], vec![0.0]]);
    let middle = coefficients(b, &mean);
    assert!(middle.iter().flatten().all(|v| v.abs() < 1e-4), "{middle:?}");
}

/// Grey: three columns of each table are one.
struct Grey;

impl Tables for Grey {
    type Error = std::convert::Infallible;

    fn count(&self) -> usize {
        3
    }

    fn read(&self, material: usize, first: usize, rgb: &mut [f32]) -> Result<(), Self::Error> {
        Made(3).read(material, first, rgb)?;
        for to in rgb.chunks_exact_mut(3) {
            // As far apart as a file's rounding puts them.
            to.copy_from_slice(&[to[0], to[0] * (1.0 + 2e-7), to[0] * (1.0 - 3e-7)]);
        }
        Ok(())
    }
}

#[test]
fn rounding_is_no_component() {
    let b = build(&Grey, &names(3), 20, 2, &|_| {}).unwrap_or_else(|e| match e {}).unwrap();
    assert_eq!(b.components, 2, "{:?}", b.singular);
}
