//! What `yugen render` says of its work: on the terminal, as JSON and in the picture.

use super::{Denoising, Outcome, Render};
use crate::json;
use indicatif::HumanBytes;
use serde_json::json;
use yugen_optics::Image;
use yugen_transport::render::{Job, MAX_SAMPLES};

impl Render {
    /// What goes into the picture's own header.
    pub(super) fn metadata(&self, job: &Job) -> Vec<(String, String)> {
        let status = job.status();
        vec![
            ("yugen:version".into(), env!("CARGO_PKG_VERSION").into()),
            ("yugen:scene".into(), self.scene.display().to_string()),
            ("yugen:seed".into(), self.seed.to_string()),
            ("yugen:samples".into(), status.samples.to_string()),
            ("yugen:rejected".into(), status.rejected.to_string()),
            ("yugen:clamped_light".into(), status.clamped.to_string()),
        ]
    }

    /// Prints what was done.
    pub(super) fn report(&self, job: &Job, outcome: &Outcome) {
        let status = job.status();
        let [w, h] = job.size();
        let pixels = u64::from(w) * u64::from(h);
        let seconds = status.elapsed.as_secs_f64();
        let rate = status.samples as f64 / seconds.max(1e-9);
        let stats = job.world().geometry.stats();
        if self.json {
            let report = json!({
                "output": self.output.display().to_string(),
                "finished": outcome.ended,
                "checkpoint": outcome.kept.map(|p| p.display().to_string()),
                "width": w,
                "height": h,
                "samples": status.samples,
                "samples_per_pixel": status.samples as f64 / pixels as f64,
                "render_seconds": seconds,
                "samples_per_second": rate,
                "load_seconds": outcome.loaded.as_secs_f64(),
                "prepare_seconds": outcome.prepared.as_secs_f64(),
                "relative_error": job.error(),
                "denoise_seconds": outcome.denoising.as_ref().map(|d| d.took.as_secs_f64()),
                "denoised_relative_error": outcome.denoising.as_ref().map(|d| d.error),
                "rejected_samples": status.rejected,
                "clamped_light": status.clamped,
                "triangles": stats.triangles,
                "hierarchy_bytes": stats.tree_bytes,
                "mesh_bytes": stats.mesh_bytes,
            });
            json::print(report);
            return;
        }
        println!(
            "{}: {w}x{h}, {:.1} samples a pixel in {seconds:.1} s{}",
            self.output.display(),
            status.samples as f64 / pixels as f64,
            // Nothing can be said of a moment.
            if seconds > 0.05 { format!(" ({:.2} M samples/s)", rate / 1e6) } else { String::new() },
        );
        if let Some(Denoising { took, error }) = &outcome.denoising {
            let from = job.error();
            let seconds = took.as_secs_f64();
            println!("denoised in {seconds:.1} s: a relative error of about {error:.3} instead of {from:.3}");
        }
        if status.clamped > 0.0 {
            println!("{:.2} % of the light was clamped away", 100.0 * status.clamped);
        }
        if status.rejected > 0 {
            println!("{} samples were not finite and were left out", status.rejected);
        }
        if let (true, Some(path)) = (outcome.ended, outcome.kept) {
            let size = std::fs::metadata(path).map_or(0, |m| m.len());
            println!("{} ({}) is kept: --resume adds samples to it", path.display(), HumanBytes(size));
        }
        if let Some(target) = self.error.filter(|target| outcome.ended && job.error() > *target) {
            println!(
                "the relative error is {:.4}: {target} was not reached within {MAX_SAMPLES} samples a pixel",
                job.error()
            );
        }
    }
}

/// Root mean square over the picture of the denoiser's estimate of the standard error over the value; dark pixels count
/// as a hundredth of the picture's mean, as in [`Job::error`].
pub(super) fn error_that_remains(picture: &Image) -> f32 {
    let Some(all) = picture.select(&["R", "G", "B", "error.R", "error.G", "error.B"]) else { return 0.0 };
    let count = 3.0 * (all.width * all.height) as f32;
    let pixels = || all.data.chunks_exact(6);
    let floor = (0.01 * pixels().flat_map(|p| &p[..3]).sum::<f32>() / count).max(1e-9);
    let squared = |p: &[f32], c: usize| p[3 + c] * p[3 + c] / (p[c] * p[c] + floor * floor);
    (pixels().map(|p| squared(p, 0) + squared(p, 1) + squared(p, 2)).sum::<f32>() / count).sqrt()
}
