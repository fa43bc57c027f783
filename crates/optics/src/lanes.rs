//! Eight numbers side by side. Kernels (those of the reference's hierarchy and of the denoiser) are written once over
//! [`Lanes`]; the portable and the AVX2 implementation do the same IEEE operations in the same order, so their results are
//! equal bit for bit.

/// Eight `f32`. Comparisons give a bit per lane and are false for NaN; `min` and `max` return the second
/// operand when either is NaN, as x86 does.
#[allow(unsafe_code)]
pub trait Lanes: Copy {
    /// `x` in all of them.
    fn splat(x: f32) -> Self;
    /// The eight from `p` on.
    /// # Safety
    /// `p` is 32-byte aligned and readable for eight `f32`.
    unsafe fn load(p: *const f32) -> Self;
    /// These eight.
    fn from_array(lanes: &[f32; 8]) -> Self;
    /// All eight.
    fn to_array(self) -> [f32; 8];
    /// Writes the lanes of `mask`, largest first, to `distances`, and their `children` beside. The lane
    /// counts as the lowest three bits of its (non-negative) number, which orders equals.
    /// # Safety
    /// Both outputs take eight values, whatever the mask; those past its ones are arbitrary.
    unsafe fn write_sorted(self, mask: u32, children: &[u32; 8], distances: *mut u32, out: *mut u32);
    /// Writes the `children` of `mask` in the order of lanes.
    /// # Safety
    /// As for `write_sorted`.
    unsafe fn write_compact(mask: u32, children: &[u32; 8], out: *mut u32);
    /// `self + b`.
    fn add(self, b: Self) -> Self;
    /// `self − b`.
    fn sub(self, b: Self) -> Self;
    /// `self · b`.
    fn mul(self, b: Self) -> Self;
    /// `self / b`.
    fn div(self, b: Self) -> Self;
    /// `self · b + c`, rounded once.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// `self · b − c`, rounded once.
    fn mul_sub(self, b: Self, c: Self) -> Self;
    /// `c − self · b`, rounded once.
    fn neg_mul_add(self, b: Self, c: Self) -> Self;
    /// The smaller of both.
    fn min(self, b: Self) -> Self;
    /// The larger of both.
    fn max(self, b: Self) -> Self;
    /// Bits of the lanes in which `self ≤ b`.
    fn le(self, b: Self) -> u32;
    /// Bits of the lanes in which `self < b`.
    fn lt(self, b: Self) -> u32;
}

/// Plain arrays.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub struct Portable([f32; 8]);

impl Portable {
    #[inline(always)]
    fn zip(self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], b.0[i])))
    }

    #[inline(always)]
    fn mask(self, b: Self, f: impl Fn(f32, f32) -> bool) -> u32 {
        (0..8).fold(0, |m, i| m | u32::from(f(self.0[i], b.0[i])) << i)
    }
}

#[allow(unsafe_code)]
impl Lanes for Portable {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; 8])
    }
    #[inline(always)]
    unsafe fn load(p: *const f32) -> Self {
        // SAFETY: the caller's promise.
        unsafe { *p.cast::<Self>() }
    }
    #[inline(always)]
    fn from_array(lanes: &[f32; 8]) -> Self {
        Self(*lanes)
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        self.0
    }
    #[inline(always)]
    unsafe fn write_sorted(self, mask: u32, children: &[u32; 8], distances: *mut u32, out: *mut u32) {
        let mut keys = [0; 8];
        let mut count = 0;
        for lane in 0..8 {
            if mask & (1 << lane) != 0 {
                keys[count] = self.0[lane as usize].to_bits() & !7 | lane;
                count += 1;
            }
        }
        keys[..count].sort_unstable_by(|a, b| b.cmp(a));
        for (i, key) in keys[..count].iter().enumerate() {
            // SAFETY: the caller's promise.
            unsafe {
                distances.add(i).write(key & !7);
                out.add(i).write(children[(key & 7) as usize]);
            }
        }
    }
    #[inline(always)]
    unsafe fn write_compact(mask: u32, children: &[u32; 8], out: *mut u32) {
        let lanes = (0..8).filter(|lane| mask & (1 << lane) != 0);
        for (i, lane) in lanes.enumerate() {
            // SAFETY: the caller's promise.
            unsafe { out.add(i).write(children[lane]) };
        }
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        self.zip(b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        self.zip(b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        self.zip(b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        self.zip(b, |a, b| a / b)
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].mul_add(b.0[i], c.0[i])))
    }
    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].mul_add(b.0[i], -c.0[i])))
    }
    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        Self(std::array::from_fn(|i| (-self.0[i]).mul_add(b.0[i], c.0[i])))
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        self.zip(b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        self.zip(b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        self.mask(b, |a, b| a <= b)
    }
    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        self.mask(b, |a, b| a < b)
    }
}

/// Whether this processor has what kernels over `Avx2` are compiled for.
pub fn has_avx2() -> bool {
    #[cfg(target_arch = "x86_64")]
    return is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("fma")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2");
    #[cfg(not(target_arch = "x86_64"))]
    false
}

#[cfg(target_arch = "x86_64")]
pub use avx2::Avx2;

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx2 {
    use super::Lanes;
    use std::arch::x86_64::*;

    /// One AVX register. Only ever to be used inside functions compiled for AVX2 and FMA, into which everything here is
    /// inlined, and which are reached only where [`super::has_avx2`].
    #[derive(Clone, Copy)]
    #[repr(transparent)]
    pub struct Avx2(__m256);

    /// Per mask the lanes that are set, lowest first.
    static COMPACT: [[u8; 8]; 256] = {
        let mut table = [[0; 8]; 256];
        let mut mask = 0;
        while mask < 256 {
            let (mut lane, mut n) = (0, 0);
            while lane < 8 {
                if mask & (1 << lane) != 0 {
                    table[mask][n] = lane;
                    n += 1;
                }
                lane += 1;
            }
            mask += 1;
        }
        table
    };

    // SAFETY (all blocks below): `Avx2` is named only by the kernels behind `#[target_feature]`, which
    // are reached only after the processor has been asked; `load` hands its caller's promise on.
    impl Lanes for Avx2 {
        #[inline(always)]
        fn splat(x: f32) -> Self {
            Self(unsafe { _mm256_set1_ps(x) })
        }
        #[inline(always)]
        unsafe fn load(p: *const f32) -> Self {
            Self(unsafe { _mm256_load_ps(p) })
        }
        #[inline(always)]
        fn from_array(lanes: &[f32; 8]) -> Self {
            Self(unsafe { _mm256_loadu_ps(lanes.as_ptr()) })
        }
        #[inline(always)]
        fn to_array(self) -> [f32; 8] {
            let mut out = [0.0; 8];
            unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self.0) };
            out
        }
        #[inline(always)]
        unsafe fn write_sorted(self, mask: u32, children: &[u32; 8], distances: *mut u32, out: *mut u32) {
            unsafe {
                let lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
                let bit = _mm256_sllv_epi32(_mm256_set1_epi32(1), lane);
                let met = _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(mask as i32), bit), bit);
                let key = _mm256_or_si256(
                    _mm256_andnot_si256(_mm256_set1_epi32(7), _mm256_castps_si256(self.0)),
                    lane,
                );
                // Lanes not met sort last.
                let v = _mm256_blendv_epi8(_mm256_set1_epi32(-1), key, met);
                // Batcher's bitonic network; every comparator keeps the larger in the lower lane.
                macro_rules! stage {
                    ($v:ident, $swapped:expr, $lower:literal) => {{
                        let other = $swapped;
                        _mm256_blend_epi32::<$lower>(_mm256_max_epi32($v, other), _mm256_min_epi32($v, other))
                    }};
                }
                let v = stage!(v, _mm256_shuffle_epi32::<0xb1>(v), 0b1010_1010);
                let v = stage!(v, _mm256_shuffle_epi32::<0x1b>(v), 0b1100_1100);
                let v = stage!(v, _mm256_shuffle_epi32::<0xb1>(v), 0b1010_1010);
                let reversed = _mm256_setr_epi32(7, 6, 5, 4, 3, 2, 1, 0);
                let v = stage!(v, _mm256_permutevar8x32_epi32(v, reversed), 0b1111_0000);
                let v = stage!(v, _mm256_shuffle_epi32::<0x4e>(v), 0b1100_1100);
                let v = stage!(v, _mm256_shuffle_epi32::<0xb1>(v), 0b1010_1010);
                let children = _mm256_load_si256(children.as_ptr().cast());
                _mm256_storeu_si256(out.cast(), _mm256_permutevar8x32_epi32(children, v));
                _mm256_storeu_si256(distances.cast(), _mm256_andnot_si256(_mm256_set1_epi32(7), v));
            }
        }
        #[inline(always)]
        unsafe fn write_compact(mask: u32, children: &[u32; 8], out: *mut u32) {
            unsafe {
                let order =
                    _mm256_cvtepu8_epi32(_mm_loadl_epi64(COMPACT[(mask & 255) as usize].as_ptr().cast()));
                let children = _mm256_load_si256(children.as_ptr().cast());
                _mm256_storeu_si256(out.cast(), _mm256_permutevar8x32_epi32(children, order));
            }
        }
        #[inline(always)]
        fn add(self, b: Self) -> Self {
            Self(unsafe { _mm256_add_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn sub(self, b: Self) -> Self {
            Self(unsafe { _mm256_sub_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn mul(self, b: Self) -> Self {
            Self(unsafe { _mm256_mul_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn div(self, b: Self) -> Self {
            Self(unsafe { _mm256_div_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn mul_add(self, b: Self, c: Self) -> Self {
            Self(unsafe { _mm256_fmadd_ps(self.0, b.0, c.0) })
        }
        #[inline(always)]
        fn mul_sub(self, b: Self, c: Self) -> Self {
            Self(unsafe { _mm256_fmsub_ps(self.0, b.0, c.0) })
        }
        #[inline(always)]
        fn neg_mul_add(self, b: Self, c: Self) -> Self {
            Self(unsafe { _mm256_fnmadd_ps(self.0, b.0, c.0) })
        }
        #[inline(always)]
        fn min(self, b: Self) -> Self {
            Self(unsafe { _mm256_min_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn max(self, b: Self) -> Self {
            Self(unsafe { _mm256_max_ps(self.0, b.0) })
        }
        #[inline(always)]
        fn le(self, b: Self) -> u32 {
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, b.0)) as u32 }
        }
        #[inline(always)]
        fn lt(self, b: Self) -> u32 {
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, b.0)) as u32 }
        }
    }
}
