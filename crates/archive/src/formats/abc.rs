//! `.abc`, Alembic 1: a mesh whose vertices move, written in the Ogawa layout, as Blender, Houdini, Maya, Cinema 4D and Unreal read it.
//!
//! Ogawa is a tree of groups and data, little-endian: sixteen bytes (`Ogawa`, ff, version 0 1, place of the root), data as a length and its
//! bytes, a group as a count and the places of its children, of which the highest bit tells data. The layers above are those of
//! Alembic's `AbcCoreOgawa` and `AbcGeom`: an archive has its versions, its objects, times and metadata; an object a compound of properties,
//! child objects and a list of their names; a property its samples, each behind sixteen bytes that tell it from others.

use crate::{Error, Place, atomic_write_with};
use glam::{Vec2, Vec3};
use std::path::Path;
use yugen_optics::Fingerprint;

/// A mesh over time.
#[derive(Clone, Copy, Debug)]
pub struct MovingMesh<'a> {
    /// What it is called; `/` becomes `_`.
    pub name: &'a str,
    /// (u, v) of its vertices, v down as everywhere here; none, or one for each.
    pub uvs: &'a [Vec2],
    /// Counter-clockwise from outside.
    pub triangles: &'a [[u32; 3]],
    /// Where its vertices are, sample by sample, m.
    pub samples: &'a [Vec<Vec3>],
    /// Samples a second; the first is at 0 s.
    pub rate: f64,
}

/// A number's kind: its code, its bytes come by themselves.
#[derive(Clone, Copy)]
#[repr(u32)]
enum Pod {
    Boolean = 0,
    Int32 = 6,
    Float32 = 10,
    Float64 = 11,
}

/// What stands at a place of the file.
enum Chunk<'a> {
    Own(Vec<u8>),
    /// A sample of points, behind its key.
    Points([u8; 16], &'a [Vec3]),
}

/// The file as it grows: places are known as soon as something is added.
struct Tree<'a> {
    chunks: Vec<Chunk<'a>>,
    end: u64,
}

/// A child of a group: its place, with the highest bit set for data.
#[derive(Clone, Copy)]
struct Child(u64);

const DATA: u64 = 1 << 63;
/// Data of no bytes has no place.
const NO_DATA: Child = Child(DATA);

impl<'a> Tree<'a> {
    fn data(&mut self, bytes: &[u8]) -> Child {
        let at = self.end;
        let mut own = (bytes.len() as u64).to_le_bytes().to_vec();
        own.extend_from_slice(bytes);
        self.end += own.len() as u64;
        self.chunks.push(Chunk::Own(own));
        Child(at | DATA)
    }

    fn group(&mut self, children: &[Child]) -> Child {
        let at = self.end;
        let mut own = (children.len() as u64).to_le_bytes().to_vec();
        own.extend(children.iter().flat_map(|c| c.0.to_le_bytes()));
        self.end += own.len() as u64;
        self.chunks.push(Chunk::Own(own));
        Child(at)
    }

    /// A sample: its key and its bytes.
    fn sample(&mut self, bytes: &[u8]) -> Child {
        let mut all = key(bytes).to_vec();
        all.extend_from_slice(bytes);
        self.data(&all)
    }

    fn points(&mut self, points: &'a [Vec3]) -> Child {
        let at = self.end;
        self.end += 8 + 16 + 12 * points.len() as u64;
        self.chunks.push(Chunk::Points(key(bytemuck::cast_slice(points)), points));
        Child(at | DATA)
    }

    /// A compound property, or the properties of an object: groups of properties and the list of them.
    fn compound(&mut self, properties: &[(Child, Vec<u8>)]) -> Child {
        let headers: Vec<u8> = properties.iter().flat_map(|p| p.1.iter().copied()).collect();
        let mut children: Vec<Child> = properties.iter().map(|p| p.0).collect();
        children.push(self.data(&headers));
        self.group(&children)
    }

    /// An object: its properties, its children and the list of these.
    fn object(&mut self, properties: Child, children: &[(Child, &str, &str)]) -> Child {
        let mut list = Vec::new();
        for (_, name, metadata) in children {
            list.extend((name.len() as u32).to_le_bytes());
            list.extend_from_slice(name.as_bytes());
            list.push(INLINE);
            list.extend((metadata.len() as u32).to_le_bytes());
            list.extend_from_slice(metadata.as_bytes());
        }
        // Hashes of properties and children, which tell objects from each other.
        let hash = key(&list);
        list.extend(hash.iter().chain(&hash));
        let mut all = vec![properties];
        all.extend(children.iter().map(|c| c.0));
        all.push(self.data(&list));
        self.group(&all)
    }
}

/// What tells one sample from another.
fn key(bytes: &[u8]) -> [u8; 16] {
    let mut two = [0; 16];
    for (half, seed) in two.chunks_exact_mut(8).zip(0u64..) {
        let mut print = Fingerprint::default();
        print.word(seed);
        print.bytes(bytes);
        half.copy_from_slice(&print.finish().to_le_bytes());
    }
    two
}

/// Instead of a number in the archive's list of metadata: it follows.
const INLINE: u8 = 0xff;

/// What a list says of a property that has values: how many samples there are, each different from the one before or all the same, and
/// whether they follow the mesh's times.
#[derive(Clone, Copy)]
struct Values {
    pod: Pod,
    /// Numbers of a value.
    extent: u32,
    array: bool,
    samples: u32,
    times: bool,
}

/// The entry of a property in its compound's list.
fn header(name: &str, metadata: &str, values: Option<Values>) -> Vec<u8> {
    let longest = metadata.len().max(name.len()).max(values.map_or(0, |v| v.samples as usize));
    let hint: u32 = match longest {
        0..=255 => 0,
        256..=65535 => 1,
        _ => 2,
    };
    let mut out = Vec::new();
    let number = |out: &mut Vec<u8>, v: u32| out.extend_from_slice(&v.to_le_bytes()[..1 << hint]);
    let mut info = hint << 2 | u32::from(INLINE) << 20;
    match values {
        None => out.extend(info.to_le_bytes()),
        Some(Values { pod, extent, array, samples, times }) => {
            // Kind of property, of number; on times of its own; as many values in each sample; all samples alike.
            info |= if array { 2 } else { 1 };
            info |= (pod as u32) << 4 | u32::from(times) << 8 | 1 << 10 | extent << 12;
            info |= u32::from(samples == 1) << 11;
            out.extend(info.to_le_bytes());
            number(&mut out, samples);
            if times {
                number(&mut out, 1);
            }
        }
    }
    number(&mut out, name.len() as u32);
    out.extend_from_slice(name.as_bytes());
    number(&mut out, metadata.len() as u32);
    out.extend_from_slice(metadata.as_bytes());
    out
}

const MESH: &str = "schema=AbcGeom_PolyMesh_v1;schemaBaseType=AbcGeom_GeomBase_v1";
const MESH_OBJECT: &str =
    "schema=AbcGeom_PolyMesh_v1;schemaBaseType=AbcGeom_GeomBase_v1;schemaObjTitle=AbcGeom_PolyMesh_v1:.geom";
const PLACE: &str = "schema=AbcGeom_Xform_v3";
const PLACE_OBJECT: &str = "schema=AbcGeom_Xform_v3;schemaObjTitle=AbcGeom_Xform_v3:.xform";
const UV: &str =
    "arrayExtent=1;geoScope=fvr;interpretation=vector;isGeomParam=true;podExtent=2;podName=float32_t";
/// Of the library whose layout this is.
const LIBRARY: u32 = 10_800;

impl MovingMesh<'_> {
    /// Writes it.
    ///
    /// # Errors
    /// Samples, (u, v) or triangles of another number of vertices, a rate that is none, or what the disk says.
    pub fn write(&self, file: &Path) -> Result<(), Error> {
        let count = self.samples.first().map_or(0, Vec::len);
        let wrong = if self.samples.iter().any(|s| s.len() != count) || count == 0 {
            Some("all samples of a mesh have the same number of vertices, above none")
        } else if !(self.uvs.is_empty() || self.uvs.len() == count) {
            Some("a mesh has one (u, v) for each vertex, or none")
        } else if self.triangles.is_empty() || self.triangles.iter().flatten().any(|v| *v as usize >= count) {
            Some("a mesh has triangles, between vertices that there are")
        } else if !(self.rate > 0.0 && self.rate.is_finite()) {
            Some("a rate is a number above zero")
        } else if [count, self.samples.len(), 3 * self.triangles.len()]
            .iter()
            .any(|n| i32::try_from(*n).is_err())
        {
            Some("an Alembic mesh has less than 2³¹ vertices, samples and corners")
        } else {
            None
        };
        if let Some(problem) = wrong {
            return Err(Error::invalid(Place::file(file), problem));
        }
        let mut tree = Tree { chunks: Vec::new(), end: 16 };
        let root = self.archive(&mut tree);
        atomic_write_with(file, |out| {
            let mut put = |bytes: &[u8]| out.write_all(bytes).map_err(|e| Error::io(file, e));
            put(b"Ogawa\xff\x00\x01")?;
            put(&root.0.to_le_bytes())?;
            for chunk in &tree.chunks {
                match chunk {
                    Chunk::Own(bytes) => put(bytes)?,
                    Chunk::Points(key, points) => {
                        put(&(16 + 12 * points.len() as u64).to_le_bytes())?;
                        put(key)?;
                        points.iter().flat_map(|p| p.to_array()).try_for_each(|v| put(&v.to_le_bytes()))?;
                    }
                }
            }
            Ok(())
        })
    }

    fn archive<'t>(&'t self, tree: &mut Tree<'t>) -> Child {
        let name = self.name.replace('/', "_");
        let name = if name.is_empty() { "mesh" } else { &name };
        let mesh = self.mesh(tree);
        let inherits = tree.sample(&[1]);
        let inherits = tree.group(&[inherits]);
        let one = Values { pod: Pod::Boolean, extent: 1, array: false, samples: 1, times: false };
        let place = tree.compound(&[(inherits, header(".inherits", "", Some(one)))]);
        let place = tree.compound(&[(place, header(".xform", PLACE, None))]);
        let shape = format!("{name}Shape");
        let object = tree.object(place, &[(mesh, &shape, MESH_OBJECT)]);
        // A compound without properties is an empty group, which has no place.
        let top = tree.object(Child(0), &[(object, name, PLACE_OBJECT)]);
        let version = tree.data(&0u32.to_le_bytes());
        let library = tree.data(&LIBRARY.to_le_bytes());
        let about = tree.data(concat!("_ai_Application=Yugen ", env!("CARGO_PKG_VERSION")).as_bytes());
        // Samples at the most, seconds of a cycle, when its samples are: what does not move, then the mesh.
        let mut times = Vec::new();
        for (samples, seconds) in [(1, 1.0), (self.samples.len() as u32, 1.0 / self.rate)] {
            times.extend(u32::to_le_bytes(samples));
            times.extend(f64::to_le_bytes(seconds));
            times.extend(1u32.to_le_bytes());
            times.extend(0f64.to_le_bytes());
        }
        let times = tree.data(&times);
        tree.group(&[version, library, top, about, times, NO_DATA])
    }

    fn mesh<'t>(&'t self, tree: &mut Tree<'t>) -> Child {
        let samples = self.samples.len() as u32;
        let mut properties = Vec::new();
        let boxes: Vec<Child> = self
            .samples
            .iter()
            .map(|s| {
                let low = s.iter().copied().fold(Vec3::INFINITY, Vec3::min);
                let high = s.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
                let both = low.to_array().into_iter().chain(high.to_array());
                let bytes: Vec<u8> = both.flat_map(|v| f64::from(v).to_le_bytes()).collect();
                tree.sample(&bytes)
            })
            .collect();
        let bounds = Values { pod: Pod::Float64, extent: 6, array: false, samples, times: true };
        properties.push((tree.group(&boxes), header(".selfBnds", "interpretation=box", Some(bounds))));
        // Lengths of arrays with one dimension follow from their bytes.
        let points: Vec<Child> = self.samples.iter().flat_map(|s| [tree.points(s), NO_DATA]).collect();
        let values = Values { pod: Pod::Float32, extent: 3, array: true, samples, times: true };
        let metadata = "geoScope=vtx;interpretation=point";
        properties.push((tree.group(&points), header("P", metadata, Some(values))));
        // Faces are clockwise from outside.
        let corners: Vec<u32> = self.triangles.iter().flat_map(|[a, b, c]| [*a, *c, *b]).collect();
        let still = |pod, extent| Values { pod, extent, array: true, samples: 1, times: false };
        let mut array = |name: &str, metadata: &str, bytes: &[u8], values: Values| {
            let sample = tree.sample(bytes);
            let group = tree.group(&[sample, NO_DATA]);
            properties.push((group, header(name, metadata, Some(values))));
        };
        let words = |all: &[u32]| all.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        array(".faceIndices", "", &words(&corners), still(Pod::Int32, 1));
        array(".faceCounts", "", &words(&vec![3; self.triangles.len()]), still(Pod::Int32, 1));
        if !self.uvs.is_empty() {
            let of = corners.iter().map(|v| self.uvs[*v as usize]);
            // v of a file runs up.
            let uvs: Vec<u8> = of.flat_map(|t| [t.x, 1.0 - t.y]).flat_map(f32::to_le_bytes).collect();
            array("uv", UV, &uvs, still(Pod::Float32, 2));
        }
        let geometry = tree.compound(&properties);
        let own = tree.compound(&[(geometry, header(".geom", MESH, None))]);
        tree.object(own, &[])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Follows the tree of a file; of each group its children.
    fn walk(bytes: &[u8], at: u64, data: &mut Vec<Vec<u8>>) -> usize {
        let word = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        let at = at as usize;
        let mut groups = 1;
        for k in 0..word(at) as usize {
            let child = word(at + 8 + 8 * k);
            if child & DATA == 0 {
                groups += if child == 0 { 0 } else { walk(bytes, child, data) };
            } else if child != DATA {
                let place = (child & !DATA) as usize;
                data.push(bytes[place + 8..place + 8 + word(place) as usize].to_vec());
            }
        }
        groups
    }

    #[test]
    fn a_file_is_a_tree_that_holds_what_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.abc");
        let samples = [0.0, 0.5, 1.0].map(|y| vec![Vec3::ZERO, Vec3::X, Vec3::new(0.0, 0.0, y), Vec3::Y * y]);
        let mesh = MovingMesh {
            name: "a/b",
            uvs: &[Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE],
            triangles: &[[0, 1, 2], [1, 3, 2]],
            samples: &samples,
            rate: 30.0,
        };
        mesh.write(&file).unwrap();
        let bytes = crate::read_own(&file, 1 << 20).unwrap();
        assert!(bytes.starts_with(b"Ogawa\xff\x00\x01"));
        let mut data = Vec::new();
        let groups = walk(&bytes, u64::from_le_bytes(bytes[8..16].try_into().unwrap()), &mut data);
        // Root; top; place: object, compound twice, value; mesh: object, compound twice, five properties.
        assert_eq!(groups, 1 + 1 + 4 + 3 + 5);
        for sample in &samples {
            let want: Vec<u8> = sample.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes).collect();
            let found: Vec<_> = data.iter().filter(|d| d.len() == 16 + 48 && d[16..] == want).collect();
            assert_eq!(found.len(), 1);
            assert_eq!(found[0][..16], key(&want));
        }
        let text = |part: &str| data.iter().any(|d| d.windows(part.len()).any(|w| w == part.as_bytes()));
        assert!(text("a_bShape") && text("AbcGeom_PolyMesh_v1:.geom") && text(".faceCounts") && !text("a/b"));
        assert_eq!(bytes.len() as u64, {
            let mut tree = Tree { chunks: Vec::new(), end: 16 };
            mesh.archive(&mut tree);
            tree.end
        });
        for (wrong, says) in [
            (MovingMesh { samples: &[], ..mesh }, "number of vertices"),
            (MovingMesh { uvs: &[Vec2::ZERO], ..mesh }, "(u, v)"),
            (MovingMesh { triangles: &[[0, 1, 4]], ..mesh }, "vertices that there are"),
            (MovingMesh { rate: f64::NAN, ..mesh }, "a rate"),
        ] {
            let said = wrong.write(&file).unwrap_err().to_string();
            assert!(said.contains(says), "{said}");
        }
    }

    #[test]
    fn lists_of_properties_are_as_alembic_writes_them() {
        // As Alembic 1.8 writes it: three changing samples of points on the second times.
        let values = Values { pod: Pod::Float32, extent: 3, array: true, samples: 3, times: true };
        let list = header("P", "a=b", Some(values));
        let info = u32::from_le_bytes(list[..4].try_into().unwrap());
        assert_eq!(info, 0xff0_0000 | 3 << 12 | 0x400 | 0x100 | 10 << 4 | 2);
        assert_eq!(list[4..], [3, 1, 1, b'P', 3, b'a', b'=', b'b']);
        // Of more than 255 samples numbers have two bytes.
        let list = header("P", "", Some(Values { samples: 300, ..values }));
        assert_eq!(list[4..], [44, 1, 1, 0, 1, 0, b'P', 0, 0]);
    }
}
