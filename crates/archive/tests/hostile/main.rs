//! Damaged and lying files: whatever the bytes are, a reader answers without a panic and with little memory.

#![allow(unsafe_code, clippy::disallowed_methods)]

mod capture;
mod meshes;
mod motion;
mod pictures;
mod scenes;
mod tables;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::Path;
use yugen_optics::random::Pcg32;

/// Counts what each thread holds, so that tests beside each other do not mix.
struct Counting;

thread_local! {
    static HELD: Cell<isize> = const { Cell::new(0) };
    static PEAK: Cell<isize> = const { Cell::new(0) };
}

fn count(bytes: isize) {
    // At the end of a thread there is nothing left to count in.
    let _ = HELD.try_with(|held| {
        held.set(held.get() + bytes);
        let _ = PEAK.try_with(|peak| peak.set(peak.get().max(held.get())));
    });
}

// SAFETY: every call goes to the system's allocator unchanged; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        unsafe { System.dealloc(p, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The most that `f` holds at a time, in bytes.
fn peak(f: impl FnOnce()) -> isize {
    let before = HELD.get();
    PEAK.set(before);
    f();
    PEAK.get() - before
}

/// One to four of the accidents that befall files.
fn mutate(seed: &[u8], other: &[u8], rng: &mut Pcg32) -> Vec<u8> {
    const LIES: [&[u8]; 10] = [
        b"0",
        b"-1",
        b"1099511627776",
        b"4294967295",
        b"99999999999999999999",
        b"1e308",
        b"nan",
        b"\xff\xff\xff\xff",
        b"\x00\x00\x00\x00\x00\x01\x00\x00",
        b"\xff\xff\xff\xff\xff\xff\xff\x7f",
    ];
    let mut out = seed.to_vec();
    let mut below = |n: usize| ((u64::from(rng.next_u32()) * n.max(1) as u64) >> 32) as usize;
    for _ in 0..1 + below(4) {
        let at = below(out.len());
        let end = (at + below(24)).min(out.len());
        match below(7) {
            0 if !out.is_empty() => out[at] ^= 1 << below(8),
            1 if !out.is_empty() => out[at] = below(256) as u8,
            2 => out.truncate(at),
            3 => drop(out.drain(at..end)),
            4 => {
                let copy = out[at..end].to_vec();
                let to = below(out.len());
                out.splice(to..to, copy);
            }
            5 => {
                let from = below(other.len());
                let part = &other[from..(from + below(24)).min(other.len())];
                out.splice(at..at, part.iter().copied());
            }
            _ => {
                let lie = LIES[below(LIES.len())];
                let end = (at + lie.len()).min(out.len());
                out.splice(at..end, lie.iter().copied());
            }
        }
    }
    out
}

/// Mistakes that leave the XML well-formed and so get further: attributes of others, lies, lines lost and
/// doubled.
fn rewrite(seed: &[u8], rng: &mut Pcg32) -> Vec<u8> {
    const LIES: [&str; 12] = [
        "",
        "0",
        "-1",
        "1e39",
        "1e-45",
        "9223372036854775808",
        "nan",
        "$n",
        "$",
        "..",
        "/etc/passwd",
        "400:1, 300:2",
    ];
    let mut below = |n: usize| ((u64::from(rng.next_u32()) * n.max(1) as u64) >> 32) as usize;
    let mut lines: Vec<String> = String::from_utf8_lossy(seed).lines().map(String::from).collect();
    for _ in 0..1 + below(3) {
        let parts: Vec<String> = lines.join("\n").split('"').map(String::from).collect();
        let values: Vec<&String> = parts.iter().skip(1).step_by(2).collect();
        match below(4) {
            0 if lines.len() > 3 => drop(lines.remove(2 + below(lines.len() - 3))),
            1 => {
                let (from, to) = (below(lines.len()), below(lines.len()));
                let copy = lines[from].clone();
                lines.insert(to, copy);
            }
            _ if !values.is_empty() => {
                let new = match below(3) {
                    0 => LIES[below(LIES.len())].to_string(),
                    _ => values[below(values.len())].clone(),
                };
                let at = 2 * below(values.len()) + 1;
                let mut parts = parts.clone();
                parts[at] = new;
                lines = parts.join("\"").lines().map(String::from).collect();
            }
            _ => {}
        }
    }
    lines.join("\n").into_bytes()
}

/// Reads mutations of the seeds. A seed itself must be good, or its mutations would test nothing.
fn assault(name: &str, seeds: &[Vec<u8>], read: impl Fn(&[u8]) -> bool) {
    assault_with(name, seeds, 20_000, mutate, read);
}

type Mutation = fn(&[u8], &[u8], &mut Pcg32) -> Vec<u8>;

fn assault_with(
    name: &str,
    seeds: &[Vec<u8>],
    rounds: usize,
    mutate: Mutation,
    read: impl Fn(&[u8]) -> bool,
) {
    let mut rng = Pcg32::new(20, 1);
    let (mut good, mut worst) = (0, 0);
    for seed in seeds {
        assert!(read(seed), "{name}: the seed itself is refused");
    }
    if let Some(corpus) = std::env::var_os("YUGEN_SEEDS") {
        // For the fuzzers (see fuzz/README.md): a folder for each target, named as the target is.
        let (target, kind) = name.split_once(' ').unwrap_or((name, "seed"));
        let folder = Path::new(&corpus).join(target);
        std::fs::create_dir_all(&folder).unwrap();
        for (i, seed) in seeds.iter().enumerate() {
            std::fs::write(folder.join(format!("{kind}{i}")), seed).unwrap();
        }
    }
    for i in 0..rounds {
        let (seed, other) = (&seeds[i % seeds.len()], &seeds[(i / 7) % seeds.len()]);
        let bytes = mutate(seed, other, &mut rng);
        worst = worst.max(peak(|| good += usize::from(read(&bytes))));
    }
    println!("{name}: {good} of {rounds} were still readable, at most {worst} bytes were held");
    assert!(good > 0 && good < rounds, "{name}: {good} of {rounds} readable is no test");
    assert!(worst < 4 << 20, "{name}: {worst} bytes for a file of a few kilobytes");
}

const FILE: &str = "nowhere/at/all";
