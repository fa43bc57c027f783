//! What masks make of places that a painter paints.

use super::Painter;
use crate::InkError;
use crate::contour::MeshPoint;
use crate::control::Controls;
use crate::mask::map::MaskMap;
use crate::mask::{self, Ground};
use crate::place_controls::PlaceControls;
use crate::projection::Projection;
use crate::texture_coordinates::TextureCoordinates;
use glam::Vec2;
use yugen_scene::prepared::{DrawRow, MeshRow, VertexRow};
use yugen_scene::{Aov, Camera};

/// What has to be seen of surfaces. Texture coordinates where masks lie on some: wrinkles are longer than the place where they begin.
pub(super) fn aovs(place_controls: &PlaceControls) -> Vec<Aov> {
    let coordinates = place_controls.has_surfaces().then_some(Aov::Uv);
    [Aov::Depth, Aov::Id, Aov::ShadingNormal].into_iter().chain(coordinates).collect()
}

impl Painter {
    /// A sentence for each table or mask of an object or a material that the scene does not have, or on which no mask can lie.
    pub fn unmet_names(&self) -> Vec<String> {
        let mut unmet = self.style.steering.unmet(&self.names);
        let without_coordinates =
            self.place_controls.unmet().filter(|mask| self.names.unknown(&mask.on).is_none());
        unmet.extend(without_coordinates.map(|mask| {
            format!(
                "[mask.{}] changes nothing: the mesh of {} has no texture coordinates, by which a mask lies on a surface",
                mask.name, mask.on
            )
        }));
        unmet
    }

    /// Where in the picture of a camera, of which one was painted in this pose, the pixels of a mask on a surface are seen.
    pub fn mask_map(&self, camera: &Camera, on: &Ground, size: [usize; 2]) -> Result<MaskMap, InkError> {
        let _span = tracing::info_span!("map_mask").entered();
        let sight = self.sights.iter().find(|s| s.camera == *camera);
        let map = &sight.ok_or_else(|| InkError::Preset("nothing is painted of this view yet".into()))?.map;
        MaskMap::new(on, size, &self.rows, &self.names, &Projection::new(camera)?, map)
    }

    /// Texture coordinates of a place on a line of a draw.
    pub(super) fn uv(&self, draw: u32, mesh_point: &MeshPoint) -> Vec2 {
        let row = &self.rows.draws[draw as usize];
        let MeshRow { first_vertex, vertices, first_triangle, triangles } =
            self.rows.meshes[row.mesh as usize];
        let use_normals = row.flags & DrawRow::HAS_NORMALS != 0;
        let Some(known) = self.topologies.get(&(row.mesh, use_normals)) else { return Vec2::ZERO };
        let range = |first: u32, count: u32| first as usize..(first + count) as usize;
        let of_vertices = &self.rows.vertices[range(first_vertex, vertices)];
        let of_mesh = &self.rows.triangles[range(first_triangle, triangles)];
        let make = || TextureCoordinates::new(&known.topology.points, of_mesh, first_vertex);
        known.coordinates.get_or_init(make).at(mesh_point, of_vertices, of_mesh, first_vertex)
    }

    /// The controls of a draw that is so small that it is one place in the picture: by the mean of a mask over its vertices.
    pub(super) fn controls_of_small(&self, draw: u32, part: Vec2) -> Controls {
        let mut controls = self.place_controls.of_draw(draw);
        let MeshRow { first_vertex, vertices, .. } =
            self.rows.meshes[self.rows.draws[draw as usize].mesh as usize];
        let vertices = &self.rows.vertices[first_vertex as usize..(first_vertex + vertices) as usize];
        self.place_controls.mask(draw, &mut controls, |mask| {
            let at = |v: &VertexRow| mask.at(&mask::Place { part, uv: Vec2::new(v.u, v.v) });
            vertices.iter().map(at).sum::<f32>() / vertices.len().max(1) as f32
        });
        controls
    }
}
