//! An environment's picture and the tables that it is sampled by.

use super::Rows;
use crate::prepared::environment::{BLOCKS, Edge, Environment, SQUARES};
use glam::{Mat3, Mat4};

/// Where the words of an environment begin: the columns of the matrix from the world and of that to it (9 floats each),
/// cells across and down, size of a block, blocks across and down, where its texels, its edges and its views begin.
pub(super) fn write(e: &Environment, rows: &mut Rows) -> u32 {
    let texels = rows.texels.len() as u32;
    rows.texels.extend(e.texels.iter().map(|t| t.to_array()));
    let edges = pack(rows, &e.cells.edges);
    let views = rows.words.len() as u32;
    for view in &e.views {
        rows.words.push(view.irradiance.to_bits());
        let flat: Vec<Edge> =
            view.rows.iter().copied().chain(view.columns.iter().flatten().copied()).collect();
        pack(rows, &flat);
    }
    let at = rows.words.len() as u32;
    // See set_orientation.
    rows.words.extend([0; 18]);
    let [sizes, counts] = [e.cells.size, e.cells.count].map(|v| v.map(|n| n as u32));
    rows.words.extend([e.across as u32, e.down as u32]);
    rows.words.extend(sizes);
    rows.words.extend(counts);
    rows.words.extend([texels, edges, views]);
    at
}

/// Sets the frame of the environment that begins at word `at`: its tables are in its own coordinates.
pub(super) fn set_orientation(at: u32, to_world: Mat4, rows: &mut Rows) {
    let to_world = Mat3::from_mat4(to_world);
    let columns = [to_world.inverse(), to_world].map(|m| m.to_cols_array().map(f32::to_bits));
    rows.words[at as usize..][..18].copy_from_slice(columns.as_flattened());
}

/// Two to a word; returns where they begin.
fn pack(rows: &mut Rows, edges: &[Edge]) -> u32 {
    let at = rows.words.len() as u32;
    rows.words.extend(
        edges
            .chunks(2)
            .map(|pair| u32::from(pair[0]) | (u32::from(pair.get(1).copied().unwrap_or(Edge::MAX)) << 16)),
    );
    at
}

/// `environment.wgsl` has them in its text.
const _: () = assert!(BLOCKS[0] == 32 && BLOCKS[1] == 16 && SQUARES == 12);
