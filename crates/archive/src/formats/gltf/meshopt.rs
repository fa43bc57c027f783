//! Kapoulkine and St. Pierre 2021, "EXT_meshopt_compression": buffer views packed as attributes, triangles or indices,
//! and the filters over them.

/// How a view is packed, from its JSON.
pub(super) struct Packing<'a> {
    pub count: usize,
    /// Bytes from one element to the next.
    pub stride: usize,
    pub mode: &'a str,
    pub filter: &'a str,
}

/// What a packed view holds; the error is the end of a sentence about it.
pub(super) fn decode(data: &[u8], packing: &Packing) -> Result<Vec<u8>, String> {
    let Packing { count, stride, mode, filter } = *packing;
    match mode {
        "ATTRIBUTES" => {
            let mut out = attributes(data, count, stride)?;
            unfilter(&mut out, stride, filter)?;
            Ok(out)
        }
        "TRIANGLES" | "INDICES" => {
            if !matches!(stride, 2 | 4) || filter != "NONE" {
                return Err(format!(
                    "has indices of {stride} bytes with the filter {filter}; expected 2 or 4, NONE"
                ));
            }
            let indices = if mode == "TRIANGLES" { triangles(data, count) } else { indices(data, count) }?;
            Ok(indices.iter().flat_map(|i| i.to_le_bytes().into_iter().take(stride)).collect())
        }
        other => Err(format!("has the mode '{other}'; expected ATTRIBUTES, TRIANGLES or INDICES")),
    }
}

const SHORT: &str = "ends before all of its elements";

/// Bytes taken one after the other.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.0.split_at_checked(n).ok_or(SHORT)?;
        self.0 = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, String> {
        Ok(self.take(1)?[0])
    }

    /// Seven bits a byte, the lowest first.
    fn varint(&mut self) -> Result<u32, String> {
        let mut value = 0u32;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err("has an index of more than 32 bits".into())
    }
}

/// The sign is the lowest bit.
fn zigzag(v: u32) -> u32 {
    (v >> 1) ^ (v & 1).wrapping_neg()
}

/// Appendix A, mode 0.
fn attributes(data: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    if stride == 0 || stride > 256 || !stride.is_multiple_of(4) {
        return Err(format!("has elements of {stride} bytes; expected a multiple of 4 up to 256"));
    }
    let (&header, body) = data.split_first().ok_or(SHORT)?;
    if header != 0xa0 {
        return Err(format!("begins with {header:#04x}; expected 0xa0"));
    }
    let body_length = body.len().checked_sub(stride.max(32)).ok_or(SHORT)?;
    let (body, tail) = body.split_at(body_length);
    // Every 64 elements cost a byte for each of theirs, so that memory is not asked for in vain.
    if count.div_ceil(64).checked_mul(stride).is_none_or(|least| least > body.len()) {
        return Err(SHORT.into());
    }
    let mut out = vec![0; count * stride];
    let mut last = tail[tail.len() - stride..].to_vec();
    let mut bytes = Bytes(body);
    let per_block = ((8192 / stride) & !15).min(256);
    for block in out.chunks_mut(per_block * stride) {
        let groups = (block.len() / stride).div_ceil(16);
        for (k, last) in last.iter_mut().enumerate() {
            let headers = bytes.take(groups.div_ceil(4))?;
            for g in 0..groups {
                let mut deltas = [0u8; 16];
                match headers[g / 4] >> (2 * (g % 4)) & 3 {
                    0 => {}
                    3 => deltas.copy_from_slice(bytes.take(16)?),
                    // Two or four bits each, the first in the highest; all ones: a byte of its own follows.
                    bits => {
                        let width = 2 * usize::from(bits);
                        let packed = bytes.take(2 * width)?;
                        let full = (1u8 << width) - 1;
                        for (i, delta) in deltas.iter_mut().enumerate() {
                            let bit = i * width;
                            let value = packed[bit / 8] >> (8 - width - bit % 8) & full;
                            *delta = if value == full { bytes.byte()? } else { value };
                        }
                    }
                }
                let elements = block.chunks_exact_mut(stride).skip(16 * g);
                for (element, delta) in elements.zip(deltas) {
                    *last = last.wrapping_add(zigzag(u32::from(delta)) as u8);
                    element[k] = *last;
                }
            }
        }
    }
    if bytes.0.is_empty() { Ok(out) } else { Err("goes on after its last element".into()) }
}

/// The last sixteen of something, the latest first.
struct Recent<T> {
    all: [T; 16],
    next: usize,
}

impl<T: Copy> Recent<T> {
    fn new(nothing: T) -> Self {
        Self { all: [nothing; 16], next: 0 }
    }

    fn push(&mut self, value: T) {
        self.all[self.next % 16] = value;
        self.next = (self.next + 1) % 16;
    }

    fn get(&self, back: u8) -> T {
        self.all[(self.next + 15 - usize::from(back & 15)) % 16]
    }
}

/// The next index that was not used yet.
fn fresh(next: &mut u32) -> u32 {
    let v = *next;
    *next = next.wrapping_add(1);
    v
}

/// Appendix A, mode 1.
fn triangles(data: &[u8], count: usize) -> Result<Vec<u32>, String> {
    if !count.is_multiple_of(3) {
        return Err(format!("has {count} indices, which are no triangles"));
    }
    let (&header, body) = data.split_first().ok_or(SHORT)?;
    if header != 0xe1 {
        return Err(format!("begins with {header:#04x}; expected 0xe1"));
    }
    let body_length = body.len().checked_sub(16).ok_or(SHORT)?;
    let (body, table) = body.split_at(body_length);
    let mut bytes = Bytes(body);
    let codes = bytes.take(count / 3)?;
    let mut out = Vec::with_capacity(count);
    let (mut next, mut last) = (0u32, 0u32);
    let mut edges = Recent::new([0u32; 2]);
    let mut vertices = Recent::new(0u32);
    for &code in codes {
        let (x, y) = (code >> 4, code & 15);
        let [a, b, c] = if x < 15 {
            let [a, b] = edges.get(x);
            let c = match y {
                0 => fresh(&mut next),
                1..=12 => vertices.get(y),
                13 | 14 => {
                    last = if y == 13 { last.wrapping_sub(1) } else { last.wrapping_add(1) };
                    last
                }
                _ => {
                    last = last.wrapping_add(zigzag(bytes.varint()?));
                    last
                }
            };
            if !(1..=12).contains(&y) {
                vertices.push(c);
            }
            [a, b, c]
        } else {
            let explicit = y >= 14;
            let pair = if explicit { bytes.byte()? } else { table[usize::from(y)] };
            if explicit && pair == 0 {
                next = 0;
            }
            // 0: the next; 15: written out; else one of the recent.
            let mut corner = |how: u8, next: &mut u32, vertices: &Recent<u32>| -> Result<u32, String> {
                Ok(match how {
                    0 => fresh(next),
                    15 if explicit => {
                        last = last.wrapping_add(zigzag(bytes.varint()?));
                        last
                    }
                    back => vertices.get(back - 1),
                })
            };
            let hows = [if y == 15 { 15 } else { 0 }, pair >> 4, pair & 15];
            let [a, b, c] = [
                corner(hows[0], &mut next, &vertices)?,
                corner(hows[1], &mut next, &vertices)?,
                corner(hows[2], &mut next, &vertices)?,
            ];
            for (v, how) in [a, b, c].into_iter().zip(hows) {
                if how == 0 || (how == 15 && explicit) {
                    vertices.push(v);
                }
            }
            edges.push([b, a]);
            [a, b, c]
        };
        edges.push([c, b]);
        edges.push([a, c]);
        out.extend([a, b, c]);
    }
    if bytes.0.is_empty() { Ok(out) } else { Err("goes on after its last triangle".into()) }
}

/// Appendix A, mode 2.
fn indices(data: &[u8], count: usize) -> Result<Vec<u32>, String> {
    let (&header, body) = data.split_first().ok_or(SHORT)?;
    if header != 0xd1 {
        return Err(format!("begins with {header:#04x}; expected 0xd1"));
    }
    let mut bytes = Bytes(&body[..body.len().checked_sub(4).ok_or(SHORT)?]);
    // An index is a byte at least.
    if count > bytes.0.len() {
        return Err(SHORT.into());
    }
    let mut last = [0u32; 2];
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let v = bytes.varint()?;
        let last = &mut last[(v & 1) as usize];
        *last = last.wrapping_add(zigzag(v >> 1));
        out.push(*last);
    }
    if bytes.0.is_empty() { Ok(out) } else { Err("goes on after its last index".into()) }
}

/// Appendix B.
fn unfilter(data: &mut [u8], stride: usize, filter: &str) -> Result<(), String> {
    let fits = match filter {
        "NONE" => return Ok(()),
        "OCTAHEDRAL" => matches!(stride, 4 | 8),
        "QUATERNION" => stride == 8,
        "EXPONENTIAL" => stride.is_multiple_of(4),
        other => {
            return Err(format!(
                "has the filter '{other}'; expected NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL"
            ));
        }
    };
    if !fits {
        return Err(format!("has elements of {stride} bytes, which the filter {filter} does not take"));
    }
    match (filter, stride) {
        ("OCTAHEDRAL", 4) => data.chunks_exact_mut(4).for_each(|e| {
            let [x, y, one] = [e[0], e[1], e[2]].map(|v| f32::from(v as i8));
            let n = octahedral(x, y, one).map(|v| (v * 127.0).round() as i8 as u8);
            e[..3].copy_from_slice(&n);
        }),
        ("OCTAHEDRAL", _) => data.chunks_exact_mut(8).for_each(|e| {
            let [x, y, one, _] = shorts(e).map(f32::from);
            let n = octahedral(x, y, one).map(|v| (v * 32767.0).round() as i16);
            n.iter().zip(e.chunks_exact_mut(2)).for_each(|(v, to)| to.copy_from_slice(&v.to_le_bytes()));
        }),
        ("QUATERNION", _) => data.chunks_exact_mut(8).for_each(|e| {
            let [x, y, z, scale] = shorts(e);
            let one = f32::from(scale | 3);
            let part = [x, y, z].map(|v| f32::from(v) / one * std::f32::consts::FRAC_1_SQRT_2);
            let w = (1.0 - part.iter().map(|v| v * v).sum::<f32>()).max(0.0).sqrt();
            // The largest was left out; the others follow it in a circle.
            let largest = usize::from(scale as u16 & 3);
            for (i, v) in [w, part[0], part[1], part[2]].into_iter().enumerate() {
                let at = 2 * ((largest + i) % 4);
                e[at..at + 2].copy_from_slice(&((v * 32767.0).round() as i16).to_le_bytes());
            }
        }),
        _ => data.chunks_exact_mut(4).for_each(|e| {
            let v = i32::from_le_bytes([e[0], e[1], e[2], e[3]]);
            let value = ((v << 8) >> 8) as f32 * 2f32.powi(v >> 24);
            e.copy_from_slice(&value.to_le_bytes());
        }),
    }
    Ok(())
}

fn shorts(e: &[u8]) -> [i16; 4] {
    std::array::from_fn(|i| i16::from_le_bytes([e[2 * i], e[2 * i + 1]]))
}

/// A unit vector from two numbers of an octahedron whose corners are at `one`.
fn octahedral(x: f32, y: f32, one: f32) -> [f32; 3] {
    let (x, y) = (x / one, y / one);
    let z = 1.0 - x.abs() - y.abs();
    let fold = z.min(0.0);
    let (x, y) = (x - fold.copysign(x), y - fold.copysign(y));
    let length = (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|v| v / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    // Made by the encoder of meshoptimizer 1.3.0, its attributes in the form of the extension.
    const SHORTS: &str = concat!(
        "a02a066666666666666666666666666666666666666600000000001f000e2a46627e9ab6d2eef5d98da185694d011506",
        "226e5a76c2aecae9fde195a9ffdf00005d712539124a3629000222ca05252225223223243234343434000000001f002f",
        "2f2f2fc02f2f2f2fc02f2f2f2fc02f2f2f2fc02f2f2f2fc02f2f2f2fc02fffff00002f2f2fc02f2f2f2f2a08868f8868",
        "f8868f1d1d1d8868f8868f8868f81d1d1d868f8868000000001d00000000000000000000000000000000000000000000",
        "000000000000000030f80000",
    );
    const TRIANGLES: &str = concat!(
        "e1fe0dfe13fe12fe12fe0dfe03fe02fe02ff0dff03ff02ff02ff0dff03ff02ff02ffff0f0cf304f202f2028f048f048f",
        "028f028f070c8f070c8f090c8f090c8f070c8f070c8f090c8f090c1f2910fc070d007687566778a98665896898016900",
        "00",
    );
    const INDICES: &str = concat!(
        "d10004141618020e04141618020e04141618020e04141618020a04141618020e04141618020e04141618020e04141618",
        "020a04141618020e04141618020e04141618020e04141618020a04141618020e04141618020e04141618020e04141618",
        "024e54320e1a4c00000000",
    );

    fn bytes(hex: &str) -> Vec<u8> {
        (0..hex.len() / 2).map(|i| u8::from_str_radix(&hex[2 * i..2 * i + 2], 16).unwrap()).collect()
    }

    fn unpack(hex: &str, count: usize, stride: usize, mode: &str, filter: &str) -> Vec<u8> {
        decode(&bytes(hex), &Packing { count, stride, mode, filter }).unwrap()
    }

    fn grid() -> Vec<u32> {
        let mut all = Vec::new();
        for p in (0..4).flat_map(|y| (0..4).map(move |x| 5 * y + x)) {
            all.extend([p, p + 1, p + 6, p, p + 6, p + 5]);
        }
        all.extend([3, 24, 11, 7, 0, 19]);
        all
    }

    #[test]
    fn attributes_and_indices_come_back_as_they_were() {
        let shorts = |i: i16| [3 * i, (i * i * 7) % 1000, (i % 5) * 1000 - 2000, 0];
        let want: Vec<u8> = (0..40).flat_map(shorts).flat_map(i16::to_le_bytes).collect();
        assert_eq!(unpack(SHORTS, 40, 8, "ATTRIBUTES", "NONE"), want);
        let want: Vec<u8> = grid().into_iter().flat_map(u32::to_le_bytes).collect();
        assert_eq!(unpack(INDICES, 102, 4, "INDICES", "NONE"), want);
        // The encoder begins a triangle with the corner that packs best; the order around it stays.
        let turned = |indices: &[u32]| -> Vec<[u32; 3]> {
            let triangles =
                indices.chunks_exact(3).map(|t| [[t[0], t[1], t[2]], [t[1], t[2], t[0]], [t[2], t[0], t[1]]]);
            triangles.map(|turns| turns.into_iter().min().unwrap()).collect()
        };
        let got = unpack(TRIANGLES, 102, 4, "TRIANGLES", "NONE");
        let got: Vec<u32> =
            got.chunks_exact(4).map(|c| u32::from_le_bytes([c[0], c[1], c[2], c[3]])).collect();
        assert_eq!(turned(&got), turned(&grid()));
    }

    #[test]
    fn filters_give_the_numbers_that_were_filtered() {
        let near = |got: f32, want: f32, step: f32| assert!((got - want).abs() <= step, "{got} for {want}");
        let normals =
            [0.0f32, 0.0, 1.0, 0.0, 0.6, 0.0, 0.8, 0.0, -0.6, 0.64, -0.48, 1.0, 0.0, -1.0, 0.0, 0.0];
        let wide = unpack(
            "a0013f000000dae30a013f00000006110c010f0000006a67010f0000000a1900000106000000010f000000fefd00000000000000000000000000000000000000000000000000000000ff070000",
            4,
            8,
            "ATTRIBUTES",
            "OCTAHEDRAL",
        );
        let wide = wide.chunks_exact(2).map(|c| f32::from(i16::from_le_bytes([c[0], c[1]])) / 32767.0);
        // Twelve bits; the fourth number is passed on as it is, here in twelve bits too.
        for (i, (got, want)) in wide.zip(normals).enumerate().filter(|(i, _)| i % 4 < 3) {
            near(got, want, if i % 4 < 3 { 2.0 / 2047.0 } else { 1.0 });
        }
        let narrow = unpack(
            "a0013f0000006cf4a0010f000000a65c00010f000000fefd0000000000000000000000000000000000000000000000000000000000007f00",
            4,
            4,
            "ATTRIBUTES",
            "OCTAHEDRAL",
        );
        for (i, (got, want)) in narrow.iter().zip(normals).enumerate() {
            if i % 4 < 3 {
                near(f32::from(*got as i8) / 127.0, want, 2.0 / 127.0);
            }
        }
        let turns = [0.0f32, 0.0, 0.0, 1.0, 0.5, 0.5, 0.5, 0.5, 0.8, 0.0, 0.6, 0.0, 0.36, 0.48, -0.8, 0.0];
        let got = unpack(
            "a0013c000000fbfc013c000000b4b3013f000000fb3474013f000000b424a4013f000000fbfc3a013f000000b4b3ad0133000000050400000000000000000000000000000000000000000000000000000000000000ff7f",
            4,
            8,
            "ATTRIBUTES",
            "QUATERNION",
        );
        let got: Vec<f32> =
            got.chunks_exact(2).map(|c| f32::from(i16::from_le_bytes([c[0], c[1]])) / 32767.0).collect();
        for (got, want) in got.chunks(4).zip(turns.chunks(4)) {
            // A quaternion and its negative are the same turn.
            let dot: f32 = got.iter().zip(want).map(|(a, b)| a * b).sum();
            near(dot.abs(), 1.0, 1e-3);
        }
        let got = unpack(
            "a00001300000001f000130000000100130000000ff01300000002c000130000000100001300000006801200000000130000000100000000000000000000000000000000000000000001000f4002800f400ccfff4",
            2,
            12,
            "ATTRIBUTES",
            "EXPONENTIAL",
        );
        // The numbers of an element share an exponent: each is as exact as the largest.
        for (got, want) in got.chunks_exact(12).zip([[1.0f32, 2.5, -3.25], [0.0, 1000.0, -0.001]]) {
            let largest = want.into_iter().fold(0.0, |a: f32, b| a.max(b.abs()));
            for (got, want) in got.chunks_exact(4).zip(want) {
                near(f32::from_le_bytes([got[0], got[1], got[2], got[3]]), want, largest * 1e-4);
            }
        }
    }

    #[test]
    fn damaged_data_is_refused_and_asks_for_no_memory() {
        let all =
            [(SHORTS, 40, 8, "ATTRIBUTES"), (TRIANGLES, 102, 4, "TRIANGLES"), (INDICES, 102, 4, "INDICES")];
        for (hex, count, stride, mode) in all {
            let good = bytes(hex);
            let packing = |count, mode| Packing { count, stride, mode, filter: "NONE" };
            for length in 0..good.len() {
                assert!(decode(&good[..length], &packing(count, mode)).is_err(), "{mode} {length}");
            }
            for at in 0..good.len() {
                let mut bad = good.clone();
                bad[at] ^= 0x55;
                let _ = decode(&bad, &packing(count, mode));
            }
            assert!(decode(&good, &packing(usize::MAX / 3 * 3, mode)).is_err());
            assert!(decode(&good, &packing(count, "STRIPS")).is_err());
        }
    }
}
