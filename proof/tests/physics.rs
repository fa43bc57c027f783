//! Every law of every model, from the one list. Never edited when a model is added.
//! `YUGEN_MODELS=ward,phong` looks at these only.

use yugen_proof::{Effort, reports};
use yugen_reflectance::Kind;

#[test]
fn every_model_keeps_the_laws_it_promises_and_breaks_those_it_declares() {
    assert!(!Kind::ALL.is_empty(), "the list of models is empty");
    let kinds: Vec<Kind> = match std::env::var("YUGEN_MODELS") {
        Ok(names) => names.split(',').map(|n| Kind::from_name(n).unwrap_or_else(|e| panic!("{e}"))).collect(),
        Err(_) => Kind::ALL.to_vec(),
    };
    let all = reports(&kinds, Effort::FULL, |_| None);
    assert_eq!(all.len(), kinds.len());
    let mut failed = Vec::new();
    for r in &all {
        println!("{r}");
        if !r.passed() {
            failed.push(r.kind.name());
        }
    }
    assert!(failed.is_empty(), "these models do not do as they say: {}", failed.join(", "));
}
