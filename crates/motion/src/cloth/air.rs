//! What air does to a vertex.
//!
//! Across, drag is that of a steady stream for what goes on its way, and more for what swings: a plate that turns back meets the vortices
//! that its edges have shed, and is held back the more the less of its width it swings by. Each place counts its way across from turn to
//! turn, once in a step. Air that is accelerated along (added mass) is in none of this.

use super::Cloth;
use glam::Vec4;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::f32::consts::PI;

/// Density of air, kg/m³, at 15 °C.
pub(super) const AIR: f32 = 1.225;
/// Drag coefficients of a plate across and along the wind: 1.17 for plates as long as wide (Hoerner 1965), .02 for
/// turbulent friction on both sides (assumed).
pub(super) const DRAG: [f32; 2] = [1.17, 0.02];
/// Drag across of a plate that swings, times the cube root of its Keulegan-Carpenter number KC = 2πA/D of amplitude A and width D: the
/// power is that of vortices at a sharp edge (Graham 1980, "The forces on sharp-edged cylinders in oscillatory flow at low Keulegan-Carpenter
/// numbers"), 8 the factor that is commonly quoted from there for measured plates; 8 to 10 are in use.
pub(super) const SWINGING: f32 = 8.0;
/// KC from and to which that holds. Below, .3 m that swing at half a hertz are slower than .6 mm/s, and the friction of air takes more than
/// vortices do. Above, vortices are left behind at each turn and are the less of the way the longer it is: drag falls as 1/KC (assumed), to
/// that of a steady stream at ways of sixteen widths.
pub(super) const SWINGS: [f32; 2] = [0.004, 20.0];
/// How many times the way between two turns that of the turns before is shorter for it, at the most. Who trembles at a turn by next to nothing
/// has hardly turned, and who swings by a thirtieth of the swing before is taken for what he is at once.
pub(super) const FORGETS: f32 = 30.0;
/// Behind a turn drag goes over to that of the new swing, on a tenth of the way before the turn and a thousandth of the width: a rounding, which
/// says whether something turns that hardly moves across, does not decide about it.
pub(super) const OVER: [f32; 2] = [0.1, 0.001];
/// The last way of what has not turned yet, m: as good as infinite.
pub(super) const NEVER: f32 = 1e6;
/// The width of cloth without free edges, m: no vortices are shed there, and so little that every swing is long.
const CLOSED: f32 = 1e-6;

/// How a place has gone across since its velocity, relative to the air, turned back.
#[derive(Clone, Copy)]
pub(super) struct Swing {
    /// Along the normal; with its sign, m.
    pub way: f32,
    /// The whole way between the two turns before, as [`FORGETS`] says, m.
    pub last: f32,
    /// The drag coefficient across at the turn.
    pub held: f32,
}

impl Default for Swing {
    fn default() -> Self {
        Self { way: 0.0, last: NEVER, held: DRAG[0] }
    }
}

impl Swing {
    /// Goes on `by`; then the drag coefficient across, of a plate so wide.
    fn go(&mut self, by: f32, width: f32) -> f32 {
        if by * self.way < 0.0 {
            let way = self.way.abs();
            let left = if self.last < NEVER { self.last - FORGETS * way } else { way };
            *self = Self { way: 0.0, last: left.max(way), held: self.drag(width) };
        }
        self.way += by;
        self.drag(width)
    }

    fn drag(&self, width: f32) -> f32 {
        let way = self.way.abs();
        // From turn to turn it is twice the amplitude.
        let kc = PI * way.max(self.last) / width;
        let swinging = if kc < SWINGS[1] {
            SWINGING / kc.max(SWINGS[0]).cbrt()
        } else {
            SWINGING * SWINGS[1].cbrt() * SWINGS[1].cbrt() / kc
        };
        let over = way / (OVER[0] * self.last + OVER[1] * width);
        let now = swinging.max(DRAG[0]);
        if over < 1.0 { self.held + (now - self.held) * over } else { now }
    }
}

/// Air in motion.
#[derive(Clone, Copy)]
pub(super) struct Air {
    /// m/s.
    pub wind: Vec4,
}

impl Air {
    /// A step of `seconds` begins: the drag coefficient across of a vertex at `v`, m/s, whose normal is as long as its `area`, in a plate
    /// of `width` metres.
    pub fn across(self, v: Vec4, area: Vec4, swing: &mut Swing, width: f32, seconds: f32) -> f32 {
        let a = area.length();
        let by = if a > 0.0 { (v - self.wind).dot(area / a) * seconds } else { 0.0 };
        swing.go(by, width)
    }

    /// What it adds, m/s, to the velocity `v` of a vertex whose normal is as long as its `area`, m², and whose drag coefficient is `across`;
    /// `seconds_per_mass` is the time that it acts over the mass of the vertex, s/kg. Implicit in its own speed: air stops a cloth, and does not throw it back.
    pub fn pull(self, v: Vec4, area: Vec4, across: f32, seconds_per_mass: f32) -> Vec4 {
        let a = area.length();
        if a <= 0.0 {
            return Vec4::ZERO;
        }
        let n = area / a;
        let relative = self.wind - v;
        let normal = n * relative.dot(n);
        let along = relative - normal;
        let pull = |u: Vec4, drag: f32| {
            let c = 0.5 * AIR * drag * a * u.length() * seconds_per_mass;
            u * (c / (1.0 + c))
        };
        pull(normal, across) + pull(along, DRAG[1])
    }
}

/// Of each vertex, how wide the piece of cloth is of which it is part, m: twice the distance to its free edges of the vertex that is
/// farthest from them, along edges. Of a strip it is its width, of a disc its diameter; of a robe, whose hem, fronts and sleeves are free,
/// about what hangs from one side to the other. Vortices are shed at free edges, and drag goes with the cube root of it.
pub(super) fn widths(cloth: &Cloth) -> Vec<f32> {
    let n = cloth.sheet.positions.len();
    let mut sides: HashMap<[u32; 2], u32> = HashMap::new();
    for t in &cloth.sheet.triangles {
        for [a, b] in [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]] {
            *sides.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let mut next = vec![Vec::new(); n];
    for s in &cloth.springs {
        let [a, b] = s.ends;
        next[a as usize].push((b, s.rest));
        next[b as usize].push((a, s.rest));
    }
    // Dijkstra, from all free edges at once. Of positive numbers bits have the same order.
    let mut far = vec![f32::INFINITY; n];
    let mut heap = BinaryHeap::new();
    for v in sides.iter().filter(|(_, count)| **count == 1).flat_map(|(edge, _)| *edge) {
        far[v as usize] = 0.0;
        heap.push(Reverse((0, v)));
    }
    while let Some(Reverse((bits, v))) = heap.pop() {
        if bits > far[v as usize].to_bits() {
            continue;
        }
        for (w, rest) in &next[v as usize] {
            let to = f32::from_bits(bits) + rest;
            if to < far[*w as usize] {
                far[*w as usize] = to;
                heap.push(Reverse((to.to_bits(), *w)));
            }
        }
    }
    // The farthest of each piece.
    let mut widths = vec![f32::NAN; n];
    let mut piece = Vec::new();
    for v in 0..n {
        if !widths[v].is_nan() {
            continue;
        }
        piece.clear();
        piece.push(v);
        widths[v] = 0.0;
        let mut done = 0;
        while done < piece.len() {
            for (w, _) in &next[piece[done]] {
                if widths[*w as usize].is_nan() {
                    widths[*w as usize] = 0.0;
                    piece.push(*w as usize);
                }
            }
            done += 1;
        }
        let farthest = piece.iter().map(|v| far[*v]).fold(0.0, f32::max);
        let width = if farthest.is_finite() { (2.0 * farthest).max(CLOSED) } else { CLOSED };
        piece.iter().for_each(|v| widths[*v] = width);
    }
    widths
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloth::{PRESETS, Sheet};
    use glam::{Vec2, Vec3};

    #[test]
    fn strips_are_as_wide_as_they_are_and_each_piece_has_its_own() {
        let strip = |size: Vec2, cells| Sheet::rectangle(Vec3::ZERO, Vec3::X, Vec3::Y, size, cells);
        let mut sheet = strip(Vec2::new(0.1, 0.5), [4, 20]);
        let first = sheet.positions.len();
        sheet.join(strip(Vec2::splat(0.6), [12; 2]));
        let widths = widths(&Cloth::new(sheet, &PRESETS[0].fabric).unwrap());
        assert!(widths[..first].iter().all(|w| (w - 0.1).abs() < 1e-6), "{}", widths[0]);
        assert!(widths[first..].iter().all(|w| (w - 0.6).abs() < 1e-6), "{}", widths[first]);
    }

    #[test]
    fn what_is_closed_or_has_no_triangles_swings_as_in_a_steady_stream() {
        let corners = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        let mut cloth = Cloth { masses: vec![1.0; 6], ..Cloth::default() };
        cloth.sheet.positions = corners.to_vec();
        for hand in [false, true] {
            let width = widths(&cloth)[0];
            assert_eq!(Swing { way: 1e-3, last: 1e-3, held: 9.0 }.go(1e-3, width), DRAG[0], "{hand}");
            for k in 0..8u32 {
                let [a, b, c] = [k & 1, 2 + (k >> 1 & 1), 4 + (k >> 2)];
                cloth.sheet.triangles.push(if k.count_ones() % 2 == 0 { [a, b, c] } else { [b, a, c] });
            }
        }
    }

    /// A square metre of a plate, of ten kilograms, on a spring: its amplitude a quarter before so many periods of a second are over.
    fn swing(amplitude: f32, width: f32, periods: u32) -> f32 {
        let (air, area, seconds, omega) = (Air { wind: Vec4::ZERO }, Vec4::X, 1.0 / 240.0, 2.0 * PI);
        // So that it does not begin as what has never turned.
        let held = SWINGING / (2.0 * PI * amplitude / width).cbrt();
        let mut swing = Swing { way: 0.0, last: 2.0 * amplitude, held };
        let (mut x, mut v, mut crossings) = (amplitude, 0.0f32, 0);
        loop {
            let across = air.across(Vec4::X * v, area, &mut swing, width, seconds);
            for _ in 0..16 {
                let (h, before) = (seconds / 16.0, x);
                v += air.pull(Vec4::X * v, area, across, h / 10.0).x - omega * omega * x * h;
                x += v * h;
                crossings += u32::from(before * x <= 0.0);
                if crossings == 2 * periods {
                    return v.abs() / omega;
                }
            }
        }
    }

    #[test]
    fn a_plate_that_swings_loses_what_was_measured() {
        for (amplitude, width) in [(0.01f32, 0.1f32), (0.01, 0.5), (0.05, 0.1), (0.001, 0.3), (0.3, 0.1)] {
            let periods = 12;
            let found = swing(amplitude, width, periods);
            // Of a square metre at ω ∫ ½ρ C_D |u|³ dt = ½ρ C_D ω²A³ 8/3 is lost in a period, and energy is 5 kg ω²A².
            let rate = 0.05 * AIR * SWINGING * (2.0 * PI / width).powf(-1.0 / 3.0) * 8.0 / 3.0;
            let truth = (amplitude.powf(-2.0 / 3.0) + 2.0 / 3.0 * rate * (periods as f32 - 0.25)).powf(-1.5);
            println!("{amplitude} of {width}: {found:.4e}, {truth:.4e}");
            let lost = (amplitude - found) / (amplitude - truth);
            assert!((lost - 1.0).abs() < 0.024, "{amplitude} of {width}: {lost}");
        }
    }

    #[test]
    fn what_trembles_at_a_turn_is_held_back_as_it_was() {
        let across = |trembles: bool| {
            let mut swing = Swing { way: 0.1, last: 0.1, held: SWINGING / (0.1 * PI).cbrt() };
            // To and fro by a hundredth of a millimetre, and back.
            [-1e-5, 1e-5].iter().take(2 * usize::from(trembles)).for_each(|by| _ = swing.go(*by, 1.0));
            swing.go(-0.02, 1.0)
        };
        // Twice thirty times as much of a tenth of a metre, and the cube root of that.
        let ratio = across(true) / across(false);
        assert!(ratio > 1.0 && ratio < 1.003, "{ratio}");
    }

    #[test]
    fn what_goes_on_its_way_is_in_a_steady_stream() {
        let mut swing = Swing::default();
        assert!((0..100).all(|_| swing.go(1e-3, 1.0) == DRAG[0]));
        // It turns: held back more, a tenth of the way before on, and less so the farther it goes; after sixteen widths no longer.
        let mut before = f32::INFINITY;
        for k in 0..1700 {
            let across = swing.go(-1e-2, 1.0);
            assert!((across <= before || k < 2) && across >= DRAG[0]);
            before = across;
            assert!(k < 1605 || across == DRAG[0], "{k} {across}");
            assert!(k > 1590 || across > DRAG[0], "{k} {across}");
        }
    }
}
