//! `.pc2`, point caches: where the vertices of a mesh are, frame by frame, as 3ds Max, Maya and Blender read them.
//!
//! Twelve bytes `POINTCACHE2\0`, then little-endian: `i32` version (1), `i32` points of a frame, `f32` first frame, `f32` frames a
//! sample, `i32` samples; then the samples, three `f32` a point.

use crate::{Error, Place, atomic_write_with};
use glam::Vec3;
use std::path::Path;

const MAGIC: &[u8; 12] = b"POINTCACHE2\0";
/// Bytes before the points.
const HEADER: usize = 32;

/// Points over time.
#[derive(Clone, Debug, PartialEq)]
pub struct PointCache {
    /// Number of the first frame.
    pub start: f32,
    /// Frames from one sample to the next.
    pub rate: f32,
    /// All samples, each with as many points, m.
    pub samples: Vec<Vec<Vec3>>,
}

impl PointCache {
    /// What a file holds.
    ///
    /// # Errors
    /// Another file, counts that do not fit its length, points that are no numbers.
    pub fn read(bytes: &[u8], file: &Path) -> Result<Self, Error> {
        let Some((head, points)) = bytes.split_first_chunk::<HEADER>().filter(|(h, _)| h.starts_with(MAGIC))
        else {
            let problem =
                "a point cache begins with POINTCACHE2 and 20 bytes of counts; this is another file";
            return Err(Error::invalid(Place::byte(file, 0), problem));
        };
        let word = |at: usize| [head[at], head[at + 1], head[at + 2], head[at + 3]];
        let [version, count, samples] = [12, 16, 28].map(|at| i32::from_le_bytes(word(at)));
        let [start, rate] = [20, 24].map(|at| f32::from_le_bytes(word(at)));
        if version != 1 {
            let problem = format!("a point cache of version 1 was expected; this has {version}");
            return Err(Error::invalid(Place::byte(file, 12), problem));
        }
        let of = |n: i32| u64::try_from(n).ok();
        let bytes_of = of(count).zip(of(samples)).and_then(|(c, s)| c.checked_mul(s)?.checked_mul(12));
        if bytes_of != Some(points.len() as u64) || count == 0 {
            let problem = format!(
                "{samples} samples of {count} points take {} bytes each; {} bytes are there: write it again",
                i64::from(count) * 12,
                points.len()
            );
            return Err(Error::invalid(Place::byte(file, 16), problem));
        }
        if !start.is_finite() || !rate.is_finite() {
            return Err(Error::invalid(
                Place::byte(file, 20),
                "the first frame and the rate must be numbers",
            ));
        }
        let (words, _) = points.as_chunks::<4>();
        let mut all = Vec::with_capacity(samples as usize);
        for (s, sample) in words.chunks_exact(3 * count as usize).enumerate() {
            let number = |w: &[u8; 4]| f32::from_le_bytes(*w);
            let points: Vec<Vec3> = sample
                .chunks_exact(3)
                .map(|p| Vec3::new(number(&p[0]), number(&p[1]), number(&p[2])))
                .collect();
            if let Some(i) = points.iter().position(|p| !p.is_finite()) {
                let at = HEADER as u64 + (s as u64 * count as u64 + i as u64) * 12;
                return Err(Error::invalid(
                    Place::byte(file, at),
                    format!("point {i} of sample {s} is no number"),
                ));
            }
            all.push(points);
        }
        Ok(Self { start, rate, samples: all })
    }

    /// Writes it.
    ///
    /// # Errors
    /// Samples that differ in number of points, or what the disk says.
    pub fn write(&self, file: &Path) -> Result<(), Error> {
        let count = self.samples.first().map_or(0, Vec::len);
        let fits = i32::try_from(count).ok().zip(i32::try_from(self.samples.len()).ok());
        let Some((points, samples)) = fits.filter(|_| self.samples.iter().all(|s| s.len() == count)) else {
            let problem = "all samples of a point cache have the same number of points, and there are less than 2³¹ of either";
            return Err(Error::invalid(Place::file(file), problem));
        };
        atomic_write_with(file, |out| {
            let mut put = |bytes: &[u8]| out.write_all(bytes).map_err(|e| Error::io(file, e));
            put(MAGIC)?;
            put(&1i32.to_le_bytes())?;
            put(&points.to_le_bytes())?;
            put(&self.start.to_le_bytes())?;
            put(&self.rate.to_le_bytes())?;
            put(&samples.to_le_bytes())?;
            for p in self.samples.iter().flatten() {
                p.to_array().iter().try_for_each(|v| put(&v.to_le_bytes()))?;
            }
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_what_is_damaged_is_told() {
        let cache = PointCache {
            start: 0.0,
            rate: 1.0,
            samples: vec![vec![Vec3::ONE, Vec3::X * -2.5], vec![Vec3::Y, Vec3::Z * 1e-20]],
        };
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.pc2");
        cache.write(&file).unwrap();
        let bytes = crate::read_own(&file, 1 << 20).unwrap();
        assert_eq!(bytes.len(), HEADER + 48);
        assert_eq!(PointCache::read(&bytes, &file).unwrap(), cache);
        let changed = |at: usize, to: &[u8]| {
            let mut bytes = bytes.clone();
            bytes[at..at + to.len()].copy_from_slice(to);
            PointCache::read(&bytes, &file).unwrap_err().to_string()
        };
        for (at, to, says) in [
            (0, b"x".to_vec(), "this is another file"),
            (12, 2i32.to_le_bytes().to_vec(), "version 1 was expected; this has 2"),
            (16, (-1i32).to_le_bytes().to_vec(), "write it again"),
            (16, i32::MAX.to_le_bytes().to_vec(), "write it again"),
            (28, 3i32.to_le_bytes().to_vec(), "48 bytes are there"),
            (36, f32::NAN.to_le_bytes().to_vec(), "point 0 of sample 0 is no number"),
        ] {
            let said = changed(at, &to);
            assert!(said.contains(says), "{said}");
        }
        assert!(PointCache::read(&bytes[..31], &file).is_err());
        let uneven = PointCache { samples: vec![vec![Vec3::ONE], vec![]], ..cache };
        assert!(uneven.write(&file).is_err());
    }
}
