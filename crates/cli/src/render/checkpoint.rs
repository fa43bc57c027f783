//! The checkpoint beside a picture: what becomes of one that is there, when one is written, when one is kept.

use super::Render;
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use yugen_archive::{Error, atomic_write, begin_own, read_own};
use yugen_transport::checkpoint::{Counting, HEAD_BYTES, Head};
use yugen_transport::render::Job;

/// A render that took less is sooner done again than its checkpoint is thrown away.
const WORTH_KEEPING: Duration = Duration::from_secs(5);
/// The largest checkpoint that is read: of more pixels than a picture may have.
const MAX_FILE: u64 = 1 << 37;

/// Something that is done again and again, and takes time itself.
pub struct Pace {
    every: Duration,
    next: Instant,
}

impl Pace {
    /// Every so many seconds, for the first time after as many.
    pub fn new(seconds: f64) -> Self {
        let every = Duration::from_secs_f64(seconds);
        Self { every, next: Instant::now() + every }
    }

    /// Does it if it is time; seldom enough that it takes no more than a twentieth of all time.
    pub fn keep<T>(&mut self, work: impl FnOnce() -> T) -> Option<T> {
        let begun = Instant::now();
        if begun < self.next {
            return None;
        }
        let done = work();
        self.next = Instant::now() + self.every.max(20 * begun.elapsed());
        Some(done)
    }
}

/// The file beside a picture from which its render goes on.
pub struct Checkpoint {
    /// Where it lies.
    pub path: PathBuf,
    wanted: bool,
    /// What lies there now belongs to this render.
    ours: bool,
}

impl Checkpoint {
    /// Says what is to become of one that is already there. An unfinished render is not thrown away unasked.
    pub fn beside(picture: &Path, options: &Render) -> Result<Self> {
        let mut name = picture.file_name().unwrap_or_default().to_os_string();
        name.push(".checkpoint");
        let path = picture.with_file_name(name);
        let wanted = options.checkpoint > 0.0;
        let ours = wanted || options.resume;
        if !wanted || options.resume || options.restart || !path.exists() {
            return Ok(Self { path, wanted, ours });
        }
        match begin_own(&path, HEAD_BYTES).map(|bytes| Head::read(&bytes)) {
            Ok(Ok(head)) if head.finished => {
                if !options.json {
                    eprintln!(
                        "the checkpoint that was kept of the earlier {} ({} samples a pixel) goes with it",
                        picture.display(),
                        head.samples
                    );
                }
                Ok(Self { path, wanted, ours })
            }
            Ok(Ok(head)) => {
                let of = match head.counting {
                    Counting::Samples(n) => format!(" of {n}"),
                    Counting::ByNoise => String::new(),
                };
                bail!(
                    "{} holds {}{of} samples a pixel of a render that has not ended; --resume goes on with it, --restart \
                     throws it away, another -o leaves it alone",
                    path.display(),
                    head.samples
                )
            }
            Ok(Err(_)) => bail!(
                "{} lies where checkpoints are written, and is none of this version; --restart throws it away, another \
                 -o leaves it alone",
                path.display()
            ),
            Err(e) => Err(e.into()),
        }
    }

    /// Takes up what lies there.
    pub fn resume(&self, job: &Job, quiet: bool) -> Result<()> {
        if !self.path.exists() {
            if !quiet {
                eprintln!(
                    "there is no checkpoint {} (none is kept of a render of less than {} s): starting from the beginning, \
                     to the same result",
                    self.path.display(),
                    WORTH_KEEPING.as_secs()
                );
            }
            return Ok(());
        }
        let bytes = read_own(&self.path, MAX_FILE)?;
        let head = job.resume(&bytes).with_context(|| {
            format!("{} (without --resume and with --restart it is thrown away)", self.path.display())
        })?;
        if !quiet {
            eprintln!("going on from {}: {} samples a pixel", self.path.display(), head.samples);
        }
        Ok(())
    }

    /// Writes it, if any are wanted; returns whether there is one now.
    pub fn write(&self, job: &Job) -> Result<bool, Error> {
        if self.wanted {
            atomic_write(&self.path, &job.checkpoint())?;
        }
        Ok(self.wanted)
    }

    /// At the end: keeps it where more samples are likely to be wanted, else takes it away. Returns whether there is
    /// one.
    pub fn close(&self, job: &Job, keep: bool) -> Result<bool, Error> {
        let head = job.head();
        if self.wanted && head.samples > 0 && (keep || head.elapsed >= WORTH_KEEPING) {
            return self.write(job);
        }
        if self.ours && self.path.exists() {
            std::fs::remove_file(&self.path).map_err(|e| Error::io(&self.path, e))?;
        }
        Ok(false)
    }
}

/// The line that was typed, made to go on.
pub fn command_to_go_on(typed: impl IntoIterator<Item = String>) -> String {
    let words = typed.into_iter().filter(|w| w != "--resume" && w != "--restart");
    words.chain(["--resume".to_string()]).map(quoted).collect::<Vec<_>>().join(" ")
}

fn quoted(word: String) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,:+@%^".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_to_go_on_can_be_pasted() {
        let typed = ["yugen", "render", "my scene.toml", "--restart", "-o", "a.exr", "-D", "name=it's"];
        assert_eq!(
            command_to_go_on(typed.map(String::from)),
            r"yugen render 'my scene.toml' -o a.exr -D 'name=it'\''s' --resume"
        );
    }
}
