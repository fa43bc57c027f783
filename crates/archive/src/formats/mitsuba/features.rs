//! What is read of Mitsuba 3.9.1, plugin by plugin, and of what version 0.6 had besides.

use crate::formats::support::Feature;

const POINTS: &str = "the renderer takes its own low-discrepancy points; the number of samples is read";
const MEDIA: &str = "no participating media; remove the medium";
const POLARISED: &str = "light is not polarised here";
const SPECTRAL: &str = "light is carried in three colours";
const GRADIENTS: &str = "no derivatives of pictures; use path";
const SENSORS: &str = "sensors make pictures here";

/// Each plugin as `class: name`.
pub const FEATURES: &[Feature] = &[
    Feature::yes("bsdf: blendbsdf"),
    Feature::yes("bsdf: bumpmap"),
    Feature::no("bsdf: circular", POLARISED),
    Feature::yes("bsdf: conductor"),
    Feature::yes("bsdf: dielectric"),
    Feature::yes("bsdf: diffuse"),
    Feature::no("bsdf: hair", "no curves to wear it; weave cloth with `yugen capture weave`"),
    Feature::yes("bsdf: mask"),
    Feature::partly("bsdf: measured", "tables in three colours from spectra, as in the rgb variants"),
    Feature::no("bsdf: measured_polarized", POLARISED),
    Feature::yes("bsdf: normalmap"),
    Feature::yes("bsdf: null"),
    Feature::yes("bsdf: phong"),
    Feature::yes("bsdf: plastic"),
    Feature::no("bsdf: polarizer", POLARISED),
    Feature::no("bsdf: pplastic", "use roughplastic; light is not polarised here"),
    Feature::yes("bsdf: principled"),
    Feature::yes("bsdf: principledthin"),
    Feature::no("bsdf: retarder", POLARISED),
    Feature::yes("bsdf: roughconductor"),
    Feature::yes("bsdf: roughdielectric"),
    Feature::partly("bsdf: roughdiffuse", "a texture of alpha"),
    Feature::yes("bsdf: roughplastic"),
    Feature::yes("bsdf: thindielectric"),
    Feature::yes("bsdf: twosided"),
    Feature::yes("bsdf: ward"),
    Feature::yes("emitter: area"),
    Feature::yes("emitter: constant"),
    Feature::yes("emitter: directional"),
    Feature::no(
        "emitter: directionalarea",
        "no surface that shines in one direction; use a projector or a spot",
    ),
    Feature::yes("emitter: envmap"),
    Feature::yes("emitter: point"),
    Feature::yes("emitter: projector"),
    Feature::yes("emitter: spot"),
    Feature::no("emitter: sunsky", "no model of the sky; bake it to a picture and use envmap"),
    Feature::no("emitter: timed_sunsky", "no model of the sky; bake it to a picture and use envmap"),
    Feature::partly("film: hdrfilm", "file and pixel formats; the name of the output says them"),
    Feature::partly("film: ldrfilm", "tone mapping; --curve and --exposure say it"),
    Feature::no("film: specfilm", SPECTRAL),
    Feature::partly("integrator: aov", "dp_du, dp_dv, prim_index, boundary_test"),
    Feature::yes("integrator: depth"),
    Feature::partly("integrator: direct", "how many samples of each kind, beyond none"),
    Feature::partly("integrator: moment", "the second moment is kept as the variance of the mean"),
    Feature::yes("integrator: path"),
    Feature::no("integrator: direct_projective", GRADIENTS),
    Feature::no("integrator: prb", GRADIENTS),
    Feature::no("integrator: prb_basic", GRADIENTS),
    Feature::no("integrator: prb_projective", GRADIENTS),
    Feature::no("integrator: prbvolpath", GRADIENTS),
    Feature::no("integrator: ptracer", "use path, which finds the same light"),
    Feature::no("integrator: stokes", POLARISED),
    Feature::partly("integrator: volpath", MEDIA),
    Feature::partly("integrator: volpathmis", MEDIA),
    Feature::no("integrator: volprim_rf_basic", MEDIA),
    Feature::no("medium: heterogeneous", MEDIA),
    Feature::no("medium: homogeneous", MEDIA),
    Feature::no("phase: blendphase", MEDIA),
    Feature::no("phase: hg", MEDIA),
    Feature::no("phase: isotropic", MEDIA),
    Feature::no("phase: rayleigh", MEDIA),
    Feature::no("phase: sggx", MEDIA),
    Feature::no("phase: tabphase", MEDIA),
    Feature::yes("rfilter: box"),
    Feature::yes("rfilter: catmullrom"),
    Feature::yes("rfilter: gaussian"),
    Feature::yes("rfilter: lanczos"),
    Feature::yes("rfilter: mitchell"),
    Feature::yes("rfilter: tent"),
    Feature::partly("sampler: halton", POINTS),
    Feature::partly("sampler: hammersley", POINTS),
    Feature::partly("sampler: independent", POINTS),
    Feature::partly("sampler: ldsampler", POINTS),
    Feature::partly("sampler: multijitter", POINTS),
    Feature::partly("sampler: orthogonal", POINTS),
    Feature::partly("sampler: sobol", POINTS),
    Feature::partly("sampler: stratified", POINTS),
    Feature::no("sensor: batch", "render its cameras one by one with --camera"),
    Feature::no("sensor: distant", SENSORS),
    Feature::no("sensor: irradiancemeter", SENSORS),
    Feature::yes("sensor: orthographic"),
    Feature::yes("sensor: perspective"),
    Feature::no("sensor: radiancemeter", SENSORS),
    Feature::partly("sensor: thinlens", "the shape of the aperture: a disc"),
    Feature::no("shape: blender", "Blender hands it over in memory; export the mesh to a file"),
    Feature::no("shape: bsplinecurve", "no curves; convert them to meshes"),
    Feature::yes("shape: cube"),
    Feature::yes("shape: cylinder"),
    Feature::yes("shape: disk"),
    Feature::no("shape: ellipsoids", "no ellipsoids; a sphere under a scale is one"),
    Feature::no("shape: ellipsoidsmesh", "no ellipsoids; a sphere under a scale is one"),
    Feature::yes("shape: instance"),
    Feature::no("shape: linearcurve", "no curves; convert them to meshes"),
    Feature::no("shape: merge", "shapes are joined in any case; put them side by side"),
    Feature::yes("shape: obj"),
    Feature::yes("shape: ply"),
    Feature::yes("shape: rectangle"),
    Feature::no("shape: sdfgrid", "no distance fields; convert it to a mesh"),
    Feature::yes("shape: serialized"),
    Feature::partly("shape: shapegroup", "shapes that emit"),
    Feature::yes("shape: sphere"),
    Feature::partly("texture: bitmap", "formats of storage; the picture is kept as floats"),
    Feature::no("texture: blackbody", "write the colour as rgb"),
    Feature::yes("texture: checkerboard"),
    Feature::yes("texture: d65"),
    Feature::yes("texture: irregular"),
    Feature::partly("texture: mesh_attribute", "attributes of vertices and faces"),
    Feature::yes("texture: rawconstant"),
    Feature::yes("texture: regular"),
    Feature::yes("texture: srgb"),
    Feature::yes("texture: uniform"),
    Feature::no("texture: volume", MEDIA),
    Feature::no("volume: constvolume", MEDIA),
    Feature::no("volume: gridvolume", MEDIA),
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// Every plugin that comes with Mitsuba 3.9.1, as its folder of plugins and its Python package name them.
    const OF_3_9_1: &str = "aov area batch bitmap blackbody blendbsdf blender blendphase box bsplinecurve bumpmap \
        catmullrom checkerboard circular conductor constant constvolume cube cylinder d65 depth dielectric diffuse \
        direct direct_projective directional directionalarea disk distant ellipsoids ellipsoidsmesh envmap gaussian \
        gridvolume hair hdrfilm heterogeneous hg homogeneous independent instance irradiancemeter irregular isotropic \
        lanczos ldsampler linearcurve mask measured measured_polarized merge mesh_attribute mitchell moment \
        multijitter normalmap null obj orthogonal orthographic path perspective plastic ply point polarizer pplastic \
        prb prb_basic prb_projective prbvolpath principled principledthin projector ptracer radiancemeter rawconstant \
        rayleigh rectangle regular retarder roughconductor roughdielectric roughplastic sdfgrid serialized sggx \
        shapegroup specfilm sphere spot srgb stokes stratified sunsky tabphase tent thindielectric thinlens \
        timed_sunsky twosided uniform volpath volpathmis volprim_rf_basic volume";

    #[test]
    fn every_plugin_stands_in_the_table_once() {
        let names: Vec<&str> = FEATURES.iter().map(|f| f.name.split_once(": ").unwrap().1).collect();
        let missing: Vec<&str> = OF_3_9_1.split_whitespace().filter(|n| !names.contains(n)).collect();
        assert!(missing.is_empty(), "{missing:?}");
        let mut seen = HashSet::new();
        assert!(FEATURES.iter().all(|f| seen.insert(f.name)));
    }
}
