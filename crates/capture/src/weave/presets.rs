//! Costumes of the Noh stage. Dimensions with a source say so; the rest is chosen to look right.

use super::fabric::noh;
use super::{Fabric, Make, Twill, Weave, Yarn};
use glam::{Vec2, Vec3};
use yugen_optics::ColourSpace;
use yugen_reflectance::Preset;
use yugen_reflectance::metals::Metal;

/// The presets of [`Fabric::preset`].
pub const PRESETS: &[Preset] = &[
    Preset {
        name: "karaori",
        doc: "vermilion karaori: a 2/1 twill of silk, flowers of glossy floss and wrapped gold floating on it",
    },
    Preset {
        name: "kinran",
        doc: "kinran brocade: flat gold strips in a pattern of hexagons (kikko), bound in twill on vermilion satin",
    },
];

impl Fabric {
    /// The preset called `name` (see [`PRESETS`]), colours in `space`.
    pub fn preset(name: &str, space: ColourSpace) -> Option<Self> {
        match name {
            "karaori" => karaori(space),
            "kinran" => kinran(space),
            _ => None,
        }
    }

    /// Vermilion silk in any weave, ten ends and ten picks to the millimetre, colours in `space`.
    ///
    /// # Panics
    /// Never: the silk of the model `noh` is always there.
    pub fn silk(name: &str, weave: Weave, space: ColourSpace) -> Self {
        let yarn = |name| vermilion(name, 0.053, 0.025, space).expect("the preset vermilion_silk");
        let yarns = vec![yarn("warp"), yarn("weft")];
        let (warp, weft) = (vec![(0, 0.1); weave.ends()], vec![(1, 0.1); weave.picks()]);
        Self { name: name.into(), weave, yarns, warp, weft, colour_space: space }
    }
}

/// A ground silk thread of the colour and gloss of `vermilion_silk`.
fn vermilion(name: &str, half_width: f32, half_height: f32, space: ColourSpace) -> Option<Yarn> {
    let (diffuse, specular, sigma) = noh("vermilion_silk", space)?;
    Some(Yarn {
        name: name.into(),
        half_width,
        half_height,
        stiffness: 1.0,
        loft: 0.0,
        rides: false,
        // Filament silk of the warp is thrown a little so that it wears.
        make: Make::Fibres { twist: 0.12 },
        diffuse,
        specular,
        sigma,
    })
}

/// Gold leaf: no diffuse part, the colour of bulk metal (leaf of 0.1 µm is nearly opaque), a little lost in creases.
fn gold(space: ColourSpace) -> Vec3 {
    (0.9 * Metal::Gold.f0(space)).clamp(Vec3::ZERO, Vec3::ONE)
}

/// Signed distances of hexagons with upright sides, `across` wide, in a honeycomb about the origin: how far p is
/// from the nearest centre, so measured that a hexagon is a circle, and that centre's own p.
fn honeycomb(p: Vec2, across: f32) -> (f32, Vec2) {
    let cell = Vec2::new(across, across * 3f32.sqrt());
    let local = |offset: Vec2| {
        let q = p - offset;
        q - cell * (q / cell).round()
    };
    let (a, b) = (local(Vec2::ZERO), local(0.5 * cell));
    let q = if a.length_squared() <= b.length_squared() { a } else { b };
    let (x, y) = (q.x.abs(), q.y.abs());
    (x.max(0.5 * x + 0.5 * 3f32.sqrt() * y), q)
}

fn kinran(space: ColourSpace) -> Option<Fabric> {
    // Hexagons of 10 mm. Three ends of the ground and a binding end (karami, betsugarami: a warp of its own) in
    // 0.332 mm; strips every 0.385 mm, as cut (0.3 to 0.5 mm; "kirikomade" 0.38 mm). A strip is held every third
    // binding end, 1.0 mm, one further in each row: a 1/2 twill.
    const ACROSS: f32 = 9.96;
    const GROUPS: usize = 30;
    const ROWS: usize = 45;
    let row = ACROSS * 3f32.sqrt() / ROWS as f32;
    let yarns = vec![
        vermilion("warp", 0.05, 0.02, space)?,
        Yarn {
            // Two or three filaments of 21 denier: 67 to 80 µm thick.
            stiffness: 0.3,
            ..vermilion("binding warp", 0.036, 0.03, space)?
        },
        vermilion("weft", 0.105, 0.025, space)?,
        Yarn {
            name: "gold strip".into(),
            half_width: 0.178,
            half_height: 0.015,
            stiffness: 8.0,
            loft: 0.0,
            rides: true,
            make: Make::Strip { roll: 0.03 },
            diffuse: Vec3::ZERO,
            specular: gold(space),
            // "Sabi", the matt grade: paper under the leaf is rough along the strip, cutting keeps it level across.
            sigma: Vec2::new(0.35, 0.15),
        },
    ];
    let warp: Vec<(usize, f32)> =
        (0..4 * GROUPS).map(|e| if e % 4 < 3 { (0, 0.094) } else { (1, 0.05) }).collect();
    let weft = (0..3 * ROWS).map(|p| if p % 3 < 2 { (2, 0.5 * row) } else { (3, 0.0) }).collect();

    // The ground: satin 5/2 of the ground ends; binding ends dip in under two picks of three.
    let satin = Weave::satin(5, 2).ok()?;
    let bound = Weave::twill(1, 2, Twill::Right).ok()?;
    let ground = Weave::from_fn(4 * GROUPS, 2 * ROWS, |e, p| match e % 4 {
        3 => bound.up(e / 4, p),
        within => satin.up(e / 4 * 3 + within, p),
    });
    let tie = Weave::from_fn(12, 3, |e, r| e % 4 == 3 && bound.up(e / 4, r));
    let ends: Vec<f32> = centres(&warp);
    let figure = |end: usize, r: usize| {
        let p = Vec2::new(ends[end], (r as f32 + 0.5) * row);
        let (m, q) = honeycomb(p, ACROSS);
        let rim = 0.5 * ACROSS - m;
        // The outline, and a flower of six petals around an eye.
        let flower = 2.9 * (0.62 + 0.38 * (6.0 * q.y.atan2(q.x)).cos());
        let gold = rim < 0.75 || (0.5..flower).contains(&q.length());
        usize::from(gold)
    };
    let weave = Weave::with_pattern_wefts(&ground, [4 * GROUPS, ROWS], 2, 1, figure, &tie);
    Some(Fabric { name: "kinran".into(), weave, yarns, warp, weft, colour_space: space })
}

/// The middles of threads that lie side by side.
fn centres(threads: &[(usize, f32)]) -> Vec<f32> {
    let mut at = 0.0;
    threads
        .iter()
        .map(|(_, spacing)| {
            at += spacing;
            at - 0.5 * spacing
        })
        .collect()
}

fn karaori(space: ColourSpace) -> Option<Fabric> {
    // Flowers of 12 mm, every second row shifted by half. Floss floats over twelve ends of the twill ground.
    const ENDS: usize = 78;
    const ROWS: usize = 39;
    const END: f32 = 0.205;
    const PICK: f32 = 0.256;
    let from_srgb = |r: f32, g: f32, b: f32| {
        (ColourSpace::LinearSrgb.matrix_to(space) * Vec3::new(r, g, b)).clamp(Vec3::ZERO, Vec3::ONE)
    };
    let floss = |name: &str, diffuse: Vec3| Yarn {
        name: name.into(),
        half_width: 0.29,
        half_height: 0.08,
        stiffness: 0.5,
        loft: 0.035,
        rides: true,
        make: Make::Fibres { twist: 0.0 },
        diffuse,
        specular: Vec3::splat(0.16),
        // Filaments side by side, parallel: narrower along than thrown silk.
        sigma: Vec2::new(0.2, 0.45),
    };
    let yarns = vec![
        vermilion("warp", 0.11, 0.04, space)?,
        vermilion("weft", 0.135, 0.045, space)?,
        floss("white floss", from_srgb(0.62, 0.58, 0.48)),
        floss("green floss", from_srgb(0.05, 0.17, 0.07)),
        Yarn {
            name: "wrapped gold".into(),
            half_width: 0.27,
            half_height: 0.09,
            stiffness: 2.0,
            loft: 0.01,
            rides: true,
            make: Make::Wrapped { winding: 1.05, pitch: 0.32, cover: 0.85, core: from_srgb(0.55, 0.3, 0.04) },
            diffuse: Vec3::ZERO,
            specular: gold(space),
            sigma: Vec2::new(0.3, 0.16),
        },
    ];
    let warp = vec![(0, END); ENDS];
    let weft = (0..5 * ROWS).map(|p| if p % 5 < 2 { (1, PICK) } else { (p % 5, 0.0) }).collect();
    let size = Vec2::new(ENDS as f32 * END, 2.0 * ROWS as f32 * PICK);
    let figure = |end: usize, r: usize| {
        let [none, white, green, gold] = [0, 1, 2, 3];
        let p = Vec2::new((end as f32 + 0.5) * END, (r as f32 + 0.5) * 2.0 * PICK);
        let local = |offset: Vec2| {
            let q = p - offset;
            q - size * (q / size).round()
        };
        for (offset, petals, eye) in [(0.25 * size, white, gold), (0.75 * size, gold, white)] {
            let q = local(offset);
            let (radius, angle) = (q.length(), q.y.atan2(q.x));
            // A chrysanthemum: twelve round petals, a gap, an eye.
            let edge = 5.2 * (0.8 + 0.2 * (6.0 * angle).cos().abs().sqrt());
            if radius < 1.3 {
                return eye;
            }
            if (1.8..edge).contains(&radius) {
                return petals;
            }
        }
        // Leaves between the flowers: lenses leaning both ways.
        for (offset, lean) in [(Vec2::new(0.72, 0.28), 0.9f32), (Vec2::new(0.28, 0.72), -0.9)] {
            let q = Vec2::from_angle(-lean).rotate(local(offset * size));
            if q.y.abs() < 1.5 * (1.0 - (q.x / 3.6).powi(2)) && q.y.abs() > 0.14 {
                return green;
            }
        }
        none
    };
    let ground = Weave::twill(2, 1, Twill::Right).ok()?;
    // One end in thirteen holds the floats, five further in each row, as in a satin.
    let tie = Weave::from_fn(13, 13, |e, r| (e + 5 * r) % 13 == 0);
    let weave = Weave::with_pattern_wefts(&ground, [ENDS, ROWS], 2, 3, figure, &tie);
    Some(Fabric { name: "karaori".into(), weave, yarns, warp, weft, colour_space: space })
}
