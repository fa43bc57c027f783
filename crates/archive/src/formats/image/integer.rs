//! What PNG, JPEG and WebP share: integers that are sRGB display values unless read as raw.

use super::{Decoded, ReadOptions, WriteOptions, damaged, shown_channels};
use crate::{Error, Place};
use ::image::{ColorType, ImageDecoder, Limits};
use yugen_optics::colour::srgb_to_linear;
use yugen_optics::tonemap::ToneMap;
use yugen_optics::{Image, Vec3};

/// Everything a decoder of the `image` crate can give, as linear floats.
pub fn decode(decoder: impl ImageDecoder, options: &ReadOptions, at: &Place) -> Result<Decoded, Error> {
    let (names, wide): (&[&str], bool) = match decoder.color_type() {
        ColorType::L8 => (&["Y"], false),
        ColorType::La8 => (&["Y", "A"], false),
        ColorType::Rgb8 => (&["R", "G", "B"], false),
        ColorType::Rgba8 => (&["R", "G", "B", "A"], false),
        ColorType::L16 => (&["Y"], true),
        ColorType::La16 => (&["Y", "A"], true),
        ColorType::Rgb16 => (&["R", "G", "B"], true),
        ColorType::Rgba16 => (&["R", "G", "B", "A"], true),
        other => {
            return Err(Error::invalid(at.clone(), format!("samples of type {other:?} are not supported")));
        }
    };
    let ([width, height], bytes) = samples(decoder, names.len(), options, at)?;
    let mut image = Image { width, height, ..Image::default() };
    image.channels = names.iter().map(|n| n.to_string()).collect();
    let max: usize = if wide { 65535 } else { 255 };
    let linear: Vec<f32> = (0..=max).map(|i| i as f32 / max as f32).collect();
    let colour: Vec<f32> =
        if options.raw { linear.clone() } else { linear.iter().map(|&v| srgb_to_linear(v)).collect() };
    let alpha = names.iter().position(|&n| n == "A");
    let value = |(i, code): (usize, usize)| {
        if Some(i % names.len()) == alpha { linear[code] } else { colour[code] }
    };
    image.data = if wide {
        bytes
            .chunks_exact(2)
            .map(|b| usize::from(u16::from_ne_bytes([b[0], b[1]])))
            .enumerate()
            .map(value)
            .collect()
    } else {
        bytes.iter().map(|&b| usize::from(b)).enumerate().map(value).collect()
    };
    Ok(Decoded { image, chromaticities: None, codes: Some(max as u32) })
}

/// Width and height, and the decoded bytes of so many channels.
pub fn samples(
    mut decoder: impl ImageDecoder,
    channels: usize,
    options: &ReadOptions,
    at: &Place,
) -> Result<([usize; 2], Vec<u8>), Error> {
    let invalid = |e: ::image::ImageError| Error::invalid(at.clone(), damaged(e));
    let (width, height) = decoder.dimensions();
    options.admit(at, width.into(), height.into(), channels as u64)?;
    let mut limits = Limits::default();
    // The decoded bytes and as much again for the decoder's own rows.
    limits.max_alloc = Some(decoder.total_bytes().saturating_mul(2).saturating_add(1 << 20));
    decoder.set_limits(limits).map_err(invalid)?;
    let mut bytes = vec![0; decoder.total_bytes() as usize];
    decoder.read_image(&mut bytes).map_err(invalid)?;
    Ok(([width as usize, height as usize], bytes))
}

/// A picture as display values in [0, 1], interleaved: grey, grey and alpha, colour, or colour and alpha.
pub struct Shown {
    pub width: u32,
    pub height: u32,
    pub channels: usize,
    pub data: Vec<f32>,
}

impl Shown {
    pub fn bytes(&self) -> Vec<u8> {
        self.data.iter().map(|v| (v * 255.0 + 0.5) as u8).collect()
    }

    /// Native-endian 16-bit samples, as the `image` crate takes them.
    pub fn words(&self) -> Vec<u8> {
        self.data.iter().flat_map(|v| ((v * 65535.0 + 0.5) as u16).to_ne_bytes()).collect()
    }
}

/// Maps scene light to the display. With `with_alpha`, the alpha of the image comes along, straight, as
/// integer formats have it; Yugen's own is premultiplied.
pub fn show(image: &Image, options: &WriteOptions, with_alpha: bool) -> Result<Shown, String> {
    let size = |n: usize| u32::try_from(n).map_err(|_| format!("the image is {n} pixels wide or high"));
    let (colour, alpha) = shown_channels(image);
    let alpha = alpha.filter(|_| with_alpha);
    let grey = colour[0] == colour[1];
    let display = ToneMap::new(options.space, options.exposure, options.curve);
    let mut data = Vec::with_capacity(image.width * image.height * 4);
    for pixel in image.data.chunks_exact(image.channels.len()) {
        let mut rgb = Vec3::from_array(colour.map(|c| pixel[c]));
        let coverage = alpha.map(|a| pixel[a].clamp(0.0, 1.0));
        if let Some(a) = coverage.filter(|&a| a > 0.0) {
            rgb /= a;
        }
        let shown = if options.raw { rgb.clamp(Vec3::ZERO, Vec3::ONE) } else { display.show(rgb) }.to_array();
        data.extend_from_slice(if grey { &shown[..1] } else { &shown });
        data.extend(coverage);
    }
    let channels = if grey { 1 } else { 3 } + usize::from(alpha.is_some());
    Ok(Shown { width: size(image.width)?, height: size(image.height)?, channels, data })
}
