//! A garment on a body that moves.

use super::belt::{Belt, Tie};
use super::cut::MOST;
use super::place::{Arrangement, spots};
use super::{Body, Cut, Garment, GarmentError};
use crate::RigidPose;
use crate::cloth::rows::Now;
use crate::cloth::{Cloth, Fabric, Settings, SmallSteps, Solid, Stance, Step};
use glam::Vec3;
use std::ops::ControlFlow;
use yugen_optics::special::smoothstep;

/// How a garment is made and simulated.
#[derive(Clone, Copy, Debug)]
pub struct Fitting {
    /// Of triangles along the threads, m.
    pub edge: f32,
    /// What it is made of.
    pub fabric: Fabric,
    /// Of a step, s: one over the frames a second.
    pub seconds: f32,
    /// Of each step, at the least: the more, the less threads stretch at the shoulders, from which all of it hangs.
    pub substeps: u32,
    /// Threads; the result does not depend on them.
    pub threads: usize,
    /// What cloth keeps from the body besides half its thickness, m: a triangle with all corners on an arm cuts into it.
    pub clearance: f32,
    /// A floor at this height, m.
    pub floor: Option<f32>,
    /// How long it is tied and settles on the body with its arms spread, then follows it to where the dance begins, s.
    pub dressing: [f32; 2],
}

impl Default for Fitting {
    /// Karaori in triangles of two centimetres at sixty frames a second, on a floor at nought.
    fn default() -> Self {
        let preset = Fabric::preset(Fabric::DEFAULT).unwrap_or(&crate::cloth::PRESETS[0]);
        Self {
            edge: 0.02,
            fabric: preset.fabric,
            seconds: 1.0 / 60.0,
            substeps: 64,
            threads: 1,
            clearance: 0.004,
            floor: Some(0.0),
            dressing: [2.0, 2.0],
        }
    }
}

impl Fitting {
    /// How far arms keep from the trunk, m: what the layers of garments between them take, if all are as thick as the thickest.
    pub fn arm_gap(&self, garments: &[Garment]) -> f32 {
        let each = garments.iter().map(|g| g.fabric.unwrap_or(self.fabric).thickness);
        2.0 * self.clearance + garments.len() as f32 * (each.fold(0.0, f32::max) + LAYER * self.edge)
    }

    /// Steps in which each garment is tied, and in which all of them then settle.
    fn steps(&self) -> [u32; 2] {
        self.dressing.map(|s| (s / self.seconds).round().clamp(1.0, 1e5) as u32)
    }

    /// Steps of putting on so many garments.
    pub fn dressing_steps(&self, garments: usize) -> u32 {
        let [each, last] = self.steps();
        each.saturating_mul(garments as u32).saturating_add(last)
    }

    /// Whether time and lengths are numbers that garments can be simulated by.
    fn check(&self, garments: &[Garment]) -> Result<(), GarmentError> {
        for (name, value, [low, high]) in [
            ("seconds of a step", self.seconds, [1e-4, 0.1]),
            ("seconds in which it is tied", self.dressing[0], [0.0, 60.0]),
            ("seconds in which it settles", self.dressing[1], [0.0, 60.0]),
            ("clearance, m,", self.clearance, [0.0, 0.05]),
            ("floor, m,", self.floor.unwrap_or(0.0), [-1e3, 1e3]),
        ] {
            if !(low..=high).contains(&value) {
                return Err(GarmentError::Fitting { name, value, low, high });
            }
        }
        let area: f64 = garments.iter().map(|g| f64::from(g.area())).sum();
        let count = area / f64::from(self.edge).powi(2);
        if count.is_nan() || count > MOST as f64 {
            return Err(GarmentError::Edge { edge: self.edge, count, most: MOST });
        }
        Ok(())
    }
}

/// Garments that are worn, in their order.
pub struct Costume {
    /// Of all of them; names and how many vertices of the mesh each has.
    cut: Cut,
    garments: Vec<(String, usize)>,
    body: Body,
    solver: SmallSteps,
    /// What the belt holds, in the coordinates of the pelvis.
    held: Vec<Tie>,
    /// Which vertices those are, in that order and sorted.
    belted: Vec<u32>,
    belt: Vec<u32>,
    /// Which vertices are of sleeves.
    sleeves: Vec<bool>,
    floor: Option<Stance>,
    /// How far arms keep from the trunk ([`Fitting::arm_gap`]), m, and where joints are as cloth meets them.
    arm_gap: f32,
    stands: Vec<RigidPose>,
    /// Filled anew in each step.
    targets: Vec<Vec3>,
    slides: Vec<Vec3>,
    stances: Vec<Stance>,
}

/// Part of the tying in which the belt is drawn shut.
const TYING: f32 = 0.7;
/// Part of the settling in which the body goes to where a dance begins; for the rest it stands there.
const UNDER_WAY: f32 = 0.75;
/// What a vertex keeps of its velocity from step to step while the garment is tied, of which sixty make a second: it comes to
/// rest where it is, without swinging.
const CALM: f32 = 0.85;
/// How firmly the belt holds cloth ([`Settings::grip`]): within some twenty substeps it is where it should be.
const GRIP: f32 = 0.2;
/// Passes that threads have which are longer than they may be ([`SmallSteps::tighten`]), once a costume is dressed: at the corners of the
/// neck, from which all of a robe hangs, in the dance of a robe of 25 mm,
/// one left 4.8 %, two 3.7 and four 2.6.
const TIGHTENED: u32 = 4;
/// Numbers of a tie.
const TIE: usize = 6;
/// As [`SmallSteps::load`], once a costume is dressed: in a robe of 30 mm at rest vertices at neck and belt trembled without end, by 4.7 mm/s in the
/// root mean square of all where this was .05, 2.8 where .1, and .3 where .15 or more. While it is tied it is .05: three crossings were
/// left in a robe of 25 mm with .2.
const LOADED: f32 = 0.2;
/// Layers under the belt are this far apart, in edges: more than contact keeps.
const LAYER: f32 = 0.45;

/// Wind that is no number is none.
fn acting<'a>(wind: Vec3, [targets, slides]: [&'a [Vec3]; 2], stances: &'a [Stance]) -> Step<'a> {
    let wind = if wind.is_finite() { wind } else { Vec3::ZERO };
    Step { wind, targets, slides, stances, ..Step::default() }
}

impl Costume {
    /// Puts garments on a body, one after the other, the innermost first: each is tied and settles while those below it are worn, and all
    /// are one cloth that touches itself. `approach` says where all joints are: at 0 with the arms spread to the sides, as a player of
    /// [`crate::dance`] rests; at 1 where the dance begins; in between on the way. `tell` hears which part of the work is done, and
    /// may end it.
    ///
    /// # Errors
    /// A garment, fabric or body that is none; [`GarmentError::Stopped`].
    pub fn dress(
        garments: &[Garment],
        body: &Body,
        fitting: &Fitting,
        mut approach: impl FnMut(f32) -> Vec<RigidPose>,
        mut tell: impl FnMut(f32) -> ControlFlow<()>,
    ) -> Result<Self, GarmentError> {
        fitting.check(garments)?;
        let poses = approach(0.0);
        let steps = fitting.steps();
        let all = fitting.dressing_steps(garments.len()) as f32;
        let arm_gap = fitting.arm_gap(garments);
        let mut done = 0.0;
        let mut tell = || {
            done += 1.0;
            match tell(done / all) {
                ControlFlow::Continue(()) => Ok(()),
                ControlFlow::Break(()) => Err(GarmentError::Stopped),
            }
        };
        let mut worn: Option<Self> = None;
        for garment in garments {
            let inner = worn.as_ref().map_or(Vec::new(), Self::trunk);
            let (mut costume, belt) = Self::arrange(worn, garment, body, fitting, arm_gap, &poses, &inner)?;
            for step in 1..=steps[0] {
                let t = smoothstep(0.0, TYING * steps[0] as f32, step as f32);
                costume.hold(&poses, belt.at(t));
                costume.advance(&poses, Vec3::ZERO);
                costume.solver.slow(CALM.powf(60.0 * fitting.seconds));
                tell()?;
            }
            costume.fasten(&belt, &poses);
            worn = Some(costume);
        }
        let mut costume = worn.ok_or(GarmentError::Nothing)?;
        for step in 1..=steps[1] {
            let t = smoothstep(0.0, UNDER_WAY * steps[1] as f32, step as f32);
            costume.step(&approach(t), Vec3::ZERO);
            tell()?;
        }
        costume.wear();
        Ok(costume)
    }

    /// It is dressed.
    fn wear(&mut self) {
        self.solver.tighten(TIGHTENED);
        self.solver.load(LOADED);
    }

    /// Where the cloth about trunk and legs is.
    fn trunk(&self) -> Vec<Vec3> {
        let points = self.solver.positions().iter().zip(&self.sleeves);
        points.filter(|(_, sleeve)| !**sleeve).map(|(p, _)| *p).collect()
    }

    /// A garment about a body with its arms spread that wears something already, or nothing, which is at the points `inner`; and the belt
    /// that is to be tied.
    fn arrange(
        worn: Option<Self>,
        garment: &Garment,
        body: &Body,
        fitting: &Fitting,
        arm_gap: f32,
        poses: &[RigidPose],
        inner: &[Vec3],
    ) -> Result<(Self, Belt), GarmentError> {
        let wearing = |problem: String| GarmentError::Wearing { garment: garment.name.clone(), problem };
        body.check(poses.len())?;
        if poses.iter().any(|p| !p.position.is_finite() || !p.rotation.is_finite()) {
            return Err(GarmentError::Body("has a joint at no place".into()));
        }
        let mut cut = garment.cut(fitting.edge)?;
        let mut stands = poses.to_vec();
        body.clear_arms(&mut stands, arm_gap);
        let poses = &stands[..];
        let fabric = garment.fabric.unwrap_or(fitting.fabric);
        let spots = spots(garment, &cut);
        let arrangement = Arrangement::new(&garment.wear, body, poses, inner).map_err(|e| match e {
            GarmentError::Body(problem) => wearing(problem),
            other => other,
        })?;
        let layers = [fitting.clearance + fabric.thickness, LAYER * fitting.edge];
        let start = arrangement.place(garment, &cut, &spots, body, poses, layers[0]);
        let belt = arrangement.belt(&cut, &spots, body, poses, inner, layers, fitting.edge);
        let first = worn.as_ref().map_or(0, |w| w.cut.sheet.positions.len() as u32);
        let mut attached: Vec<u32> = belt.vertices().map(|v| v + first).collect();
        if attached.is_empty() {
            return Err(wearing("is where the belt meets no cloth".into()));
        }
        cut.sheet.positions = start;
        let mut cloth = Cloth::new(cut.sheet.clone(), &fabric)?;
        let mut garments = vec![(garment.name.clone(), cut.uvs.len())];
        let mut velocities = vec![Vec3::ZERO; cut.sheet.positions.len()];
        let mut held = Vec::new();
        let mut sleeves = vec![false; cut.sheet.positions.len()];
        for (v, spot) in cut.vertex.iter().zip(&spots) {
            sleeves[*v as usize] |=
                garment.wear.form.legs().is_none() && spot.x.abs() > garment.wear.half + 1e-4;
        }
        if let Some(worn) = worn {
            let own = std::mem::replace(&mut cloth, worn.solver.cloth().clone());
            cloth.sheet.positions = worn.solver.positions().to_vec();
            cloth.join(own);
            velocities.splice(0..0, worn.solver.velocities());
            let own = std::mem::replace(&mut cut, worn.cut);
            cut.join(own);
            garments.splice(0..0, worn.garments);
            attached.splice(0..0, worn.belted.iter().copied());
            held = worn.held;
            sleeves.splice(0..0, worn.sleeves);
        }
        let settings = Settings {
            seconds: fitting.seconds,
            substeps: fitting.substeps,
            contact: true,
            grip: GRIP,
            threads: fitting.threads,
            ..Settings::default()
        };
        let floor = fitting.floor.map(|y| Stance { origin: Vec3::Y * y, ..Stance::default() });
        let solids = body.solids(fitting.clearance).zip(body.stances(poses));
        let ground = floor.map(|stance| (Solid::Ground, stance));
        let start = cloth.sheet.positions.clone();
        let mut solver =
            SmallSteps::new(cloth, &attached, settings)?.with_bodies(solids.chain(ground).collect())?;
        solver.place(&start, &velocities);
        let mut sorted = attached.clone();
        sorted.sort_unstable();
        let ties = attached.len();
        let costume = Self {
            body: body.clone(),
            solver,
            belt: sorted,
            belted: attached,
            held,
            floor,
            arm_gap,
            sleeves,
            targets: Vec::with_capacity(ties),
            slides: Vec::with_capacity(ties),
            stances: Vec::with_capacity(body.capsules.len() + 1),
            cut,
            garments,
            stands,
        };
        Ok((costume, belt))
    }

    /// From now on the belt holds where it is drawn shut.
    fn fasten(&mut self, belt: &Belt, poses: &[RigidPose]) {
        let pelvis = poses[self.body.pelvis];
        let back = pelvis.rotation.inverse();
        let local = |tie: Tie| Tie { to: back * (tie.to - pelvis.position), along: back * tie.along };
        self.held.extend(belt.at(1.0).map(local));
    }

    /// As [`Costume::dress`], for a costume that was worn before: from what [`Costume::memory`] said of it, with all joints where
    /// they were at 0 of its approach. `None` where the memory is of another one.
    ///
    /// # Errors
    /// As there.
    pub fn recall(
        garments: &[Garment],
        body: &Body,
        fitting: &Fitting,
        poses: &[RigidPose],
        memory: &[f32],
    ) -> Result<Option<Self>, GarmentError> {
        fitting.check(garments)?;
        let mut worn: Option<Self> = None;
        let arm_gap = fitting.arm_gap(garments);
        for garment in garments {
            let (mut costume, belt) = Self::arrange(worn, garment, body, fitting, arm_gap, poses, &[])?;
            costume.fasten(&belt, poses);
            worn = Some(costume);
        }
        let mut costume = worn.ok_or(GarmentError::Nothing)?;
        Ok(costume.restore(memory).then_some(costume))
    }

    /// Goes back to where it was when [`Costume::memory`] was asked; false, and nothing changes, where that was another one.
    pub fn restore(&mut self, memory: &[f32]) -> bool {
        let Some((ties, solver)) = memory.split_at_checked(TIE * self.held.len()) else { return false };
        if ties.iter().any(|v| !v.is_finite()) || !self.solver.recall(solver) {
            return false;
        }
        for (tie, v) in self.held.iter_mut().zip(ties.chunks_exact(TIE)) {
            *tie = Tie { to: Vec3::from_slice(v), along: Vec3::from_slice(&v[3..]) };
        }
        self.wear();
        true
    }

    /// What it needs besides how it was made to go on with the same bits, as [`SmallSteps::memory`]: where its belts hold it, then that.
    pub fn memory(&self) -> Vec<f32> {
        let ties = self.held.iter().flat_map(|t| t.to.to_array().into_iter().chain(t.along.to_array()));
        ties.chain(self.solver.memory()).collect()
    }

    /// One step: to where all joints are at its end, in air that moves at `wind`, m/s. Poses that are too few or no numbers are
    /// passed over: the body then stands still; and so is wind that is none.
    pub fn step(&mut self, poses: &[RigidPose], wind: Vec3) {
        self.give(poses);
        self.advance(poses, wind);
    }

    /// What [`Costume::step`] gives its solver, for another one that goes on from it.
    pub fn given(&mut self, poses: &[RigidPose], wind: Vec3) -> Step<'_> {
        self.give(poses);
        self.stand(poses);
        acting(wind, [&self.targets, &self.slides], &self.stances)
    }

    fn give(&mut self, poses: &[RigidPose]) {
        if self.good(poses) {
            self.hold(poses, std::iter::empty());
        }
    }

    /// Where the belts are at the end of the next step: those that are tied, then one that is being tied.
    fn hold(&mut self, poses: &[RigidPose], ties: impl Iterator<Item = Tie>) {
        let pelvis = poses[self.body.pelvis];
        let turned = |tie: &Tie| Tie {
            to: pelvis.rotation * tie.to + pelvis.position,
            along: pelvis.rotation * tie.along,
        };
        self.targets.clear();
        self.slides.clear();
        for Tie { to, along } in self.held.iter().map(turned).chain(ties) {
            self.targets.push(to);
            self.slides.push(along);
        }
    }

    /// Whether the body can stand so.
    fn good(&self, poses: &[RigidPose]) -> bool {
        self.body.check(poses.len()).is_ok()
            && poses.iter().all(|p| p.position.is_finite() && p.rotation.is_finite())
    }

    fn advance(&mut self, poses: &[RigidPose], wind: Vec3) {
        self.stand(poses);
        self.solver.step(&acting(wind, [&self.targets, &self.slides], &self.stances));
    }

    /// Where the body is at the end of the next step.
    fn stand(&mut self, poses: &[RigidPose]) {
        if self.good(poses) {
            self.stands.clear();
            self.stands.extend_from_slice(poses);
            self.body.clear_arms(&mut self.stands, self.arm_gap);
            self.stances.clear();
            self.stances.extend(self.body.stances(&self.stands));
            self.stances.extend(self.floor);
        }
    }

    /// The mesh: its triangles, its (u, v), which of its vertices are one.
    pub fn cut(&self) -> &Cut {
        &self.cut
    }

    /// What is worn, the innermost first, and how many vertices of the mesh each has, one after the other.
    pub fn garments(&self) -> &[(String, usize)] {
        &self.garments
    }

    /// Where the vertices of the mesh are, m.
    pub fn points(&self) -> Vec<Vec3> {
        self.cut.points(self.solver.positions())
    }

    /// Their normals.
    pub fn normals(&self) -> Vec<Vec3> {
        self.cut.normals(self.solver.positions())
    }

    /// Where the joints are as cloth meets them: with arms out of the trunk ([`Body::clear_arms`]).
    pub fn stands(&self) -> &[RigidPose] {
        &self.stands
    }

    /// The cloth and what moves it.
    pub fn solver(&self) -> &SmallSteps {
        &self.solver
    }

    /// As [`SmallSteps::go_on`].
    #[must_use]
    pub fn go_on(&mut self, now: &Now) -> bool {
        self.solver.go_on(now)
    }

    /// As [`SmallSteps::search_anew`].
    pub fn search_anew(&mut self) {
        self.solver.search_anew();
    }

    /// How many vertices of the cloth the belt holds.
    pub fn held(&self) -> usize {
        self.held.len()
    }

    /// Whether the belt holds a vertex of the cloth.
    pub fn holds(&self, vertex: u32) -> bool {
        self.belt.binary_search(&vertex).is_ok()
    }
}
