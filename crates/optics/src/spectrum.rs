//! Spectra: tables over wavelength, colour-matching functions, illuminants.
