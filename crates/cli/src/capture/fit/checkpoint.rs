//! Rows that are done, on the disk beside the output: an interrupted fit goes on from them.

use anyhow::{Context, Result, anyhow, bail};
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use yugen_archive::Error;
use yugen_capture::fit::{Fitted, Kind};
use yugen_optics::{Vec2, Vec3};
use yugen_reflectance::btf::Texel;

/// A file of texels behind a line that says what they were fitted from. Grows row by row; half a row at its end, left by
/// a crash, is ignored.
pub struct Checkpoint {
    path: PathBuf,
    file: File,
    head: u64,
    width: usize,
    rows: usize,
}

/// Floats a texel.
const FLOATS: usize = 19;
const RECORD: usize = 4 * FLOATS;
const MAGIC: &str = "yugen capture fit 2";

/// Where the checkpoint of an output lies.
pub fn place(output: &Path) -> Result<PathBuf> {
    let mut name =
        output.file_name().with_context(|| format!("{} names no file", output.display()))?.to_os_string();
    name.push(".checkpoint");
    Ok(output.with_file_name(name))
}

impl Checkpoint {
    /// Goes on from the checkpoint of `output` if asked to and there is one; starts a new one otherwise. A checkpoint of
    /// other photographs or settings is an error.
    pub fn open(output: &Path, identity: &str, width: usize, resume: bool) -> Result<Self> {
        let path = place(output)?;
        let head = format!("{MAGIC}\n{identity}\n\n");
        let context = || format!("{}", path.display());
        if resume && path.exists() {
            let mut file = OpenOptions::new().read(true).write(true).open(&path).with_context(context)?;
            let mut found = vec![0; head.len()];
            if file.read_exact(&mut found).is_err() || found != head.as_bytes() {
                bail!(
                    "{}: this checkpoint is of other photographs or settings; leave out --resume to start anew",
                    path.display()
                );
            }
            let length = file.metadata().with_context(context)?.len() - head.len() as u64;
            let rows = (length / (RECORD * width) as u64) as usize;
            let head = head.len() as u64;
            file.set_len(head + (rows * width * RECORD) as u64).with_context(context)?;
            file.seek(SeekFrom::End(0)).with_context(context)?;
            return Ok(Self { path, file, head, width, rows });
        }
        let file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(true)
            .open(&path)
            .with_context(context)?;
        let mut new = Self { path, file, head: head.len() as u64, width, rows: 0 };
        new.file.write_all(head.as_bytes()).map_err(|e| Error::io(&new.path, e))?;
        Ok(new)
    }

    /// Rows that are done.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Adds the rows of a band.
    pub fn append(&mut self, fitted: &[Fitted]) -> Result<()> {
        let mut bytes = Vec::with_capacity(RECORD * self.width);
        for row in fitted.chunks(self.width) {
            bytes.clear();
            bytes.extend(row.iter().flat_map(record).flat_map(f32::to_le_bytes));
            self.file.write_all(&bytes).map_err(|e| {
                let rows = self.rows;
                let kept = match rows {
                    0 => String::new(),
                    _ => format!("; {rows} rows are kept there, from which --resume goes on"),
                };
                anyhow!("{}{kept}", Error::io(&self.path, e))
            })?;
            self.rows += 1;
        }
        Ok(())
    }

    /// All rows.
    pub fn texels(&mut self) -> Result<Vec<Fitted>> {
        let context = || format!("{}", self.path.display());
        self.file.seek(SeekFrom::Start(self.head)).with_context(context)?;
        let mut all = Vec::with_capacity(self.rows * self.width);
        let mut row = vec![0; RECORD * self.width];
        for _ in 0..self.rows {
            self.file.read_exact(&mut row).with_context(context)?;
            all.extend(row.chunks_exact(RECORD).map(|bytes| {
                let (floats, _) = bytes.as_chunks::<4>();
                let floats: Vec<f32> = floats.iter().map(|b| f32::from_le_bytes(*b)).collect();
                fitted(&floats)
            }));
        }
        Ok(all)
    }

    /// The output is there: nothing to go on from any more.
    pub fn remove(mut self) {
        self.rows = 0;
    }
}

/// A checkpoint without rows is of no use.
impl Drop for Checkpoint {
    fn drop(&mut self) {
        if self.rows == 0 {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

fn record(f: &Fitted) -> [f32; FLOATS] {
    let Texel { diffuse: d, specular: s, normal: n, tangent: t, sigma, confidence } = f.texel;
    let (readings, passes) = (f32::from(f.readings), f32::from(f.passes));
    let kind = Kind::ALL.iter().position(|k| *k == f.kind).unwrap_or(0) as f32;
    [
        d.x, d.y, d.z, s.x, s.y, s.z, n.x, n.y, n.z, t.x, t.y, t.z, sigma.x, sigma.y, confidence, f.residual,
        readings, passes, kind,
    ]
}

fn fitted(v: &[f32]) -> Fitted {
    let vec3 = |i: usize| Vec3::from_slice(&v[i..i + 3]);
    Fitted {
        kind: Kind::ALL.get(v[18] as usize).copied().unwrap_or(Kind::Nothing),
        texel: Texel {
            diffuse: vec3(0),
            specular: vec3(3),
            normal: vec3(6),
            tangent: vec3(9),
            sigma: Vec2::from_slice(&v[12..14]),
            confidence: v[14],
        },
        residual: v[15],
        readings: v[16] as u16,
        passes: v[17] as u16,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_rows_survive_an_accident() {
        let folder = std::env::temp_dir().join(format!("yugen-fit-checkpoint-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let output = folder.join("a.btf");
        let texel = |i: usize| {
            let mut v: Vec<f32> = (0..FLOATS).map(|c| (c * 10 + i) as f32).collect();
            v[18] = (i % 4) as f32;
            fitted(&v)
        };
        let all: Vec<Fitted> = (0..15).map(texel).collect();
        let mut first = Checkpoint::open(&output, "these", 5, true).unwrap();
        first.append(&all[..10]).unwrap();
        first.append(&all[10..]).unwrap();
        assert!(first.texels().unwrap() == all);
        let path = first.path.clone();
        let length = first.file.metadata().unwrap().len();
        drop(first);
        File::options().write(true).open(&path).unwrap().set_len(length - 7).unwrap();
        let mut again = Checkpoint::open(&output, "these", 5, true).unwrap();
        assert_eq!(again.rows(), 2);
        again.append(&all[10..]).unwrap();
        assert!(again.texels().unwrap() == all);
        drop(again);
        assert!(Checkpoint::open(&output, "those", 5, true).is_err());
        let anew = Checkpoint::open(&output, "those", 5, false).unwrap();
        assert_eq!(anew.rows(), 0);
        anew.remove();
        assert!(!path.exists());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
