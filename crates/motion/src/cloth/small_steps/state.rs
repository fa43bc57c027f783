//! The state of a solver: read, set, kept and taken up again; and what it solves.

use super::{LOADS, SmallSteps, Task};
use crate::cloth::air::Swing;
use crate::cloth::body::Stance;
use crate::cloth::lattice::Lattices;
use crate::cloth::lines::Bundle;
use crate::cloth::rows::{Now, Rows, TaskRows};
use glam::{Quat, Vec3, Vec4};
use std::sync::atomic::Ordering;

impl SmallSteps {
    /// Where the cloth is, in the order of [`SmallSteps::rows`].
    pub fn now(&self) -> Now {
        let points = |all: &[Vec4]| all.iter().map(|v| v.truncate()).collect();
        Now {
            places: [&self.x, &self.v, &self.lost].map(|all| points(all)),
            swings: self.swings.iter().map(|s| [s.way, s.last, s.held]).collect(),
            targets: self.attached.iter().map(|a| a.2.truncate()).collect(),
            stances: self.stances.clone(),
        }
    }

    /// Goes on from where another cloth is that was made from the same rows; whether it has as many places, attachments and bodies.
    #[must_use]
    pub fn go_on(&mut self, now: &Now) -> bool {
        let n = self.x.len();
        let alike = now.places.iter().all(|all| all.len() == n)
            && now.swings.len() == n
            && now.targets.len() == self.attached.len()
            && now.stances.len() == self.stances.len();
        if !alike {
            return false;
        }
        for (to, from) in [&mut self.x, &mut self.v, &mut self.lost].into_iter().zip(&now.places) {
            to.iter_mut().zip(from).for_each(|(to, from)| *to = from.extend(0.0));
        }
        for (swing, [way, last, held]) in self.swings.iter_mut().zip(&now.swings) {
            *swing = Swing { way: *way, last: *last, held: *held };
        }
        self.attached.iter_mut().zip(&now.targets).for_each(|(a, target)| a.2 = target.extend(0.0));
        self.stances.clone_from(&now.stances);
        self.take_positions();
        self.search_anew();
        true
    }

    pub(super) fn take_positions(&mut self) {
        for (x, v) in self.x.iter().zip(&self.order.vertex) {
            self.positions[*v as usize] = x.truncate();
        }
    }

    /// What is solved in which order.
    pub fn rows(&self) -> Rows {
        let tasks = [&self.strips, &self.borders].map(|tasks| {
            let rows = |task: &Task| TaskRows {
                places: task.range.clone(),
                springs: task.springs.rows(task.range.start),
                loose: task.loose.as_ref().map(|springs| springs.rows(task.range.start)),
                hinges: task.hinges.rows(task.range.start),
            };
            tasks.iter().map(rows).collect()
        });
        let (levels, reach) = self.lattices.as_ref().map(Lattices::rows).unwrap_or_default();
        let place = |v: u32| self.order.place[v as usize];
        Rows {
            vertex: self.order.vertex.clone(),
            triangles: self.cloth.sheet.triangles.iter().map(|t| t.map(place)).collect(),
            inverse: self.inverse.clone(),
            widths: self.widths.clone(),
            tasks,
            lines: [0, 1].map(|along| self.lines[along].iter().flat_map(Bundle::lines).collect()),
            levels,
            reach,
            attached: self.attached.iter().map(|a| a.0).collect(),
            grip: self.settings.grip,
            seconds: self.settings.seconds,
            substeps: self.settings.substeps,
            calm_seconds: self.settings.calm_seconds(),
            friction: self.cloth.friction[0],
            gap: 0.5 * self.cloth.thickness,
            bodies: self.bodies.clone(),
            contact: self.contacts.as_ref().map(|c| c.rows(self.passes, self.loaded, LOADS)),
        }
    }

    /// Puts vertices elsewhere, with velocities.
    pub fn place(&mut self, positions: &[Vec3], velocities: &[Vec3]) {
        for (i, v) in self.order.vertex.iter().enumerate() {
            let v = *v as usize;
            if let (Some(x), Some(u)) = (positions.get(v), velocities.get(v)) {
                self.x[i] = x.extend(0.0);
                self.v[i] = u.extend(0.0);
                self.lost[i] = Vec4::ZERO;
                self.swings[i] = Swing::default();
                self.positions[v] = *x;
            }
        }
        self.search_anew();
    }

    /// What it needs besides how it was made to go on with the same bits, if pairs of contact are found anew
    /// ([`SmallSteps::search_anew`]) before the next step of both.
    pub fn memory(&self) -> Vec<f32> {
        let of = |all: &[Vec4]| all.iter().flat_map(|v| v.truncate().to_array()).collect::<Vec<f32>>();
        let mut memory = [&self.x, &self.v, &self.lost].map(|all| of(all)).concat();
        memory.extend_from_slice(&self.give);
        memory.extend(self.swings.iter().flat_map(|s| [s.way, s.last, s.held]));
        memory.extend(self.attached.iter().flat_map(|a| a.2.truncate().to_array()));
        memory.extend(
            self.stances.iter().flat_map(|s| s.rotation.to_array().into_iter().chain(s.origin.to_array())),
        );
        memory
    }

    /// Takes up a memory; whether it is of a cloth that was made as this one.
    #[must_use]
    pub fn recall(&mut self, memory: &[f32]) -> bool {
        let (n, held) = (self.x.len(), self.attached.len());
        if memory.len() != 13 * n + 3 * held + 7 * self.stances.len() || memory.iter().any(|v| !v.is_finite())
        {
            return false;
        }
        let turns =
            memory[13 * n + 3 * held..].chunks_exact(7).map(|v| Quat::from_xyzw(v[0], v[1], v[2], v[3]));
        if turns.into_iter().any(|rotation| !rotation.is_normalized()) {
            return false;
        }
        let (all, rest) = memory.split_at(9 * n);
        let point = |v: &[f32]| Vec3::from_slice(v).extend(0.0);
        for (to, from) in [&mut self.x, &mut self.v, &mut self.lost].into_iter().zip(all.chunks_exact(3 * n))
        {
            to.iter_mut().zip(from.chunks_exact(3)).for_each(|(to, from)| *to = point(from));
        }
        let (give, rest) = rest.split_at(n);
        self.give.copy_from_slice(give);
        let (swings, rest) = rest.split_at(3 * n);
        for (swing, v) in self.swings.iter_mut().zip(swings.chunks_exact(3)) {
            *swing = Swing { way: v[0], last: v[1], held: v[2] };
        }
        let (held, stances) = rest.split_at(3 * held);
        self.attached.iter_mut().zip(held.chunks_exact(3)).for_each(|(a, v)| a.2 = point(v));
        for (stance, v) in self.stances.iter_mut().zip(stances.chunks_exact(7)) {
            let rotation = Quat::from_xyzw(v[0], v[1], v[2], v[3]);
            *stance = Stance { rotation, origin: Vec3::from_slice(&v[4..]) };
        }
        self.take_positions();
        self.search_anew();
        true
    }

    /// Finds pairs of contact anew in the next step, as a cloth does that has just been made: what follows then depends on nothing but
    /// its memory.
    pub fn search_anew(&mut self) {
        self.stale.store(true, Ordering::Relaxed);
        if let Some(contacts) = &mut self.contacts {
            contacts.forget();
        }
    }
}
