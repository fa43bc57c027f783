//! Two pictures in one: the reference, or a painting by another method, beside the one that is shown.

use super::{App, Wake};
use crate::reference::difference;
use std::sync::mpsc;
use std::time::{Duration, Instant};
use winit::event_loop::ActiveEventLoop;
use yugen_optics::Image;
use yugen_optics::tonemap::ToneMap;

/// Between two comparisons with the reference, at least.
pub(super) const COMPARE: Duration = Duration::from_millis(1500);

impl App {
    /// Measures how far the two are apart, now and then.
    pub(super) fn compare(&mut self, event_loop: &ActiveEventLoop) {
        if let Some(comparing) = &self.comparing {
            match comparing.try_recv() {
                Err(mpsc::TryRecvError::Empty) => return,
                Ok(difference) => self.seen.difference = difference.filter(|_| self.state.reference),
                Err(mpsc::TryRecvError::Disconnected) => {}
            }
            self.comparing = None;
            self.compared = Instant::now();
        }
        let Some(finding) = self.finding.clone() else { return };
        // A picture of which parts have no sample yet cannot be compared.
        let ready = self.settled() && self.frames >= 4 && finding.samples >= 1.0;
        if !ready
            || self.compared.elapsed() < COMPARE && self.script.is_empty()
            || finding.number == self.compared_number
        {
            return;
        }
        let image = match self.graphics.as_ref().and_then(|g| g.stage.as_ref()).map(|s| s.image()) {
            Some(Ok(image)) => image,
            Some(Err(e)) => return self.fail(event_loop, e),
            None => return,
        };
        self.compared_number = finding.number;
        let display = ToneMap::new(self.changed_scene.working_space, self.state.exposure, self.state.curve);
        let (sender, receiver) = mpsc::channel();
        let wake = self.proxy.clone();
        std::thread::spawn(move || {
            // Nobody may listen any more.
            let _ = sender.send(difference(&image, &finding.image, &display));
            let _ = wake.send_event(Wake::Thread);
        });
        self.comparing = Some(receiver);
    }

    /// The first column of a picture in which the other one of two is seen, as they are compared now.
    pub(super) fn first_of_other(&self, width: usize) -> usize {
        use crate::command::Compare;
        match self.state.compare {
            Compare::Split => (self.state.split * width as f32).round() as usize,
            Compare::Reference => 0,
            Compare::RealTime | Compare::Flicker => width,
        }
    }
}

/// The picture with another as a layer of this name beside it.
pub(super) fn beside(image: Image, other: &Image, name: &str) -> Image {
    let names: Vec<String> =
        image.channels.iter().cloned().chain(["R", "G", "B"].map(|c| format!("{name}.{c}"))).collect();
    let n = image.channels.len();
    let pixels = image.data.chunks_exact(n).zip(other.data.chunks_exact(3));
    let data = pixels.flat_map(|(a, b)| a.iter().chain(b).copied()).collect();
    Image { channels: names, data, ..image }
}

/// The picture, from column `from` on the reference.
pub(super) fn split(image: &Image, reference: &Image, from: usize) -> Image {
    let mut out = Image::rgb(image.width, image.height);
    for y in 0..image.height {
        for x in 0..image.width {
            let source = if x < from { image } else { reference };
            out.pixel_mut(x, y).copy_from_slice(&source.pixel(x, y)[..3]);
        }
    }
    out
}
