//! The zero set of values at the nodes of a mesh, as chains of crossed edges.
//!
//! Zero counts as positive, so that a triangle has two crossed edges or none. A crossing is computed once for an edge and shared
//! by the triangles beside it: lines have no cracks, and the edge is the link by which they are chained.

use crate::topology::{NONE, Topology};

/// A line of the zero set.
#[derive(Clone, Debug)]
pub struct ZeroChain {
    /// The edges that it crosses, in order.
    pub edges: Vec<u32>,
    /// The triangle between each edge and the next; of a closed chain also that between the last and the first.
    pub triangles: Vec<u32>,
    /// The last edge is followed by the first.
    pub closed: bool,
}

/// All chains of two edges or more. Edges with a value that is not finite are not crossed; where more than two triangles meet
/// a chain ends.
pub fn zero_chains(topology: &Topology, values: &[f64]) -> Vec<ZeroChain> {
    let Topology { edges, edges_of, .. } = topology;
    // A byte for each node, 2 where unknown: all edges look them up, in no order.
    let side: Vec<u8> = values.iter().map(|g| if g.is_finite() { u8::from(*g >= 0.0) } else { 2 }).collect();
    let mut crossing_of = vec![NONE; edges.len()];
    let mut crossings: Vec<u32> = Vec::new();
    for (i, edge) in edges.iter().enumerate() {
        let [a, b] = edge.nodes;
        if side[a as usize] ^ side[b as usize] == 1 {
            crossing_of[i] = crossings.len() as u32;
            crossings.push(i as u32);
        }
    }
    let across = |t: u32, from: u32| {
        edges_of[t as usize].into_iter().find(|e| *e != from && crossing_of[*e as usize] != NONE)
    };
    // The triangles through which a chain leaves a crossing.
    let links: Vec<[u32; 2]> = crossings
        .iter()
        .map(|edge| {
            let [t, u] = edges[*edge as usize].triangles.map(|t| match t {
                NONE => NONE,
                t if across(t, *edge).is_some() => t,
                _ => NONE,
            });
            if t == NONE { [u, NONE] } else { [t, u] }
        })
        .collect();
    let mut used = vec![false; crossings.len()];
    let mut chains = Vec::new();
    let ends = (0..links.len()).filter(|i| links[*i][1] == NONE);
    for start in ends.chain(0..links.len()) {
        if used[start] {
            continue;
        }
        let mut chain = ZeroChain { edges: vec![crossings[start]], triangles: Vec::new(), closed: false };
        used[start] = true;
        let (mut edge, mut triangle) = (crossings[start], links[start][0]);
        while triangle != NONE {
            let Some(next) = across(triangle, edge) else { break };
            let next_crossing = crossing_of[next as usize] as usize;
            if used[next_crossing] {
                chain.closed = next_crossing == start && chain.edges.len() > 2;
                if chain.closed {
                    chain.triangles.push(triangle);
                }
                break;
            }
            used[next_crossing] = true;
            chain.triangles.push(triangle);
            chain.edges.push(next);
            let [a, b] = links[next_crossing];
            (edge, triangle) = (next, if a == triangle { b } else { a });
        }
        if chain.edges.len() > 1 {
            chains.push(chain);
        }
    }
    chains
}
