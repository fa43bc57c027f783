//! The few controls that a painting is steered by, as one list.

use crate::InkError;
use yugen_scene::suggest;

/// What is known of a control.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// Of presets and the command line.
    pub name: &'static str,
    /// Where nobody says.
    pub default: f32,
    /// Least value.
    pub min: f32,
    /// Greatest value.
    pub max: f32,
    /// What it does.
    pub doc: &'static str,
}

macro_rules! controls {
    ($($name:ident = $default:literal, $min:literal to $max:literal: $doc:literal;)*) => {
        /// Values of all controls.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Controls {
            $(#[doc = $doc] pub $name: f32,)*
        }

        /// All controls, in the order of help texts.
        pub const CONTROLS: &[Control] = &[$(Control {
            name: stringify!($name), default: $default, min: $min, max: $max, doc: $doc,
        },)*];

        impl Default for Controls {
            fn default() -> Self {
                Self { $($name: $default,)* }
            }
        }

        impl Controls {
            /// The value of the control called `name`.
            pub fn get(&self, name: &str) -> Option<f32> {
                match name {
                    $(stringify!($name) => Some(self.$name),)*
                    _ => None,
                }
            }

            /// The control called `name`.
            fn slot(&mut self, name: &str) -> Option<&mut f32> {
                match name {
                    $(stringify!($name) => Some(&mut self.$name),)*
                    _ => None,
                }
            }
        }
    };
}

controls! {
    ink = 0.8, 0.0 to 1.5: "How dark the ink is: 0 is water, 1 freshly ground.";
    water = 0.5, 0.0 to 1.0: "How much the brush holds: how far a stroke goes before it runs dry.";
    dryness = 0.45, 0.0 to 1.0: "How soon a stroke runs dry and shows the paper between the bristles (flying white).";
    size = 1.0, 0.1 to 8.0: "Width of the brush; 1 is 18 pixels, wholly pressed, in a picture of 1080 lines.";
    roughness = 0.4, 0.0 to 1.0: "How much the hand wavers and how ragged edges are.";
    bleed = 0.5, 0.0 to 1.0: "How much of the ink of wet strokes flows into the paper around them.";
    contrast = 0.6, 0.0 to 1.0: "Difference between a stroke pressed and a stroke lifted.";
    detail = 0.6, 0.0 to 1.0: "How many of the lines are drawn: 0 the outlines, 1 all.";
    distance = 0.5, 0.0 to 1.0: "How much paler what is far away is.";
    mist = 0.0, 0.0 to 1.0: "How much mist lies over the ground: what is far and low sinks into it and is left as paper.";
    wash = 1.0, 0.0 to 2.0: "Ink of the wash (ran); 0 leaves it out.";
    wrinkle = 1.0, 0.0 to 2.0: "Ink of wrinkles (cun); 0 leaves them out.";
    rub = 0.0, 0.0 to 2.0: "Ink of rubbing (ca), a dry brush wiped over what is dark; 0 leaves it out.";
    suggestive = 0.0, 0.0 to 1.0: "Ink of suggestive contours, which would be contours from a little aside; 0 leaves them out.";
    light = 1.0, 0.1 to 10.0: "Brightness of the scene as the wash sees it.";
    flicker = 0.5, 0.0 to 1.0: "Flicker of fires in the wash: 1 as they burn at each moment, less as in the mean over a while, 0 over two seconds.";
    dot = 1.0, 0.0 to 2.0: "Ink of dots (dian), which small things become; 0 leaves them out.";
    contour = 1.0, 0.0 to 2.0: "Ink of contours (gou); 0 leaves them out.";
}

impl Controls {
    /// Gives a control a value within its range.
    pub fn set(&mut self, name: &str, value: f32) -> Result<(), InkError> {
        let Some(control) = CONTROLS.iter().find(|c| c.name == name) else {
            let hint = suggest(name, CONTROLS.iter().map(|c| c.name));
            return Err(InkError::Preset(format!("there is no control '{name}'{hint}")));
        };
        if !(control.min..=control.max).contains(&value) {
            let Control { min, max, .. } = control;
            return Err(InkError::Preset(format!("{name} = {value} is out of range: {min} to {max}")));
        }
        if let Some(slot) = self.slot(name) {
            *slot = value;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn controls_are_set_by_name_within_their_ranges() {
        let mut controls = Controls::default();
        for c in CONTROLS {
            assert!((c.min..=c.max).contains(&c.default) && !c.doc.is_empty(), "{}", c.name);
            controls.set(c.name, c.max).unwrap();
            assert_eq!(controls.get(c.name), Some(c.max));
        }
        let said = |name, value| Controls::default().set(name, value).unwrap_err().to_string();
        assert!(said("dryeness", 0.5).contains("did you mean 'dryness'?"));
        assert!(said("ink", 7.0).contains("ink = 7 is out of range: 0 to 1.5"));
        assert!(said("ink", f32::NAN).contains("out of range"));
    }
}
