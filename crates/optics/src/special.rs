//! Special functions used by normalisers and samplers.
