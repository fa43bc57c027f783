//! LBNL WINDOW XML, as WINDOW, Radiance's genBSDF and gonio-photometers write it: matrices over the patches of Klems
//! (1994, "A New Method for Predicting the Solar Heat Gain of Complex Fenestration Systems"), and tensor trees (Ward,
//! Kurt and Bonneel 2012, "A Practical Framework for Sharing and Rendering Real-World Bidirectional Scattering
//! Distribution Functions").
//!
//! f in 1/sr. Of the two sides of a pane the one is read that is called `Reflection Front`, or if there is none
//! `Reflection Back`; either is seen from where it faces, x to the right, y up. A patch or a leaf is read at its
//! middle, large leaves in several places.

use super::{HORIZON, MAX_READINGS, Measurement, Reading, from_xyz};
use crate::formats::support::{Feature, Support, find};
use crate::{Error, Place};
use glam::{Vec2, Vec3};
use roxmltree::{Document, Node, ParsingOptions};
use std::f32::consts::{PI, TAU};
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_optics::frame::spherical;
use yugen_optics::warp::concentric_disc;

/// What is read.
pub const FEATURES: &[Feature] = &[
    Feature::yes("Columns"),
    Feature::yes("Rows"),
    Feature::yes("TensorTree3"),
    Feature::yes("TensorTree4"),
    Feature::yes("LBNL/Klems Full, Half, Quarter"),
    Feature::yes("AngleBasis of other names"),
    Feature::yes("LBNL/Shirley-Chiu"),
    Feature::yes("Reflection Front"),
    Feature::partly("Reflection Back", "read where there is no Reflection Front"),
    Feature::no("Transmission Front", "tables of readings reflect; what goes through is not read"),
    Feature::no("Transmission Back", "tables of readings reflect; what goes through is not read"),
    Feature::yes("Visible"),
    Feature::yes("CIE-X"),
    Feature::yes("CIE-Z"),
    Feature::yes("CIE-u"),
    Feature::yes("CIE-v"),
    Feature::no("Solar, NIR and other ranges", "they have no colour"),
];

/// Rings of patches: polar angles in degrees where they begin, and how many there are around; the last one ends at 90.
const BASES: [(&str, &[(f32, usize)]); 3] = [
    (
        "LBNL/Klems Full",
        &[(0., 1), (5., 8), (15., 16), (25., 20), (35., 24), (45., 24), (55., 24), (65., 16), (75., 12)],
    ),
    ("LBNL/Klems Half", &[(0., 1), (6.5, 8), (19.5, 12), (32.5, 16), (46.5, 20), (61.5, 12), (76.5, 4)]),
    ("LBNL/Klems Quarter", &[(0., 1), (9., 8), (27., 12), (46., 12), (66., 8)]),
];
/// Patches of a hemisphere.
const MAX_PATCHES: usize = 4096;
/// Splits of a tree: a leaf is 1/4096 of the square wide.
const MAX_DEPTH: usize = 12;

/// Somewhere in the file.
#[derive(Clone, Copy)]
struct Here<'a> {
    file: &'a Path,
    text: &'a str,
}

impl Here<'_> {
    fn wrong(self, node: Node, problem: impl Into<String>) -> Error {
        Error::invalid(Place::in_text(self.file, self.text, node.range().start), problem)
    }
}

fn child<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    let found = node.children().find(|c| c.has_tag_name(name));
    found.and_then(|c| c.text()).map(str::trim).filter(|t| !t.is_empty())
}

/// The data of one side, by channel: Visible, CIE-X, CIE-Z, CIE-u, CIE-v.
type Side<'a, 'i> = [Option<Node<'a, 'i>>; 5];
const CHANNELS: [&str; 5] = ["Visible", "CIE-X", "CIE-Z", "CIE-u", "CIE-v"];
const SIDES: [&str; 2] = ["Reflection Front", "Reflection Back"];

/// The readings of a file, colours in `space`.
pub fn read(bytes: &[u8], file: &Path, space: ColourSpace) -> Result<Measurement, Error> {
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
    let text = std::str::from_utf8(bytes).map_err(|e| {
        Error::invalid(
            Place::byte(file, e.valid_up_to() as u64),
            "this is not text in UTF-8; convert it to that encoding",
        )
    })?;
    let here = Here { file, text };
    let options = ParsingOptions { allow_dtd: false, nodes_limit: 1 << 18, ..ParsingOptions::default() };
    let tree = Document::parse_with_options(text, options).map_err(|e| {
        let at = e.pos();
        Error::invalid(
            Place::line(file, at.row as usize, at.col as usize),
            format!("not well-formed XML: {e}"),
        )
    })?;
    let whole = |problem: String| Error::invalid(Place::file(file), problem);
    let Some(definition) = tree.descendants().find(|n| n.has_tag_name("DataDefinition")) else {
        return Err(whole(
            "has no <DataDefinition>; expected <WindowElement> with <Optical>, <Layer>".into(),
        ));
    };
    let layer = definition.parent().unwrap_or(tree.root_element());
    let structure = child(definition, "IncidentDataStructure").unwrap_or_default();
    let known = ["Columns", "Rows", "TensorTree3", "TensorTree4"];
    let Some(structure) = known.iter().copied().find(|s| s.eq_ignore_ascii_case(structure)) else {
        let short: String = structure.chars().take(40).collect();
        let problem = format!("<IncidentDataStructure> is '{short}'; expected {}", known.join(", "));
        return Err(here.wrong(definition, problem));
    };
    let mut sides: [Side; 2] = Default::default();
    let mut left_out: Vec<String> = Vec::new();
    for data in layer.children().filter(|n| n.has_tag_name("WavelengthData")) {
        let range = child(data, "Wavelength").unwrap_or_default();
        let channel = CHANNELS.iter().position(|c| c.eq_ignore_ascii_case(range));
        for block in data.children().filter(|n| n.has_tag_name("WavelengthDataBlock")) {
            let direction = child(block, "WavelengthDataDirection").unwrap_or_default();
            let side = SIDES.iter().position(|s| s.eq_ignore_ascii_case(direction));
            match (side, channel) {
                (Some(side), Some(channel)) => sides[side][channel] = Some(block),
                _ => {
                    // Words of the file, which may be any.
                    let named: String = format!("{direction}, {range}").chars().take(80).collect();
                    if left_out.len() < 64 && !left_out.contains(&named) {
                        left_out.push(named);
                    }
                }
            }
        }
    }
    let Some(side) = (0..2).find(|s| sides[*s][0].is_some()) else {
        let why = match find(FEATURES, "Transmission Front").map(|f| f.support) {
            Some(Support::No(why)) if left_out.iter().any(|l| l.starts_with("Transmission")) => why,
            _ => "it has none in the range 'Visible'",
        };
        let held = if left_out.is_empty() { "nothing".into() } else { left_out.join("; ") };
        return Err(whole(format!("has no reflection to be read: {why}; the file holds: {held}")));
    };
    if side == 0 && sides[1][0].is_some() {
        left_out.push(SIDES[1].into());
    }
    let (front, blocks) = (side == 0, sides[side]);
    let (readings, isotropic) = match structure {
        "TensorTree3" => (trees(here, &blocks, 3, front, space)?, Some(true)),
        "TensorTree4" => (trees(here, &blocks, 4, front, space)?, None),
        _ => (matrices(here, definition, &blocks, structure == "Rows", front, space)?, None),
    };
    Measurement::new("LBNL WINDOW XML", readings, isotropic, left_out, file)
}

/// A direction of the file's frame, which is that of the back, as the side sees it.
fn seen(front: bool, w: Vec3) -> Vec3 {
    if front { Vec3::new(-w.x, w.y, w.z) } else { w }
}

fn data<'a>(here: Here, block: Node<'a, '_>) -> Result<&'a str, Error> {
    child(block, "ScatteringData").ok_or_else(|| here.wrong(block, "has no <ScatteringData>"))
}

/// The middle of each patch of a basis with its projected solid angle.
fn patches(here: Here, definition: Node, block: Node, which: &str) -> Result<Vec<(Vec3, f32)>, Error> {
    let name = child(block, which).unwrap_or_default();
    let custom = definition.children().find(|n| {
        n.has_tag_name("AngleBasis")
            && child(*n, "AngleBasisName").is_some_and(|b| b.eq_ignore_ascii_case(name))
    });
    // Bounds and counts.
    let mut rings: Vec<(f32, f32, usize)> = Vec::new();
    if let Some((_, ring)) = BASES.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)) {
        let ends = ring.iter().skip(1).map(|r| r.0).chain([90.0]);
        rings.extend(ring.iter().zip(ends).map(|((low, n), high)| (*low, high, *n)));
    } else if let Some(custom) = custom {
        for ring in custom.children().filter(|n| n.has_tag_name("AngleBasisBlock")) {
            let bound = |name: &str| {
                let bounds = ring.children().find(|n| n.has_tag_name("ThetaBounds"))?;
                child(bounds, name)?.parse::<f32>().ok().filter(|a| (0.0..=90.0).contains(a))
            };
            let count = child(ring, "nPhis").and_then(|n| n.parse::<usize>().ok());
            match (bound("LowerTheta"), bound("UpperTheta"), count) {
                (Some(low), Some(high), Some(n)) if low < high && (1..=MAX_PATCHES).contains(&n) => {
                    rings.push((low, high, n));
                }
                _ => {
                    let problem =
                        "expected <ThetaBounds> with <LowerTheta> below <UpperTheta>, 0 to 90, and <nPhis>";
                    return Err(here.wrong(ring, problem));
                }
            }
            if rings.iter().map(|r| r.2).sum::<usize>() > MAX_PATCHES {
                return Err(here.wrong(ring, format!("the basis has more than {MAX_PATCHES} patches")));
            }
        }
    }
    if rings.is_empty() {
        let short: String = name.chars().take(40).collect();
        let known: Vec<_> = BASES.iter().map(|b| b.0).collect();
        let problem =
            format!("<{which}> is '{short}'; expected {}, or an <AngleBasis> of that name", known.join(", "));
        return Err(here.wrong(block, problem));
    }
    let mut all = Vec::new();
    for (low, high, n) in rings {
        let [a, b] = [low, high].map(|t| t.to_radians().cos());
        let share = PI * (a * a - b * b) / n as f32;
        // One patch about the pole has its middle there.
        let theta = if low == 0.0 && n == 1 { 0.0 } else { 0.5 * (low + high) };
        all.extend((0..n).map(|k| (spherical(theta.to_radians(), TAU * k as f32 / n as f32), share)));
    }
    Ok(all)
}

fn matrices(
    here: Here,
    definition: Node,
    blocks: &Side,
    rows: bool,
    front: bool,
    space: ColourSpace,
) -> Result<Vec<Reading>, Error> {
    let [visible, x, z, ..] = *blocks;
    let Some(visible) = visible else { return Ok(Vec::new()) };
    // The incident directions are always of the basis of the columns.
    let incident = patches(here, definition, visible, "ColumnAngleBasis")?;
    let outgoing = patches(here, definition, visible, "RowAngleBasis")?;
    let (n_in, n_out) = (incident.len(), outgoing.len());
    if n_in * n_out > MAX_READINGS {
        return Err(here.wrong(visible, format!("has more than {MAX_READINGS} readings")));
    }
    let numbers = |block: Node| -> Result<Vec<f32>, Error> {
        let mut all = Vec::new();
        for word in data(here, block)?.split([',', ' ', '\t', '\n', '\r']).filter(|w| !w.is_empty()) {
            let v = word.parse().ok().filter(|v: &f32| v.is_finite());
            let short = || word.chars().take(40).collect::<String>();
            all.push(v.ok_or_else(|| here.wrong(block, format!("'{}' is not a finite number", short())))?);
            if all.len() > n_in * n_out {
                break;
            }
        }
        if all.len() != n_in * n_out {
            let problem = format!(
                "<ScatteringData> has {} numbers; its bases of {n_in} and {n_out} patches make {}",
                if all.len() > n_in * n_out { "more".into() } else { all.len().to_string() },
                n_in * n_out
            );
            return Err(here.wrong(block, problem));
        }
        Ok(all)
    };
    let y = numbers(visible)?;
    let colours = match (x, z) {
        (Some(x), Some(z)) => Some((numbers(x)?, numbers(z)?)),
        _ => None,
    };
    let to_space = from_xyz(space);
    let mut readings = Vec::with_capacity(n_in * n_out);
    for (i, (light, share_i)) in incident.iter().enumerate() {
        for (o, (eye, share_o)) in outgoing.iter().enumerate() {
            let at = if rows { i * n_out + o } else { o * n_in + i };
            let f = match &colours {
                Some((x, z)) => to_space * Vec3::new(x[at], y[at], z[at]),
                None => Vec3::splat(y[at]),
            };
            // Where light of that direction would go on to: a mirror has the diagonal.
            let light = Vec3::new(-light.x, -light.y, light.z);
            let cosines = (light.z * eye.z).max(HORIZON);
            readings.push(Reading {
                wi: seen(front, light),
                wo: seen(front, *eye),
                f: f.max(Vec3::ZERO),
                weight: share_i * share_o / cosines,
            });
        }
    }
    Ok(readings)
}

/// Of a tree over the cube of so many dimensions.
enum Tree {
    /// In order of the bits of a child's place, the first dimension the lowest.
    Split(Vec<Tree>),
    /// 2^log each way, the first dimension the slowest.
    Grid { log: u32, values: Vec<f32> },
}

impl Tree {
    /// `left`: how many more splits and numbers there may be.
    fn parse(rest: &mut &str, dimensions: u32, depth: usize, left: &mut usize) -> Result<Self, String> {
        let blank = |c: char| c.is_whitespace() || c == ',';
        *rest = rest.trim_start_matches(blank);
        *rest = rest.strip_prefix('{').ok_or("the tree lacks a '{'")?;
        *rest = rest.trim_start_matches(blank);
        let mut take = || match left.checked_sub(1) {
            Some(n) => {
                *left = n;
                Ok(())
            }
            None => Err(format!("the tree has more than {MAX_READINGS} splits and numbers; thin it out")),
        };
        take()?;
        let tree = if rest.starts_with('{') {
            if depth == MAX_DEPTH {
                return Err(format!("the tree is deeper than {MAX_DEPTH} splits"));
            }
            let children = (0..1 << dimensions).map(|_| Self::parse(rest, dimensions, depth + 1, left));
            Self::Split(children.collect::<Result<_, _>>()?)
        } else {
            let end = rest.find(['{', '}']).ok_or("the tree lacks a '}'")?;
            let mut values = Vec::new();
            for word in rest[..end].split(blank).filter(|w| !w.is_empty()) {
                take()?;
                let v = word.parse().ok().filter(|v: &f32| v.is_finite());
                values.push(v.ok_or_else(|| {
                    format!("'{}' is not a finite number", word.chars().take(40).collect::<String>())
                })?);
            }
            *rest = &rest[end..];
            let log = values.len().trailing_zeros() / dimensions;
            if values.is_empty()
                || values.len() != 1usize << (dimensions * log)
                || depth + log as usize > MAX_DEPTH
            {
                return Err(format!(
                    "a leaf has {} numbers; expected a power of {}",
                    values.len(),
                    1 << dimensions
                ));
            }
            Self::Grid { log, values }
        };
        *rest = rest.trim_start_matches(blank);
        *rest = rest.strip_prefix('}').ok_or("the tree lacks a '}'")?;
        Ok(tree)
    }

    fn of(here: Here, block: Node, dimensions: u32) -> Result<Self, Error> {
        let basis = child(block, "AngleBasis").unwrap_or_default();
        if !basis.eq_ignore_ascii_case("LBNL/Shirley-Chiu") {
            let short: String = basis.chars().take(40).collect();
            return Err(here.wrong(block, format!("<AngleBasis> is '{short}'; expected LBNL/Shirley-Chiu")));
        }
        let mut rest = data(here, block)?;
        let tree = Self::parse(&mut rest, dimensions, 0, &mut { MAX_READINGS })
            .map_err(|problem| here.wrong(block, problem))?;
        if !rest.trim_matches(|c: char| c.is_whitespace() || c == ',').is_empty() {
            return Err(here.wrong(block, "<ScatteringData> goes on behind its tree"));
        }
        Ok(tree)
    }

    fn at(&self, place: &[f32]) -> f32 {
        let mut place: [f32; 4] =
            std::array::from_fn(|k| place.get(k).map_or(0.0, |p| p.clamp(0.0, 0.999_999)));
        let mut tree = self;
        loop {
            match tree {
                Self::Split(children) => {
                    let dimensions = children.len().trailing_zeros() as usize;
                    let mut child = 0;
                    for (k, p) in place.iter_mut().enumerate().take(dimensions) {
                        let upper = *p >= 0.5;
                        child |= usize::from(upper) << k;
                        *p = 2.0 * *p - if upper { 1.0 } else { 0.0 };
                    }
                    tree = &children[child];
                }
                Self::Grid { log, values } => {
                    let side = 1usize << log;
                    // As many dimensions as make the count; a single value has any.
                    let dimensions = if *log == 0 { 0 } else { values.len().trailing_zeros() / log };
                    let index = place
                        .iter()
                        .take(dimensions as usize)
                        .fold(0, |index, p| index * side + ((p * side as f32) as usize).min(side - 1));
                    return values[index];
                }
            }
        }
    }

    /// Calls `each` with the middle and the width of every leaf, none wider than `widest`.
    fn visit(&self, low: [f32; 4], width: f32, n: usize, widest: f32, each: &mut impl FnMut([f32; 4], f32)) {
        match self {
            Self::Split(children) => {
                let half = 0.5 * width;
                for (c, child) in children.iter().enumerate() {
                    let corner = std::array::from_fn(|k| low[k] + if c >> k & 1 == 1 { half } else { 0.0 });
                    child.visit(corner, half, n, widest, each);
                }
            }
            Self::Grid { log, .. } => {
                let mut cells = 1usize << log;
                while width / cells as f32 > widest {
                    cells *= 2;
                }
                let step = width / cells as f32;
                for c in 0..cells.pow(n as u32) {
                    let middle = std::array::from_fn(|k| {
                        if k < n {
                            low[k] + step * ((c / cells.pow(k as u32) % cells) as f32 + 0.5)
                        } else {
                            0.0
                        }
                    });
                    each(middle, step);
                }
            }
        }
    }
}

fn trees(
    here: Here,
    blocks: &Side,
    dimensions: u32,
    front: bool,
    space: ColourSpace,
) -> Result<Vec<Reading>, Error> {
    let [visible, _, _, u, v] = *blocks;
    let Some(visible) = visible else { return Ok(Vec::new()) };
    let y = Tree::of(here, visible, dimensions)?;
    let chroma = match (u, v) {
        (Some(u), Some(v)) => Some((Tree::of(here, u, dimensions)?, Tree::of(here, v, dimensions)?)),
        _ => None,
    };
    let to_space = from_xyz(space);
    // Uniform leaves are read in as many places as tell a Lambertian surface from a hole.
    let widest = if dimensions == 3 { 1.0 / 16.0 } else { 1.0 / 8.0 };
    let mut readings = Vec::new();
    let mut full = false;
    let disc = |a: f32, b: f32| {
        let p = concentric_disc(Vec2::new(a, b));
        Vec3::new(p.x, p.y, (1.0 - p.length_squared()).max(0.0).sqrt())
    };
    y.visit([0.0; 4], 1.0, dimensions as usize, widest, &mut |at, width| {
        let (light, eye, share) = if dimensions == 3 {
            // One half is not used.
            let sine = 1.0 - 2.0 * at[0];
            if sine <= 0.0 {
                return;
            }
            let light = Vec3::new(-sine, 0.0, (1.0 - sine * sine).sqrt());
            (light, disc(at[1], at[2]), width.powi(3) * sine)
        } else {
            let light = disc(at[0], at[1]);
            (Vec3::new(-light.x, -light.y, light.z), disc(at[2], at[3]), width.powi(4))
        };
        if readings.len() == MAX_READINGS {
            full = true;
            return;
        }
        let luminance = y.at(&at[..dimensions as usize]);
        let f = match &chroma {
            None => Vec3::splat(luminance),
            Some((u, v)) => {
                let (u, v) = (u.at(&at[..dimensions as usize]), v.at(&at[..dimensions as usize]).max(1e-3));
                // CIE 1976 u′, v′ back to XYZ.
                let scale = luminance / (4.0 * v);
                to_space * Vec3::new(9.0 * u * scale, luminance, (12.0 - 3.0 * u - 20.0 * v) * scale)
            }
        };
        let cosines = (light.z * eye.z).max(HORIZON);
        let f = f.max(Vec3::ZERO);
        if f.is_finite() {
            readings.push(Reading {
                wi: seen(front, light),
                wo: seen(front, eye),
                f,
                weight: share / cosines,
            });
        }
    });
    match full {
        true => Err(here.wrong(visible, format!("has more than {MAX_READINGS} readings"))),
        false => Ok(readings),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_1_PI;
    use std::fmt::Write;

    const SRGB: ColourSpace = ColourSpace::LinearSrgb;

    fn of(text: &str) -> Result<Measurement, String> {
        read(text.as_bytes(), "a.xml".as_ref(), SRGB).map_err(|e| e.to_string())
    }

    fn xml(structure: &str, blocks: &str) -> String {
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<WindowElement xmlns=\"http://windows.lbl.gov\">\n<Optical><Layer>\n\
             <DataDefinition><IncidentDataStructure>{structure}</IncidentDataStructure></DataDefinition>\n{blocks}\n\
             </Layer></Optical></WindowElement>\n"
        )
    }

    fn block(range: &str, side: &str, basis: &str, data: &str) -> String {
        format!(
            "<WavelengthData><Wavelength unit=\"Integral\">{range}</Wavelength><WavelengthDataBlock>\
             <WavelengthDataDirection>{side}</WavelengthDataDirection><ColumnAngleBasis>{basis}</ColumnAngleBasis>\
             <RowAngleBasis>{basis}</RowAngleBasis><AngleBasis>{basis}</AngleBasis>\
             <ScatteringData>{data}</ScatteringData></WavelengthDataBlock></WavelengthData>\n"
        )
    }

    /// Of patch to patch; `f(incident, outgoing)` numbers them.
    fn matrix(n: usize, f: impl Fn(usize, usize) -> f32) -> String {
        let mut text = String::new();
        for o in 0..n {
            for i in 0..n {
                write!(text, "{:.6},\t", f(i, o)).unwrap();
            }
            text.push('\n');
        }
        text
    }

    #[test]
    fn a_lambertian_comes_back_of_every_basis() {
        for (basis, n) in [("LBNL/Klems Full", 145), ("LBNL/Klems Half", 73), ("LBNL/Klems Quarter", 41)] {
            for structure in ["Columns", "Rows"] {
                let text = xml(
                    structure,
                    &block("Visible", "Reflection Back", basis, &matrix(n, |_, _| 0.5 * FRAC_1_PI)),
                );
                let m = of(&text).unwrap();
                assert_eq!((m.readings.len(), m.isotropic), (n * n, true), "{basis}");
                let g = m.table();
                assert!(g.rgb.iter().all(|v| (v - 0.5 * FRAC_1_PI).abs() < 1e-5), "{basis}");
                // The projected solid angles make up both hemispheres, π each.
                let all: f32 = m.readings.iter().map(|r| r.weight * r.wo.z * r.wi.z).sum();
                assert!((all - PI * PI).abs() < 1e-3, "{basis}: {all}");
            }
        }
    }

    #[test]
    fn a_mirror_is_the_diagonal() {
        let one = |i: usize, o: usize| if i == o { 1.0 } else { 0.0 };
        for side in SIDES {
            let m =
                of(&xml("Columns", &block("Visible", side, "LBNL/Klems Quarter", &matrix(41, one)))).unwrap();
            for r in m.readings.iter().filter(|r| r.f.x > 0.5) {
                assert!(((r.wi + r.wo).normalize() - Vec3::Z).length() < 1e-5, "{r:?}");
            }
        }
        // Columns are of the light, rows of the eye, unless the file says otherwise.
        let text = block("Visible", "Reflection Back", "LBNL/Klems Quarter", &matrix(41, |i, _| i as f32));
        let light = |structure: &str| {
            let m = of(&xml(structure, &text)).unwrap();
            m.readings.iter().find(|r| r.wi.z > 0.999 && r.wo.z < 0.9).unwrap().f.x
        };
        assert_eq!(light("Columns"), 0.0);
        assert!(light("Rows") > 0.0);
        // The first of a ring is at azimuth 0 for the eye, which is +x of the back and −x of the front.
        for (side, x) in [(SIDES[1], 1.0), (SIDES[0], -1.0)] {
            let first = |_: usize, o: usize| if o == 1 { 1.0 } else { 0.0 };
            let m = of(&xml("Columns", &block("Visible", side, "LBNL/Klems Quarter", &matrix(41, first))))
                .unwrap();
            let r = m.readings.iter().find(|r| r.f.x > 0.5).unwrap();
            assert!(
                (r.wo - Vec3::new(x * 18f32.to_radians().sin(), 0.0, 18f32.to_radians().cos())).length()
                    < 1e-5
            );
        }
    }

    #[test]
    fn bases_of_other_names_say_their_patches() {
        let ring = |low: f32, high: f32, n: usize| {
            format!(
                "<AngleBasisBlock><Theta>{}</Theta><nPhis>{n}</nPhis><ThetaBounds><LowerTheta>{low}</LowerTheta>\
                 <UpperTheta>{high}</UpperTheta></ThetaBounds></AngleBasisBlock>",
                0.5 * (low + high)
            )
        };
        let basis = format!(
            "</IncidentDataStructure><AngleBasis><AngleBasisName>mine</AngleBasisName>{}{}</AngleBasis><IncidentDataStructure>",
            ring(0.0, 20.0, 1),
            ring(20.0, 80.0, 4)
        );
        let text = xml(
            "Columns",
            &block("Visible", "Reflection Front", "mine", &matrix(5, |i, o| (i * 5 + o) as f32)),
        );
        let text = text.replace("</IncidentDataStructure>", &basis.replace("<IncidentDataStructure>", ""));
        let m = of(&text).unwrap();
        assert_eq!(m.readings.len(), 25);
        assert!((m.readings[6].wi.z - 50f32.to_radians().cos()).abs() < 1e-6);
    }

    #[test]
    fn colours_and_what_is_left_out() {
        let data = matrix(41, |_, _| 0.25);
        let named = |range: &str, side: &str| block(range, side, "LBNL/Klems Quarter", &data);
        let text = xml(
            "Columns",
            &[
                named("Visible", "Reflection Front"),
                named("CIE-X", "Reflection Front"),
                named("CIE-Z", "Reflection Front"),
                named("Visible", "Reflection Back"),
                named("Visible", "Transmission Front"),
                named("Solar", "Reflection Front"),
            ]
            .concat(),
        );
        let m = of(&text).unwrap();
        assert!((m.readings[7].f - 0.25).abs().max_element() < 1e-5);
        assert_eq!(m.left_out, ["Transmission Front, Visible", "Reflection Front, Solar", "Reflection Back"]);
        let error = of(&xml("Columns", &named("Visible", "Transmission Back"))).unwrap_err();
        assert!(
            error.contains("what goes through is not read; the file holds: Transmission Back, Visible"),
            "{error}"
        );
    }

    #[test]
    fn trees_are_lambertian_mirrors_and_coloured() {
        let basis = "LBNL/Shirley-Chiu";
        for structure in ["TensorTree3", "TensorTree4"] {
            let m = of(&xml(structure, &block("Visible", "Reflection Back", basis, "{ 0.159155 }"))).unwrap();
            assert!(m.isotropic && m.readings.len() > 1000, "{structure}");
            assert!(m.table().rgb.iter().all(|v| (v - 0.5 * FRAC_1_PI).abs() < 1e-6));
            // Leaves have their shares of the projected hemisphere, about the light as well.
            let (all, lit) = m.readings.iter().fold((0.0, 0.0), |(all, lit), r| {
                let share = f64::from(r.weight * r.wi.z * r.wo.z);
                (all + share, lit + share * f64::from(r.wo.z * r.wo.z))
            });
            assert!((lit / all - 0.5).abs() < 0.02, "{structure}: {}", lit / all);
        }
        // In the third dimension, bit 2 of a child: the upper half of the eye's square is its +y.
        let children = |f: &dyn Fn(usize) -> f32, n: usize| {
            let leaves: Vec<String> = (0..n).map(|c| format!("{{{}}}", f(c))).collect();
            format!("{{{}}}", leaves.join(" "))
        };
        let text = children(&|c| if c >> 2 & 1 == 1 { 0.5 } else { 0.1 }, 8);
        let m = of(&xml("TensorTree3", &block("Visible", "Reflection Back", basis, &text))).unwrap();
        assert!(m.readings.iter().all(|r| (r.f.x == 0.5) == (r.wo.y > 0.0) && r.wi.x < 0.0));
        // Of four, the first two are of the light, and look where it goes.
        let text = children(&|c| if c & 1 == 1 { 0.5 } else { 0.1 }, 16);
        let m = of(&xml("TensorTree4", &block("Visible", "Reflection Back", basis, &text))).unwrap();
        assert!(!m.isotropic && m.readings.iter().all(|r| (r.f.x == 0.5) == (r.wi.x < 0.0)));
        // A grid has the first dimension slowest.
        let grid: Vec<String> = (0..8).map(|i| i.to_string()).collect();
        let m = of(&xml(
            "TensorTree3",
            &block("Visible", "Reflection Back", basis, &format!("{{{}}}", grid.join(","))),
        ));
        let m = m.unwrap();
        let value =
            |x: f32, y: f32| m.readings.iter().find(|r| r.wo.x * x > 0.3 && r.wo.y * y > 0.3).unwrap().f.x;
        // The half of large first coordinates is not used.
        assert_eq!(
            [value(-1.0, -1.0), value(-1.0, 1.0), value(1.0, -1.0), value(1.0, 1.0)],
            [0.0, 1.0, 2.0, 3.0]
        );
        // Grey light is (4/19, 9/19).
        let chroma = |u: f32, v: f32| {
            let text = [("Visible", 0.25), ("CIE-u", u), ("CIE-v", v)]
                .map(|(range, v)| block(range, "Reflection Back", basis, &format!("{{{v}}}")))
                .concat();
            of(&xml("TensorTree4", &text)).unwrap().readings[0].f
        };
        assert!((chroma(4.0 / 19.0, 9.0 / 19.0) - 0.25).abs().max_element() < 1e-5);
        assert!(chroma(0.4, 0.5).x > 2.0 * chroma(0.4, 0.5).z);
    }

    #[test]
    fn bad_files_get_a_sentence() {
        let matrices = xml(
            "Columns",
            &block("Visible", "Reflection Back", "LBNL/Klems Quarter", &matrix(41, |_, _| 0.25)),
        );
        let trees = xml(
            "TensorTree3",
            &block("Visible", "Reflection Back", "LBNL/Shirley-Chiu", "{{1}{1}{1}{1}{1}{1}{1}{1}}"),
        );
        assert!(of(&matrices).is_ok() && of(&trees).is_ok());
        for (text, from, to, want) in [
            (&matrices, "</Layer>", "", "not well-formed XML"),
            (&matrices, "Columns", "Diagonals", "<IncidentDataStructure> is 'Diagonals'"),
            (
                &matrices,
                "Klems Quarter</Column",
                "Klems Third</Column",
                "<ColumnAngleBasis> is 'LBNL/Klems Third'",
            ),
            (&matrices, "0.250000,", "", "has 1680 numbers; its bases of 41 and 41 patches make 1681"),
            (&matrices, "0.250000,", "0.25,0.25,", "has more numbers"),
            (&matrices, "0.250000,", "x,", "'x' is not a finite number"),
            (&matrices, "Visible", "NIR", "has no reflection to be read: it has none in the range 'Visible'"),
            (&trees, "{1}", "", "the tree lacks a '{'"),
            (&trees, "{1}", "{1 2}", "a leaf has 2 numbers; expected a power of 8"),
            (&trees, "{1}", "{nan}", "'nan' is not a finite number"),
            (&trees, "}}", "}} 1", "goes on behind its tree"),
            (&trees, "}}", "}", "the tree lacks a '}'"),
            (&trees, "<AngleBasis>LBNL/Shirley-Chiu", "<AngleBasis>other", "<AngleBasis> is 'other'"),
        ] {
            assert!(text.contains(from), "{from}");
            let error = of(&text.replacen(from, to, 1)).unwrap_err();
            assert!(error.contains(want) && error.starts_with("a.xml"), "{error}");
        }
        let error = of(&matrices.replace("DataDefinition", "Definition")).unwrap_err();
        assert!(error.starts_with("a.xml: has no <DataDefinition>"), "{error}");
        let error = of(&matrices.replace("ScatteringData", "Scattering")).unwrap_err();
        assert!(error.contains("has no <ScatteringData>"), "{error}");
        let deep = format!("{}1{}", "{".repeat(40), "}".repeat(40));
        let error = of(&xml("TensorTree3", &block("Visible", "Reflection Back", "LBNL/Shirley-Chiu", &deep)))
            .unwrap_err();
        assert!(error.contains("deeper than 12"), "{error}");
    }
}
