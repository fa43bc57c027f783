//! Cameras, films, reconstruction filters and samplers.

use super::Builder;
use super::document::Class;
use super::properties::Properties;
use crate::Error;
use glam::Vec2;
use yugen_scene::{Camera, Film, Filter, FovAxis, Projection};

/// Pixels along a side of a picture.
const MAX_SIDE: u32 = 1 << 16;

impl Builder<'_> {
    pub(super) fn camera(&mut self, p: Properties) -> Result<Camera, Error> {
        if !["perspective", "thinlens", "orthographic"].contains(&p.plugin()) {
            return Err(p.unknown_plugin());
        }
        let film = p.child(Class::Film)?.map_or(Ok(Film::default()), film)?;
        let samples_per_pixel = match p.child(Class::Sampler)? {
            Some(s) => {
                s.check_plugin()?;
                s.accept(&["seed", "jitter", "strength", "scramble", "dimension"]);
                let n = s.count("sample_count", 4, 1, u32::MAX)?;
                s.finish()?;
                n
            }
            None => 4,
        };
        p.accept(&["shutter_open", "shutter_close"]);
        let near = p.float_in("near_clip", 1e-2, |v| v > 0.0, "more than 0")?;
        let far =
            p.float_in("far_clip", 1e4, |v| v > near, &format!("more than near_clip, which is {near}"))?;
        let focus_distance = p.float("focus_distance", far)? as f32;
        let to_world = p.to_world()?;
        let projection = if p.plugin() == "orthographic" {
            Projection::Orthographic
        } else {
            let aspect = f64::from(film.width) / f64::from(film.height);
            let aperture_radius = if p.plugin() == "thinlens" {
                p.float_or_none("aperture_radius")?.ok_or_else(|| p.missing("aperture_radius"))? as f32
            } else {
                0.0
            };
            // Mitsuba moves the centre of projection over the picture, and so the picture the other way.
            let principal_point = Vec2::new(
                -p.float("principal_point_offset_x", 0.0)? as f32,
                -p.float("principal_point_offset_y", 0.0)? as f32,
            );
            let (fov_x, fov_axis) = field_of_view(p, aspect)?;
            Projection::Perspective {
                fov_x: fov_x as f32,
                fov_axis,
                aperture_radius,
                focus_distance,
                principal_point,
            }
        };
        p.finish()?;
        Ok(Camera {
            name: p.id().to_string(),
            to_world,
            projection,
            near_far: [near as f32, far as f32],
            film,
            samples_per_pixel,
        })
    }
}

/// Across the width, in radians, and what it was given along: `fov` and its axis, or the diagonal by `focal_length`.
pub(super) fn field_of_view(p: Properties, aspect: f64) -> Result<(f64, FovAxis), Error> {
    if p.has("fov") && p.has("focal_length") {
        return Err(p.invalid("'fov' and 'focal_length' cannot both be given"));
    }
    let across =
        |half_tangent: f64, axis: FovAxis| Ok((2.0 * (half_tangent * axis.width_share(aspect)).atan(), axis));
    if p.has("fov") {
        let fov = p.float_in("fov", 0.0, |v| v > 0.0 && v < 180.0, "degrees between 0 and 180")?.to_radians();
        let axis = p.choice("fov_axis", "x", &["x", "y", "diagonal", "smaller", "larger"])?;
        let axis = match axis {
            "y" => FovAxis::Y,
            "diagonal" => FovAxis::Diagonal,
            "smaller" => FovAxis::Smaller,
            "larger" => FovAxis::Larger,
            _ => FovAxis::X,
        };
        return across((0.5 * fov).tan(), axis);
    }
    // The focal length of a 35 mm camera, whose frame is 36 x 24 mm; 50 mm where nothing is said.
    let (text, at) = p.string("focal_length")?.map_or(("50mm", None), |(t, at)| (t, Some(at)));
    let millimetres = text.trim().strip_suffix("mm").unwrap_or(text).trim().parse::<f64>();
    match (millimetres, at) {
        (Ok(f), _) if f > 0.0 && f.is_finite() => across(36f64.hypot(24.0) / (2.0 * f), FovAxis::Diagonal),
        (_, at) => Err(Error::invalid(
            at.map_or(p.place(), |at| p.place_of(at)),
            format!("expected a focal length such as '50mm', found '{text}'"),
        )),
    }
}

fn film(p: Properties) -> Result<Film, Error> {
    match p.plugin() {
        "hdrfilm" => {}
        // Of 0.6: the same picture, for display. How it is shown is chosen where it is written.
        "ldrfilm" => {
            p.accept(&["gamma", "exposure", "key", "burn", "tonemap_method", "has_vignetting", "attach_log"])
        }
        _ => return Err(p.unknown_plugin()),
    }
    p.accept(&["file_format", "pixel_format", "component_format", "sample_border", "banner", "compensate"]);
    let default = Film::default();
    let width = p.count("width", default.width, 1, MAX_SIDE)?;
    let height = p.count("height", default.height, 1, MAX_SIDE)?;
    let x = p.count("crop_offset_x", 0, 0, width - 1)?;
    let y = p.count("crop_offset_y", 0, 0, height - 1)?;
    let w = p.count("crop_width", width, 1, width)?;
    let h = p.count("crop_height", height, 1, height)?;
    if x + w > width || y + h > height {
        return Err(p.invalid(format!(
            "the crop {w} x {h} at ({x}, {y}) reaches out of the picture of {width} x {height}"
        )));
    }
    let crop = ([x, y, w, h] != [0, 0, width, height]).then_some([x, y, w, h]);
    let filter = p.child(Class::Filter)?.map_or(Ok(default.filter), filter)?;
    p.finish()?;
    Ok(Film { width, height, crop, filter })
}

fn filter(p: Properties) -> Result<Filter, Error> {
    // Wider filters than this mix pixels that have nothing to do with each other, and cost its square.
    let radius = |name, default| {
        p.float_in(name, default, |v| v > 0.0 && v <= 64.0, "more than 0, at most 64 pixels")
            .map(|v| v as f32)
    };
    let filter = match p.plugin() {
        "box" => Filter::Box,
        "tent" => Filter::Tent { radius: radius("radius", 1.0)? },
        "gaussian" => Filter::Gaussian { stddev: radius("stddev", 0.5)? },
        "mitchell" => {
            Filter::Mitchell { b: p.float("B", 1.0 / 3.0)? as f32, c: p.float("C", 1.0 / 3.0)? as f32 }
        }
        "catmullrom" => Filter::CatmullRom,
        "lanczos" => Filter::Lanczos { lobes: p.count("lobes", 3, 1, 64)? as f32 },
        _ => return Err(p.unknown_plugin()),
    };
    p.finish()?;
    Ok(filter)
}
