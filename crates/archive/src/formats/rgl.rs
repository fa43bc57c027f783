//! RGL `.bsdf`: the measurements of Dupuy and Jakob 2018, in their container of named tensors.
//!
//! `tensor_file\0`, two bytes of version, a `u32` count of fields; for each field a `u16` length and its name, a
//! `u16` count of dimensions, a byte for the type, a `u64` offset, the `u64` dimensions. Data is aligned to 8
//! bytes; all little-endian, last dimension fastest.

use crate::{Error, Place};
use glam::{DVec3, Vec3};
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_optics::spectrum::Sensor;
use yugen_reflectance::rgl::{Grid, Measurement};

const MAGIC: &[u8; 12] = b"tensor_file\0";
/// Types of the format, and bytes of each: u8, i8, u16, i16, u32, i32, u64, i64, f16, f32, f64 are 1 to 11.
const SIZES: [u64; 12] = [0, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8];
const U8: u8 = 1;
const F32: u8 = 10;

/// A field of a tensor file.
#[derive(Clone, Debug, PartialEq)]
pub struct Field<'a> {
    /// Its name.
    pub name: String,
    /// Dimensions, the last fastest.
    pub shape: Vec<usize>,
    /// The number of its type in the format.
    pub kind: u8,
    /// Its data.
    pub bytes: &'a [u8],
    /// Where the data starts.
    pub offset: u64,
}

/// Reads numbers off the front.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    file: &'a Path,
}

impl<'a> Cursor<'a> {
    fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N], Error> {
        Ok(*self.slice(N, what)?.first_chunk().unwrap_or(&[0; N]))
    }

    fn slice(&mut self, n: usize, what: &str) -> Result<&'a [u8], Error> {
        let found = self.bytes.get(self.at..).and_then(|rest| rest.get(..n));
        let found =
            found.ok_or_else(|| self.error(format!("the file ends inside {what}; fetch it again")))?;
        self.at += n;
        Ok(found)
    }

    fn error(&self, problem: String) -> Error {
        Error::invalid(Place::byte(self.file, self.at as u64), problem)
    }
}

/// The fields of a tensor file; every one lies inside it.
pub fn fields<'a>(bytes: &'a [u8], file: &'a Path) -> Result<Vec<Field<'a>>, Error> {
    let mut c = Cursor { bytes, at: 0, file };
    if bytes.get(..MAGIC.len()) != Some(MAGIC) {
        return Err(c.error("a .bsdf file starts with 'tensor_file'; this is another format".into()));
    }
    c.at = MAGIC.len();
    let version: [u8; 2] = c.take("the version")?;
    if version != [1, 0] {
        return Err(c.error(format!(
            "tensor files have version 1.0, but this one has {}.{}",
            version[0], version[1]
        )));
    }
    let count = u32::from_le_bytes(c.take("the count of fields")?);
    // No need for a limit: every field takes bytes of the header, which ends with the file.
    let mut fields = Vec::new();
    for _ in 0..count {
        let length = u16::from_le_bytes(c.take("a name")?);
        let name = String::from_utf8_lossy(c.slice(length.into(), "a name")?).into_owned();
        let dimensions = u16::from_le_bytes(c.take("a field")?);
        let [kind] = c.take("a field")?;
        let offset = u64::from_le_bytes(c.take("a field")?);
        let item = SIZES.get(usize::from(kind)).copied().filter(|s| *s > 0);
        let item =
            item.ok_or_else(|| c.error(format!("field '{name}' has type {kind}; expected 1 to 11")))?;
        let mut shape = Vec::new();
        let mut size = Some(item);
        for _ in 0..dimensions {
            let n = u64::from_le_bytes(c.take("a field")?);
            size = size.and_then(|s| s.checked_mul(n));
            shape.push(usize::try_from(n).unwrap_or(usize::MAX));
        }
        let range = size.and_then(|s| offset.checked_add(s)).and_then(|end| {
            let (start, end) = (usize::try_from(offset).ok()?, usize::try_from(end).ok()?);
            bytes.get(start..end)
        });
        let data = range.ok_or_else(|| {
            c.error(format!(
                "field '{name}' of shape {shape:?} at byte {offset} reaches beyond the end of the file"
            ))
        })?;
        fields.push(Field { name, shape, kind, bytes: data, offset });
    }
    Ok(fields)
}

/// The bytes of a tensor file with these fields; offsets are set here.
pub fn write_fields(fields: &[Field]) -> Vec<u8> {
    let header: usize = fields.iter().map(|f| 13 + f.name.len() + 8 * f.shape.len()).sum();
    let mut at = MAGIC.len() + 6 + header;
    let mut bytes = MAGIC.to_vec();
    bytes.extend([1, 0]);
    bytes.extend((fields.len() as u32).to_le_bytes());
    let mut data = Vec::new();
    for f in fields {
        let padding = at.next_multiple_of(8) - at;
        data.extend(std::iter::repeat_n(0, padding));
        at += padding;
        bytes.extend((f.name.len() as u16).to_le_bytes());
        bytes.extend(f.name.as_bytes());
        bytes.extend((f.shape.len() as u16).to_le_bytes());
        bytes.push(f.kind);
        bytes.extend((at as u64).to_le_bytes());
        f.shape.iter().for_each(|&n| bytes.extend((n as u64).to_le_bytes()));
        data.extend(f.bytes);
        at += f.bytes.len();
    }
    bytes.extend(data);
    bytes
}

/// Fields by name, with their errors.
struct Tensors<'a> {
    fields: Vec<Field<'a>>,
    file: &'a Path,
}

impl<'a> Tensors<'a> {
    fn error(&self, problem: String) -> Error {
        Error::invalid(Place::file(self.file), problem)
    }

    fn has(&self, name: &str) -> bool {
        self.fields.iter().any(|f| f.name == name)
    }

    fn field(&self, name: &str, dimensions: usize, kind: u8) -> Result<&Field<'a>, Error> {
        let field = self.fields.iter().find(|f| f.name == name);
        let field = field.ok_or_else(|| self.error(format!("this .bsdf file lacks the field '{name}'")))?;
        if field.shape.len() != dimensions || field.kind != kind {
            return Err(Error::invalid(
                Place::byte(self.file, field.offset),
                format!(
                    "field '{name}' has {} dimensions of type {}; expected {dimensions} of type {kind}",
                    field.shape.len(),
                    field.kind
                ),
            ));
        }
        Ok(field)
    }

    fn floats(&self, name: &str, dimensions: usize) -> Result<(Vec<usize>, Vec<f32>), Error> {
        let field = self.field(name, dimensions, F32)?;
        let values = field.bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b));
        Ok((field.shape.clone(), values.collect()))
    }

    /// The last two dimensions as a grid; those before must be `leading`.
    fn grid(&self, name: &str, leading: &[usize]) -> Result<Grid, Error> {
        let (shape, values) = self.floats(name, leading.len() + 2)?;
        if shape[..leading.len()] != *leading {
            return Err(self.error(format!(
                "field '{name}' has shape {shape:?}, but there are {leading:?} eye directions"
            )));
        }
        Ok(Grid { width: shape[leading.len() + 1], height: shape[leading.len()], values })
    }
}

/// A measurement, its colours as RGB of `space`. RGB files are taken as linear sRGB; spectra become the colour
/// under D65.
pub fn read(bytes: &[u8], file: &Path, space: ColourSpace) -> Result<Measurement, Error> {
    let t = Tensors { fields: fields(bytes, file)?, file };
    let (_, phi) = t.floats("phi_i", 1)?;
    let (_, theta) = t.floats("theta_i", 1)?;
    let leading = [phi.len(), theta.len()];
    let luminance = t.grid("luminance", &leading)?;
    let n = luminance.width;
    if luminance.height != n {
        return Err(t.error(format!("field 'luminance' is {n} x {}; expected a square", luminance.height)));
    }
    let jacobian = t.field("jacobian", 1, U8)?;
    let &[jacobian] = jacobian.bytes else {
        return Err(t.error(format!("field 'jacobian' has {} bytes; expected 1", jacobian.bytes.len())));
    };
    let (name, weights): (&str, Vec<DVec3>) = if t.has("rgb") {
        let to_space = ColourSpace::LinearSrgb.matrix_to(space).as_dmat3();
        ("rgb", vec![to_space.x_axis, to_space.y_axis, to_space.z_axis])
    } else {
        let (_, wavelengths) = t.floats("wavelengths", 1)?;
        let wavelengths: Vec<f64> = wavelengths.into_iter().map(f64::from).collect();
        let rising = wavelengths.len() >= 2 && wavelengths.windows(2).all(|w| w[0] < w[1]);
        if !(rising && wavelengths[0] < 780.0 && wavelengths[wavelengths.len() - 1] > 380.0) {
            return Err(t.error("field 'wavelengths' must rise and reach into the visible, in nm".into()));
        }
        ("spectra", Sensor::reflectance_at(space, wavelengths).weights().to_vec())
    };
    let field = t.field(name, 5, F32)?;
    let expected = [phi.len(), theta.len(), weights.len(), n, n];
    if field.shape != expected {
        return Err(Error::invalid(
            Place::byte(file, field.offset),
            format!(
                "field '{name}' has shape {:?}; expected {expected:?} from the other fields",
                field.shape
            ),
        ));
    }
    let slice = n * n;
    let mut rgb = Vec::with_capacity(3 * luminance.values.len());
    // One eye direction at a time, straight from the file: spectra are the bulk of it.
    let (numbers, _) = field.bytes.as_chunks::<4>();
    for spectra in numbers.chunks_exact((weights.len() * slice).max(1)) {
        let mut sum = vec![DVec3::ZERO; slice];
        for (plane, weight) in spectra.chunks_exact(slice).zip(&weights) {
            sum.iter_mut().zip(plane).for_each(|(s, v)| *s += *weight * f64::from(f32::from_le_bytes(*v)));
        }
        (0..3).for_each(|c| rgb.extend(sum.iter().map(|s| s[c] as f32)));
    }
    let measurement = Measurement {
        ndf: t.grid("ndf", &[])?,
        sigma: t.grid("sigma", &[])?,
        vndf: t.grid("vndf", &leading)?,
        phi,
        theta,
        luminance,
        rgb,
        jacobian: jacobian != 0,
    };
    measurement.check().map_err(|problem| t.error(format!("the measurement {problem}")))?;
    Ok(measurement)
}

/// The bytes of an RGB file (linear sRGB) with this measurement, whose colours are of `space`.
pub fn write(m: &Measurement, description: &str, space: ColourSpace) -> Vec<u8> {
    let to_srgb = space.matrix_to(ColourSpace::LinearSrgb);
    let n = m.luminance.width;
    let mut rgb = m.rgb.clone();
    for grids in rgb.chunks_exact_mut(3 * n * n) {
        for i in 0..n * n {
            let c = to_srgb * Vec3::new(grids[i], grids[n * n + i], grids[2 * n * n + i]);
            (0..3).for_each(|k| grids[k * n * n + i] = c[k]);
        }
    }
    let (phi, theta) = (m.phi.len(), m.theta.len());
    let jacobian = [u8::from(m.jacobian)];
    let floats = |name: &str, shape: &[usize], values: &[f32]| {
        (
            name.to_string(),
            shape.to_vec(),
            F32,
            values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>(),
        )
    };
    let all = [
        ("description".to_string(), vec![description.len()], U8, description.as_bytes().to_vec()),
        floats("phi_i", &[phi], &m.phi),
        floats("theta_i", &[theta], &m.theta),
        floats("ndf", &[m.ndf.height, m.ndf.width], &m.ndf.values),
        floats("sigma", &[m.sigma.height, m.sigma.width], &m.sigma.values),
        floats("vndf", &[phi, theta, m.vndf.height, m.vndf.width], &m.vndf.values),
        floats("luminance", &[phi, theta, n, n], &m.luminance.values),
        floats("rgb", &[phi, theta, 3, n, n], &rgb),
        ("jacobian".to_string(), vec![1], U8, jacobian.to_vec()),
    ];
    let fields: Vec<Field> = all
        .iter()
        .map(|(name, shape, kind, bytes)| Field {
            name: name.clone(),
            shape: shape.clone(),
            kind: *kind,
            bytes,
            offset: 0,
        })
        .collect();
    write_fields(&fields)
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::frame::spherical;
    use yugen_optics::spectrum::reflectance_rgb;
    use yugen_reflectance::microfacet::{Distribution, Masking, Microfacets};
    use yugen_reflectance::rgl::Sweep;
    use yugen_reflectance::{Bsdf, Kind};

    /// GGX with a little Lambert, as if measured.
    fn measured(ax: f32, ay: f32) -> Measurement {
        let facets = Microfacets::new(Distribution::Ggx, Masking::HeightCorrelated, ax, ay);
        let f = |wo: Vec3, wi: Vec3| facets.reflect(wo, wi).0 * Vec3::new(0.9, 0.5, 0.2) + 0.05;
        let sweep = if ax == ay { Sweep::None } else { Sweep::Quarter(9) };
        Measurement::of(f, (ax, ay), sweep, 8, 32, 16)
    }

    fn parse(bytes: &[u8]) -> Result<Measurement, Error> {
        read(bytes, Path::new("a.bsdf"), ColourSpace::LinearSrgb)
    }

    fn sentence(bytes: &[u8]) -> String {
        parse(bytes).unwrap_err().to_string()
    }

    #[test]
    fn the_same_file_means_the_same_to_mitsuba() {
        for ((ax, ay), cases) in [((0.3, 0.3), ISO), ((0.25, 0.5), ANISO)] {
            let bytes = write(&measured(ax, ay), "GGX", ColourSpace::LinearSrgb);
            let m = parse(&bytes).unwrap();
            assert_eq!(m, measured(ax, ay));
            let (kind, slots) = (Kind::Rgl, Kind::Rgl.defaults());
            let table = kind.bake(&slots, &m.to_data()).unwrap();
            let bsdf = Bsdf::new(kind, &slots, &table);
            let (mut worst, mut worst_pdf) = (0.0f32, 0.0f32);
            for &([theta_o, phi_o, theta_i, phi_i], f, pdf) in cases {
                let (wo, wi) = (spherical(theta_o, phi_o), spherical(theta_i, phi_i));
                let (got, got_pdf) = bsdf.eval_pdf(wo, wi);
                let f = Vec3::from(f);
                worst = worst.max((got - f).abs().max_element() / f.max_element());
                worst_pdf = worst_pdf.max((got_pdf - pdf).abs() / pdf);
            }
            // Measured 1.1e-5: single precision on both sides.
            assert!(worst < 5e-5 && worst_pdf < 5e-5, "{worst} {worst_pdf}");
        }
    }

    #[test]
    fn spectra_become_colours_under_d65() {
        let m = measured(0.3, 0.3);
        let n = m.luminance.width;
        // Each place reflects a ramp over the visible, as strong as its luminance.
        let wavelengths: Vec<f32> = (0..195).map(|i| 360.0 + 640.0 * i as f32 / 194.0).collect();
        let ramp = |l: f32| 0.2 + 0.001 * (l - 360.0);
        let spectra: Vec<f32> = m
            .luminance
            .values
            .chunks_exact(n * n)
            .flat_map(|grid| wavelengths.iter().flat_map(move |&l| grid.iter().map(move |v| v * ramp(l))))
            .collect();
        let bytes_of = |v: &[f32]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let (wavelength_bytes, spectra_bytes) = (bytes_of(&wavelengths), bytes_of(&spectra));
        let rgb_file = write(&m, "", ColourSpace::LinearSrgb);
        let mut all = fields(&rgb_file, Path::new("a")).unwrap();
        all.retain(|f| f.name != "rgb");
        let field = |name: &str, shape: Vec<usize>, bytes| Field {
            name: name.into(),
            shape,
            kind: F32,
            bytes,
            offset: 0,
        };
        all.push(field("wavelengths", vec![195], &wavelength_bytes));
        all.push(field("spectra", vec![1, m.theta.len(), 195, n, n], &spectra_bytes));
        let got = parse(&write_fields(&all)).unwrap();
        let colour = reflectance_rgb(ColourSpace::LinearSrgb, |l| f64::from(ramp(l as f32)));
        for (slice, luminance) in got.rgb.chunks_exact(3 * n * n).zip(m.luminance.values.chunks_exact(n * n))
        {
            for (i, v) in luminance.iter().enumerate() {
                let rgb = Vec3::new(slice[i], slice[n * n + i], slice[2 * n * n + i]);
                assert!(
                    (rgb - colour * *v).abs().max_element() <= 1e-5 * v.max(1e-3),
                    "{rgb} {}",
                    colour * *v
                );
            }
        }
        all.retain(|f| f.name != "wavelengths");
        assert_eq!(sentence(&write_fields(&all)), "a.bsdf: this .bsdf file lacks the field 'wavelengths'");
    }

    #[test]
    fn bad_files_get_a_sentence() {
        let good = write(&measured(0.3, 0.3), "GGX", ColourSpace::LinearSrgb);
        assert!(sentence(b"MZ").contains("starts with 'tensor_file'"));
        // Cut anywhere: never a panic, never success.
        for n in (0..600).chain((600..good.len()).step_by(997)) {
            assert!(parse(&good[..n]).is_err(), "{n}");
        }
        let patched = |name: &str, change: &dyn Fn(&mut Field)| {
            let mut all = fields(&good, Path::new("a")).unwrap();
            all.iter_mut().filter(|f| f.name == name).for_each(change);
            write_fields(&all)
        };
        let shape_of = |name: &str, shape: &[usize]| sentence(&patched(name, &|f| f.shape = shape.to_vec()));
        assert!(shape_of("theta_i", &[1 << 40]).contains("beyond the end of the file"));
        assert!(shape_of("rgb", &[usize::MAX, 8, 3, 16, 16]).contains("beyond the end of the file"));
        assert!(shape_of("rgb", &[1, 8, 3, 16, 8]).contains("expected [1, 8, 3, 16, 16]"));
        assert!(shape_of("vndf", &[1, 4, 32, 32]).contains("there are [1, 8] eye directions"));
        assert!(shape_of("vndf", &[1, 8, 1, 1]).contains("at least 2 x 2"));
        assert!(shape_of("luminance", &[1, 8, 16, 8]).contains("expected a square"));
        assert!(shape_of("luminance", &[1, 8, 0, 0]).contains("field 'rgb' has shape"));
        assert!(shape_of("ndf", &[32 * 32]).contains("has 1 dimensions of type 10; expected 2"));
        assert!(shape_of("jacobian", &[0]).contains("'jacobian' has"));
        assert!(sentence(&patched("sigma", &|f| f.kind = 12)).contains("type 12"));
        assert!(
            sentence(&patched("sigma", &|f| f.name = "gamma".into())).contains("lacks the field 'sigma'")
        );
        static NAN: [u8; 32 * 32 * 4] = [0xff; 32 * 32 * 4];
        assert!(sentence(&patched("ndf", &|f| f.bytes = &NAN)).contains("ndf that is not finite"));
        let mut version = good.clone();
        version[12] = 9;
        assert!(sentence(&version).contains("version 1.0, but this one has 9.0"));
        let mut count = good;
        count[14..18].fill(0xff);
        assert!(parse(&count).is_err());
    }

    /// Eye (polar angle, azimuth), light (polar angle, azimuth); f; density of the sampler.
    type Case = ([f32; 4], [f32; 3], f32);
    // Mitsuba 3.9.1, `measured` in scalar_rgb, on the files written above.
    #[rustfmt::skip]
    const ISO: &[Case] = &[
        ([0.1242, -1.6537, 1.1618, 0.5162], [0.174575, 0.118643, 0.0766934], 0.0784334),
        ([0.1365, -0.4202, 0.01, 3.386], [0.787615, 0.459499, 0.213413], 0.792877),
        ([0.5673, 0.1052, 0.6244, 0.5454], [0.117332, 0.087043, 0.0643264], 0.119632),
        ([1.0699, 2.8668, 1.2135, 5.9684], [3.46767, 1.95017, 0.812044], 1.21624),
        ([0.0022, 2.9748, 0.4327, -1.1688], [0.457673, 0.276554, 0.140715], 0.422472),
        ([1.293, 0.5351, 1.2564, 3.8771], [1.69732, 0.966977, 0.419218], 0.523072),
        ([0.5427, -2.5707, 0.9577, 2.711], [0.106276, 0.0801776, 0.0606038], 0.0775538),
        ([0.3004, 0.8174, 0.4536, 3.767], [0.848263, 0.493362, 0.227187], 0.763779),
        ([1.2033, 0.9906, 0.9901, 2.0111], [0.0950084, 0.074122, 0.0584572], 0.0721074),
        ([0.6214, 1.6255, 0.7335, 4.8059], [1.24981, 0.716843, 0.317117], 0.936356),
        ([0.6955, -2.2221, 1.0127, -1.307], [0.0942864, 0.0735167, 0.0579393], 0.0662476),
        ([1.2632, -1.4114, 0.8891, 1.8683], [1.56981, 0.894335, 0.387731], 0.996061),
        ([0.2614, 1.5511, 1.0907, 0.4208], [0.130125, 0.0934454, 0.0659357], 0.0715929),
        ([1.3356, -1.8487, 1.5, 0.8613], [0.249906, 0.161419, 0.0950542], 0.0197285),
        ([1.1412, 1.8216, 0.0784, -0.8213], [0.180217, 0.122018, 0.0783695], 0.214015),
        ([0.1231, -1.9256, 0.1198, 1.1415], [0.855746, 0.497371, 0.22859], 1.00173),
        ([0.7146, 2.1957, 1.3996, 1.3078], [0.0580238, 0.0450368, 0.0352965], 0.0131483),
        ([0.3098, 0.2826, 0.1898, 3.6982], [0.819945, 0.477413, 0.220515], 0.81506),
        ([0.8551, 1.0652, 0.9702, 0.1448], [0.0904, 0.0714176, 0.0571808], 0.0691534),
        ([0.8044, -1.8966, 0.9864, 1.3964], [1.4628, 0.835375, 0.364805], 0.814493),
        ([1.1225, -0.6681, 0.0284, 0.1744], [0.158682, 0.110451, 0.0742783], 0.191741),
        ([0.2976, 1.5159, 0.3791, 4.7024], [0.911296, 0.528573, 0.241531], 0.8464),
        ([0.5058, -0.9549, 0.6971, -2.5554], [0.187054, 0.126085, 0.0803581], 0.16333),
        ([0.7928, 2.6479, 0.969, 6.0029], [1.26495, 0.725416, 0.320764], 0.722954),
        ([1.0788, 1.9677, 1.1892, -1.5472], [0.704064, 0.414486, 0.197303], 0.272314),
        ([0.6988, -0.9882, 0.7222, 2.5053], [0.94255, 0.545843, 0.248313], 0.718567),
        ([0.8445, -2.4856, 0.6415, -0.6921], [0.164383, 0.113562, 0.0754473], 0.15757),
        ([1.0246, -2.5878, 0.9568, 0.6507], [2.16652, 1.22588, 0.52039], 1.26202),
        ([0.4826, -1.9024, 1.3512, -1.6091], [0.0656187, 0.050989, 0.0400167], 0.018571),
        ([0.2132, -1.383, 0.292, 1.9288], [0.863682, 0.502169, 0.231034], 0.836369),
        ([0.1827, -0.533, 0.9688, 2.4172], [0.269866, 0.172496, 0.0994688], 0.163266),
        ([1.4497, -2.2391, 1.3322, 0.8072], [4.79354, 2.68913, 1.11082], 0.964444),
        ([0.2522, 1.6828, 1.3596, 0.2406], [0.124736, 0.088564, 0.0614354], 0.0310294),
        ([0.013, -2.7379, 0.01, 0.5751], [0.845637, 0.491963, 0.226708], 0.970443),
        ([0.5877, -1.4756, 1.0206, -1.2048], [0.0923038, 0.0726846, 0.0579703], 0.0642299),
        ([0.5392, 1.667, 0.5181, 4.9685], [1.05109, 0.605902, 0.27201], 0.936568),
        ([0.6434, 2.3422, 0.8191, 2.9205], [0.0973469, 0.0753604, 0.0588705], 0.0870938),
        ([0.0017, -1.003, 0.01, 2.2145], [0.845382, 0.491872, 0.226739], 1.06858),
        ([1.2708, 1.1533, 0.7935, 0.3925], [0.093979, 0.0729775, 0.0572265], 0.0896543),
        ([0.9662, -1.1064, 0.9882, 2.2415], [1.57954, 0.899956, 0.390269], 0.876412),
        ([0.0392, 0.232, 1.2436, 0.8798], [0.147498, 0.103427, 0.0703726], 0.0551216),
        ([0.933, -0.6852, 0.6696, 2.5869], [1.14, 0.655525, 0.29217], 0.913533),
        ([1.2706, 2.9056, 0.1967, -2.4167], [0.133425, 0.0958538, 0.0676757], 0.164291),
        ([1.2963, -0.6212, 1.2761, 2.4826], [6.43602, 3.59827, 1.46996], 1.85332),
        ([0.7064, 1.0056, 1.0451, -3.0645], [0.217216, 0.143243, 0.0877632], 0.123497),
        ([1.1758, -0.4136, 1.1975, 2.7028], [4.4761, 2.51049, 1.03627], 1.65516),
        ([0.3076, 0.2684, 0.2437, 0.7296], [0.341175, 0.211593, 0.114407], 0.347934),
        ([1.3078, 2.4042, 1.2844, 5.2995], [1.08333, 0.627277, 0.285238], 0.309658),
        ([0.6014, 1.3393, 1.0702, -0.3068], [0.12726, 0.0918613, 0.0653125], 0.0751485),
        ([0.926, 1.0613, 0.7744, 4.0453], [1.39888, 0.799408, 0.349803], 1.01889),
        ([0.7419, -1.0277, 0.6299, 2.6544], [0.635951, 0.375463, 0.180096], 0.530003),
        ([0.272, -2.2098, 0.1922, 1.0807], [0.856238, 0.497587, 0.2286], 0.848953),
        ([0.3858, -1.8952, 0.8703, -0.0936], [0.197481, 0.132077, 0.0830239], 0.142996),
        ([1.1898, -1.824, 1.0804, 1.4305], [2.79362, 1.57453, 0.660214], 1.30927),
        ([1.3206, -0.0075, 0.8839, 0.3835], [0.0977195, 0.0763047, 0.0602437], 0.0826479),
        ([0.2759, 0.0096, 0.2609, 3.2964], [0.893416, 0.518321, 0.236999], 0.904482),
        ([0.4738, -2.2875, 0.2022, 1.8533], [0.502969, 0.301577, 0.150532], 0.508013),
        ([1.3908, 0.1272, 1.5, 2.9013], [0.344764, 0.217215, 0.121554], 0.0252779),
        ([0.093, -1.8062, 1.2582, -0.0435], [0.156872, 0.108536, 0.0722836], 0.0553556),
        ([0.9537, 1.7437, 0.8689, 5.2507], [0.88125, 0.511619, 0.234395], 0.586269),
        ([0.2713, 3.101, 0.0152, 1.1995], [0.643822, 0.379787, 0.181762], 0.650123),
        ([1.2769, -1.6876, 1.1043, 1.1845], [1.14049, 0.655844, 0.292361], 0.515312),
        ([0.6198, 2.7773, 0.173, 2.7899], [0.206762, 0.137108, 0.0848666], 0.230316),
        ([0.0663, 2.7535, 0.0712, 5.6692], [0.847401, 0.492786, 0.226824], 0.935444),
        ([0.9828, 0.8063, 1.1692, -2.1776], [1.92839, 1.09502, 0.469986], 0.752619),
        ([0.5817, 0.7143, 0.5329, 3.5975], [0.997194, 0.576045, 0.260183], 0.870616),
        ([0.3226, 0.9483, 0.0694, -1.6056], [0.652209, 0.384381, 0.183509], 0.658122),
        ([0.4407, -1.5174, 0.3457, 1.7798], [0.918532, 0.532341, 0.242698], 0.871103),
        ([0.427, -1.1044, 0.1787, -1.6176], [0.307146, 0.192907, 0.107227], 0.32137),
        ([0.8767, 1.4514, 0.7792, 4.3567], [1.22788, 0.704376, 0.31175], 0.889992),
        ([0.1228, -2.6938, 1.1009, -0.0271], [0.199966, 0.133503, 0.0836554], 0.100522),
        ([0.6163, 0.8392, 0.4952, 4.1029], [1.03271, 0.595623, 0.267805], 0.929756),
        ([0.6041, -0.1912, 0.3948, 0.5497], [0.156397, 0.108642, 0.0728258], 0.172049),
        ([0.2975, 0.2174, 0.4727, 3.2277], [0.837709, 0.487511, 0.224862], 0.748001),
        ([1.2811, -2.3676, 0.3086, 1.3838], [0.232818, 0.151083, 0.0897811], 0.254006),
        ([0.4379, -2.3944, 0.4646, 0.5098], [0.958581, 0.554839, 0.252033], 0.858397),
        ([1.371, 1.7728, 0.5371, -1.9329], [0.31229, 0.194509, 0.106174], 0.292199),
        ([1.2574, 1.8073, 1.2207, 5.1207], [2.26392, 1.281, 0.543809], 0.762089),
        ([0.7573, -2.6136, 0.1085, 0.6004], [0.31107, 0.194679, 0.107386], 0.337997),
        ([1.0624, 0.8058, 1.1807, 3.9799], [3.35407, 1.8868, 0.786348], 1.28663),
        ([0.5403, -1.4663, 1.2095, -2.2128], [0.0843257, 0.0653294, 0.0510822], 0.0388975),
        ([0.3014, 1.3451, 0.1017, 4.456], [0.739305, 0.432756, 0.202843], 0.74102),
        ([0.3175, -2.1655, 0.7139, 0.4657], [0.497794, 0.298804, 0.149561], 0.385906),
        ([0.5028, 0.5745, 0.5842, 3.8711], [1.04303, 0.601762, 0.270809], 0.877673),
        ([0.0803, -2.4104, 1.1335, -0.8113], [0.158118, 0.109286, 0.0726614], 0.0767345),
        ([0.7146, -0.3085, 0.7825, 2.9828], [1.32265, 0.757081, 0.332901], 0.951052),
        ([0.491, -0.4993, 0.3834, 1.5156], [0.421061, 0.256109, 0.132394], 0.406329),
        ([1.0184, -0.7299, 1.1741, 2.2009], [1.60851, 0.917373, 0.399017], 0.622693),
        ([0.8373, 2.5232, 1.3779, -2.8186], [0.0686116, 0.0526856, 0.0407411], 0.0173588),
        ([0.5506, -2.8881, 0.3898, 0.4138], [0.901932, 0.523062, 0.23891], 0.848779),
        ([0.1251, 1.9564, 0.888, -1.2401], [0.263616, 0.168845, 0.0977662], 0.178234),
        ([1.1387, -2.8962, 1.2085, 0.2346], [4.28592, 2.40501, 0.994319], 1.53466),
        ([0.7273, 1.3202, 0.8544, -2.9095], [0.201816, 0.134417, 0.0838681], 0.152316),
        ([0.3985, 1.2956, 0.3934, 4.4059], [0.975777, 0.564132, 0.255398], 0.94756),
        ([1.3496, -2.8303, 0.8021, 2.5741], [0.10058, 0.0768389, 0.0590332], 0.0924356),
        ([1.0159, -1.3762, 1.404, 1.7454], [3.04874, 1.72105, 0.725282], 0.500008),
        ([1.2697, 2.2995, 1.1047, -0.7819], [3.74682, 2.10416, 0.872156], 1.67193),
        ([1.1556, 3.0151, 1.1764, 5.9069], [1.37072, 0.784403, 0.344664], 0.52904),
        ([1.0442, -2.7628, 0.872, -2.4277], [0.0853202, 0.0685632, 0.0559954], 0.076595),
        ([0.9701, 1.5925, 0.954, 4.7055], [2.24937, 1.2718, 0.538629], 1.37009),
        ([1.0234, 1.8078, 0.1678, -1.101], [0.24025, 0.155203, 0.0914166], 0.269294),
        ([0.0801, -1.6657, 0.01, 1.6478], [0.826674, 0.481203, 0.222099], 0.845574),
        ([0.5828, 2.3401, 0.7319, -0.9456], [1.10378, 0.635442, 0.28419], 0.829393),
        ([1.1344, 2.2891, 1.1808, 5.3428], [3.38767, 1.90493, 0.792868], 1.28742),
        ([0.7694, -1.5533, 1.1673, -0.8458], [0.0735891, 0.0582045, 0.0466661], 0.0392194),
        ([0.2629, 0.8121, 0.0856, 3.8151], [0.756037, 0.442076, 0.206604], 0.758731),
        ([0.1904, -0.1221, 0.0057, 1.8179], [0.730902, 0.42816, 0.201103], 0.7352),
        ([0.109, -2.8931, 0.1372, 0.3372], [0.853142, 0.495991, 0.228128], 0.850853),
        ([1.0643, -2.9553, 0.9335, -2.7329], [0.0862089, 0.0695316, 0.0570235], 0.071637),
        ([0.0155, 2.1639, 0.01, 5.3853], [0.845454, 0.491848, 0.226644], 1.18339),
    ];
    #[rustfmt::skip]
    const ANISO: &[Case] = &[
        ([0.9277, 2.9705, 0.6884, 2.2192], [0.0718277, 0.0611385, 0.0531216], 0.0850987),
        ([1.1916, 0.5448, 1.1706, 3.8658], [1.65135, 0.940571, 0.407484], 0.667811),
        ([0.6368, 0.9241, 0.4457, -1.7799], [0.457087, 0.275928, 0.14006], 0.458393),
        ([0.1542, 1.9133, 0.0107, 5.0402], [0.60201, 0.356329, 0.172068], 0.664355),
        ([0.6866, 1.1722, 0.1755, 1.5441], [0.295236, 0.186084, 0.10422], 0.336096),
        ([0.2129, 2.8802, 0.1803, 6.1434], [0.639963, 0.377607, 0.18084], 0.725169),
        ([0.7236, -2.6007, 0.4053, -1.3479], [0.185438, 0.125052, 0.0797634], 0.20962),
        ([0.2394, -0.5271, 0.1753, 2.8754], [0.635105, 0.374806, 0.179581], 0.684169),
        ([1.0542, -0.4541, 0.2891, -2.3779], [0.162294, 0.111889, 0.0740843], 0.197064),
        ([0.6039, 0.9637, 0.4863, 3.9467], [0.779116, 0.454171, 0.210462], 0.751578),
        ([1.232, -1.0561, 0.6771, -2.1345], [0.247461, 0.159119, 0.0928625], 0.22218),
        ([0.8476, -2.8754, 0.6992, 0.3257], [0.960571, 0.555802, 0.252225], 0.798701),
        ([0.0022, -0.4916, 0.621, 0.2582], [0.176041, 0.119336, 0.076807], 0.174918),
        ([0.1807, -0.0109, 0.1341, 3.2812], [0.626373, 0.369988, 0.177699], 0.677506),
        ([0.4391, 1.341, 1.1437, -3.0535], [0.0914746, 0.0685502, 0.0513569], 0.0509523),
        ([0.3126, -1.3594, 0.4914, 2.1117], [0.555583, 0.330867, 0.16233], 0.534951),
        ([0.4163, -2.1313, 1.0817, 1.1528], [0.599665, 0.356352, 0.173867], 0.307224),
        ([0.4421, 2.3635, 0.0874, 5.6565], [0.440105, 0.266625, 0.136514], 0.486837),
        ([1.372, 0.0543, 0.1979, 0.6118], [0.0791805, 0.0641226, 0.0528293], 0.116799),
        ([0.0244, 1.9983, 0.01, 5.4139], [0.622427, 0.367909, 0.17702], 0.740443),
        ([1.3143, -1.982, 1.4472, 2.2638], [0.0781249, 0.0637574, 0.0529817], 0.0134553),
        ([0.4776, -2.8204, 0.352, 0.5342], [0.625711, 0.36973, 0.177744], 0.642623),
        ([0.3954, 2.3728, 0.0529, 2.6544], [0.335576, 0.208421, 0.113054], 0.378894),
        ([0.6514, 1.4954, 0.5463, 4.6227], [0.824432, 0.479182, 0.220245], 0.778508),
        ([0.7368, 0.0478, 0.48, -1.2232], [0.0992211, 0.0764819, 0.0594275], 0.121463),
        ([0.1293, 0.0138, 0.077, 2.7382], [0.61207, 0.361939, 0.174342], 0.688648),
        ([1.4021, -1.1341, 0.169, 2.1095], [0.300951, 0.188863, 0.104798], 0.314078),
        ([1.3641, 0.9372, 1.3473, 4.2504], [0.874359, 0.541859, 0.292483], 0.194771),
        ([0.5365, 2.6679, 0.1498, -2.2777], [0.181831, 0.122428, 0.0778762], 0.217527),
        ([0.048, -0.0269, 0.0595, 2.8278], [0.623419, 0.368395, 0.177127], 0.76628),
        ([0.9236, 0.6453, 0.7336, -2.6728], [1.09319, 0.629057, 0.28096], 0.877395),
        ([0.1412, 0.9054, 0.1795, 3.7921], [0.622717, 0.368045, 0.177042], 0.679529),
        ([0.3542, -1.4621, 0.2038, 1.0211], [0.552407, 0.328831, 0.161148], 0.593677),
        ([1.0435, -2.3126, 1.2456, 0.9234], [2.31491, 1.31182, 0.559494], 0.776037),
        ([1.2613, -1.4688, 0.9343, 0.8547], [0.102242, 0.0753661, 0.0552094], 0.0778915),
        ([1.3657, 1.4006, 1.3625, 4.1971], [0.101046, 0.0727942, 0.0516052], 0.024584),
        ([1.0738, -0.9883, 0.954, -2.4029], [0.26049, 0.167013, 0.0969052], 0.177398),
        ([0.9376, -0.7216, 0.7437, 2.4709], [1.09657, 0.630939, 0.281715], 0.873075),
        ([0.5687, -0.2358, 0.4849, -2.5288], [0.53985, 0.321954, 0.158532], 0.525767),
        ([0.4642, 2.3666, 0.6028, 5.4494], [0.762743, 0.446207, 0.208806], 0.687651),
        ([1.1556, -2.7942, 0.2379, 2.8666], [0.075508, 0.0624718, 0.0526946], 0.111141),
        ([0.4058, 1.7503, 0.5354, 4.6842], [0.688901, 0.404905, 0.191909], 0.644497),
        ([1.2701, -1.6435, 1.0309, -3.1038], [0.0908514, 0.0708751, 0.0558929], 0.06318),
        ([1.2548, -0.537, 1.174, 2.631], [3.29638, 1.85181, 0.768379], 1.33572),
        ([0.1522, -2.1683, 0.6617, -1.5491], [0.379555, 0.23329, 0.123591], 0.335388),
        ([0.9396, -1.9442, 1.184, 1.2926], [1.64822, 0.940241, 0.409254], 0.654104),
        ([0.4147, 0.4877, 0.9444, 2.6579], [0.285397, 0.180791, 0.102336], 0.194384),
        ([0.8493, -0.3866, 0.8183, 2.5487], [1.05044, 0.605754, 0.272242], 0.779515),
        ([0.434, -2.0913, 0.7184, -0.747], [0.276646, 0.175833, 0.100224], 0.242091),
        ([0.2303, 0.1879, 0.01, 3.5866], [0.474151, 0.285586, 0.144162], 0.523975),
        ([0.0833, 1.3028, 0.8166, 1.582], [0.366899, 0.226118, 0.120532], 0.282421),
        ([1.3554, 0.0688, 1.3789, 3.2007], [9.02238, 5.03884, 2.05118], 1.70786),
        ([1.4383, -0.9693, 0.6158, -0.1603], [0.0844122, 0.0683585, 0.0563183], 0.0926186),
        ([0.9277, -2.7585, 0.9383, 0.6166], [1.20267, 0.69054, 0.306444], 0.767919),
        ([0.8207, 0.4497, 0.8751, -2.9875], [0.995121, 0.575303, 0.260439], 0.689613),
        ([0.4764, 1.496, 0.3613, 4.4257], [0.677824, 0.398345, 0.188736], 0.695989),
        ([0.981, 3.0342, 0.0057, -2.3959], [0.102496, 0.0786165, 0.0607072], 0.143772),
        ([0.1287, -1.8453, 0.2128, 1.7301], [0.610836, 0.361412, 0.174345], 0.657438),
        ([1.2787, -0.1625, 0.358, -1.3062], [0.085689, 0.069111, 0.0566776], 0.120007),
        ([0.6118, -1.2098, 0.4511, 2.2286], [0.716398, 0.419841, 0.197423], 0.705694),
        ([1.4052, 0.3928, 0.1369, 2.5689], [0.118066, 0.0859613, 0.0618824], 0.152074),
        ([0.526, -0.744, 0.444, 2.4974], [0.74998, 0.438126, 0.204236], 0.750302),
        ([0.5357, -0.485, 0.5518, 1.0829], [0.125352, 0.0911811, 0.0655533], 0.138501),
        ([1.3768, -2.8713, 1.191, 0.0772], [3.18174, 1.78969, 0.745656], 1.16694),
        ([1.2703, 1.3988, 0.1551, -0.3311], [0.265854, 0.169765, 0.0976979], 0.295272),
        ([1.0981, 0.3395, 1.058, 3.7618], [1.15615, 0.664849, 0.296373], 0.616134),
        ([0.504, -2.4904, 0.5237, -3.044], [0.0913994, 0.0713387, 0.0562932], 0.109418),
        ([1.4477, -2.2826, 1.2431, 1.0087], [1.05247, 0.616559, 0.289626], 0.308138),
        ([1.2866, -1.9655, 1.4458, -0.6752], [0.323613, 0.204916, 0.115893], 0.0457067),
        ([1.425, -1.0385, 1.3372, 2.3558], [0.393085, 0.243996, 0.132179], 0.0876832),
        ([1.2767, -1.7751, 0.4603, 0.403], [0.362385, 0.223066, 0.118578], 0.355153),
        ([1.2602, 2.2319, 1.4369, 5.3439], [6.82923, 3.84297, 1.60328], 0.888653),
        ([1.351, 2.2857, 0.339, 0.8101], [0.226774, 0.148001, 0.0889214], 0.242887),
        ([1.0618, 0.928, 1.2059, 3.8226], [0.76977, 0.453047, 0.215505], 0.294754),
        ([0.7028, 1.4914, 0.8353, 2.5505], [0.142554, 0.101039, 0.0699031], 0.122931),
        ([0.7111, -0.3188, 0.7434, 3.0076], [0.980933, 0.567284, 0.257048], 0.78197),
        ([1.3553, -2.6065, 0.875, -0.08], [0.80025, 0.466445, 0.216091], 0.539997),
        ([1.0937, -2.8611, 0.6458, 0.1578], [0.584587, 0.346965, 0.168749], 0.524159),
        ([0.0695, -1.0206, 0.0398, -1.2108], [0.604614, 0.357854, 0.172784], 0.668848),
        ([0.3616, 0.7487, 0.2832, 3.8843], [0.662639, 0.389869, 0.185292], 0.697655),
        ([0.9577, 0.2157, 1.1296, 2.9635], [1.11721, 0.643851, 0.288829], 0.515862),
        ([0.6969, 2.901, 0.8941, 5.909], [0.982176, 0.568164, 0.257655], 0.662001),
        ([0.4572, 2.6576, 0.5595, 0.7848], [0.484354, 0.291388, 0.146663], 0.454598),
        ([1.2463, 2.0706, 1.2398, 5.3729], [1.34452, 0.773337, 0.344952], 0.440674),
        ([0.6273, 2.5039, 0.2326, -2.3331], [0.147737, 0.103309, 0.0699882], 0.180132),
        ([0.4533, -1.6668, 0.4789, 1.3403], [0.721098, 0.422929, 0.199301], 0.710046),
        ([0.3149, 2.3561, 1.2788, -2.364], [0.0769822, 0.0613805, 0.0496793], 0.0311287),
        ([1.1114, 0.4314, 1.2616, 3.4201], [1.95519, 1.10991, 0.475945], 0.640821),
        ([0.8805, 0.2077, 0.7695, -1.997], [0.205756, 0.137061, 0.0855406], 0.179918),
        ([1.1966, 0.2541, 1.0653, 3.8163], [0.615519, 0.36484, 0.17683], 0.33121),
        ([0.5762, 2.6543, 0.664, -1.9195], [0.124012, 0.0907285, 0.0657662], 0.127377),
        ([0.6739, -0.6665, 0.6285, 2.3946], [0.884136, 0.513138, 0.234889], 0.783331),
        ([0.1948, -1.2904, 1.0747, 0.6409], [0.105867, 0.0795644, 0.0598376], 0.0671771),
        ([0.6037, -0.5424, 0.6489, 2.029], [0.522114, 0.312159, 0.154692], 0.458201),
        ([1.0043, 1.9896, 0.6228, -1.9182], [0.164574, 0.112408, 0.0732847], 0.164456),
        ([0.3488, -1.5912, 0.3351, 1.5382], [0.683575, 0.401673, 0.190246], 0.745764),
        ([1.3871, 2.7612, 1.1263, 1.8435], [0.101943, 0.0772087, 0.0586581], 0.0609107),
        ([0.4539, 1.6221, 0.3631, 4.518], [0.659296, 0.388317, 0.185083], 0.678492),
        ([1.0542, -2.9447, 0.5559, 0.6027], [0.28379, 0.179258, 0.100859], 0.285616),
        ([1.2275, 0.3972, 1.2157, 3.6216], [3.24713, 1.82741, 0.762612], 1.17538),
        ([1.2063, 0.7517, 0.261, -2.6705], [0.231035, 0.150058, 0.0893242], 0.263559),
        ([0.07, -1.4463, 0.2756, 1.9259], [0.584078, 0.346633, 0.168549], 0.615453),
        ([1.1451, 0.1916, 1.1126, -1.5287], [0.0920942, 0.0752132, 0.0625525], 0.0612323),
        ([0.826, 2.4299, 0.5782, 5.235], [0.468337, 0.282386, 0.142924], 0.435307),
        ([0.4125, -0.0662, 0.9915, 0.5897], [0.0708738, 0.0593065, 0.050631], 0.0570244),
        ([0.9006, 2.2906, 1.0617, 5.4702], [1.40525, 0.803474, 0.352142], 0.732518),
        ([1.375, -0.3506, 0.5188, 2.517], [0.210567, 0.138168, 0.083869], 0.215263),
        ([1.3648, 1.7154, 1.2176, 4.5532], [0.246074, 0.157941, 0.0918402], 0.0910728),
        ([0.083, -0.3863, 0.3149, 1.4148], [0.529205, 0.315999, 0.156096], 0.554643),
        ([0.8868, 2.7413, 0.5655, 5.8834], [0.62436, 0.368975, 0.177436], 0.583488),
    ];
}
