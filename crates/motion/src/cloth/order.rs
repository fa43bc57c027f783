//! The order in which vertices lie in memory, and who works on which.
//!
//! Vertices are sorted by their distance along edges from one of them (breadth first, as Cuthill and McKee 1969), and cut
//! into strips of whole levels. Whatever a spring or hinge joins lies within one strip, or around the border of two
//! neighbours; and since a strip has more levels than such a stencil spans, the borders do not touch each other. So all strips can be
//! worked on at once, then all borders. What is done does not depend on the number of threads: same bits.

use std::ops::Range;

pub(super) struct Order {
    /// Of each place, the vertex that lies there.
    pub vertex: Vec<u32>,
    /// Of each vertex, its place.
    pub place: Vec<u32>,
    /// Places, cut up.
    pub strips: Vec<Range<usize>>,
    /// From the middle of a strip to the middle of the next, one fewer.
    pub borders: Vec<Range<usize>>,
}

/// Levels of a strip, at the least: the stencil of a hinge spans three, on either side of the middle.
const LEVELS: usize = 6;
/// Vertices of a strip, as near as levels allow: its springs and hinges fit into a second-level cache, and a costume has
/// more strips than a processor cores.
const STRIP: usize = 800;

impl Order {
    /// Of `n` vertices joined by `edges`; stencils reach no further than two edges.
    pub fn new(n: usize, edges: &[[u32; 2]]) -> Self {
        let mut start = vec![0u32; n + 1];
        edges.iter().flatten().for_each(|v| start[*v as usize + 1] += 1);
        (0..n).for_each(|i| start[i + 1] += start[i]);
        let mut next = start.clone();
        let mut to = vec![0u32; 2 * edges.len()];
        for [a, b] in edges {
            for (v, w) in [(a, b), (b, a)] {
                to[next[*v as usize] as usize] = *w;
                next[*v as usize] += 1;
            }
        }
        let neighbours = |v: u32| &to[start[v as usize] as usize..start[v as usize + 1] as usize];
        let mut level = vec![u32::MAX; n];
        let mut vertex: Vec<u32> = Vec::with_capacity(n);
        // First places of the levels.
        let mut levels: Vec<usize> = Vec::new();
        for seed in 0..n as u32 {
            if level[seed as usize] != u32::MAX {
                continue;
            }
            // From the far end of its component the levels are many and narrow.
            let first = vertex.len();
            let mut from = seed;
            for pass in 0..2 {
                for v in &vertex[first..] {
                    level[*v as usize] = u32::MAX;
                }
                vertex.truncate(first);
                let mut found: Vec<usize> = vec![first];
                level[from as usize] = 0;
                vertex.push(from);
                let mut at = first;
                while at < vertex.len() {
                    let end = vertex.len();
                    for i in at..end {
                        let next = level[vertex[i] as usize] + 1;
                        for &w in neighbours(vertex[i]) {
                            if level[w as usize] == u32::MAX {
                                level[w as usize] = next;
                                vertex.push(w);
                            }
                        }
                    }
                    if vertex.len() > end {
                        found.push(end);
                    }
                    at = end;
                }
                from = vertex[vertex.len() - 1];
                if pass == 1 {
                    levels.append(&mut found);
                }
            }
        }
        let mut place = vec![0u32; n];
        vertex.iter().enumerate().for_each(|(i, v)| place[*v as usize] = i as u32);
        levels.push(n);
        // Strips as ranges of levels.
        let mut cuts = vec![0];
        for l in 1..levels.len() {
            let last = cuts[cuts.len() - 1];
            if l - last >= LEVELS && levels[l] - levels[last] >= STRIP {
                cuts.push(l);
            }
        }
        // What is left over joins the last strip.
        match cuts.len() {
            1 => cuts.push(levels.len() - 1),
            k => cuts[k - 1] = levels.len() - 1,
        }
        let strips: Vec<_> = cuts.windows(2).map(|c| levels[c[0]]..levels[c[1]]).collect();
        let middles: Vec<usize> = cuts.windows(2).map(|c| levels[(c[0] + c[1]) / 2]).collect();
        let borders = middles.windows(2).map(|m| m[0]..m[1]).collect();
        Self { vertex, place, strips, borders }
    }

    /// Sorts stencils of places into those within strips and those at borders, each with its range.
    pub fn share<const N: usize>(&self, stencils: impl Iterator<Item = [u32; N]>) -> [Vec<Vec<usize>>; 2] {
        let mut within = vec![Vec::new(); self.strips.len()];
        let mut across = vec![Vec::new(); self.borders.len()];
        for (i, stencil) in stencils.enumerate() {
            let (low, high) = stencil.iter().fold((u32::MAX, 0), |(l, h), v| (l.min(*v), h.max(*v)));
            let (low, high) = (low as usize, high as usize);
            let strip = self.strips.partition_point(|s| s.end <= low);
            if high < self.strips[strip].end {
                within[strip].push(i);
                continue;
            }
            let border = self.borders.partition_point(|b| b.end <= low);
            // As many levels as a strip has, this holds for every stencil of two edges.
            assert!(self.borders[border].contains(&low) && self.borders[border].contains(&high));
            across[border].push(i);
        }
        [within, across]
    }
}

/// Sorts stencils so that neighbours in the list have no vertex in common as far as colours last: those of the first
/// colour, then the second. Returns the lists of the colours.
pub(super) fn colours<const N: usize>(stencils: &[[u32; N]], vertices: Range<usize>) -> Vec<Vec<usize>> {
    let mut used = vec![0u64; vertices.len()];
    let mut lists: Vec<Vec<usize>> = Vec::new();
    for (i, stencil) in stencils.iter().enumerate() {
        let places = stencil.map(|v| v as usize - vertices.start);
        let taken = places.iter().fold(0, |t, p| t | used[*p]);
        // Beyond 64 colours order alone decides; a vertex with so many springs is no mesh.
        let colour = (taken.trailing_ones() as usize).min(63);
        places.iter().for_each(|p| used[*p] |= 1 << colour);
        if lists.len() <= colour {
            lists.resize(colour + 1, Vec::new());
        }
        lists[colour].push(i);
    }
    lists
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_cover_all_and_borders_keep_apart() {
        // Two sheets and a lone vertex.
        let (w, h) = (41u32, 120u32);
        let mut edges = Vec::new();
        for sheet in 0..2 {
            let at = |i: u32, j: u32| sheet * w * h + j * w + i;
            for j in 0..h {
                for i in 0..w {
                    edges.extend((i + 1 < w).then(|| [at(i, j), at(i + 1, j)]));
                    edges.extend((j + 1 < h).then(|| [at(i, j), at(i, j + 1)]));
                    edges.extend((i + 1 < w && j + 1 < h).then(|| [at(i, j), at(i + 1, j + 1)]));
                }
            }
        }
        let n = 2 * w * h + 1;
        let order = Order::new(n as usize, &edges);
        let mut seen = order.vertex.clone();
        seen.sort_unstable();
        assert!(seen.into_iter().eq(0..n));
        assert!(order.strips.len() > 4, "{:?}", order.strips);
        assert_eq!(order.strips[0].start, 0);
        assert_eq!(order.strips[order.strips.len() - 1].end, n as usize);
        let stencils: Vec<[u32; 2]> = edges.iter().map(|e| e.map(|v| order.place[v as usize])).collect();
        let [within, across] = order.share(stencils.iter().copied());
        assert_eq!(within.iter().chain(&across).map(Vec::len).sum::<usize>(), edges.len());
        // Borders do not even read what another writes.
        let reach = |list: &Vec<usize>| {
            let all = list.iter().flat_map(|i| stencils[*i]);
            all.fold((u32::MAX, 0), |(l, h), v| (l.min(v), h.max(v)))
        };
        for pair in across.windows(2) {
            assert!(reach(&pair[0]).1 < reach(&pair[1]).0);
        }
        for (strip, list) in order.strips.iter().zip(&within) {
            let mine: Vec<[u32; 2]> = list.iter().map(|i| stencils[*i]).collect();
            for colour in colours(&mine, strip.clone()) {
                let mut used = std::collections::HashSet::new();
                assert!(colour.iter().flat_map(|i| mine[*i]).all(|v| used.insert(v)));
            }
        }
    }
}
