//! The file beside an output from which a simulation goes on, to the same bits.

use super::Simulate;
use anyhow::{Result, bail};
use std::path::{Path, PathBuf};
use yugen_archive::{Error, Place, atomic_write, begin_own, read_own};
use yugen_optics::{Fingerprint, Vec3};
use yugen_scene::Scene;

/// What a simulation has come to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    /// Frames that are done.
    pub frames: u32,
    /// What the cloth needs to go on.
    pub memory: Vec<f32>,
    /// Those frames, where they are not files of their own.
    pub samples: Vec<Vec<Vec3>>,
}

/// The file.
pub struct Checkpoint {
    path: PathBuf,
    /// Of what is simulated and how.
    print: u64,
    wanted: bool,
    /// What lies there now belongs to this simulation.
    ours: bool,
}

const MAGIC: &[u8; 8] = b"YUGENSIM";
const VERSION: u32 = 2;
/// Bytes before the numbers: magic, version, fingerprint, frames done, samples, vertices of each, numbers of the memory.
const HEADER: usize = 8 + 4 + 8 + 4 + 4 + 4 + 8;
/// The largest that is read: ten minutes of a garment of 60 000 vertices.
const MOST: u64 = 1 << 35;

impl Checkpoint {
    /// Beside an output; what is there already goes on or away if that was asked for, and is left alone otherwise.
    pub fn beside(output: &Path, verb: &Simulate, scene: &Scene) -> Result<Self> {
        let mut name = output.file_name().unwrap_or_default().to_os_string();
        name.push(".checkpoint");
        let path = output.with_file_name(name);
        let wanted = verb.checkpoint > 0.0;
        if wanted && path.exists() && !verb.resume && !verb.restart {
            bail!(
                "{} is of a simulation that has not ended; --resume goes on with it, --restart throws it away, another -o leaves it \
                 alone",
                path.display()
            );
        }
        let mut print = Fingerprint::default();
        verb.options.fingerprint(&mut print);
        print.debug(&verb.up);
        if wanted || verb.resume {
            scene.parts().into_iter().for_each(|(_, hash)| print.word(hash));
            print.debug(&scene.figures);
            print.debug(&scene.caches);
        }
        Ok(Self { path, print: print.finish(), wanted, ours: wanted || verb.resume || verb.restart })
    }

    /// Its file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What lies there; none where there is nothing.
    pub fn resume(&self, quiet: bool) -> Result<Option<Progress>> {
        if !self.path.exists() {
            if !quiet {
                eprintln!(
                    "there is no checkpoint {}: starting from the beginning, to the same result",
                    self.path.display()
                );
            }
            return Ok(None);
        }
        // Before much is read.
        if !begin_own(&self.path, MAGIC.len() as u64)?.starts_with(MAGIC) {
            return Err(not_one(&self.path).into());
        }
        let (progress, print) = read(&read_own(&self.path, MOST)?, &self.path)?;
        if print != self.print {
            bail!(
                "{} is of another simulation: the scene, the motion, the garment or an option has changed since; --restart begins anew",
                self.path.display()
            );
        }
        Ok(Some(progress))
    }

    /// Writes it, if any are wanted; returns whether there is one now.
    pub fn write(&self, progress: &Progress) -> Result<bool, Error> {
        if self.wanted && progress.frames > 0 {
            atomic_write(&self.path, &bytes(progress, self.print))?;
        }
        Ok(self.wanted && progress.frames > 0)
    }

    /// At the end.
    pub fn remove(&self) -> Result<(), Error> {
        match self.ours && self.path.exists() {
            true => std::fs::remove_file(&self.path).map_err(|e| Error::io(&self.path, e)),
            false => Ok(()),
        }
    }
}

fn bytes(progress: &Progress, print: u64) -> Vec<u8> {
    let Progress { frames, memory, samples } = progress;
    let vertices = samples.first().map_or(0, Vec::len);
    let mut out = Vec::with_capacity(HEADER + 4 * memory.len() + 12 * vertices * samples.len() + 8);
    out.extend_from_slice(MAGIC);
    out.extend(VERSION.to_le_bytes());
    out.extend(print.to_le_bytes());
    out.extend(frames.to_le_bytes());
    out.extend((samples.len() as u32).to_le_bytes());
    out.extend((vertices as u32).to_le_bytes());
    out.extend((memory.len() as u64).to_le_bytes());
    let points = samples.iter().flatten().flat_map(|p| p.to_array());
    memory.iter().copied().chain(points).for_each(|v| out.extend(v.to_le_bytes()));
    let hash = Fingerprint::of(&out);
    out.extend(hash.to_le_bytes());
    out
}

fn not_one(path: &Path) -> Error {
    let problem = "this is no checkpoint of a simulation by this version; --restart throws it away";
    Error::invalid(Place::byte(path, 0), problem)
}

fn read(bytes: &[u8], path: &Path) -> Result<(Progress, u64), Error> {
    let wrong = |at: u64, problem: &str| {
        let problem = format!("{problem}; --restart throws this checkpoint away");
        Error::invalid(Place::byte(path, at), problem)
    };
    let word = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| bytes[at + k]));
    let long = |at: usize| u64::from_le_bytes(std::array::from_fn(|k| bytes[at + k]));
    if bytes.len() < HEADER + 8 || !bytes.starts_with(MAGIC) || word(8) != VERSION {
        return Err(not_one(path));
    }
    let body = bytes.len() - 8;
    if Fingerprint::of(&bytes[..body]) != long(body) {
        return Err(wrong(body as u64, "the file is damaged"));
    }
    let (print, frames, samples, vertices) = (long(12), word(20), word(24) as usize, word(28) as usize);
    let points = (samples as u64).checked_mul(vertices as u64).and_then(|n| n.checked_mul(3));
    let numbers = points.and_then(|n| n.checked_add(long(32)));
    if numbers.and_then(|n| n.checked_mul(4)) != Some((body - HEADER) as u64) {
        return Err(wrong(24, "the file is shorter or longer than it says"));
    }
    let (words, _) = bytes[HEADER..body].as_chunks::<4>();
    let (memory, points) = words.split_at(long(32) as usize);
    let number = |w: &[u8; 4]| f32::from_le_bytes(*w);
    let point = |p: &[[u8; 4]]| Vec3::new(number(&p[0]), number(&p[1]), number(&p[2]));
    let samples = match vertices {
        0 => Vec::new(),
        _ => points.chunks_exact(3 * vertices).map(|s| s.chunks_exact(3).map(point).collect()).collect(),
    };
    Ok((Progress { frames, memory: memory.iter().map(number).collect(), samples }, print))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_what_is_damaged_is_told() {
        let progress = Progress {
            frames: 31,
            memory: vec![1.0, -0.0, 3.5],
            samples: vec![vec![Vec3::X, Vec3::Y], vec![Vec3::Z, Vec3::NEG_X]],
        };
        let path = Path::new("a.pc2.checkpoint");
        let whole = bytes(&progress, 7);
        assert_eq!(read(&whole, path).unwrap(), (progress.clone(), 7));
        let files = Progress { samples: Vec::new(), ..progress };
        assert_eq!(read(&bytes(&files, 8), path).unwrap(), (files, 8));
        for at in 0..whole.len() {
            let mut bent = whole.clone();
            bent[at] ^= 4;
            assert!(read(&bent, path).is_err(), "byte {at}");
            assert!(read(&whole[..at], path).is_err(), "{at} bytes");
        }
        // Numbers that do not fit one another, in a file that is as it was written.
        for at in 20..HEADER {
            for bit in 0..8 {
                let mut bent = whole[..whole.len() - 8].to_vec();
                bent[at] ^= 1 << bit;
                let hash = Fingerprint::of(&bent);
                bent.extend(hash.to_le_bytes());
                let is = read(&bent, path);
                assert!(is.is_err() || (20..24).contains(&at), "byte {at}, bit {bit}");
            }
        }
    }
}
