//! MP4 with H.264 (ISO/IEC 14496-12 and 14496-10), which every browser and player shows.
//!
//! Colours are those of Rec. 709 in the studio's range (16 to 235), 4:2:0, and say so in the stream; display values are
//! coded by sRGB's curve, which the stream says as well. Chroma lies where H.264 has it if nothing else is said: level
//! with every second column, between two rows.

use super::{Encode, Timing};
use muxide::api::{Muxer, MuxerBuilder, VideoCodec};
use openh264::OpenH264API;
use openh264::encoder::{
    BitRate, Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod, QpRange, RateControlMode,
    TransferCharacteristics, VuiConfig,
};
use openh264::formats::YUVSlices;
use std::io::Write;

/// Luminance of Rec. 709: red and blue, green being the rest.
const RED: f32 = 0.2126;
const BLUE: f32 = 0.0722;

/// Steps of quantisation of H.264, 0 (best) to 51: at 14 the luminance of a moving patch of noise is off by .33 code
/// values in the root mean square and by 6 at most, at 20 by .7 and 12.
const QUANTISATION: u8 = 14;

/// Bits a second that are not reached, the most of level 5.2, so that every frame has the quality above and none is left out. (The mode of the
/// encoder without control of the rate has a fixed quality of its own, in which edges that have moved on leave specks.)
const NO_LIMIT: u32 = 240_000_000;

/// Most pixels across and down that the encoder takes.
const MOST: [u32; 2] = [3840, 2160];

struct Mp4<'a> {
    encoder: Encoder,
    muxer: Muxer<&'a mut dyn Write>,
    rate: f64,
    added: u32,
    size: [usize; 2],
}

pub fn check(size: [u32; 2]) -> Result<(), String> {
    let [w, h] = size;
    let even = size.map(|n| (n / 2 * 2).max(16));
    if size != even {
        let [ew, eh] = even;
        return Err(format!(
            "an .mp4 needs an even number of pixels across and down, and at least 16; {w}x{h} are not: make it {ew}x{eh}, or \
             an .apng"
        ));
    }
    if w.max(h) > MOST[0] || w.min(h) > MOST[1] {
        let [mw, mh] = MOST;
        return Err(format!("an .mp4 has at most {mw}x{mh} pixels; {w}x{h} are more"));
    }
    Ok(())
}

pub fn begin<'a>(
    timing: Timing,
    size: [u32; 2],
    out: &'a mut dyn Write,
) -> Result<Box<dyn Encode + 'a>, String> {
    let [w, h] = size;
    let config = EncoderConfig::new()
        .max_frame_rate(FrameRate::from_hz(timing.rate as f32))
        .rate_control_mode(RateControlMode::Quality)
        .bitrate(BitRate::from_bps(NO_LIMIT))
        .qp(QpRange::new(QUANTISATION, QUANTISATION))
        .scene_change_detect(false)
        .background_detection(false)
        .adaptive_quantization(false)
        // A player jumps to whole pictures, which come every second.
        .intra_frame_period(IntraFramePeriod::from_num_frames(timing.rate.round().max(1.0) as u32))
        // Same frames, same bits.
        .num_threads(1)
        .vui(VuiConfig::bt709().transfer_characteristics(TransferCharacteristics::Srgb));
    let encoder = Encoder::with_api_config(OpenH264API::from_source(), config).map_err(|e| e.to_string())?;
    let muxer = MuxerBuilder::new(out)
        .video(VideoCodec::H264, w, h, timing.rate)
        .with_fast_start(true)
        .build()
        .map_err(|e| e.to_string())?;
    Ok(Box::new(Mp4 { encoder, muxer, rate: timing.rate, added: 0, size: size.map(|n| n as usize) }))
}

impl Encode for Mp4<'_> {
    fn add(&mut self, rgb: &[u8]) -> Result<(), String> {
        let [w, h] = self.size;
        let [y, u, v] = to_yuv(rgb, self.size);
        let frame = YUVSlices::new((&y, &u, &v), (w, h), (w, w / 2, w / 2));
        let stream = self.encoder.encode(&frame).map_err(|e| e.to_string())?;
        let whole = matches!(stream.frame_type(), FrameType::IDR | FrameType::I);
        let seconds = f64::from(self.added) / self.rate;
        self.muxer.write_video(seconds, &stream.to_vec(), whole).map_err(|e| e.to_string())?;
        self.added += 1;
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<(), String> {
        self.muxer.finish().map_err(|e| e.to_string())
    }
}

/// The planes Y, Cb and Cr, the latter of half the width and height, which are even.
fn to_yuv(rgb: &[u8], [w, h]: [usize; 2]) -> [Vec<u8>; 3] {
    let pixel = |x: usize, y: usize| {
        let at = 3 * (y * w + x);
        [rgb[at], rgb[at + 1], rgb[at + 2]].map(|v| f32::from(v) / 255.0)
    };
    let luminance = |[r, g, b]: [f32; 3]| RED * r + (1.0 - RED - BLUE) * g + BLUE * b;
    let code = |v: f32| (v + 0.5) as u8;
    let mut planes =
        [Vec::with_capacity(w * h), Vec::with_capacity(w * h / 4), Vec::with_capacity(w * h / 4)];
    for y in 0..h {
        planes[0].extend((0..w).map(|x| code(16.0 + 219.0 * luminance(pixel(x, y)))));
    }
    for y in (0..h).step_by(2) {
        for x in (0..w).step_by(2) {
            // A quarter, a half and a quarter about the column, in both rows.
            let columns = [(x.saturating_sub(1), 0.125), (x, 0.25), (x + 1, 0.125)];
            let mut mean = [0.0f32; 3];
            for (column, weight) in columns {
                for row in [y, y + 1] {
                    for (m, v) in mean.iter_mut().zip(pixel(column, row)) {
                        *m += weight * v;
                    }
                }
            }
            let luma = luminance(mean);
            let blue = 0.5 * (mean[2] - luma) / (1.0 - BLUE);
            let red = 0.5 * (mean[0] - luma) / (1.0 - RED);
            planes[1].push(code(128.0 + 224.0 * blue));
            planes[2].push(code(128.0 + 224.0 * red));
        }
    }
    planes
}
