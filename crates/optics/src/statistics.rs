//! Tests of hypotheses: chi-square, z and Šidák.
