//! What a cloth is made of, by quantities that are measured on cloth.

/// A cloth as an instrument sees it.
///
/// Bending is given by Peirce's bending length c ("The handle of cloth as a measurable quantity", Journal of the Textile
/// Institute 21, 1930): a strip's flexural rigidity is its weight times the cube of it, G = W c³, whatever the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fabric {
    /// Mass of an area, kg/m².
    pub areal_mass: f32,
    /// Tensile modulus along the warp, N/m: force on a width for a strain of one.
    pub warp: f32,
    /// Along the weft, N/m.
    pub weft: f32,
    /// Shear modulus, N/m.
    pub shear: f32,
    /// Bending length of strips along the warp, m.
    pub bending_warp: f32,
    /// Of strips along the weft, m.
    pub bending_weft: f32,
    /// Retardation time of stretch, s: a spring of stiffness k has a damper of this times k (Kelvin and Voigt).
    pub damping: f32,
    /// Of bending, s.
    pub bending_damping: f32,
    /// Strain at which threads are straight and stretch no further, along warp and weft.
    pub limit: f32,
    /// The same along the bias, where shear locks.
    pub bias_limit: f32,
    /// Coefficient of friction on a body.
    pub friction: f32,
    /// On cloth.
    pub layer_friction: f32,
    /// Thickness, m.
    pub thickness: f32,
}

/// A number of a fabric: its range and what it is.
#[derive(Clone, Copy, Debug)]
pub struct Quantity {
    /// As in [`Fabric`] and files.
    pub name: &'static str,
    /// Least and most.
    pub range: [f32; 2],
    /// Of both.
    pub unit: &'static str,
    /// Reads it.
    pub get: fn(&Fabric) -> f32,
    /// The place to write it to.
    pub place: fn(&mut Fabric) -> &mut f32,
}

macro_rules! quantities {
    ($($name:ident $low:literal $high:literal $unit:literal)*) => {
        /// The numbers of a fabric. Ranges go from below the lightest silk gauze to beyond carpets and sailcloth.
        pub const QUANTITIES: &[Quantity] = &[$(Quantity {
            name: stringify!($name),
            range: [$low, $high],
            unit: $unit,
            get: |f| f.$name,
            place: |f| &mut f.$name,
        }),*];
    };
}

quantities! {
    areal_mass 0.005 5.0 "kg/m²"
    warp 1.0 1e6 "N/m"
    weft 1.0 1e6 "N/m"
    shear 0.0 1e6 "N/m"
    bending_warp 0.0 0.5 "m"
    bending_weft 0.0 0.5 "m"
    damping 0.0 1.0 "s"
    bending_damping 0.0 1.0 "s"
    limit 0.0 1.0 ""
    bias_limit 0.0 1.0 ""
    friction 0.0 10.0 ""
    layer_friction 0.0 10.0 ""
    thickness 0.00002 0.02 "m"
}

/// A fabric of the table, with the source of its numbers.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// As in files.
    pub name: &'static str,
    /// Its numbers.
    pub fabric: Fabric,
    /// Where each is from, and which are assumed.
    pub source: &'static str,
}

/// Said of all presets: what no source was found for.
const ASSUMED: &str = "Assumed of all: moduli (in the order of silks on the KES-F tensile tester), shear (KES-F shear of woven \
     cloth is .3 to 1.5 gf/(cm·degree), 17 to 84 N/m), strain limits, dampings, friction (silk on silk .25 to .4).";

const SILK: Fabric = Fabric {
    areal_mass: 0.069,
    warp: 1200.0,
    weft: 900.0,
    shear: 30.0,
    bending_warp: 0.016,
    bending_weft: 0.014,
    damping: 0.002,
    bending_damping: 0.01,
    limit: 0.01,
    bias_limit: 0.25,
    friction: 0.35,
    layer_friction: 0.3,
    thickness: 0.00015,
};

/// The fabrics with a name.
pub const PRESETS: &[Preset] = &[
    Preset {
        name: "silk",
        fabric: SILK,
        source: "plain habutae of 16 momme: 16 × 4.34 g/m² by definition of the momme. Bending length assumed, such that its \
                 drape coefficient is among those published for silk, 20 to 40 %.",
    },
    Preset {
        name: "karaori",
        fabric: Fabric {
            areal_mass: 0.45,
            warp: 4000.0,
            weft: 3000.0,
            shear: 60.0,
            bending_warp: 0.034,
            bending_weft: 0.042,
            bias_limit: 0.2,
            friction: 0.4,
            layer_friction: 0.35,
            thickness: 0.0011,
            ..SILK
        },
        source: "twill ground with floating pattern wefts. Areal mass assumed within .35 to .6 kg/m²: no measurement was found. \
                 Bending assumed, stiffer along the floats of the weft.",
    },
    Preset {
        name: "kinran",
        fabric: Fabric {
            areal_mass: 0.38,
            warp: 3500.0,
            weft: 6000.0,
            shear: 70.0,
            bending_warp: 0.030,
            bending_weft: 0.050,
            bias_limit: 0.15,
            friction: 0.35,
            layer_friction: 0.3,
            thickness: 0.0007,
            ..SILK
        },
        source: "silk with strips of gilt paper, .3 to .5 mm wide, along the weft. Areal mass assumed (no measurement was found), \
                 and bending: paper makes the weft stiff.",
    },
    Preset {
        name: "hemp",
        fabric: Fabric {
            areal_mass: 0.16,
            warp: 8000.0,
            weft: 7000.0,
            shear: 80.0,
            bending_warp: 0.040,
            bending_weft: 0.036,
            bias_limit: 0.2,
            friction: 0.45,
            layer_friction: 0.4,
            thickness: 0.0004,
            ..SILK
        },
        source: "plain weave of ramie or hemp, as of summer robes and hakama. All assumed, by linens of shirts.",
    },
];

impl Fabric {
    /// Which of [`PRESETS`] cloth is made of where nobody says it.
    pub const DEFAULT: &str = "karaori";

    /// The fabric of this name in [`PRESETS`].
    pub fn preset(name: &str) -> Option<&'static Preset> {
        PRESETS.iter().find(|p| p.name == name)
    }

    /// What no source was found for, said of all presets.
    pub fn assumed() -> &'static str {
        ASSUMED
    }

    /// Flexural rigidity along warp and weft for a width of one, N·m, with gravity of 9.80665 m/s².
    pub fn rigidity(&self) -> [f64; 2] {
        // Of the standard acceleration: bending lengths are measured on Earth.
        let weight = f64::from(self.areal_mass) * 9.80665;
        [self.bending_warp, self.bending_weft].map(|c| weight * f64::from(c).powi(3))
    }

    /// Whether every number is within its range.
    pub fn check(&self) -> Result<(), super::ClothError> {
        for q in QUANTITIES {
            let (value, [low, high]) = ((q.get)(self), q.range);
            if !(low..=high).contains(&value) {
                return Err(super::ClothError::Range { name: q.name, value, unit: q.unit, low, high });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_within_their_ranges_and_what_is_not_is_told() {
        for preset in PRESETS {
            assert_eq!(preset.fabric.check(), Ok(()), "{}", preset.name);
            assert!(preset.source.to_lowercase().contains("assumed"));
            assert!(Fabric::preset(preset.name).is_some());
        }
        assert!(Fabric::preset("carpet").is_none() && Fabric::preset(Fabric::DEFAULT).is_some());
        for quantity in QUANTITIES {
            for wrong in [f32::NAN, -1.0, f32::INFINITY] {
                let mut fabric = SILK;
                *(quantity.place)(&mut fabric) = wrong;
                let said = fabric.check().unwrap_err().to_string();
                assert!(said.contains(quantity.name), "{said}");
            }
        }
    }
}
