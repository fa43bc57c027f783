//! The numbers behind the header, in each of the encodings.

use super::header::Scalar;
use crate::formats::numbers::Scanner;
use crate::{Error, Place};
use std::path::Path;

/// The values after the header, one by one.
pub(super) trait Values {
    fn next(&mut self, scalar: Scalar) -> Result<f64, Error>;
    fn skip(&mut self, scalar: Scalar, n: u64) -> Result<(), Error>;
    fn place(&self) -> Place;
    fn bytes_left(&self) -> u64;
    /// The fewest bytes a value takes.
    fn least(&self, scalar: Scalar) -> u64;
}

pub(super) struct Text<'a>(pub(super) Scanner<'a>);

impl Values for Text<'_> {
    #[inline]
    fn next(&mut self, scalar: Scalar) -> Result<f64, Error> {
        self.0.space();
        let _ = scalar;
        self.0.float().ok_or_else(|| self.0.expected("a finite number"))
    }

    fn skip(&mut self, scalar: Scalar, n: u64) -> Result<(), Error> {
        for _ in 0..n {
            self.next(scalar)?;
        }
        Ok(())
    }

    fn place(&self) -> Place {
        self.0.place()
    }

    fn bytes_left(&self) -> u64 {
        // The last number need not be followed by a blank.
        self.0.rest().len() as u64 + 1
    }

    fn least(&self, _: Scalar) -> u64 {
        2
    }
}

pub(super) struct Binary<'a, const LITTLE: bool> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
    pub(super) path: &'a Path,
}

impl<const LITTLE: bool> Binary<'_, LITTLE> {
    #[inline]
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut a = *self.bytes.get(self.at..)?.first_chunk::<N>()?;
        if !LITTLE {
            a.reverse();
        }
        self.at += N;
        Some(a)
    }

    #[inline]
    fn value(&mut self, scalar: Scalar) -> Option<f64> {
        Some(match scalar {
            Scalar::I8 => f64::from(i8::from_le_bytes(self.array()?)),
            Scalar::U8 => f64::from(u8::from_le_bytes(self.array()?)),
            Scalar::I16 => f64::from(i16::from_le_bytes(self.array()?)),
            Scalar::U16 => f64::from(u16::from_le_bytes(self.array()?)),
            Scalar::I32 => f64::from(i32::from_le_bytes(self.array()?)),
            Scalar::U32 => f64::from(u32::from_le_bytes(self.array()?)),
            Scalar::F32 => f64::from(f32::from_le_bytes(self.array()?)),
            Scalar::F64 => f64::from_le_bytes(self.array()?),
        })
    }

    fn cut_off(&self) -> Error {
        Error::invalid(
            Place::byte(self.path, self.at as u64),
            "the file ends in the middle of its data; it may be cut off",
        )
    }
}

impl<const LITTLE: bool> Values for Binary<'_, LITTLE> {
    #[inline]
    fn next(&mut self, scalar: Scalar) -> Result<f64, Error> {
        self.value(scalar).ok_or_else(|| self.cut_off())
    }

    fn skip(&mut self, scalar: Scalar, n: u64) -> Result<(), Error> {
        let bytes = n.checked_mul(scalar.size() as u64).filter(|&b| b <= self.bytes_left());
        self.at += bytes.ok_or_else(|| self.cut_off())? as usize;
        Ok(())
    }

    fn place(&self) -> Place {
        Place::byte(self.path, self.at as u64)
    }

    fn bytes_left(&self) -> u64 {
        (self.bytes.len() - self.at) as u64
    }

    fn least(&self, scalar: Scalar) -> u64 {
        scalar.size() as u64
    }
}
