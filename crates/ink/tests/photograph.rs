//! A photograph of a stroke gives back the controls with which the stroke was painted.

use glam::Vec2;
use std::sync::Arc;
use yugen_ink::brush::photograph::{Found, find};
use yugen_ink::canvas::{BRUSHED, Canvas, LAYERS, Layer, Materials};
use yugen_ink::contour::{Anchor, LineKind, MeshPoint};
use yugen_ink::control::Controls;
use yugen_ink::paper::PAPERS;
use yugen_ink::piece::Piece;
use yugen_ink::pigment::PIGMENTS;
use yugen_ink::place_controls::PlaceControls;
use yugen_ink::resolve::Resolve;
use yugen_ink::stamp::{self, Stamp};
use yugen_ink::stroke::{Hand, Path};
use yugen_ink::visibility::Sample;
use yugen_optics::Image;
use yugen_optics::random::Pcg32;
use yugen_realtime::Gpu;

/// Pixels of the sheet, and of the photograph.
const SHEET: [u32; 2] = [1100, 200];
const PHOTOGRAPH: [usize; 2] = [1200, 420];

/// Paints strokes with the brush of some controls.
struct Sheet {
    canvas: Canvas,
    hand: Hand,
}

impl Sheet {
    /// `unit`: pixels for one in a picture of 1080 lines.
    fn new(gpu: &Gpu, controls: Controls, unit: f32, seed: u32) -> Self {
        let hand = Hand {
            controls,
            place_controls: Arc::new(PlaceControls::plain(controls)),
            size: Vec2::from(SHEET.map(|n| n as f32)),
            edits: Arc::default(),
            unit,
            depths: [1.0, 1.0],
            shade: Vec2::new(0.55, 0.835),
            seed,
        };
        let materials = Materials {
            paper: &PAPERS[0],
            pigments: [&PIGMENTS[0]; LAYERS],
            full: hand.radius(1.0),
            bleed: controls.bleed,
            roughness: controls.roughness,
            bristles: None,
            unit,
            seed,
        };
        let canvas = Canvas::new(&gpu.device, &gpu.queue, SHEET, &materials, &Resolve::default()).unwrap();
        Self { canvas, hand }
    }

    /// A straight stroke as a contour that stands out gets it, from left to right.
    fn paint(&self, seed: u32) -> Image {
        let mesh_point = MeshPoint { ends: [Anchor { vertices: [0, 1], part: 0.0 }; 2], part: 0.0 };
        let sample = |i: u32| {
            let pixel = Vec2::new(70.0 + 2.0 * i as f32, 0.5 * SHEET[1] as f32);
            Sample {
                pixel,
                depth: 1.0,
                outward: Vec2::Y,
                visible: true,
                gap: 1.0,
                silhouette: true,
                cover: 0.0,
                mesh_point,
                line: pixel,
                uv: Vec2::ZERO,
                strength: 1.0,
                trace: None,
                pinned: None,
            }
        };
        let samples: Vec<Sample> = (0..480).map(sample).collect();
        let piece = Piece { kind: LineKind::Contour, draw: 0, shape: 1, samples, closed: false };
        let arc = piece.arc();
        let path = Path { seed, s: &arc, phase: &arc };
        let brush = self.hand.brush(&piece, seed, &path);
        let stroke = self.hand.stroke(&piece, seed, &path, &brush, &vec![1.0; arc.len()]);
        let mut layers: [Vec<Stamp>; BRUSHED] = Default::default();
        stamp::along(&stroke, self.hand.radius(1.0), &mut layers[Layer::Contour as usize]);
        self.canvas.paint(&layers);
        self.canvas.picture().unwrap()
    }
}

/// A sheet as a camera sees it that is held askew: turned, darker to one side, warm, with noise.
fn photograph(sheet: &Image, seed: u64) -> Image {
    let [w, h] = PHOTOGRAPH;
    let mut random = Pcg32::new(seed, 11);
    let mut photograph = Image::rgb(w, h);
    let turn = Vec2::from_angle(0.12);
    for (i, pixel) in photograph.data.chunks_exact_mut(3).enumerate() {
        let p = Vec2::new((i % w) as f32 - 0.5 * w as f32, (i / w) as f32 - 0.5 * h as f32);
        let at = turn.rotate(p) + 0.5 * Vec2::new(sheet.width as f32, sheet.height as f32);
        let at = at.clamp(Vec2::ZERO, Vec2::new(sheet.width as f32 - 1.001, sheet.height as f32 - 1.001));
        let (x, y, t) = (at.x as usize, at.y as usize, at.fract());
        let light = (0.75 - 0.25 * (i % w) as f32 / w as f32) * (1.0 + 0.03 * random.normal());
        for (c, value) in pixel.iter_mut().enumerate() {
            let row = |y: usize| sheet.pixel(x, y)[c] * (1.0 - t.x) + sheet.pixel(x + 1, y)[c] * t.x;
            *value = light * [1.0, 0.97, 0.88][c] * (row(y) * (1.0 - t.y) + row(y + 1) * t.y);
        }
    }
    photograph
}

fn controls(dryness: f32, roughness: f32) -> Controls {
    Controls { dryness, roughness, size: 2.0, ..Controls::default() }
}

/// Strokes of these seeds, photographed.
fn found(gpu: &Gpu, controls: Controls, unit: f32, brush: u32, seeds: std::ops::Range<u32>) -> Vec<Found> {
    let sheet = Sheet::new(gpu, controls, unit, brush);
    let shown = |seed: u32| find(&photograph(&sheet.paint(seed), u64::from(seed)));
    seeds.map(|seed| shown(seed).unwrap_or_else(|e| panic!("{controls:?}, {seed}: {e}"))).collect()
}

fn mean(all: &[Found], of: impl Fn(&Found) -> f32) -> f32 {
    all.iter().map(of).sum::<f32>() / all.len() as f32
}

/// Prints the tables of `photograph.rs`: `cargo test --release -p yugen-ink --test photograph -- --ignored --nocapture`.
#[test]
#[ignore = "prints constants"]
fn what_photographs_show_of_strokes_of_ours() {
    let gpu = Gpu::for_tests().expect("a GPU");
    let row = |dryness: f32, roughness: f32| {
        let mut all = Vec::new();
        for brush in [1, 2] {
            all.extend(found(&gpu, controls(dryness, roughness), 1.75, brush, 100..108));
        }
        let spread = |of: &dyn Fn(&Found) -> f32| {
            let m = mean(&all, of);
            mean(&all, |f| (of(f) - m).powi(2)).sqrt()
        };
        println!(
            "dryness {dryness:.2} roughness {roughness:.2}: white {:.4} ± {:.4}, of the wettest third {:.4}; ragged {:.5} ± {:.5}",
            mean(&all, |f| f.all_white()),
            spread(&|f| f.all_white()),
            mean(&all, |f| f.white.iter().copied().fold(1.0, f32::min)),
            mean(&all, |f| f.ragged),
            spread(&|f| f.ragged),
        );
    };
    for dryness in [0.3, 0.45, 0.6, 0.75, 0.9, 1.0] {
        row(dryness, 0.4);
    }
    for (dryness, roughness) in
        [0.1, 0.9].into_iter().flat_map(|d| [0.0, 0.25, 0.5, 0.75, 1.0].map(|r| (d, r)))
    {
        row(dryness, roughness);
    }
}

/// Strokes of other brushes and hands than those of the tables: each to within what their spread allows, four together closer.
#[test]
fn a_photographed_stroke_gives_back_its_controls() {
    let Some(gpu) = Gpu::for_tests() else { return };
    for (dryness, roughness) in
        [(0.1, 0.1), (0.1, 0.6), (0.3, 0.9), (0.5, 0.4), (0.7, 0.4), (0.85, 0.2), (0.95, 0.7)]
    {
        let all = found(&gpu, controls(dryness, roughness), 1.75, 7, 20..24);
        let of = |f: &Found| [f.dryness, f.roughness.unwrap_or(f32::NAN)];
        for f in &all {
            println!("{dryness} {roughness}: {:?} white {:.4} ragged {:.5}", of(f), f.all_white(), f.ragged);
        }
        let means = [0, 1].map(|k| mean(&all, |f| of(f)[k]));
        println!("{dryness} {roughness}: means {means:?}");
        for (k, known) in [(0, dryness), (1, roughness)] {
            assert!(all.iter().all(|f| (of(f)[k] - known).abs() < EACH[k]), "{dryness} {roughness}: {k}");
            assert!((means[k] - known).abs() < FOUR[k], "{dryness} {roughness}: {k}");
        }
        // A whole brush is as wide as it was painted, wherever it is pressed less.
        let half = mean(&all, |f| f.half_width);
        assert!((half / (9.0 * 2.0 * 1.75) - 0.9).abs() < 0.25, "{half}");
    }
}

/// Most that dryness and roughness of one stroke are off, and of the mean of four.
const EACH: [f32; 2] = [0.35, 0.4];
const FOUR: [f32; 2] = [0.2, 0.2];
