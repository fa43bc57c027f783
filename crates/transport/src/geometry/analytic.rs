//! Sphere, rectangle, disc and cylinder, met exactly in their own coordinates. Double precision: these
//! shapes are few, and a sphere seen from afar loses all digits of single precision.

use crate::accel::{Aabb, Ray};
use glam::{DAffine3, DVec3};
use yugen_scene::prepared::Form;

/// A form in its place.
#[derive(Clone, Debug)]
pub(super) struct Analytic {
    pub(super) form: Form,
    pub(super) to_world: DAffine3,
    pub(super) to_object: DAffine3,
}

/// Up to two distances, ascending, each with its point on the form. NaN: none.
fn roots(form: Form, o: DVec3, d: DVec3) -> [(f64, DVec3); 2] {
    const NONE: (f64, DVec3) = (f64::NAN, DVec3::ZERO);
    let flat = |inside: fn(DVec3) -> bool| {
        let t = -o.z / d.z;
        let p = (o + d * t).with_z(0.0);
        [if inside(p) { (t, p) } else { NONE }, NONE]
    };
    match form {
        Form::Rectangle => flat(|p| p.x.abs() <= 1.0 && p.y.abs() <= 1.0),
        Form::Disc => flat(|p| p.x * p.x + p.y * p.y <= 1.0),
        Form::Sphere => {
            let a = d.length_squared();
            let middle = -o.dot(d) / a;
            // Distance from the centre squared, taken at the nearest point: no cancellation from afar.
            let half = ((1.0 - (o + d * middle).length_squared()) / a).sqrt();
            [middle - half, middle + half].map(|t| (t, (o + d * t).normalize_or_zero()))
        }
        Form::Cylinder => {
            let (o2, d2) = (o.with_z(0.0), d.with_z(0.0));
            let a = d2.length_squared();
            let middle = -o2.dot(d2) / a;
            let half = ((1.0 - (o2 + d2 * middle).length_squared()) / a).sqrt();
            [middle - half, middle + half].map(|t| {
                let p = o + d * t;
                if (0.0..=1.0).contains(&p.z) {
                    (t, p.with_z(0.0).normalize_or_zero().with_z(p.z))
                } else {
                    NONE
                }
            })
        }
    }
}

impl Analytic {
    /// The nearest distance in (t_min, t_max] and the point, in the form's coordinates.
    pub(super) fn intersect(&self, ray: &Ray, t_min: f32, t_max: f32) -> Option<(f32, DVec3)> {
        let o = self.to_object.transform_point3(ray.origin.as_dvec3());
        let d = self.to_object.transform_vector3(ray.dir.as_dvec3());
        let near =
            |&(t, _): &(f64, DVec3)| (t as f32) > t_min && (t as f32) <= t_max && (t as f32) < f32::INFINITY;
        roots(self.form, o, d).into_iter().find(near).map(|(t, p)| (t as f32, p))
    }

    /// The point of the form that the ray meets near distance `t`.
    pub(super) fn point_near(&self, ray: &Ray, t: f32) -> DVec3 {
        let o = self.to_object.transform_point3(ray.origin.as_dvec3());
        let d = self.to_object.transform_vector3(ray.dir.as_dvec3());
        let t = f64::from(t);
        let [a, b] = roots(self.form, o, d);
        if (b.0 - t).abs() < (a.0 - t).abs() || a.0.is_nan() { b.1 } else { a.1 }
    }

    pub(super) fn bounds(&self) -> Aabb {
        let m = self.to_world.matrix3;
        let c = self.to_world.translation;
        let (centre, half) = match self.form {
            Form::Rectangle => (c, m.x_axis.abs() + m.y_axis.abs()),
            // A linear image of the unit ball (or disc) reaches as far as its rows are long.
            Form::Sphere => {
                (c, (m.x_axis.powf(2.0) + m.y_axis.powf(2.0) + m.z_axis.powf(2.0)).map(f64::sqrt))
            }
            Form::Disc => (c, (m.x_axis.powf(2.0) + m.y_axis.powf(2.0)).map(f64::sqrt)),
            Form::Cylinder => (
                c + 0.5 * m.z_axis,
                (m.x_axis.powf(2.0) + m.y_axis.powf(2.0)).map(f64::sqrt) + 0.5 * m.z_axis.abs(),
            ),
        };
        rounded_out(centre - half, centre + half)
    }
}

/// The box in single precision, a little larger.
fn rounded_out(lo: DVec3, hi: DVec3) -> Aabb {
    let pad = (lo.abs().max(hi.abs())) * f64::from(f32::EPSILON) * 2.0;
    Aabb { lo: (lo - pad).as_vec3(), hi: (hi + pad).as_vec3() }
}

/// The box of a transformed box.
pub(super) fn transformed(b: Aabb, m: &DAffine3) -> Aabb {
    let (lo, hi) = (b.lo.as_dvec3(), b.hi.as_dvec3());
    let centre = m.transform_point3(0.5 * (lo + hi));
    let half = 0.5 * (hi - lo);
    let a = m.matrix3;
    let half = a.x_axis.abs() * half.x + a.y_axis.abs() * half.y + a.z_axis.abs() * half.z;
    rounded_out(centre - half, centre + half)
}

/// How far the unit cube reaches under `m`, roughly.
pub(super) fn extent(m: &DAffine3) -> f32 {
    let a = m.matrix3;
    (a.x_axis.abs() + a.y_axis.abs() + a.z_axis.abs()).max_element() as f32
}
