//! Where trousers begin: a tube about the hips that parts into one about each leg.

use super::place::{Arrangement, LAP, ROOM, Spot};
use super::{Body, GarmentError, Legs, Wear};
use crate::RigidPose;
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};
use yugen_optics::special::smoothstep;

/// From one leg of the trousers to the other where they begin, half of it, m.
const APART: f32 = 0.5 * LAP;
/// What must at least be left between a leg and its tube, m.
const LOOSE: f32 = 0.005;

impl Arrangement {
    /// About the legs of a body that stands upright.
    pub(super) fn about_legs(
        wear: &Wear,
        legs: Legs,
        body: &Body,
        poses: &[RigidPose],
    ) -> Result<Self, GarmentError> {
        let pelvis = poses[body.pelvis].position;
        let top = pelvis.y + body.tied + 0.5 * (wear.belt[1] - wear.belt[0]);
        let wrong = |problem: String| Err(GarmentError::Body(problem));
        // Hands may hang beside the hips.
        let arms = |joint: usize| body.arms.iter().any(|arm| arm.contains(&joint));
        let own = Body {
            capsules: body.capsules.iter().filter(|c| !arms(c.joint)).copied().collect(),
            ..Body::default()
        };
        let hips = own.discs(poses, [top - legs.crotch, top]);
        let (low, high) = hips
            .iter()
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), (p, r)| (l.min(p.y - r), h.max(p.y + r)));
        let depth = (0.5 * (high - low) + ROOM).max(0.1);
        if depth.is_nan() || depth >= legs.round / PI {
            return wrong(format!(
                "is {:.2} m deep at the hips; trousers that are {:.2} m around them have room for {:.2} m",
                high - low,
                2.0 * legs.round,
                2.0 * (legs.round / PI - ROOM)
            ));
        }
        let middle = Vec2::new(pelvis.x, 0.5 * (low + high));
        let below = own.discs(poses, [top - wear.length, top - legs.crotch]);
        let radius = legs.round / TAU;
        let mut centres = [Vec2::ZERO; 2];
        for (centre, side) in centres.iter_mut().zip([1.0, -1.0]) {
            let of_side: Vec<(Vec2, f32)> = below
                .iter()
                .map(|(p, r)| (Vec2::new(side * (p.x - middle.x), p.y), *r))
                .filter(|(p, _)| p.x > 0.0)
                .collect();
            // Feet reach where a hem does not; what counts is how wide legs stand.
            let (near, far) = of_side
                .iter()
                .fold((f32::INFINITY, f32::NEG_INFINITY), |(n, f), (p, r)| (n.min(p.x - r), f.max(p.x + r)));
            let name = if side > 0.0 { "left" } else { "right" };
            if near > far {
                return wrong(format!("has no {name} leg below where the trousers part"));
            }
            let z = of_side.iter().map(|(p, _)| p.y).sum::<f32>() / of_side.len() as f32;
            let [wide, most] = [far - near, 2.0 * (radius - LOOSE)];
            if wide > most {
                return wrong(format!(
                    "has a {name} leg {wide:.2} m wide below where the trousers part; these, {:.2} m around each, have room for {most:.2} m",
                    legs.round
                ));
            }
            if near < APART {
                return wrong(format!(
                    "has a {name} leg that comes within {near:.3} m of its middle below where the trousers part; cloth between legs needs \
                     {APART:.3} m"
                ));
            }
            let x = (0.5 * (near + far)).max(radius + APART);
            *centre = Vec2::new(side * x, z - middle.y);
        }
        Ok(Self {
            wear: *wear,
            middle,
            top,
            depth,
            under: 0.0,
            back: 0.0,
            opened: 0.0,
            beside: [0.0; 2],
            centres,
        })
    }

    /// A spot in the world.
    pub(super) fn on_leg(&self, spot: &Spot, legs: Legs) -> Vec3 {
        let (oval, _) = self.oval(spot.x, legs.round);
        let centre = self.centres[usize::from(!spot.left)];
        let angle = TAU * spot.x.abs() / legs.round;
        let side = if spot.left { 1.0 } else { -1.0 };
        let circle = centre - Vec2::new(side * angle.cos(), angle.sin()) * (legs.round / TAU);
        let p = self.middle + oval.lerp(circle, smoothstep(0.2 * legs.crotch, legs.crotch, spot.s));
        Vec3::new(p.x, self.top - spot.s, p.y)
    }
}
