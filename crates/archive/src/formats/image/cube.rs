//! Kainz, Bogart and Hess 2004, "The OpenEXR Image File Format": cube-face environment maps.
//!
//! Six squares one below the other look along +x, −x, +y, −y, +z, −z; texels stand at the rims of a square, so that
//! neighbours share theirs.

use glam::Vec3;
use yugen_optics::Image;

/// The size of the latitude-longitude picture that shows as much as a cube whose squares are `side` wide.
pub(super) fn panorama_size(side: usize) -> [usize; 2] {
    [4 * side, 2 * side]
}

/// The latitude-longitude picture of a cube: +y up, the middle of the picture looks along +z, +x to its left.
pub(super) fn panorama(cube: &Image) -> Image {
    let side = cube.width.min(cube.height / 6);
    let [width, height] = panorama_size(side);
    let names: Vec<&str> = cube.channels.iter().map(String::as_str).collect();
    let mut out = Image::new(width, height, &names);
    for y in 0..height {
        let (sin_lat, cos_lat) = (std::f32::consts::PI * (0.5 - (y as f32 + 0.5) / height as f32)).sin_cos();
        for x in 0..width {
            let (sin, cos) = (std::f32::consts::TAU * (0.5 - (x as f32 + 0.5) / width as f32)).sin_cos();
            let [face, at_x, at_y] = place(Vec3::new(sin * cos_lat, sin_lat, cos * cos_lat), side);
            let (left, top) = (at_x.floor(), at_y.floor());
            let (s, t) = (at_x - left, at_y - top);
            let column = |x: f32| (x as usize).min(side - 1);
            let row = |y: f32| face as usize * side + (y as usize).min(side - 1);
            let texels = [
                (cube.pixel(column(left), row(top)), (1.0 - s) * (1.0 - t)),
                (cube.pixel(column(left + 1.0), row(top)), s * (1.0 - t)),
                (cube.pixel(column(left), row(top + 1.0)), (1.0 - s) * t),
                (cube.pixel(column(left + 1.0), row(top + 1.0)), s * t),
            ];
            for (c, v) in out.pixel_mut(x, y).iter_mut().enumerate() {
                *v = texels.iter().map(|(texel, weight)| texel[c] * weight).sum();
            }
        }
    }
    out
}

/// The square that a direction meets, and where in it: column and row.
fn place(d: Vec3, side: usize) -> [f32; 3] {
    let last = (side - 1) as f32;
    let a = d.abs();
    // Two coordinates of the face, from −1 to 1 across it.
    let at = |v: f32, of: f32| (0.5 * (v / of + 1.0) * last).clamp(0.0, last);
    if a.x >= a.y && a.x >= a.z {
        let (up, along) = (at(d.y, a.x), at(d.z, a.x));
        if d.x > 0.0 { [0.0, along, last - up] } else { [1.0, last - along, last - up] }
    } else if a.y >= a.z {
        let (across, along) = (at(d.x, a.y), at(d.z, a.y));
        if d.y > 0.0 { [2.0, across, last - along] } else { [3.0, across, along] }
    } else {
        let (across, up) = (at(d.x, a.z), at(d.y, a.z));
        if d.z > 0.0 { [4.0, last - across, last - up] } else { [5.0, across, last - up] }
    }
}
