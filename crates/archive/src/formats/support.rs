//! What the readers make of other people's files, feature by feature. Readers look words up in these tables, and the
//! manual prints them, so that it says what the code does.

/// How much of a feature is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Support {
    /// All of it.
    Yes,
    /// Some of it: what is left out.
    Partly(&'static str),
    /// Nothing: why, or what to do instead.
    No(&'static str),
}

/// A plugin, an extension, a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Feature {
    /// As files write it.
    pub name: &'static str,
    /// How much of it is read.
    pub support: Support,
}

impl Feature {
    /// All of it is read.
    pub const fn yes(name: &'static str) -> Self {
        Self { name, support: Support::Yes }
    }

    /// Some of it is.
    pub const fn partly(name: &'static str, left_out: &'static str) -> Self {
        Self { name, support: Support::Partly(left_out) }
    }

    /// Nothing of it is.
    pub const fn no(name: &'static str, why: &'static str) -> Self {
        Self { name, support: Support::No(why) }
    }
}

/// The feature called `name`, among `features`.
pub fn find<'a>(features: &'a [Feature], name: &str) -> Option<&'a Feature> {
    features.iter().find(|f| f.name == name)
}
