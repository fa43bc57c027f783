//! Damaged and lying files: whatever the bytes are, a reader answers without a panic and with little memory.

#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::Path;
use yugen_archive::formats::{Options, mitsuba, obj, ply, serialized};
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
    assault_with(name, seeds, mutate, read);
}

type Mutation = fn(&[u8], &[u8], &mut Pcg32) -> Vec<u8>;

fn assault_with(name: &str, seeds: &[Vec<u8>], mutate: Mutation, read: impl Fn(&[u8]) -> bool) {
    let mut rng = Pcg32::new(20, 1);
    let (mut good, mut worst) = (0, 0);
    for seed in seeds {
        assert!(read(seed), "{name}: the seed itself is refused");
    }
    const ROUNDS: usize = 20_000;
    for i in 0..ROUNDS {
        let (seed, other) = (&seeds[i % seeds.len()], &seeds[(i / 7) % seeds.len()]);
        let bytes = mutate(seed, other, &mut rng);
        worst = worst.max(peak(|| good += usize::from(read(&bytes))));
    }
    println!("{name}: {good} of {ROUNDS} were still readable, at most {worst} bytes were held");
    assert!(good > 0 && good < ROUNDS, "{name}: {good} of {ROUNDS} readable is no test");
    // Seeds are below 3 kB; DEFLATE may blow up a thousandfold, and the document of a scene has its tables.
    assert!(worst < 4 << 20, "{name}: {worst} bytes for a file of a few kilobytes");
}

const FILE: &str = "nowhere/at/all";

#[test]
fn obj() {
    let seed = b"# seed\nmtllib a.mtl\no thing\nv 0 0 0\nv 1.5 0 0 1 0 0\nv 1 1e-1 0\nv 0 1 -.5\nvt 0 0\nvt 1 0.5\n\
        vn 0 0 1\nusemtl a\ns off\nf 1/1/1 2/2/1 3/1/1 4/2/1\nusemtl b\nf -4//-1 -3//1 \\\n -2//1\nf 1/1 2/2 3/1\n";
    assault("OBJ", &[seed.to_vec()], |b| match obj::read(b, Path::new(FILE)) {
        Ok(o) => {
            let parts = o.split();
            let corners = |(_, m): &(Option<String>, yugen_archive::scene::Mesh)| {
                m.triangles.iter().flatten().map(|&i| m.positions[i as usize].x).sum::<f32>()
            };
            parts.iter().map(corners).sum::<f32>().is_finite() || !parts.is_empty()
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}

#[test]
fn mtl() {
    let seed = b"newmtl a\nKd 1 0 0.5\nNs 20\nmap_Kd -bm 1 wood.png\n# x\nnewmtl b\nd 0.5\n".to_vec();
    assault("MTL", &[seed], |b| {
        let materials = obj::read_mtl(b, Path::new(FILE)).unwrap_or_default();
        materials.iter().any(|m| m.colour("Kd").is_some() && m.file("map_Kd").is_some())
    });
}

fn ply_seed(encoding: &str) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat {encoding} 1.0\ncomment seed\nelement vertex 3\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float nx\n\
         property float ny\nproperty float nz\nproperty float u\nproperty float v\nproperty double heat_x\n\
         property list uchar short odd\nelement face 1\nproperty list uchar int vertex_indices\nelement other 1\n\
         property list int float y\nend_header\n"
    )
    .into_bytes();
    if encoding == "ascii" {
        out.extend(b"0 0 0 255 0 0 0 0 1 0 0 1.5 1 7\n1 0 0 255 0 0 0 0 1 0 0 1.5 0\n");
        out.extend(b"0 1 0 9 9 9 0 0 1 1 1 2 0\n3 0 1 2\n1 5\n");
        return out;
    }
    let mut put = |mut b: Vec<u8>| {
        if encoding.contains("big") {
            b.reverse();
        }
        out.extend(b);
    };
    for [x, y] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0f32]] {
        [x, y, 0.0].iter().for_each(|v| put(v.to_le_bytes().into()));
        [1, 2, 3u8].iter().for_each(|&v| put(vec![v]));
        [0.0, 0.0, 1.0, x, y].iter().for_each(|v| put(v.to_le_bytes().into()));
        put(1.5f64.to_le_bytes().into());
        put(vec![1]);
        put(7i16.to_le_bytes().into());
    }
    put(vec![3]);
    [0, 1, 2i32].iter().for_each(|v| put(v.to_le_bytes().into()));
    put(1i32.to_le_bytes().into());
    put(5f32.to_le_bytes().into());
    out
}

#[test]
fn ply() {
    let seeds = ["ascii", "binary_little_endian", "binary_big_endian"].map(ply_seed);
    assault("PLY", &seeds, |b| match ply::read(b, Path::new(FILE)) {
        Ok(m) => {
            let n = m.positions.len();
            assert!(m.triangles.iter().flatten().all(|&i| (i as usize) < n));
            assert!(m.attributes.iter().all(|(_, w, v)| v.len() == w * n));
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}

/// One triangle. At level 0 the stream is stored as it is, so that mutations reach what it says.
fn serialized_seed(version: u16, level: u32) -> Vec<u8> {
    let mut body = 0x1003u32.to_le_bytes().to_vec();
    if version == 4 {
        body.extend(b"tri\0");
    }
    body.extend(3u64.to_le_bytes());
    body.extend(1u64.to_le_bytes());
    let positions = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0f32];
    let normals = [0.0, 0.0, 1.0].repeat(3);
    let uvs = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
    for v in positions.iter().chain(&normals).chain(&uvs) {
        body.extend(v.to_le_bytes());
    }
    for i in [0, 1, 2u32] {
        body.extend(i.to_le_bytes());
    }
    let mut out = 0x041cu16.to_le_bytes().to_vec();
    out.extend(version.to_le_bytes());
    let mut zip = flate2::write::ZlibEncoder::new(out, flate2::Compression::new(level));
    std::io::Write::write_all(&mut zip, &body).unwrap();
    let mut out = zip.finish().unwrap();
    if version == 4 {
        out.extend(0u64.to_le_bytes())
    } else {
        out.extend(0u32.to_le_bytes())
    }
    out.extend(1u32.to_le_bytes());
    out
}

#[test]
fn serialized_meshes() {
    let seeds = [(3, 0), (4, 0), (4, 9)].map(|(version, level)| serialized_seed(version, level));
    assault("serialized", &seeds, |b| match serialized::read(b, 0, Path::new(FILE)) {
        Ok(s) => {
            assert!(s.mesh.triangles.iter().flatten().all(|&i| (i as usize) < s.mesh.positions.len()));
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            // The table of offsets is another way in.
            let _ = serialized::read(b, 1, Path::new(FILE));
            false
        }
    });
}

#[test]
fn mitsuba_scenes() {
    let seed = br#"<?xml version="1.0"?><!-- seed -->
<scene version="3.0.0"><default name="n" value="4"/><default name="kind" value="path"/>
<integrator type="moment"><integrator type="$kind"><integer name="max_depth" value="$n"/></integrator></integrator>
<sensor type="thinlens"><float name="aperture_radius" value="0.1"/><string name="fov_axis" value="smaller"/>
<float name="fov" value="40"/><transform name="to_world"><rotate y="1" angle="20"/>
<lookat origin="1,2,3" target="0 0 0" up="0,1,0"/><matrix value="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"/></transform>
<film type="hdrfilm"><integer name="width" value="64"/><rfilter type="mitchell"><float name="B" value="0.2"/></rfilter>
</film></sensor>
<texture type="checkerboard" id="t"><rgb name="color0" value="0.1 0.2 0.3"/>
<transform name="to_uv"><scale value="3"/></transform></texture>
<bsdf type="twosided" id="m"><bsdf type="diffuse"><ref name="reflectance" id="t"/></bsdf></bsdf><alias id="m" as="m2"/>
<bsdf type="roughconductor"><string name="material" value="Au"/><ref name="alpha" id="t"/></bsdf>
<bsdf type="mask" id="k"><float name="opacity" value="0.5"/>
<bsdf type="dielectric"><string name="int_ior" value="water"/></bsdf></bsdf>
<shape type="sphere"><point name="center" x="1" y="2" z="3"/><ref id="m2"/>
<emitter type="area"><spectrum name="radiance" value="400:1, 700:2"/></emitter></shape>
<shape type="shapegroup" id="g"><shape type="cube"><ref id="k"/></shape>
<shape type="cylinder"><float name="radius" value="2"/></shape></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><translate x="3"/></transform></shape>
<emitter type="spot"><rgb name="intensity" value="3"/></emitter><emitter type="constant"/></scene>"#;
    let options = Options { defines: vec![("n".into(), "7".into())], ..Options::default() };
    let read = |b: &[u8]| match mitsuba::read(b, Path::new(FILE), &options) {
        Ok(scene) => scene.cameras.len() == 1,
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    };
    assault("Mitsuba XML, bytes", &[seed.to_vec()], read);
    assault_with("Mitsuba XML, words", &[seed.to_vec()], |seed, _, rng| rewrite(seed, rng), read);
}

#[test]
fn claims_of_a_trillion_elements_cost_nothing() {
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let text = format!(
            "ply\nformat {encoding} 1.0\nelement vertex 1099511627776\nproperty float x\nproperty float y\n\
             property float z\nelement face 1099511627776\nproperty list uchar int vertex_indices\nend_header\n0 0 0"
        );
        let bytes = peak(|| assert!(ply::read(text.as_bytes(), Path::new(FILE)).is_err()));
        assert!(bytes < 1 << 16, "{bytes} bytes for {encoding}");
    }
    let mut lie = serialized_seed(4, 0);
    let at = lie.windows(8).position(|w| w == 3u64.to_le_bytes()).unwrap();
    lie[at..at + 8].copy_from_slice(&(1u64 << 40).to_le_bytes());
    let bytes = peak(|| assert!(serialized::read(&lie, 0, Path::new(FILE)).is_err()));
    assert!(bytes < 1 << 18, "{bytes} bytes for a serialized mesh");
}
