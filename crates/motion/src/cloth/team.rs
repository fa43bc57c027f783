//! Threads that work through phases together.

use std::cell::Cell;
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Threads that take tasks of a phase in turn, and go on to the next when all are done.
pub(super) struct Team {
    threads: usize,
    next: AtomicUsize,
    arrived: AtomicUsize,
    phase: AtomicUsize,
    failed: AtomicBool,
}

/// Rounds of waiting before a thread lets others run: about as long as the shortest phase.
const PATIENCE: u32 = 2000;

impl Team {
    /// Runs `work` on so many threads, this one among them.
    pub fn run(threads: usize, work: impl Fn(&Member<'_>) + Sync) {
        let team = Self {
            threads: threads.max(1),
            next: AtomicUsize::new(0),
            arrived: AtomicUsize::new(0),
            phase: AtomicUsize::new(0),
            failed: AtomicBool::new(false),
        };
        if threads <= 1 {
            return work(&Member { team: &team, number: 0, phase: Cell::new(0) });
        }
        std::thread::scope(|scope| {
            let (team, work) = (&team, &work);
            for number in 1..threads {
                scope.spawn(move || work(&Member { team, number, phase: Cell::new(0) }));
            }
            work(&Member { team, number: 0, phase: Cell::new(0) });
        });
    }
}

/// A thread of a team.
pub(super) struct Member<'a> {
    team: &'a Team,
    /// Its number in the team.
    pub number: usize,
    phase: Cell<usize>,
}

impl Member<'_> {
    /// A phase of `tasks`: each is done once, by whichever thread comes first; returns when all are done.
    pub fn each(&self, tasks: usize, task: impl Fn(usize)) {
        let team = self.team;
        if team.threads == 1 {
            return (0..tasks).for_each(task);
        }
        // A task that panics must not leave the others waiting.
        let guard = Failing(&team.failed);
        loop {
            let i = team.next.fetch_add(1, Ordering::Relaxed);
            if i >= tasks {
                break;
            }
            task(i);
        }
        std::mem::forget(guard);
        let phase = self.phase.get() + 1;
        self.phase.set(phase);
        if team.arrived.fetch_add(1, Ordering::AcqRel) + 1 == team.threads {
            team.next.store(0, Ordering::Relaxed);
            team.arrived.store(0, Ordering::Relaxed);
            team.phase.store(phase, Ordering::Release);
            return;
        }
        let mut rounds = 0;
        while team.phase.load(Ordering::Acquire) != phase {
            assert!(!team.failed.load(Ordering::Relaxed), "another thread of the cloth failed");
            rounds += 1;
            if rounds < PATIENCE {
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
    }
}

struct Failing<'a>(&'a AtomicBool);

impl Drop for Failing<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// A slice of which threads take parts that do not overlap.
pub(super) struct Parts<'a, T> {
    first: *mut T,
    len: usize,
    of: PhantomData<&'a mut [T]>,
}

// SAFETY: it is a slice that is borrowed for ever shorter parts; who takes them promises that they do not overlap.
#[allow(unsafe_code)]
unsafe impl<T: Send> Sync for Parts<'_, T> {}

impl<'a, T> Parts<'a, T> {
    pub fn new(slice: &'a mut [T]) -> Self {
        Self { first: slice.as_mut_ptr(), len: slice.len(), of: PhantomData }
    }

    /// A part to write to.
    ///
    /// # Safety
    /// While it lives nobody else holds a part that overlaps.
    #[allow(unsafe_code, clippy::mut_from_ref)]
    pub unsafe fn part(&self, range: &Range<usize>) -> &mut [T] {
        assert!(range.start <= range.end && range.end <= self.len);
        // SAFETY: within the slice by the line above, alone by the promise.
        unsafe { std::slice::from_raw_parts_mut(self.first.add(range.start), range.len()) }
    }

    /// A part to read.
    ///
    /// # Safety
    /// While it lives nobody holds an overlapping part to write to.
    #[allow(unsafe_code)]
    pub unsafe fn read(&self, range: &Range<usize>) -> &[T] {
        assert!(range.start <= range.end && range.end <= self.len);
        // SAFETY: within the slice by the line above; nobody writes by the promise.
        unsafe { std::slice::from_raw_parts(self.first.add(range.start), range.len()) }
    }

    /// One of them to read or write.
    ///
    /// # Safety
    /// While it lives nobody else holds a part that overlaps; and there are more than `i`.
    #[inline(always)]
    #[allow(unsafe_code, clippy::mut_from_ref)]
    pub unsafe fn one(&self, i: usize) -> &mut T {
        debug_assert!(i < self.len);
        // SAFETY: by the promise.
        unsafe { &mut *self.first.add(i) }
    }

    /// How long the slice is.
    pub fn len(&self) -> usize {
        self.len
    }
}
