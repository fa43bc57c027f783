//! Ink painting (sumi-e): what a brush would make of a scene.
//!
//! Lines are found on meshes, seen or not by the depth of the real-time renderer, chosen, and given pressure, dryness and ink
//! along their way; the GPU prints them stamp by stamp, evens out overlap, lets bristles run dry over the grain of the paper and
//! lays pigments over one another. The strokes themselves are kept: they leave as vectors.
//!
//! | file | what is in it |
//! | --- | --- |
//! | [`topology`] | welded vertices, edges, creases and borders of a mesh |
//! | [`contour`] | where a surface turns away from the eye (gou), chained |
//! | [`suggestive`], [`curvature`] | where it would from a little aside; how it bends |
//! | [`zero_set`] | where values of a mesh are zero, chained |
//! | [`depth`] | what is in front at each pixel |
//! | [`visibility`] | lines in the picture, and which parts of them are seen |
//! | [`select`] | which lines are drawn where they crowd |
//! | [`tracking`] | strokes that stay what they are from frame to frame |
//! | [`piece`] | parts of lines that are drawn in one go |
//! | [`stroke`] | lines as strokes: pressure, dryness, ink |
//! | [`mist`] | what lies before what is far and low |
//! | [`tone`], [`scatter`] | how dark a place is; places that stay on surfaces |
//! | [`wash`], [`wrinkle`], [`rub`], [`dot`] | colour wash (ran), wrinkles (cun), rubbing (ca), dots (dian) |
//! | [`stamp`], [`footprint`] | prints of the brush and what one looks like |
//! | [`brush`] | bristles from the picture or the photograph of a stroke |
//! | [`canvas`], [`resolve`] | stamps to loads of ink to a picture, on the GPU |
//! | [`flow`], [`dispersion`] | water and ink that run in paper, on the processor and on the GPU |
//! | [`paper`], [`pigment`] | what is painted on and with |
//! | [`signature`] | an inscription and the artist's seal |
//! | [`mount`] | what a painting hangs, rolls or folds in |
//! | [`svg`], `path`, `isoline` | strokes as vectors, closed curves, outlines of a picture |
//! | [`literal`] | the slides of Xu, Yang and Wu 2012 as they stand, for comparison |
//! | [`control`], [`preset`] | what is steered, and ways of painting |
//! | [`steering`] | what of single objects and strokes is otherwise |
//! | [`mask`] | pictures that say where something is otherwise; a brush that paints them |
//! | [`place_controls`], [`texture_coordinates`] | the controls place by place; texture coordinates of places on lines |
//! | [`painter`] | all of it in order |
//!
//! Lengths are in pixels of a picture of 1080 lines where nothing else is said, so that a painting looks the same in any size.

pub mod brush;
pub mod canvas;
pub mod contour;
pub mod control;
pub mod curvature;
pub mod depth;
pub mod dispersion;
pub mod dot;
mod drying;
mod error;
pub mod flow;
pub mod footprint;
mod isoline;
pub mod literal;
pub mod mask;
pub mod mist;
pub mod mount;
pub mod painter;
pub mod paper;
mod passes;
mod path;
pub mod piece;
pub mod pigment;
pub mod place_controls;
pub mod preset;
pub mod projection;
pub mod resolve;
pub mod rub;
pub mod scatter;
pub mod select;
pub mod signature;
pub mod stamp;
pub mod steering;
pub mod stroke;
pub mod suggestive;
pub mod svg;
pub mod texture_coordinates;
pub mod tone;
pub mod topology;
pub mod tracking;
pub mod visibility;
pub mod wash;
pub mod wrinkle;
pub mod zero_set;

pub use error::InkError;
