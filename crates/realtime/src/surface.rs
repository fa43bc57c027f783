//! The local geometry of a place on a triangle, in WGSL.

/// `Surface` and `surface_at`: position, normals, frame, texture coordinates. Stands on the scene and its hierarchy.
pub const SURFACE_WGSL: &str = include_str!("surface.wgsl");

/// `passes` for shaders without materials: nothing does.
pub const OPAQUE_WGSL: &str = include_str!("opaque.wgsl");

/// `primary_hit`: what a pixel of the visibility buffer sees. Stands on the view, the surface and `passes`.
pub const PRIMARY_WGSL: &str = include_str!("primary.wgsl");

/// `passes` for shaders with materials, and `shading_point`. Stands on the surface and [`yugen_scene::prepared::wgsl`].
pub const SEE_THROUGH_WGSL: &str = include_str!("see_through.wgsl");
