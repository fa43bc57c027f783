//! Animated PNG (PNG, third edition, 2025), which plays again and again.

use super::{Encode, Timing};
use png::{BitDepth, ColorType, Encoder, SrgbRenderingIntent, Writer};
use std::io::Write;

struct Apng<'a> {
    writer: Writer<&'a mut dyn Write>,
    frames: u32,
    added: u32,
}

pub fn begin<'a>(
    timing: Timing,
    [width, height]: [u32; 2],
    out: &'a mut dyn Write,
) -> Result<Box<dyn Encode + 'a>, String> {
    let said = |e: png::EncodingError| e.to_string();
    let mut encoder = Encoder::new(out, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    // Repeats: 0 for ever.
    encoder.set_animated(timing.frames, 0).map_err(said)?;
    // The delay is a fraction of two numbers of 16 bits.
    let parts = [1000.0, 100.0, 10.0, 1.0].into_iter().find(|p| p * timing.rate <= 65535.0).unwrap_or(1.0);
    let per_second = (parts * timing.rate).round().clamp(1.0, 65535.0);
    encoder.set_frame_delay(parts as u16, per_second as u16).map_err(said)?;
    let writer = encoder.write_header().map_err(said)?;
    Ok(Box::new(Apng { writer, frames: timing.frames, added: 0 }))
}

impl Encode for Apng<'_> {
    fn add(&mut self, rgb: &[u8]) -> Result<(), String> {
        self.added += 1;
        self.writer.write_image_data(rgb).map_err(|e| e.to_string())
    }

    fn finish(self: Box<Self>) -> Result<(), String> {
        if self.added < self.frames {
            return Err(format!(
                "only {} of {} frames are there, and an animated PNG says first how many it has",
                self.added, self.frames
            ));
        }
        self.writer.finish().map_err(|e| e.to_string())
    }
}
