//! Materials of Wavefront OBJ files. Alias|Wavefront 1995, "Material Library", with the statements for physically based
//! materials that Blender and others write.
//!
//! A Lambertian `Kd` and a normalised Blinn-Phong lobe `Ks` of exponent `Ns` share what arrives: the lobe takes the
//! largest channel of `Ks`, the rest is left to `Kd`, so that no surface returns more than it gets. Where `Pr`, `Pm`
//! and their like are given, the material is glTF's instead. `illum` 4 with an index `Ni` above one is a sheet of glass,
//! 6 and 7 are solid glass. Both sides look alike, because the format says nothing about sides. Colours are linear
//! sRGB, pictures sRGB-encoded.

mod libraries;

pub(crate) use libraries::{Finish, Libraries};

use super::numbers::{Scanner, text};
use super::support::{Feature, Support, find};
use glam::{Affine2, Mat2, Vec2, Vec3};
use std::path::Path;
use yugen_optics::ColourSpace;

const AMBIENT: &str = "no constant is added for light from everywhere: that light is followed";

/// The statements of a material.
pub const FEATURES: &[Feature] = &[
    Feature::yes("newmtl"),
    Feature::partly("Ka", AMBIENT),
    Feature::partly("Kd", "three numbers, one or `xyz`; no spectral curves (.rfl)"),
    Feature::partly(
        "Ks",
        "likewise; what it takes is missing from Kd; not for glass, `illum` 0 and 1, nor beside Pr or Pm",
    ),
    Feature::yes("Ke"),
    Feature::partly("Ns", "up to 1000; glass is smooth"),
    Feature::partly("Ni", "for glass and beside Pr or Pm"),
    Feature::partly("d", "with -halo the same from all sides; not for glass"),
    Feature::yes("Tr"),
    Feature::partly("Tf", "for glass"),
    Feature::partly(
        "illum",
        "0 and 1 are matt; 4 is a sheet of glass, 6 and 7 solid glass, where Ni is above 1; all others are as 2",
    ),
    Feature::partly("map_Ka", AMBIENT),
    Feature::yes("map_Kd"),
    Feature::partly("map_Ks", "its brightness; the hue is that of Ks"),
    Feature::yes("map_Ke"),
    Feature::yes("map_Ns"),
    Feature::yes("map_d"),
    Feature::partly("map_bump", "a picture in the colours of normals is read as `norm`"),
    Feature::partly("bump", "a picture in the colours of normals is read as `norm`"),
    Feature::yes("norm"),
    Feature::yes("Pr"),
    Feature::yes("Pm"),
    Feature::partly("Ps", "white sheen"),
    Feature::yes("Pc"),
    Feature::yes("Pcr"),
    Feature::yes("aniso"),
    Feature::yes("anisor"),
    Feature::yes("map_Pr"),
    Feature::yes("map_Pm"),
    Feature::partly("map_Ps", "white sheen"),
    Feature::yes("map_Pc"),
    Feature::yes("map_Pcr"),
    Feature::partly("map_RMA", "R is roughness, G metal; occlusion is followed, not read"),
    Feature::partly("map_ORM", "G is roughness, B metal; occlusion is followed, not read"),
    Feature::no("map_Tf", "glass has one colour"),
    Feature::no("disp", "surfaces are not displaced; the slope alone can be had with 'bump'"),
    Feature::no("map_disp", "surfaces are not displaced; the slope alone can be had with 'bump'"),
    Feature::no("decal", "pictures are not laid over each other; bake them into map_Kd"),
    Feature::no("refl", "reflections are followed, not read from a picture"),
    Feature::no("sharpness", "reflections are followed, not read from a picture"),
    Feature::no("map_aat", "an instruction for other renderers"),
];

/// The options of a picture, and how many words each takes at most.
pub const OPTIONS: &[Feature] = &[
    Feature::yes("-s"),
    Feature::yes("-o"),
    Feature::no("-t", "pictures are not stirred by turbulence"),
    Feature::partly("-clamp", "beyond its rim the picture goes on as its border does"),
    Feature::yes("-bm"),
    Feature::yes("-mm"),
    Feature::yes("-imfchan"),
    Feature::partly("-blendu", "pictures are always interpolated"),
    Feature::partly("-blendv", "pictures are always interpolated"),
    Feature::partly("-texres", "pictures are used in their own size"),
    Feature::no("-boost", "pictures are not sharpened"),
    Feature::no("-cc", "colours are as in the picture"),
    Feature::no("-type", "reflections are followed, not read from a picture"),
];

/// How many words follow an option: at most, and whether they have to be numbers.
fn words_of(option: &str) -> (usize, bool) {
    match option {
        "-s" | "-o" | "-t" => (3, true),
        "-mm" => (2, true),
        "-bm" | "-texres" | "-boost" => (1, true),
        _ => (1, false),
    }
}

/// A material of a library, as written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mtl {
    /// What stands after `newmtl`.
    pub name: String,
    /// Statements in order: keyword, and the rest of the line.
    pub statements: Vec<(String, String)>,
}

impl Mtl {
    /// One or three numbers after a keyword (`Ns`, `Kd`, …), or three after `xyz`; one number stands for grey. The last
    /// statement counts. Colours are linear sRGB.
    pub fn colour(&self, keyword: &str) -> Option<Vec3> {
        let rest = self.rest(keyword)?;
        let (numbers, xyz) = match rest.strip_prefix("xyz") {
            Some(numbers) => (numbers, true),
            None => (rest, false),
        };
        let v: Vec<f32> = numbers.split_whitespace().map_while(|w| w.parse().ok()).collect();
        let c = match v[..] {
            [x] | [x, _] => Vec3::splat(x),
            [x, y, z, ..] => Vec3::new(x, y, z),
            [] => return None,
        };
        let c = if xyz { (ColourSpace::LinearSrgb.to_xyz().inverse() * c.as_dvec3()).as_vec3() } else { c };
        c.is_finite().then_some(c)
    }

    /// The first number after a keyword, past the words that are none, such as `-halo`.
    fn number(&self, keyword: &str) -> Option<f32> {
        self.rest(keyword)?.split_whitespace().find_map(|w| w.parse().ok()).filter(|v: &f32| v.is_finite())
    }

    /// The picture named after a keyword (`map_Kd`, `bump`, …) with its options.
    pub fn map(&self, keyword: &str) -> Option<Map> {
        Map::parse(self.rest(keyword)?)
    }

    fn has(&self, keywords: &[&str]) -> bool {
        keywords.iter().any(|k| self.rest(k).is_some())
    }

    fn rest(&self, keyword: &str) -> Option<&str> {
        self.statements.iter().rev().find(|(k, _)| k.eq_ignore_ascii_case(keyword)).map(|(_, r)| r.as_str())
    }
}

/// A picture as a material names it.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// The file; may have blanks.
    pub file: String,
    /// `-s`: how often the picture fits into a unit of (u, v).
    pub scale: Vec2,
    /// `-o`: added to (u, v), of which v runs up.
    pub offset: Vec2,
    /// `-clamp on`.
    pub clamp: bool,
    /// `-bm`: a factor on the height.
    pub bump: f32,
    /// `-mm`: the value of black and the distance from there to white.
    pub range: [f32; 2],
    /// `-imfchan`: r, g, b, m (alpha), l (luminance) or z.
    pub channel: Option<char>,
    /// Options that are not followed, and words that look like options.
    pub ignored: Vec<String>,
}

impl Map {
    /// `None` where no file is named.
    fn parse(text: &str) -> Option<Self> {
        let mut map = Self {
            file: String::new(),
            scale: Vec2::ONE,
            offset: Vec2::ZERO,
            clamp: false,
            bump: 1.0,
            range: [0.0, 1.0],
            channel: None,
            ignored: Vec::new(),
        };
        // Words with their places: a name may have blanks, and may stand before the options.
        let words: Vec<(usize, &str)> =
            text.split_whitespace().map(|w| (w.as_ptr() as usize - text.as_ptr() as usize, w)).collect();
        let mut name: Option<(usize, usize)> = None;
        let mut i = 0;
        while let Some(&(start, word)) = words.get(i) {
            i += 1;
            let lower = word.to_ascii_lowercase();
            let Some(option) = find(OPTIONS, &lower) else {
                let begin = name.map_or(start, |n| n.0);
                name = Some((begin, start + word.len()));
                continue;
            };
            let (most, numbers) = words_of(&lower);
            let mut values = Vec::new();
            let first = i;
            while i < words.len() && i - first < most {
                match words[i].1.parse::<f32>().ok().filter(|v| v.is_finite()) {
                    Some(v) => values.push(v),
                    None if numbers => break,
                    None => {}
                }
                i += 1;
            }
            let said = words.get(first).map_or("", |w| w.1).to_ascii_lowercase();
            let pair =
                |old: Vec2| Vec2::new(*values.first().unwrap_or(&old.x), *values.get(1).unwrap_or(&old.y));
            match (option.name, &values[..]) {
                ("-s", _) => map.scale = pair(map.scale),
                ("-o", _) => map.offset = pair(map.offset),
                ("-clamp", _) => map.clamp = said == "on",
                ("-bm", [v, ..]) => map.bump = *v,
                ("-mm", [base, gain]) => map.range = [*base, *gain],
                ("-imfchan", _) => map.channel = said.chars().next(),
                _ => {}
            }
            if let Support::No(_) = option.support {
                map.ignored.push(option.name.to_string());
            }
        }
        let (start, end) = name?;
        map.file = text[start..end].trim_matches('"').to_string();
        Some(map)
    }

    /// From the (u, v) of a mesh, of which v runs down.
    fn to_uv(&self) -> Affine2 {
        let (s, o) = (self.scale, self.offset);
        Affine2::from_mat2_translation(Mat2::from_diagonal(s), Vec2::new(o.x, 1.0 - s.y - o.y))
    }
}

/// Reads a library; `path` names it in messages. Numbers are checked where they are asked for.
pub fn read(bytes: &[u8], path: &Path) -> Vec<Mtl> {
    let bytes = text(bytes);
    let mut s = Scanner::new(&bytes, path);
    let mut materials: Vec<Mtl> = Vec::new();
    let mut stray = 0;
    loop {
        s.space();
        if s.at_end() {
            break;
        }
        let keyword = String::from_utf8_lossy(s.word()).into_owned();
        let line = String::from_utf8_lossy(s.next_line()).into_owned();
        if keyword.starts_with('#') {
            continue;
        }
        if keyword.eq_ignore_ascii_case("newmtl") {
            materials.push(Mtl { name: line, statements: Vec::new() });
            continue;
        }
        // A comment after a blank; names of materials may have such a sign.
        let rest = line.split_once(" #").map_or(&*line, |l| l.0).trim().to_string();
        match materials.last_mut() {
            Some(last) => last.statements.push((keyword, rest)),
            None => stray += 1,
        }
    }
    if stray > 0 {
        tracing::warn!(
            "{}: statements before the first 'newmtl' belong to no material and are skipped: {stray}",
            path.display()
        );
    }
    materials
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_library_of_materials() {
        let text = "\u{feff}Kd 3\n# x\nnewmtl red\nKd 1 0 0.5\nNs 20 # sharp\nmap_Kd -bm 1 wood.png\nd -halo 0.25\n\
                    newmtl b\nKd xyz 0.9505 1 1.089\nKs spectral glass.rfl";
        let m = read(text.as_bytes(), Path::new("a.mtl"));
        assert_eq!(m.len(), 2);
        assert_eq!(m[0].colour("kd"), Some(Vec3::new(1.0, 0.0, 0.5)));
        assert_eq!(m[0].colour("Ns"), Some(Vec3::splat(20.0)));
        assert_eq!(m[0].map("map_Kd").unwrap().file, "wood.png");
        assert_eq!(m[0].number("d"), Some(0.25));
        assert!((m[1].colour("Kd").unwrap() - Vec3::ONE).abs().max_element() < 1e-3);
        assert_eq!((m[1].colour("Ks"), m[1].colour("Ka")), (None, None));
    }

    #[test]
    fn options_and_names_with_blanks() {
        let map = |text: &str| Map::parse(text);
        for text in [
            "half tex 01.png",
            "-clamp on half tex 01.png",
            "half tex 01.png -blendu off",
            "\"half tex 01.png\"",
            "-o 0.5 half tex 01.png",
            "-imfchan l -bm 2 -texres 512 half tex 01.png -cc on",
            "-t 1 1 1 half tex 01.png",
        ] {
            assert_eq!(map(text).unwrap().file, "half tex 01.png", "{text}");
        }
        assert_eq!(map("half  tex.png").unwrap().file, "half  tex.png");
        let m = map("-S 2 3 1 -o 0.5 0.25 -mm 0.1 0.8 -clamp on -bm -0.5 -imfchan m a-s.png").unwrap();
        assert_eq!((m.scale, m.offset), (Vec2::new(2.0, 3.0), Vec2::new(0.5, 0.25)));
        assert_eq!((m.range, m.clamp, m.bump, m.channel), ([0.1, 0.8], true, -0.5, Some('m')));
        assert!(m.ignored.is_empty() && map("-t 1 x.png").unwrap().ignored == ["-t"]);
        assert_eq!((map(""), map("-s 2 2 2")), (None, None));
        // Where v runs up, v' = 3 v + 0.25.
        assert!((m.to_uv().transform_point2(Vec2::new(0.5, 0.9)) - Vec2::new(1.5, 0.45)).length() < 1e-6);
        assert_eq!(m.to_uv().transform_point2(Vec2::new(0.5, 1.0)).y, 0.75);
    }
}
