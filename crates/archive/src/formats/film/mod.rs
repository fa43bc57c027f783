//! Films: pictures one after the other, eight bits, as a display shows them.

mod apng;
#[cfg(feature = "mp4")]
mod mp4;

use super::image::{WriteOptions, show};
use crate::{Error, Place, atomic_write_with, check_writable};
use std::io::Write;
use std::path::Path;
use yugen_optics::Image;
use yugen_optics::adaptation::{Adaptation, Eye};

/// Begins a film; what is wrong with it, as a sentence, where it cannot be.
type Begin = for<'a> fn(Timing, [u32; 2], &'a mut dyn Write) -> Result<Box<dyn Encode + 'a>, String>;

/// A format of films.
struct Format {
    /// For people.
    name: &'static str,
    /// Lower case, without the dot.
    extension: &'static str,
    begin: Begin,
    /// What is wrong with this many pixels across and down.
    check: fn([u32; 2]) -> Result<(), String>,
}

/// Every format of films.
const FORMATS: &[Format] = &[
    #[cfg(feature = "mp4")]
    Format { name: "MP4 (H.264)", extension: "mp4", begin: mp4::begin, check: mp4::check },
    Format { name: "animated PNG", extension: "apng", begin: apng::begin, check: |_| Ok(()) },
];

/// How many frames, and how fast they follow one another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// At least one.
    pub frames: u32,
    /// A second; from 0.1 to 1000.
    pub rate: f64,
}

/// Frames go in, a file comes out.
trait Encode {
    /// Adds a frame: R, G, B of eight bits, rows from the top, of the size the film was begun with.
    fn add(&mut self, rgb: &[u8]) -> Result<(), String>;
    /// Writes what is left.
    fn finish(self: Box<Self>) -> Result<(), String>;
}

/// Whether a file's name ends as those of films do that can be written.
pub fn is_film(path: &Path) -> bool {
    format_of(path).is_some()
}

/// Whether this film can be written: its format, which the error names, and its folder. Ask before an hour of rendering.
pub fn can_write(path: &Path) -> Result<(), Error> {
    known(path)?;
    check_writable(path)
}

/// Whether a film of this name may have so many pixels across and down.
pub fn check_size(path: &Path, size: [u32; 2]) -> Result<(), Error> {
    (known(path)?.check)(size).map_err(|problem| Error::invalid(Place::file(path), problem))
}

/// Whether a film of this name must have all of the frames that were said when it was begun.
pub fn needs_all_frames(path: &Path) -> bool {
    format_of(path).is_some_and(|f| f.extension == "apng")
}

fn known(path: &Path) -> Result<&'static Format, Error> {
    format_of(path).ok_or_else(|| {
        let known: Vec<_> = FORMATS.iter().map(|f| format!(".{} ({})", f.extension, f.name)).collect();
        let problem = format!("this is no name of a film; expected {}", known.join(" or "));
        Error::invalid(Place::file(path), problem)
    })
}

fn format_of(path: &Path) -> Option<&'static Format> {
    let extension = path.extension()?.to_str()?.to_lowercase();
    FORMATS.iter().find(|f| f.extension == extension)
}

/// A film that is being written.
pub struct Film<'a> {
    path: &'a Path,
    timing: Timing,
    options: &'a WriteOptions,
    format: &'static Format,
    out: Option<&'a mut dyn Write>,
    encoder: Option<Box<dyn Encode + 'a>>,
    size: [u32; 2],
    /// Who watches it, where the exposure follows that.
    eye: Option<Eye>,
}

impl Film<'_> {
    /// Adds a frame; all of them must have the size of the first.
    pub fn add(&mut self, picture: &Image) -> Result<(), Error> {
        let wrong = |problem: String| Error::invalid(Place::file(self.path), problem);
        let stops = self.eye.as_mut().map_or(0.0, |eye| eye.stops(picture));
        let options = WriteOptions { exposure: self.options.exposure + stops, ..self.options.clone() };
        let mut shown = show(picture, &options, false).map_err(wrong)?;
        let size = [shown.width, shown.height];
        if shown.channels == 1 {
            shown.data = shown.data.iter().flat_map(|&v| [v; 3]).collect();
        }
        if let Some(out) = self.out.take() {
            (self.format.check)(size).map_err(wrong)?;
            self.size = size;
            self.encoder = Some((self.format.begin)(self.timing, size, out).map_err(wrong)?);
        }
        if size != self.size {
            let ([w, h], [fw, fh]) = (size, self.size);
            return Err(wrong(format!("a frame of {w}x{h} pixels cannot follow one of {fw}x{fh}")));
        }
        match &mut self.encoder {
            Some(encoder) => encoder.add(&shown.bytes()).map_err(wrong),
            None => Ok(()),
        }
    }
}

/// Writes a film, whole or not at all: `fill` adds its frames. Where it adds fewer than it said, an animated PNG is
/// refused and any other film is that much shorter. Of `options`, the space, the curve, the exposure and what it follows count.
pub fn write<E: From<Error>>(
    path: &Path,
    timing: Timing,
    options: &WriteOptions,
    fill: impl FnOnce(&mut Film) -> Result<(), E>,
) -> Result<(), E> {
    let format = known(path)?;
    let mut filled = Ok(());
    let written = atomic_write_with(path, |out| {
        let eye = (options.adaptation == Adaptation::Eye).then(|| Eye::new(options.space, timing.rate));
        let mut film =
            Film { path, timing, options, format, out: Some(out), encoder: None, size: [0; 2], eye };
        filled = fill(&mut film);
        // The file is not kept then; the caller learns of the reason that it gave itself.
        let abandoned = || Error::invalid(Place::file(path), "the film was given up");
        filled.as_ref().map_err(|_| abandoned())?;
        let encoder = film
            .encoder
            .take()
            .ok_or_else(|| Error::invalid(Place::file(path), "a film needs at least one frame"))?;
        encoder.finish().map_err(|problem| Error::invalid(Place::file(path), problem))
    });
    filled?;
    Ok(written?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;
    use yugen_optics::{ColourSpace, Vec3};

    /// A frame in which a bright bar moves over colours.
    fn frame(i: usize, [w, h]: [usize; 2]) -> Image {
        let mut image = Image::new(w, h, &["R", "G", "B"]);
        for (k, pixel) in image.data.chunks_exact_mut(3).enumerate() {
            let (x, y) = (k % w, k / w);
            let bar = x / 4 == i;
            let colour = Vec3::new(x as f32 / w as f32, y as f32 / h as f32, 0.4);
            pixel.copy_from_slice(&(if bar { Vec3::ONE } else { colour }).to_array());
        }
        image
    }

    fn film(name: &str, frames: usize, size: [usize; 2]) -> Result<Vec<u8>, Error> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        let timing = Timing { frames: 4, rate: 25.0 };
        let options = WriteOptions::from(ColourSpace::LinearSrgb);
        write(&path, timing, &options, |film| (0..frames).try_for_each(|i| film.add(&frame(i, size))))?;
        assert_eq!(folder.path().read_dir().unwrap().count(), 1, "nothing else is left behind");
        Ok(crate::read_bounded(&path, 1 << 24).unwrap())
    }

    #[test]
    fn an_animated_png_is_the_frames_to_the_bit() {
        let bytes = film("wave.apng", 4, [37, 21]).unwrap();
        let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
        assert_eq!(reader.info().animation_control().unwrap().num_frames, 4);
        let control = *reader.info().frame_control().unwrap();
        assert_eq!(f64::from(control.delay_num) / f64::from(control.delay_den), 0.04);
        let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
        let options = WriteOptions::from(ColourSpace::LinearSrgb);
        for i in 0..4 {
            reader.next_frame(&mut buffer).unwrap();
            let want = show(&frame(i, [37, 21]), &options, false).unwrap().bytes();
            assert_eq!(buffer, want, "frame {i}");
        }
    }

    #[test]
    fn an_eye_gets_used_to_what_it_is_shown() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("dusk.apng");
        // As bright as one another but for the first; the last of them is shown darker than the second.
        let light = |i: usize| {
            let mut image = Image::rgb(4, 4);
            image.data.fill(if i == 0 { 0.1 } else { 0.4 });
            image
        };
        let shown = |adaptation| {
            let options = WriteOptions { adaptation, ..WriteOptions::from(ColourSpace::LinearSrgb) };
            let timing = Timing { frames: 4, rate: 25.0 };
            write(&path, timing, &options, |film| (0..4).try_for_each(|i| film.add(&light(i)))).unwrap();
            let bytes = crate::read_bounded(&path, 1 << 24).unwrap();
            let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
            let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
            [(); 4].map(|()| {
                reader.next_frame(&mut buffer).unwrap();
                buffer[0]
            })
        };
        let (as_it_is, adapted) = (shown(Adaptation::None), shown(Adaptation::Eye));
        assert!(as_it_is[0] == adapted[0] && as_it_is[1] == as_it_is[3], "{as_it_is:?} {adapted:?}");
        assert!(adapted[1] > adapted[2] && adapted[2] > adapted[3] && adapted[3] > adapted[0], "{adapted:?}");
    }

    #[test]
    fn films_that_cannot_be_are_refused_and_leave_nothing() {
        let refused = |name, frames, size| film(name, frames, size).unwrap_err().to_string();
        assert!(refused("a.mov", 1, [8, 8]).contains("expected"), "{}", refused("a.mov", 1, [8, 8]));
        assert!(refused("a.apng", 0, [8, 8]).contains("at least one frame"));
        assert!(refused("a.apng", 2, [8, 8]).contains("2 of 4 frames"), "{}", refused("a.apng", 2, [8, 8]));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.apng");
        let timing = Timing { frames: 2, rate: 25.0 };
        let grows = write(&path, timing, &WriteOptions::default(), |film| {
            film.add(&frame(0, [8, 8]))?;
            film.add(&frame(1, [8, 10]))
        });
        assert!(grows.unwrap_err().to_string().contains("8x10 pixels cannot follow one of 8x8"));
        assert_eq!(folder.path().read_dir().unwrap().count(), 0);
    }

    #[cfg(feature = "mp4")]
    #[test]
    fn an_mp4_comes_back_as_the_frames_that_went_in() {
        use openh264::decoder::Decoder;
        use openh264::formats::YUVSource;
        let size = [64, 48];
        let bytes = film("wave.mp4", 4, size).unwrap();
        assert_eq!(bytes, film("wave.mp4", 4, size).unwrap(), "same frames, same bits");
        // An independent reading of the container: samples lie in mdat one after the other, each with its length.
        let at = bytes.windows(4).position(|w| w == b"mdat").unwrap() + 4;
        let setup = {
            let avcc = bytes.windows(4).position(|w| w == b"avcC").unwrap() + 4 + 6;
            let sps = usize::from(u16::from_be_bytes([bytes[avcc], bytes[avcc + 1]]));
            let pps_at = avcc + 2 + sps + 1;
            let pps = usize::from(u16::from_be_bytes([bytes[pps_at], bytes[pps_at + 1]]));
            [&bytes[avcc + 2..][..sps], &bytes[pps_at + 2..][..pps]]
        };
        let mut stream = Vec::new();
        for unit in setup {
            stream.extend([0, 0, 0, 1]);
            stream.extend(unit);
        }
        let mut decoder = Decoder::new().unwrap();
        decoder.decode(&stream).unwrap();
        let (mut next, mut frames) = (at, 0);
        let (mut worst, mut farthest) = (0.0f64, 0.0f32);
        while next + 4 <= bytes.len() && frames < 4 {
            let length = u32::from_be_bytes(bytes[next..next + 4].try_into().unwrap()) as usize;
            let mut unit = vec![0, 0, 0, 1];
            unit.extend(&bytes[next + 4..][..length]);
            next += 4 + length;
            let Some(yuv) = decoder.decode(&unit).unwrap() else { continue };
            let options = WriteOptions::from(ColourSpace::LinearSrgb);
            let want = show(&frame(frames, size), &options, false).unwrap().data;
            let mut sum = 0.0;
            for (k, rgb) in want.chunks_exact(3).enumerate() {
                let (x, y) = (k % size[0], k / size[0]);
                // Luminance of Rec. 709 in the studio's range.
                let luma = 16.0 + 219.0 * (0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]);
                let off = f32::from(yuv.y()[y * yuv.strides().0 + x]) - luma;
                sum += f64::from(off).powi(2);
                farthest = farthest.max(off.abs());
            }
            worst = worst.max((sum / (size[0] * size[1]) as f64).sqrt());
            frames += 1;
        }
        assert_eq!(frames, 4);
        // Measured: .62 and 3.1. Nothing is left where the bar has been.
        assert!(worst < 2.5 && farthest < 12.0, "{worst} {farthest}");
        let odd = film("odd.mp4", 1, [33, 20]).unwrap_err().to_string();
        assert!(odd.contains("even") && odd.contains("33x20") && odd.contains("32x20"), "{odd}");
    }
}
