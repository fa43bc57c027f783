//! OpenEXR: any channels, several parts, half and float in; one part, ZIP-compressed scanlines out.

use super::{Codec, Decoded, ReadOptions, WriteOptions, cube, damaged};
use crate::formats::support::{Feature, Support};
use crate::{Error, Place};
use ::exr::meta::MetaData;
use ::exr::meta::attribute::{AttributeValue, EnvironmentMap};
use ::exr::prelude::{FlatSamples, ReadChannels, ReadLayers, f16, read};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::io::{Cursor, Write};
use yugen_optics::Image;

pub const CODEC: Codec = Codec {
    name: "OpenEXR",
    extensions: &["exr"],
    support: Support::Partly("see below"),
    recognises: |bytes| bytes.starts_with(&MAGIC),
    decode,
    encode: Some(encode),
};

const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

const WAVELETS: &str = "write it with ZIP or DWAA compression";

/// The compressions, in the order of their numbers in the file.
const COMPRESSIONS: &[Feature] = &[
    Feature::yes("no compression"),
    Feature::yes("RLE compression"),
    Feature::yes("ZIPS compression"),
    Feature::yes("ZIP compression"),
    Feature::yes("PIZ compression"),
    Feature::yes("PXR24 compression"),
    Feature::yes("B44 compression"),
    Feature::yes("B44A compression"),
    Feature::yes("DWAA compression"),
    Feature::yes("DWAB compression"),
    Feature::no("HTJ2K256 compression", WAVELETS),
    Feature::no("HTJ2K32 compression", WAVELETS),
    Feature::no("LJ2K compression", WAVELETS),
    Feature::no("ZSTD compression", WAVELETS),
];

const SUBSAMPLED: Feature = Feature::no("subsampled channels", "write all channels at full size");
const DEEP: Feature = Feature::no("deep data", "flatten the picture first");
const CUBE: Feature = Feature::partly("envmap: cube", "comes as a latitude-longitude picture");

const PARTS: &[Feature] = &[
    Feature::yes("half, float, unsigned integer"),
    Feature::yes("scan lines and tiles"),
    Feature::partly("mip and rip levels", "the largest"),
    Feature::yes("several parts"),
    Feature::yes("layers, such as ViewLayer.Combined.R"),
    Feature::partly("views", "a view is a layer"),
    Feature::yes("chromaticities"),
    Feature::yes("X, Y, Z as a colour, white as that of sRGB"),
    Feature::yes("envmap: latitude-longitude"),
    CUBE,
    SUBSAMPLED,
    DEEP,
];

/// What files of the format may hold.
pub fn features() -> impl Iterator<Item = Feature> {
    PARTS.iter().chain(COMPRESSIONS).copied()
}

/// "This is not supported, do that instead", for a feature that is not read.
fn refused(feature: Feature) -> String {
    let why = match feature.support {
        Support::No(why) | Support::Partly(why) => why,
        Support::Yes => "it is read",
    };
    format!("{} is not supported; {why}", feature.name)
}

/// A compression of the header that is not read: libraries take its number for damage.
fn unread_compression(bytes: &[u8]) -> Option<Feature> {
    const ATTRIBUTE: &[u8] = b"compression\0compression\0\x01\0\0\0";
    // Headers of many parts end within this.
    let head = &bytes[..bytes.len().min(1 << 16)];
    let numbers = head.windows(ATTRIBUTE.len() + 1).filter_map(|w| w.strip_prefix(ATTRIBUTE));
    numbers
        .filter_map(|n| COMPRESSIONS.get(usize::from(n[0])))
        .find(|f| matches!(f.support, Support::No(_)))
        .copied()
}

fn decode(bytes: &[u8], options: &ReadOptions, at: &Place) -> Result<Decoded, Error> {
    let invalid = |e: ::exr::error::Error| Error::invalid(at.clone(), damaged(e));
    if let Some(compression) = unread_compression(bytes) {
        return Err(Error::invalid(at.clone(), refused(compression)));
    }
    let window = admit(bytes, options, at)?;
    let file = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(invalid)?;

    let several = file.layer_data.len() > 1;
    let mut planes: Vec<(String, [i64; 2], [usize; 2], &FlatSamples)> = Vec::new();
    for layer in &file.layer_data {
        let position = layer.attributes.layer_position;
        let part = layer.attributes.layer_name.as_ref().map(|n| n.to_string()).unwrap_or_default();
        for channel in &layer.channel_data.list {
            let name = channel.name.to_string();
            let prefix = format!("{part}.");
            // Parts are told apart by their names, unless the channels carry them already. The part that
            // viewers show first goes by many names, none of which belongs into a channel's.
            let plain = !several
                || ["", "rgba", "RGBA", "rgb", "main", "Beauty", "beauty"].contains(&part.as_str())
                || name.starts_with(&prefix);
            let name = if plain { name } else { prefix + &name };
            let origin = [i64::from(position.x()) - window.x, i64::from(position.y()) - window.y];
            planes.push((name, origin, [layer.size.x(), layer.size.y()], &channel.sample_data));
        }
    }
    planes.sort_by(|a, b| order(&a.0).cmp(&order(&b.0)));
    planes.dedup_by(|a, b| a.0 == b.0);

    let names: Vec<&str> = planes.iter().map(|p| p.0.as_str()).collect();
    let mut image = Image::new(window.width, window.height, &names);
    let stride = planes.len();
    for (c, (_, origin, size, samples)) in planes.iter().enumerate() {
        let mut values = samples.values_as_f32();
        for y in 0..size[1] {
            // The windows of all parts lie in their union, so that this cannot be negative.
            let row = image.offset(origin[0] as usize, origin[1] as usize + y);
            for (x, v) in values.by_ref().take(size[0]).enumerate() {
                image.data[row + x * stride + c] = v;
            }
        }
    }
    let mut chromaticities = file
        .attributes
        .chromaticities
        .map(|c| [c.red, c.green, c.blue, c.white].map(|v| [f64::from(v.x()), f64::from(v.y())]));
    if !options.raw && name_xyz(&mut image) {
        chromaticities = Some(XYZ);
    }
    let cubes = file.layer_data.iter().any(|l| l.attributes.environment_map == Some(EnvironmentMap::Cube));
    if cubes {
        let side = image.width.min(image.height / 6);
        let [width, height] = cube::panorama_size(side);
        options.admit(at, width as u64, height as u64, image.channels.len() as u64)?;
        image = cube::panorama(&image);
    }
    Ok(Decoded { image, chromaticities, codes: None })
}

/// What a file says beside its pixels, part by part: names and values. Nothing where it is damaged.
pub(super) fn attributes(bytes: &[u8]) -> Vec<(String, String)> {
    let Ok(meta) = MetaData::read_from_buffered(Cursor::new(bytes), false) else { return Vec::new() };
    let value = |v: &AttributeValue| match v {
        AttributeValue::Text(t) => Some(t.to_string()),
        AttributeValue::TextVector(all) => {
            Some(all.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "))
        }
        AttributeValue::F32(v) => Some(v.to_string()),
        AttributeValue::F64(v) => Some(v.to_string()),
        AttributeValue::I32(v) => Some(v.to_string()),
        AttributeValue::FloatVec2(v) => Some(format!("{}, {}", v.x(), v.y())),
        AttributeValue::FloatVec3((x, y, z)) => Some(format!("{x}, {y}, {z}")),
        _ => None,
    };
    let mut all = Vec::new();
    for (i, header) in meta.headers.iter().enumerate() {
        let own = &header.own_attributes;
        let part = own.layer_name.as_ref().map_or_else(|| i.to_string(), ToString::to_string);
        let name = |what: &str| if meta.headers.len() > 1 { format!("{part}: {what}") } else { what.into() };
        let mut samples: Vec<String> =
            header.channels.list.iter().map(|c| format!("{:?}", c.sample_type).to_lowercase()).collect();
        samples.sort();
        samples.dedup();
        all.push((name("compression"), header.compression.to_string()));
        all.push((name("samples"), samples.join(", ")));
        let known = [("software", &own.software_name), ("owner", &own.owner), ("comments", &own.comments)];
        all.extend(known.iter().filter_map(|(what, text)| Some((name(what), text.as_ref()?.to_string()))));
        let shared = header.shared_attributes.other.iter().filter(|_| i == 0);
        let mut others: Vec<(String, String)> = own
            .other
            .iter()
            .chain(shared)
            .filter_map(|(k, v)| Some((name(&k.to_string()), value(v)?)))
            .collect();
        others.sort();
        all.extend(others);
    }
    all
}

/// The primaries of CIE XYZ with the white of sRGB: X, Y and Z are then in units of those of white.
const XYZ: [[f64; 2]; 4] = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [0.3127, 0.3290]];

/// Where a picture's own channels are X, Y and Z they become R, G and B of the space [`XYZ`].
fn name_xyz(image: &mut Image) -> bool {
    let [Some(x), Some(y), Some(z)] = ["X", "Y", "Z"].map(|c| image.channel(c)) else { return false };
    if image.channel("R").is_some() {
        return false;
    }
    let [wx, wy] = XYZ[3];
    let white = [wx / wy, 1.0, (1.0 - wx - wy) / wy].map(|v| v as f32);
    let stride = image.channels.len();
    for (c, white, name) in [(x, white[0], "R"), (y, white[1], "G"), (z, white[2], "B")] {
        image.channels[c] = name.into();
        image.data.iter_mut().skip(c).step_by(stride).for_each(|v| *v /= white);
    }
    true
}

/// The smallest rectangle around the data windows of all parts.
struct Window {
    x: i64,
    y: i64,
    width: usize,
    height: usize,
}

/// Reads only the header, and refuses what it should not have promised.
fn admit(bytes: &[u8], options: &ReadOptions, at: &Place) -> Result<Window, Error> {
    let invalid = |problem: String| Error::invalid(at.clone(), problem);
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| invalid(damaged(e)))?;
    let (mut low, mut high) = ([i64::MAX; 2], [i64::MIN; 2]);
    let (mut channels, mut samples, mut chunks) = (0u64, 0u64, 0u64);
    for header in &meta.headers {
        if header.deep {
            return Err(invalid(refused(DEEP)));
        }
        if let Some(c) = header.channels.list.iter().find(|c| c.sampling.x() != 1 || c.sampling.y() != 1) {
            return Err(invalid(format!("channel '{}': {}", c.name, refused(SUBSAMPLED))));
        }
        let position = header.own_attributes.layer_position;
        let size = [header.layer_size.x() as u64, header.layer_size.y() as u64];
        let count = header.channels.list.len() as u64;
        options.admit(at, size[0], size[1], count)?;
        for (a, p) in [position.x(), position.y()].into_iter().enumerate() {
            low[a] = low[a].min(i64::from(p));
            high[a] = high[a].max(i64::from(p).saturating_add_unsigned(size[a]));
        }
        channels += count;
        samples = samples.saturating_add(size[0] * size[1] * count);
        chunks = chunks.saturating_add(header.chunk_count as u64);
    }
    let size = [0, 1].map(|a| high[a].saturating_sub(low[a]).max(0) as u64);
    options.admit(at, size[0], size[1], channels.max(1))?;
    // Each chunk has eight bytes in the offset table and eight or more in front of its pixels.
    if chunks.saturating_mul(16) > bytes.len() as u64 {
        return Err(invalid(format!(
            "the header promises {samples} samples in {chunks} chunks, but the file has only {} bytes; it is cut off or damaged",
            bytes.len()
        )));
    }
    Ok(Window { x: low[0], y: low[1], width: size[0] as usize, height: size[1] as usize })
}

/// Files keep channels sorted by letter; people want the picture first, and R, G, B, A in each layer.
fn order(name: &str) -> (bool, &str, usize, &str) {
    let (layer, channel) = name.rsplit_once('.').unwrap_or(("", name));
    let place = ["R", "G", "B", "X", "Y", "Z", "A"].iter().position(|&c| c == channel).unwrap_or(usize::MAX);
    (!layer.is_empty(), layer, place, channel)
}

/// Version 2 of the format; bit 10 allows names of up to 255 bytes.
const VERSION: u32 = 2;
const LONG_NAMES: u32 = 1 << 10;
/// ZIP compression works on blocks of this many scanlines.
const ZIP_LINES: usize = 16;

fn encode(image: &Image, options: &WriteOptions) -> Result<Vec<u8>, String> {
    let (Ok(width), Ok(height)) = (i32::try_from(image.width), i32::try_from(image.height)) else {
        return Err(format!("{} x {} pixels are more than OpenEXR can hold", image.width, image.height));
    };
    let mut channels: Vec<(usize, &str)> = image.channels.iter().map(String::as_str).enumerate().collect();
    channels.sort_by_key(|c| c.1);
    if channels.windows(2).any(|c| c[0].1 == c[1].1) {
        return Err("two channels have the same name".into());
    }
    let names = channels.iter().map(|c| c.1).chain(options.metadata.iter().map(|m| m.0.as_str()));
    let longest = names.map(check_name).collect::<Result<Vec<_>, _>>()?.into_iter().max().unwrap_or(0);

    let mut out = MAGIC.to_vec();
    out.extend((VERSION | if longest > 31 { LONG_NAMES } else { 0 }).to_le_bytes());
    let mut list = Vec::new();
    for (_, name) in &channels {
        list.extend(name.as_bytes());
        list.push(0);
        let sample_type: i32 = if options.half { 1 } else { 2 };
        for v in [sample_type, 0, 1, 1] {
            list.extend(v.to_le_bytes());
        }
    }
    list.push(0);
    let floats = |v: &[f32]| v.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let primaries: Vec<f32> = options.space.chromaticities().iter().flatten().map(|&x| x as f32).collect();
    let window: Vec<u8> = [0, 0, width - 1, height - 1].iter().flat_map(|x: &i32| x.to_le_bytes()).collect();
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        for text in [name, kind] {
            out.extend(text.as_bytes());
            out.push(0);
        }
        out.extend((value.len() as u32).to_le_bytes());
        out.extend(value);
    };
    attribute("channels", "chlist", &list);
    attribute("chromaticities", "chromaticities", &floats(&primaries));
    attribute("compression", "compression", &[3]);
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &floats(&[1.0]));
    attribute("screenWindowCenter", "v2f", &floats(&[0.0, 0.0]));
    attribute("screenWindowWidth", "float", &floats(&[1.0]));
    attribute("software", "string", b"Yugen");
    for (name, value) in &options.metadata {
        attribute(name, "string", value.as_bytes());
    }
    out.push(0);

    let blocks = image.height.div_ceil(ZIP_LINES);
    let table = out.len();
    out.resize(table + 8 * blocks, 0);
    let row = image.width * image.channels.len();
    for (b, lines) in image.data.chunks(ZIP_LINES * row).enumerate() {
        let offset = (out.len() as u64).to_le_bytes();
        out[table + 8 * b..][..8].copy_from_slice(&offset);
        let mut raw = Vec::with_capacity(lines.len() * 4);
        for line in lines.chunks_exact(row) {
            for &(c, _) in &channels {
                let values = line.iter().skip(c).step_by(image.channels.len()).copied();
                if options.half {
                    // Beyond the largest half lies infinity, which no reader wants.
                    raw.extend(values.flat_map(|v| f16::from_f32(v.clamp(-65504.0, 65504.0)).to_le_bytes()));
                } else {
                    raw.extend(values.flat_map(f32::to_le_bytes));
                }
            }
        }
        let packed = zip(&raw)?;
        // What does not get smaller is stored as it is, without the predictor.
        let data = if packed.len() < raw.len() { &packed } else { &raw };
        out.extend(((b * ZIP_LINES) as i32).to_le_bytes());
        out.extend((data.len() as u32).to_le_bytes());
        out.extend(data);
    }
    Ok(out)
}

fn check_name(name: &str) -> Result<usize, String> {
    if name.is_empty() || name.len() > 255 || name.contains('\0') {
        return Err(format!("'{name}' cannot name a channel or an attribute; expected 1 to 255 bytes"));
    }
    Ok(name.len())
}

/// Even bytes before odd ones, each as the difference to the one before it, deflated.
fn zip(raw: &[u8]) -> Result<Vec<u8>, String> {
    let mut bytes: Vec<u8> = raw.iter().step_by(2).chain(raw.iter().skip(1).step_by(2)).copied().collect();
    let mut previous = bytes.first().copied().unwrap_or(0);
    for b in bytes.iter_mut().skip(1) {
        let value = *b;
        *b = value.wrapping_sub(previous).wrapping_add(128);
        previous = value;
    }
    // Level 4 as OpenEXR has it: the higher ones cost much time for little size.
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(4));
    encoder.write_all(&bytes).and_then(|()| encoder.finish()).map_err(|e| e.to_string())
}
