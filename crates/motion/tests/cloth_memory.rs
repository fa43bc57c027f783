//! A step of cloth asks for no memory.

use glam::{Vec2, Vec3};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};
use yugen_motion::cloth::{Cloth, PRESETS, Provot, Settings, Sheet, SmallSteps, Step};

struct Counting;

static ASKED: AtomicUsize = AtomicUsize::new(0);

// SAFETY: all is passed on to the system's allocator.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ASKED.fetch_add(1, Ordering::Relaxed);
        // SAFETY: as it came.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: as it came.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// The only test of this file: others would be counted too.
#[test]
fn a_step_asks_for_no_memory() {
    let sheet = Sheet::rectangle(Vec3::ZERO, Vec3::X, Vec3::Z, Vec2::ONE, [40, 40]);
    let cloth = Cloth::new(sheet, &PRESETS[0].fabric).unwrap();
    let targets = [Vec3::ZERO, Vec3::X];
    let step = Step { targets: &targets, wind: Vec3::Z, ..Step::default() };
    let mut small = SmallSteps::new(cloth.clone(), &[0, 40], Settings::default()).unwrap();
    let mut provot = Provot::new(cloth, &[0, 40], 1e-4, 1).unwrap();
    let before = ASKED.load(Ordering::Relaxed);
    for _ in 0..5 {
        small.step(&step);
        provot.step(&step);
    }
    assert_eq!(ASKED.load(Ordering::Relaxed) - before, 0);
    // The count counts.
    std::hint::black_box(vec![1u8; 100]);
    assert!(ASKED.load(Ordering::Relaxed) > before);
}
