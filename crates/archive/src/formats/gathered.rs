//! A picture that comes in bands of rows and is written when it is whole. A large one waits in a temporary file without
//! a name (in the folder `TMPDIR`), so that memory does not grow with the picture.

use super::relightable::{Basis, Colouring, Relightable};
use crate::{Error, Place};
use std::borrow::Cow;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;

/// The rows of a [`Relightable`] so far.
#[derive(Debug)]
pub struct Gathered<'a> {
    width: usize,
    height: usize,
    basis: Basis,
    colouring: Colouring,
    /// How many numbers have come.
    numbers: usize,
    /// Smallest and largest of each of a texel's numbers.
    ranges: Vec<[f32; 2]>,
    finite: bool,
    memory: u64,
    linear: bool,
    place: Set<'a>,
}

#[derive(Debug)]
enum Set<'a> {
    Memory(Cow<'a, [f32]>),
    Disk(File),
}

impl Gathered<'static> {
    /// For a picture of this size, which is held in memory if it needs no more than so many bytes; what is made of it when
    /// it is written may need as many again, or as many as a single picture of it takes.
    ///
    /// # Errors
    /// Where no temporary file can be made.
    pub fn new(
        [width, height]: [usize; 2],
        basis: Basis,
        colouring: Colouring,
        memory: u64,
    ) -> Result<Self, Error> {
        let stride = colouring.stride(basis);
        let place = if (width * height * stride * size_of::<f32>()) as u64 <= memory {
            let mut all = Vec::new();
            all.reserve_exact(width * height * stride);
            Set::Memory(Cow::Owned(all))
        } else {
            Set::Disk(tempfile::tempfile().map_err(failed)?)
        };
        let ranges = vec![[f32::INFINITY, f32::NEG_INFINITY]; stride];
        let (numbers, finite, linear) = (0, true, false);
        Ok(Self { width, height, basis, colouring, numbers, ranges, finite, memory, linear, place })
    }

    /// Says whether the values are proportional to light, in files that tell; else they are display values.
    pub fn set_linear(&mut self, linear: bool) {
        self.linear = linear;
    }

    /// Takes the next texels, in the order of [`Relightable::coefficients`].
    ///
    /// # Errors
    /// Where the temporary file cannot be written, as on a full disk.
    pub fn push(&mut self, coefficients: &[f32]) -> Result<(), Error> {
        self.look_at(coefficients);
        match &mut self.place {
            Set::Memory(all) => all.to_mut().extend_from_slice(coefficients),
            Set::Disk(file) => file.write_all(bytemuck::cast_slice(coefficients)).map_err(failed)?,
        }
        Ok(())
    }
}

impl<'a> From<&'a Relightable> for Gathered<'a> {
    fn from(r: &'a Relightable) -> Self {
        let Relightable { width, height, basis, colouring, .. } = *r;
        let ranges = vec![[f32::INFINITY, f32::NEG_INFINITY]; r.stride()];
        let place = Set::Memory(Cow::Borrowed(&r.coefficients[..]));
        let memory = size_of_val(&r.coefficients[..]) as u64;
        let (numbers, finite, linear) = (0, true, false);
        let mut all =
            Self { width, height, basis, colouring, numbers, ranges, finite, memory, linear, place };
        all.look_at(&r.coefficients);
        all
    }
}

fn failed(e: std::io::Error) -> Error {
    Error::io(&std::env::temp_dir(), e)
}

impl Gathered<'_> {
    fn look_at(&mut self, coefficients: &[f32]) {
        self.numbers += coefficients.len();
        for texel in coefficients.chunks_exact(self.ranges.len()) {
            for (range, &v) in self.ranges.iter_mut().zip(texel) {
                // Neither takes what is no number.
                *range = [range[0].min(v), range[1].max(v)];
                self.finite &= v.is_finite();
            }
        }
    }

    /// Texels across and down.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// The functions of light.
    pub fn basis(&self) -> Basis {
        self.basis
    }

    /// What they make up.
    pub fn colouring(&self) -> Colouring {
        self.colouring
    }

    /// Numbers a texel.
    pub fn stride(&self) -> usize {
        self.ranges.len()
    }

    /// Whether the values are proportional to light.
    pub(super) fn is_linear(&self) -> bool {
        self.linear
    }

    /// Bytes that what is made of it may need.
    pub(super) fn memory(&self) -> u64 {
        self.memory
    }

    /// Smallest and largest of each of a texel's numbers.
    pub(super) fn ranges(&self) -> &[[f32; 2]] {
        &self.ranges
    }

    /// Smallest and largest coefficient of each term over all texels and colours.
    pub(super) fn term_ranges(&self) -> Vec<[f32; 2]> {
        let (fixed, colours) = match self.colouring {
            Colouring::Rgb => (0, 3),
            Colouring::Lrgb => (3, 1),
        };
        let wider = |a: [f32; 2], b: &[f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        let nothing = [f32::INFINITY, f32::NEG_INFINITY];
        self.ranges[fixed..].chunks_exact(colours).map(|c| c.iter().fold(nothing, wider)).collect()
    }

    /// Refuses what no file can hold: no texels, numbers that are not finite or not as many as there should be.
    pub(super) fn check(&self, file: &Path) -> Result<(), Error> {
        let problem = if self.width == 0 || self.height == 0 {
            "an empty picture cannot be written"
        } else if self.numbers != self.width * self.height * self.stride() {
            "the picture has not as many coefficients as its size says"
        } else if !self.finite {
            "a coefficient is not a finite number; fit the picture again without the texels that cannot be fitted"
        } else {
            return Ok(());
        };
        Err(Error::invalid(Place::file(file), problem))
    }

    /// The texels of row `y`, counted from the top.
    pub(super) fn row(&mut self, y: usize, out: &mut Vec<f32>) -> Result<(), Error> {
        let count = self.width * self.stride();
        match &mut self.place {
            Set::Memory(all) => {
                out.clear();
                out.extend_from_slice(&all[y * count..(y + 1) * count]);
            }
            Set::Disk(file) => {
                out.resize(count, 0.0);
                file.seek(SeekFrom::Start((y * count * size_of::<f32>()) as u64)).map_err(failed)?;
                file.read_exact(bytemuck::cast_slice_mut(out)).map_err(failed)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::relightable::tests::sample;
    use super::*;

    #[test]
    fn what_waits_on_the_disk_is_what_waits_in_memory() {
        for colouring in [Colouring::Rgb, Colouring::Lrgb] {
            let r = sample(Basis::Hsh { order: 2 }, colouring, 7, 5);
            let mut borrowed = Gathered::from(&r);
            for memory in [0, u64::MAX] {
                let mut all = Gathered::new([7, 5], r.basis, colouring, memory).unwrap();
                assert_eq!(matches!(all.place, Set::Disk(_)), memory == 0);
                let parts = r.coefficients.chunks(2 * 7 * r.stride());
                parts.for_each(|band| all.push(band).unwrap());
                all.check(Path::new("a")).unwrap();
                assert_eq!(all.ranges, borrowed.ranges);
                assert_eq!(all.term_ranges(), r.ranges());
                let (mut a, mut b) = (Vec::new(), Vec::new());
                // Whatever order they are asked for in.
                for y in [4, 0, 2, 1, 3] {
                    all.row(y, &mut a).unwrap();
                    borrowed.row(y, &mut b).unwrap();
                    assert_eq!(a, b);
                    assert_eq!(a, r.coefficients[y * 7 * r.stride()..][..7 * r.stride()]);
                }
            }
        }
        let mut all = Gathered::new([2, 1], Basis::Ptm, Colouring::Rgb, 0).unwrap();
        all.push(&[0.5; 18]).unwrap();
        let error = all.check(Path::new("a.ptm")).unwrap_err().to_string();
        assert!(error.contains("not as many coefficients"), "{error}");
        all.push(&[f32::NAN; 18]).unwrap();
        let error = all.check(Path::new("a.ptm")).unwrap_err().to_string();
        assert!(error.contains("not a finite number"), "{error}");
    }
}
