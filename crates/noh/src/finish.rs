//! What the parts are made of: textures of wood, bark, gravel, iron and cloth, generated, the same on every machine.

use crate::garden::GRAVEL;
use crate::painting;
use crate::part::Finish;
use crate::pattern::{Surface, Texel, fbm, lattice, nearest, noise, srgb};
use crate::roof::BARK;
use crate::timber::WOOD;
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;
use yugen_optics::special::smoothstep;

/// Texels along an edge of most textures. Renderers keep 16 bytes a texel: with these sizes all textures of a stage, with
/// their pyramids, stay below the 128 MiB that every WebGPU device binds at once.
const N: usize = 512;

/// What a finish needs beyond its texture.
#[derive(Clone, Copy, Debug)]
pub struct Gloss {
    /// Colour of the fibres that stand up; linear sRGB.
    pub sheen: Vec3,
    /// How little they are in order.
    pub sheen_roughness: f32,
    /// Strength of the reflection of a dielectric.
    pub specular: f32,
    /// Anisotropic: widths of the highlight across and along fibres that run with v, instead of one from the texture.
    pub fibres: Option<[f32; 2]>,
    /// Diffuse by rough cavities instead of a dielectric's highlight: standard deviation of their slope, radians.
    pub matt: Option<f32>,
}

const PLAIN: Gloss =
    Gloss { sheen: Vec3::ZERO, sheen_roughness: 0.5, specular: 1.0, fibres: None, matt: None };

impl Finish {
    /// How many times coarser than colours its normals are, where nothing fine stands out.
    pub(crate) fn relief(self) -> usize {
        match self {
            Self::PineLeft | Self::PineMiddle | Self::PineRight | Self::BambooPainting => 4,
            Self::Curtain | Self::Plaster | Self::Needles => 2,
            _ => 1,
        }
    }

    /// Its gloss.
    pub fn gloss(self) -> Gloss {
        match self {
            Self::Gravel => Gloss { matt: Some(0.45), ..PLAIN },
            Self::Earth | Self::Plaster => Gloss { matt: Some(0.35), ..PLAIN },
            Self::Curtain => {
                Gloss { sheen: Vec3::splat(0.16), sheen_roughness: 0.45, specular: 0.5, ..PLAIN }
            }
            Self::Lining => {
                Gloss { sheen: Vec3::new(0.16, 0.05, 0.03), sheen_roughness: 0.4, specular: 0.5, ..PLAIN }
            }
            Self::Under => Gloss { sheen: Vec3::splat(0.12), sheen_roughness: 0.4, specular: 0.5, ..PLAIN },
            // Of human hair, oiled: wide across the strands, narrow along them.
            Self::Hair => Gloss { fibres: Some([0.42, 0.12]), ..PLAIN },
            Self::Bark | Self::PineBark | Self::Log => Gloss { specular: 0.4, ..PLAIN },
            _ => PLAIN,
        }
    }

    /// Its texture, if it has one of ours. `gravel` is the mean albedo of gravel.
    pub(crate) fn surface(self, gravel: f32) -> Option<Surface> {
        Some(match self {
            Self::Floor => floor(),
            Self::Timber => timber(),
            Self::Bark => bark(),
            Self::Copper => copper(),
            Self::Gravel => stones(gravel),
            Self::Earth => earth(),
            Self::Iron => iron(),
            Self::Log => log(),
            Self::PineLeft => painting::pine(0),
            Self::PineMiddle => painting::pine(1),
            Self::PineRight => painting::pine(2),
            Self::BambooPainting => painting::bamboo(),
            Self::Plaster => plaster(),
            Self::Curtain => curtain(),
            Self::Needles => needles(),
            Self::PineBark => scales(),
            Self::Bamboo => culm(),
            Self::Lacquer => lacquer(),
            Self::Gilt => gilt(),
            Self::Lining => lining(),
            Self::Omote => crate::player::omote(),
            Self::Hannya => crate::player::hannya(),
            Self::Hair => hair(),
            Self::Band => band(),
            Self::Skin => skin(),
            Self::Under => white(),
            Self::Fan => gilt_paper(),
            Self::Cloth => return None,
        })
    }
}

/// Between two colours.
fn mix(a: Vec3, b: Vec3, t: f32) -> Vec3 {
    a + (b - a) * t.clamp(0.0, 1.0)
}

/// How dark a growth ring is at its phase: early wood darkens slowly to late wood, which ends at once.
fn ring(phase: f32) -> f32 {
    let f = phase - phase.floor();
    smoothstep(0.35, 0.92, f) * (1.0 - smoothstep(0.95, 1.0, f))
}

/// Two plane-sawn boards of hinoki side by side, polished by feet in white socks. Each is a plane cut through a log
/// near its heart: the rings are circles about the heart, whose depth below the board changes along it, and so the cut
/// shows arches in the middle and lines at the edges.
fn floor() -> Surface {
    let (early, late) = (srgb(0xd9b27c), srgb(0xa8743f));
    Surface::bake(N, 2 * N, WOOD, |p| {
        let row = (2.0 * p.y / WOOD.y).floor();
        let seed = 11 + 17 * row as u32;
        let t = p.x / WOOD.x;
        let across = p.y - (row + 0.5) * 0.5 * WOOD.y;
        // The heart wanders; all is periodic along the board.
        let heart = 0.035 * (TAU * t + row).sin() + if row > 0.0 { 0.05 } else { -0.03 };
        let deep = 0.085 + 0.045 * (TAU * (t + 0.3 * row)).cos() + 0.012 * (2.0 * TAU * t + 2.0 * row).sin();
        let wobble = 0.0035 * fbm(Vec2::new(6.0 * t, across / 0.06 + 8.0), [6, 64], 3, seed);
        let r = Vec2::new(across - heart, deep).length() + wobble;
        // Years differ.
        let width = 0.0034;
        let years = r / width + 0.9 * noise(Vec2::new(r / 0.021, 0.5 + row), [64, 64], seed + 7);
        let late_wood = ring(years);
        let year = lattice(years.floor() as i32, 3, seed);
        let fibre = noise(Vec2::new(160.0 * t, p.y / 0.0011), [160, 4096], seed + 3);
        let pore = noise(Vec2::new(64.0 * t, p.y / 0.0022), [64, 2048], seed + 4);
        let cloud = fbm(Vec2::new(4.0 * t, p.y / 0.18), [4, 4], 3, 5 + seed);
        let mut colour = mix(early, late, (0.30 + 0.5 * year) * late_wood + 0.06 * pore);
        colour *= 1.0 + 0.07 * fibre + 0.09 * cloud + if row > 0.0 { -0.05 } else { 0.02 };
        // Boards redden towards the heart.
        colour *= Vec3::new(1.0, 1.0 - 0.05 * (deep / 0.1 - 1.0), 1.0 - 0.1 * (deep / 0.1 - 1.0));
        Texel {
            colour,
            roughness: 0.30 + 0.05 * cloud - 0.05 * late_wood + 0.05 * fibre.abs(),
            metallic: 0.0,
            // Late wood wears less. Some hundredths of a millimetre.
            height: 22e-6 * late_wood + 7e-6 * fibre,
        }
    })
}

/// Quarter-sawn hinoki, planed and aged: straight rings.
fn timber() -> Surface {
    let (early, late) = (srgb(0xb88a58), srgb(0x8a5e36));
    Surface::bake(N / 2, N, WOOD, |p| {
        let (t, v) = (p.x / WOOD.x, p.y / WOOD.y);
        let sway = 0.7 * fbm(Vec2::new(3.0 * t, 5.0 * v), [3, 5], 3, 41);
        // A whole number of rings, so that the texture tiles.
        let years = 170.0 * v + sway + 1.3 * noise(Vec2::new(0.5, 40.0 * v), [1, 40], 42);
        let late_wood = ring(years);
        let fibre = noise(Vec2::new(180.0 * t, 640.0 * v), [180, 640], 43);
        let cloud = fbm(Vec2::new(4.0 * t, 6.0 * v), [4, 6], 4, 44);
        let colour = mix(early, late, 0.62 * late_wood) * (1.0 + 0.09 * fibre + 0.16 * cloud);
        Texel {
            colour,
            roughness: 0.52 + 0.08 * cloud,
            metallic: 0.0,
            height: 40e-6 * late_wood + 14e-6 * fibre,
        }
    })
}

/// Layers of cypress bark, each laid a little higher than the one below: strips a hand wide whose lower edges stand out
/// by a few millimetres, fibres down the slope, grey where the weather has been.
fn bark() -> Surface {
    const ROWS: f32 = 84.0;
    let (fresh, weathered, deep) = (srgb(0x5e4736), srgb(0x6f665c), srgb(0x2b211a));
    Surface::bake(N, N, BARK, |p| {
        let (u, v) = (p.x / BARK.x, p.y / BARK.y);
        let ragged = 0.22 * noise(Vec2::new(70.0 * u, 12.0 * v), [70, 12], 61)
            + 0.16 * noise(Vec2::new(9.0 * u, 4.0 * v), [9, 4], 60);
        let y = ROWS * v + ragged;
        let row = y.floor();
        let f = y - row;
        let wrapped = (row as i32).rem_euclid(ROWS as i32);
        // Pieces in a row, of different widths.
        let pieces = 17;
        let x = u * pieces as f32 + lattice(wrapped, 7, 62);
        let warp = 0.3 * noise(Vec2::new(x, wrapped as f32 + 0.5), [pieces, ROWS as i32], 63);
        let piece = (x + warp).floor() as i32;
        let tone = lattice(piece.rem_euclid(pieces), wrapped, 64);
        let joint = {
            let g = x + warp - (x + warp).floor();
            smoothstep(0.0, 0.02, g.min(1.0 - g))
        };
        let fibre = noise(Vec2::new(420.0 * u, 24.0 * v), [420, 24], 65)
            + 0.5 * noise(Vec2::new(210.0 * u, 60.0 * v), [210, 60], 66);
        let weather = 0.5 + 0.9 * fbm(Vec2::new(5.0 * u, 5.0 * v), [5, 5], 4, 67);
        let mut colour = mix(fresh, weathered, 0.65 * weather + 0.5 * (tone - 0.5));
        // The lower edge catches light, what lies under it is dark.
        let shade = smoothstep(0.0, 0.30, f);
        colour = mix(deep, colour, 0.4 + 0.6 * shade)
            * (0.8 + 0.4 * tone)
            * (1.0 + 0.3 * fibre)
            * (0.55 + 0.45 * joint);
        Texel {
            colour: colour.max(Vec3::splat(0.008)),
            roughness: 0.92,
            metallic: 0.0,
            height: 0.0024 * f + 0.0009 * fibre + 0.0008 * tone,
        }
    })
}

fn copper() -> Surface {
    let (brown, green) = (srgb(0x4a3a30), srgb(0x55786a));
    Surface::bake(N / 2, N / 2, Vec2::splat(1.2), |p| {
        let (u, v) = (p.x / 1.2, p.y / 1.2);
        let cloud = fbm(Vec2::new(5.0 * u, 5.0 * v), [5, 5], 5, 71);
        let streak = noise(Vec2::new(48.0 * u, 3.0 * v), [48, 3], 72);
        // Sheets overlap in courses.
        let f = 4.0 * v - (4.0 * v).floor();
        let seam = 1.0 - smoothstep(0.0, 0.015, f.min(1.0 - f));
        Texel {
            colour: mix(brown, green, 0.25 + 0.9 * cloud + 0.3 * streak) * (1.0 - 0.4 * seam),
            roughness: 0.55 + 0.15 * cloud,
            metallic: 0.0,
            height: 0.004 * seam + 0.0008 * cloud,
        }
    })
}

/// Rounded white stones of one to two centimetres. Their mean reflectance is what the table says.
fn stones(albedo: f32) -> Surface {
    const CELLS: i32 = 64;
    let mut surface = Surface::bake(N, N, GRAVEL, |p| {
        let q = p / GRAVEL.x * CELLS as f32;
        // Flattened domes, turned and laid anyhow; what is highest is seen.
        let cell = q.floor();
        let (mut h, mut tone, mut hue) = (0.0f32, 0.5, 0.5);
        for j in -2..=2 {
            for i in -2..=2 {
                let (x, y) = (cell.x as i32 + i, cell.y as i32 + j);
                let at = |k: u32| lattice(x.rem_euclid(CELLS), y.rem_euclid(CELLS), 81 + k);
                let middle = Vec2::new(x as f32 + 0.15 + 0.7 * at(0), y as f32 + 0.15 + 0.7 * at(1));
                let d = Vec2::from_angle(TAU * at(2)).rotate(q - middle);
                let (long, flat) = (0.62 + 0.38 * at(3), 0.72 + 0.28 * at(4));
                let r2 = (d / Vec2::new(long, long * flat)).length_squared();
                if r2 < 1.0 {
                    // Between a dome and a tablet.
                    let dome = long * (1.0 - r2.powf(1.4)).sqrt() * 0.62 + 0.5 * at(5);
                    if dome > h {
                        (h, tone, hue) = (dome, at(6), at(7));
                    }
                }
            }
        }
        let speck = noise(q * 5.0, [5 * CELLS; 2], 101);
        let mut colour = Vec3::splat(0.62 + 0.3 * tone);
        colour *= mix(Vec3::new(1.0, 0.97, 0.91), Vec3::new(0.95, 0.98, 1.0), hue);
        if hue > 0.93 {
            colour *= 0.5;
        }
        colour *= 1.0 + 0.07 * speck;
        // Less light comes out from between stones.
        colour *= 0.3 + 0.7 * smoothstep(0.15, 0.75, h);
        Texel { colour, roughness: 0.9, metallic: 0.0, height: 0.0075 * h + 0.00012 * speck }
    });
    let mean = |s: &Surface| {
        s.texels.iter().map(|t| f64::from(t.colour.element_sum())).sum::<f64>()
            / (3.0 * s.texels.len() as f64)
    };
    // White stones have no room above; a few steps settle it.
    for _ in 0..8 {
        let factor = albedo / mean(&surface) as f32;
        for t in &mut surface.texels {
            t.colour = (t.colour * factor).min(Vec3::splat(0.93));
        }
    }
    surface
}

fn earth() -> Surface {
    let (dry, damp) = (srgb(0x7b6a55), srgb(0x4f4335));
    Surface::bake(N / 2, N / 2, Vec2::splat(1.6), |p| {
        let q = p / 1.6;
        let cloud = fbm(q * 5.0, [5; 2], 6, 111);
        let (d, [i, j], _) = nearest(q * 70.0, [70; 2], 0.9, 112);
        let pebble = if lattice(i, j, 113) > 0.72 { (1.0 - (d / 0.38).powi(2)).max(0.0).sqrt() } else { 0.0 };
        Texel {
            colour: mix(damp, dry, 0.5 + 0.45 * cloud + 0.3 * pebble * (lattice(i, j, 114) - 0.3)),
            roughness: 0.95,
            metallic: 0.0,
            height: 0.004 * cloud + 0.004 * pebble,
        }
    })
}

/// Forged iron: scale, hammer marks, rust in patches.
fn iron() -> Surface {
    let (scale, rust) = (srgb(0x4a4644), srgb(0x5c3a26));
    Surface::bake(N / 2, N / 2, Vec2::splat(0.4), |p| {
        let q = p / 0.4;
        let patch = smoothstep(0.02, 0.35, fbm(q * 6.0, [6; 2], 5, 121));
        let (d, _, gap) = nearest(q * 16.0, [16; 2], 0.9, 122);
        let grit = noise(q * 200.0, [200; 2], 123);
        Texel {
            colour: mix(scale, rust, 0.85 * patch) * (1.0 + 0.15 * grit),
            roughness: 0.48 + 0.3 * patch + 0.06 * grit,
            metallic: 0.85 * (1.0 - patch),
            height: 0.0009 * d * smoothstep(0.0, 0.3, gap) + 0.00012 * grit * (0.3 + patch),
        }
    })
}

/// Split pine, charred where it burns.
fn log() -> Surface {
    let (wood, char, ash) = (srgb(0x6a4426), srgb(0x211b16), srgb(0x8d8880));
    Surface::bake(N / 2, N / 2, Vec2::splat(0.5), |p| {
        let q = p / 0.5;
        let burnt = smoothstep(-0.75, -0.2, fbm(q * 3.0, [3; 2], 4, 131));
        // Char cracks into blocks along the grain.
        let (_, [i, j], gap) = nearest(q * Vec2::new(26.0, 44.0), [26, 44], 0.9, 132);
        let crack = smoothstep(0.0, 0.25, gap);
        let fibre = noise(q * Vec2::new(8.0, 150.0), [8, 150], 133);
        let dust = smoothstep(0.55, 0.95, lattice(i, j, 134)) * burnt * 0.12;
        let charred = mix(char * (0.5 + 0.5 * crack), ash, dust);
        Texel {
            colour: mix(wood * (1.0 + 0.25 * fibre), charred, burnt),
            roughness: 0.75 - 0.2 * burnt * crack,
            metallic: 0.0,
            height: 0.0025 * crack * burnt + 0.0006 * fibre,
        }
    })
}

fn plaster() -> Surface {
    Surface::bake(N / 4, N / 4, Vec2::splat(1.0), |p| {
        let cloud = fbm(p * 6.0, [6; 2], 5, 141);
        let colour = Vec3::new(0.74, 0.71, 0.65) * (1.0 + 0.06 * cloud);
        Texel { colour, roughness: 0.9, metallic: 0.0, height: 0.0008 * cloud }
    })
}

/// Five colours side by side in a damask of silk: purple, white, red, yellow, green.
fn curtain() -> Surface {
    let colours = [0x4b2a63, 0xe9e2d0, 0xa82820, 0xd0992a, 0x1f5a3e].map(srgb);
    let size = Vec2::new(2.0, 2.73);
    Surface::bake(N / 2, N, size, |p| {
        let band = 5.0 * p.x / size.x;
        let i = (band as usize).min(4);
        // A seam between two widths.
        let seam = smoothstep(0.0, 0.012, (band - band.floor()).min(1.0 - (band - band.floor())));
        // Diamonds with a flower in each: where the weave turns, it shines otherwise.
        let q = p / 0.11;
        let diamond = Vec2::new(q.x + q.y * 0.8, q.x - q.y * 0.8);
        let cell = diamond - diamond.floor() - 0.5;
        let flower = cell.length() * (1.0 + 0.28 * (5.0 * cell.y.atan2(cell.x)).cos());
        let figure = smoothstep(0.34, 0.30, flower) + smoothstep(0.46, 0.49, cell.x.abs().max(cell.y.abs()));
        let thread = noise(p / 0.004, [500, 683], 151);
        Texel {
            colour: colours[i] * (0.94 + 0.14 * figure + 0.05 * thread) * (0.6 + 0.4 * seam),
            roughness: 0.62 - 0.16 * figure,
            metallic: 0.0,
            height: 6e-5 * figure + 4e-5 * thread,
        }
    })
}

fn needles() -> Surface {
    let (dark, light) = (srgb(0x1f3a1c), srgb(0x56702f));
    Surface::bake(64, 64, Vec2::splat(0.1), |p| {
        let q = p / 0.1;
        let t = 0.5 + fbm(q * 4.0, [4; 2], 3, 161);
        Texel { colour: mix(dark, light, t), roughness: 0.5, metallic: 0.0, height: 0.0 }
    })
}

/// Plates of pine bark.
fn scales() -> Surface {
    let (plate, crack) = (srgb(0x7a5a45), srgb(0x2b1d15));
    Surface::bake(N / 2, N / 2, Vec2::splat(0.35), |p| {
        let q = p / 0.35;
        let warp = Vec2::new(noise(q * 9.0, [9; 2], 171), noise(q * 9.0, [9; 2], 172)) * 0.05;
        let (_, [i, j], gap) = nearest((q + warp) * Vec2::new(7.0, 14.0), [7, 14], 0.9, 173);
        let flat = smoothstep(0.02, 0.28, gap);
        let layers = noise(q * Vec2::new(30.0, 60.0), [30, 60], 174);
        Texel {
            colour: mix(crack, plate * (0.75 + 0.5 * lattice(i, j, 175)) * (1.0 + 0.2 * layers), flat),
            roughness: 0.85,
            metallic: 0.0,
            height: 0.004 * flat + 0.0006 * layers,
        }
    })
}

fn culm() -> Surface {
    let colour = srgb(0xb09a5a);
    Surface::bake(128, 512, Vec2::splat(1.0), |p| {
        let f = 5.0 * p.x - (5.0 * p.x).floor();
        let node = 1.0 - smoothstep(0.0, 0.05, f.min(1.0 - f));
        let streak = noise(Vec2::new(4.0 * p.x, 90.0 * p.y), [4, 90], 181);
        Texel {
            colour: colour * (1.0 - 0.45 * node + 0.12 * streak),
            roughness: 0.38,
            metallic: 0.0,
            height: 0.001 * node,
        }
    })
}

/// Black lacquer, polished by hand (roiro): nearly a mirror, which swells a little.
fn lacquer() -> Surface {
    Surface::bake(128, 128, Vec2::splat(0.3), |p| {
        let q = p / 0.3;
        let cloud = fbm(q * 4.0, [4; 2], 3, 191);
        Texel {
            colour: Vec3::new(0.010, 0.008, 0.007),
            roughness: 0.10 + 0.03 * cloud,
            metallic: 0.0,
            height: 2e-5 * noise(q * 7.0, [7; 2], 194),
        }
    })
}

/// Copper, fire-gilt and punched with small rings (nanako); worn in places.
fn gilt() -> Surface {
    let (gold, worn) = (Vec3::new(0.95, 0.66, 0.26), Vec3::new(0.60, 0.36, 0.20));
    Surface::bake(256, 256, Vec2::splat(0.04), |p| {
        let q = p / 0.04;
        let patch = smoothstep(0.1, 0.6, fbm(q * 3.0, [3; 2], 4, 201));
        let cell = q * 32.0 - (q * 32.0).floor() - 0.5;
        let dome = (1.0 - (cell.length() / 0.46).powi(2)).max(0.0).sqrt();
        Texel {
            colour: mix(gold, worn, 0.6 * patch) * (0.75 + 0.25 * smoothstep(0.0, 0.4, dome)),
            roughness: 0.24 + 0.14 * patch,
            metallic: 1.0,
            height: 1.6e-4 * dome,
        }
    })
}

/// Red silk in plain weave, dyed with safflower (momi).
fn lining() -> Surface {
    let red = srgb(0xb03024);
    Surface::bake(128, 128, Vec2::splat(0.05), |p| {
        let q = p / 0.05;
        let thread = noise(q * Vec2::new(60.0, 90.0), [60, 90], 211);
        Texel {
            colour: red * (1.0 + 0.08 * thread + 0.05 * fbm(q * 3.0, [3; 2], 2, 212)),
            roughness: 0.5,
            metallic: 0.0,
            height: 2e-5 * thread,
        }
    })
}

/// Strands along v.
fn hair() -> Surface {
    Surface::bake(256, 128, Vec2::splat(0.1), |p| {
        let q = p / 0.1;
        let strand = noise(q * Vec2::new(90.0, 2.0), [90, 2], 221);
        let lock = noise(q * Vec2::new(14.0, 1.0), [14, 1], 222);
        Texel {
            colour: srgb(0x18120f) * (1.0 + 0.5 * strand + 0.3 * lock),
            roughness: 0.3,
            metallic: 0.0,
            height: 5e-5 * strand + 2.2e-4 * lock,
        }
    })
}

/// Gold figures of leaf and lozenge (uroko) on red silk.
fn band() -> Surface {
    let (ground, gold) = (srgb(0x9c2018), Vec3::new(0.90, 0.62, 0.26));
    Surface::bake(256, 256, Vec2::splat(0.1), |p| {
        let q = p / 0.1 * Vec2::new(6.0, 6.0);
        let cell = q - q.floor();
        // Triangles like scales.
        let over = cell.y > (2.0 * cell.x - 1.0).abs();
        let thread = noise(p / 0.1 * Vec2::new(160.0, 110.0), [160, 110], 231);
        let t = if over { 1.0 } else { 0.0 };
        Texel {
            colour: mix(ground, gold, t) * (1.0 + 0.07 * thread),
            roughness: 0.5 - 0.12 * t,
            metallic: t,
            height: 6e-5 * t + 2e-5 * thread,
        }
    })
}

fn skin() -> Surface {
    Surface::bake(128, 128, Vec2::splat(0.25), |p| {
        let q = p / 0.25;
        let cloud = fbm(q * 5.0, [5; 2], 4, 241);
        let pore = noise(q * 60.0, [60; 2], 242);
        Texel {
            colour: srgb(0xc48f6e) * (1.0 + 0.06 * cloud),
            roughness: 0.48 + 0.05 * cloud,
            metallic: 0.0,
            height: 4e-5 * pore,
        }
    })
}

/// White glossed silk (neri), in plain weave.
fn white() -> Surface {
    Surface::bake(128, 128, Vec2::splat(0.25), |p| {
        let q = p / 0.25;
        let cloud = fbm(q * 4.0, [4; 2], 3, 251);
        let thread = noise(q * Vec2::new(60.0, 60.0), [60, 60], 252);
        Texel {
            colour: srgb(0xe6dfd0) * (1.0 + 0.03 * cloud),
            roughness: 0.6,
            metallic: 0.0,
            height: 3e-5 * thread,
        }
    })
}

/// Paper with gold leaf, laid in squares, and red clouds at its ends: a woman's fan.
fn gilt_paper() -> Surface {
    let (gold, red, pine) = (Vec3::new(0.93, 0.66, 0.28), srgb(0x8e1b14), srgb(0x2b4a30));
    Surface::bake(512, 256, Vec2::new(0.6, 0.22), |p| {
        let q = p / Vec2::new(0.6, 0.22);
        let leaf = Vec2::new(12.0 * q.x, 5.0 * q.y);
        let edge = (leaf - leaf.floor()).min(1.0 - (leaf - leaf.floor())).min_element();
        let tone = lattice(leaf.x as i32, leaf.y as i32, 261);
        let cloud = fbm(q * Vec2::new(7.0, 3.0), [7, 3], 4, 262);
        let wave = 0.10 * (TAU * 3.0 * q.x).sin();
        // Clouds above and to the sides, and between them three sprays of pine.
        let over = smoothstep(0.02, -0.02, q.y - 0.26 - wave + 0.12 * cloud).max(smoothstep(
            0.02,
            -0.02,
            0.90 - q.y + 0.05 * cloud,
        ));
        let mut needle = 0.0f32;
        for (x, y) in [(0.27, 0.62), (0.5, 0.56), (0.73, 0.62)] {
            let d = (q - Vec2::new(x, y)) * Vec2::new(2.7, 1.0);
            let turn = d.y.atan2(d.x);
            let spray = (26.0 * turn).sin().abs();
            let far = d.length();
            needle = needle.max(
                smoothstep(0.55, 0.9, spray) * smoothstep(0.17, 0.15, far) * smoothstep(0.01, 0.03, far),
            );
        }
        let paint = over.max(needle);
        let colour = gold * (0.92 + 0.08 * tone) * (0.85 + 0.15 * smoothstep(0.0, 0.03, edge));
        Texel {
            colour: mix(mix(colour, pine, needle), red * (1.0 + 0.1 * cloud), over),
            roughness: 0.3 + 0.08 * tone + 0.2 * paint,
            metallic: 1.0 - paint,
            height: 1.5e-5 * paint,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tiles(finish: Finish) -> bool {
        use Finish::{BambooPainting, Curtain, Fan, Hannya, Omote, PineLeft, PineMiddle, PineRight};
        ![BambooPainting, Curtain, Fan, Hannya, Omote, PineLeft, PineMiddle, PineRight].contains(&finish)
    }

    #[test]
    fn textures_are_reflectances_no_larger_than_needed_and_tile() {
        for finish in Finish::ALL {
            let Some(s) = finish.surface(0.55) else {
                assert_eq!(finish, Finish::Cloth);
                continue;
            };
            assert!(s.width <= 1024 && s.height <= 1024 && s.texels.len() == s.width * s.height);
            for t in &s.texels {
                assert!(
                    t.colour.is_finite() && t.colour.min_element() >= 0.0 && t.colour.max_element() <= 1.0,
                    "{finish:?} {t:?}"
                );
                assert!(t.roughness.is_finite() && t.height.is_finite());
            }
            // Neighbours over the seam differ as others do.
            let at = |x: usize, y: usize| s.texels[(y % s.height) * s.width + x % s.width].colour;
            let step = |x: usize, d: [usize; 2], n: usize| -> f32 {
                (0..n)
                    .map(|i| {
                        if d[0] == 1 {
                            (at(x, i) - at(x + 1, i)).length()
                        } else {
                            (at(i, x) - at(i, x + 1)).length()
                        }
                    })
                    .sum::<f32>()
                    / n as f32
            };
            for (d, n, last) in [([1, 0], s.height, s.width - 1), ([0, 1], s.width, s.height - 1)] {
                let usual = (1..16).map(|k| step(k * last / 16, d, n)).fold(0.0, f32::max);
                let seam = step(last, d, n);
                // Twice the largest of fifteen others; boards of the floor do end there, across.
                let allowed =
                    !tiles(finish) || finish == Finish::Floor && d == [0, 1] || seam < 2.0 * usual + 1e-3;
                assert!(allowed, "{finish:?} {d:?}: {seam} {usual}");
            }
        }
    }

    #[test]
    fn gravel_throws_back_what_the_table_says() {
        for albedo in [0.5, 0.55, 0.6] {
            let s = Finish::Gravel.surface(albedo).unwrap();
            let mean =
                s.texels.iter().map(|t| t.colour.element_sum() / 3.0).sum::<f32>() / s.texels.len() as f32;
            assert!((mean - albedo).abs() < 0.005, "{mean} {albedo}");
        }
    }
}
