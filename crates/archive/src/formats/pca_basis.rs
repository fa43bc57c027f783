//! A basis of measured BRDFs, as `yugen brdf pca build` writes it.
//!
//! Little-endian: the line `yugen-pca 1\n`; `u32` counts of materials, singular values, components and rows; each
//! name as `u16` length and UTF-8; the singular values; one bit for each bin of a MERL table (lowest first), set for
//! those that are rows; the rows' means; the rows' components, row by row. Numbers are `f32`.

use crate::{Error, Place};
use std::path::Path;
use yugen_reflectance::merl::VALUES;

const MAGIC: &[u8] = b"yugen-pca 1\n";
const BINS: usize = VALUES / 3;

/// Principal components of the logarithms of measured BRDFs: ln(f C + 0.001) ≈ mean + Σ component · coefficient at each
/// bin, C the product of the two cosines, no less than 0.01.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis {
    /// The materials it was made from.
    pub names: Vec<String>,
    /// Of the logarithms less their means: all of them, falling.
    pub singular: Vec<f32>,
    /// Bins of a MERL table (θ_h slowest, φ_d fastest) that every material has, rising.
    pub bins: Vec<u32>,
    /// One a row.
    pub mean: Vec<f32>,
    /// Columns kept.
    pub components: usize,
    /// Row by row; each column has the length of its singular value.
    pub q: Vec<f32>,
}

/// The bytes of a file.
pub fn write(basis: &Basis) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    for n in [basis.names.len(), basis.singular.len(), basis.components, basis.bins.len()] {
        out.extend((n as u32).to_le_bytes());
    }
    for name in &basis.names {
        let mut end = name.len().min(usize::from(u16::MAX));
        while !name.is_char_boundary(end) {
            end -= 1;
        }
        out.extend((end as u16).to_le_bytes());
        out.extend(&name.as_bytes()[..end]);
    }
    let floats = |out: &mut Vec<u8>, v: &[f32]| v.iter().for_each(|x| out.extend(x.to_le_bytes()));
    floats(&mut out, &basis.singular);
    let mut bits = vec![0u8; BINS.div_ceil(8)];
    basis.bins.iter().for_each(|&b| bits[b as usize / 8] |= 1 << (b % 8));
    out.extend(bits);
    floats(&mut out, &basis.mean);
    floats(&mut out, &basis.q);
    out
}

/// The basis of a file.
pub fn read(bytes: &[u8], file: &Path) -> Result<Basis, Error> {
    let size = bytes.len();
    let mut rest = bytes;
    let mut take = |n: usize, what: &str| {
        let at = size - rest.len();
        let (head, tail) = rest.split_at_checked(n).ok_or_else(|| {
            let problem = format!("the file ends within {what}; it was cut off, make it again");
            Error::invalid(Place::byte(file, at as u64), problem)
        })?;
        rest = tail;
        Ok::<_, Error>(head)
    };
    let invalid = |problem: String| Error::invalid(Place::file(file), problem);
    if take(MAGIC.len(), "its first line").ok() != Some(MAGIC) {
        return Err(invalid("is not a basis as `yugen brdf pca build` writes it".into()));
    }
    let head = take(16, "its counts")?;
    let (counts, _) = head.as_chunks::<4>();
    let [materials, values, components, rows] = [0, 1, 2, 3].map(|i| u32::from_le_bytes(counts[i]) as usize);
    if rows == 0
        || rows > BINS
        || components == 0
        || components > values
        || values > 1 << 16
        || materials > 1 << 16
    {
        return Err(invalid(format!(
            "says {materials} materials, {values} singular values, {components} components, {rows} rows; expected at \
             most {BINS} rows and no more components than values"
        )));
    }
    // Before memory is asked for.
    let least = 2 * materials + 4 * values + BINS.div_ceil(8) + 4 * rows * (components + 1);
    if size < least {
        return Err(invalid(format!("has {size} bytes, but what it says it holds needs at least {least}")));
    }
    let mut names = Vec::new();
    for _ in 0..materials {
        let length = take(2, "a name")?;
        let name = take(usize::from(u16::from_le_bytes([length[0], length[1]])), "a name")?;
        names.push(String::from_utf8(name.to_vec()).map_err(|_| invalid("a name is not UTF-8".into()))?);
    }
    let floats = |bytes: &[u8], what: &str| -> Result<Vec<f32>, Error> {
        let (chunks, _) = bytes.as_chunks::<4>();
        let all: Vec<f32> = chunks.iter().map(|b| f32::from_le_bytes(*b)).collect();
        match all.iter().all(|v| v.is_finite()) {
            true => Ok(all),
            false => Err(invalid(format!("{what} hold what is not a finite number"))),
        }
    };
    let singular = floats(take(4 * values, "the singular values")?, "the singular values")?;
    let bits = take(BINS.div_ceil(8), "its mask")?;
    let bins: Vec<u32> = (0..BINS as u32).filter(|b| bits[*b as usize / 8] >> (b % 8) & 1 == 1).collect();
    if bins.len() != rows {
        return Err(invalid(format!("its mask has {} rows, its head says {rows}", bins.len())));
    }
    let mean = floats(take(4 * rows, "the means")?, "the means")?;
    let q = floats(take(4 * rows * components, "the components")?, "the components")?;
    if !rest.is_empty() {
        return Err(invalid(format!("goes on for {} bytes after its end", rest.len())));
    }
    Ok(Basis { names, singular, bins, mean, components, q })
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;

    fn small() -> Basis {
        Basis {
            names: vec!["gold".into(), "silk".into()],
            singular: vec![3.0, 2.0, 0.5],
            bins: vec![0, 7, 8, 1_457_999],
            mean: vec![-1.0, -2.0, -3.0, 0.5],
            components: 2,
            q: (0..8).map(|i| i as f32).collect(),
        }
    }

    #[test]
    fn goes_out_and_comes_back() {
        assert_eq!(read(&write(&small()), Path::new("b.pca")).unwrap(), small());
    }

    #[test]
    fn damaged_files_get_a_sentence() {
        let good = write(&small());
        let text = |bytes: &[u8]| read(bytes, Path::new("b.pca")).unwrap_err().to_string();
        assert!(text(b"gold").contains("is not a basis"));
        assert!(text(&good[..good.len() - 1]).contains("ends within the components"));
        assert!(text(&[&good[..], &[0]].concat()).contains("goes on for 1 bytes"));
        let mut lying = good.clone();
        lying[24..28].copy_from_slice(&1_458_001u32.to_le_bytes());
        assert!(text(&lying).contains("1458001 rows"));
        lying[24..28].copy_from_slice(&1_458_000u32.to_le_bytes());
        assert!(text(&lying).contains("needs at least"));
        let mut nan = good.clone();
        let end = nan.len();
        nan[end - 4..].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(text(&nan).contains("the components hold what is not"));
        let mut rng = Pcg32::new(1, 9);
        let mut refused = 0;
        for _ in 0..60 {
            let mut bytes = good.clone();
            let at = rng.next_u32() as usize % 60;
            bytes[at] ^= 1 << (rng.next_u32() % 8);
            bytes.truncate(bytes.len() - (rng.next_u32() % 2) as usize * 5);
            refused += usize::from(read(&bytes, Path::new("b")).is_err());
        }
        assert!(refused > 30, "{refused}");
    }
}
