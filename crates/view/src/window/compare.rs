//! Two pictures in one: the reference, or a painting by another method, beside the one that is shown.

use super::stage::same_view;
use super::{App, Wake};
use crate::reference::{Reference, difference};
use std::sync::mpsc;
use std::time::{Duration, Instant};
use winit::event_loop::ActiveEventLoop;
use yugen_optics::Image;
use yugen_optics::tonemap::ToneMap;
use yugen_scene::Camera;

/// Between two comparisons with the reference, at least.
pub(super) const COMPARE: Duration = Duration::from_millis(1500);

impl App {
    /// Starts, restarts and ends the reference, and shows what it has found.
    pub(super) fn refine(&mut self) {
        if !self.state.reference {
            (self.reference, self.reference_of, self.finding) = (None, None, None);
            (self.seen.reference, self.seen.difference, self.seen.samples) = (None, None, 0.0);
            self.comparing = None;
            return;
        }
        let Some(view) = self.view(true) else { return };
        let same =
            |(changes, camera): &(u64, Camera)| *changes == self.shown_changes && same_view(camera, &view);
        if !self.reference_of.as_ref().is_some_and(same) {
            // What it has found is of another picture, and what is being compared as well.
            (self.reference, self.reference_of, self.finding) = (None, None, None);
            self.comparing = None;
            (self.seen.reference, self.seen.difference, self.seen.samples) = (None, None, 0.0);
            if self.at_rest() && self.shown_changes == self.state.changes && self.frames > 0 {
                let wake = self.proxy.clone();
                let bounces = self.state.most_bounces();
                self.reference = Some(Reference::start(&self.changed_scene, &view, bounces, move || {
                    // The loop may have ended.
                    drop(wake.send_event(Wake::Thread));
                }));
                self.reference_of = Some((self.shown_changes, view));
                self.compared_number = 0;
            }
        }
        let Some(graphics) = &mut self.graphics else { return };
        let settings = graphics.settings(&self.state);
        match self.reference.as_ref().and_then(Reference::take) {
            Some(Err(problem)) => {
                self.state.reference = false;
                self.state.complain(problem);
            }
            Some(Ok(finding)) => {
                graphics.set_reference(&finding.image);
                self.seen.samples = finding.samples;
                self.seen.reference = graphics.reference();
                self.finding = Some(finding);
            }
            None => {}
        }
        if self.finding.is_some() {
            graphics.show_reference(settings);
        }
    }

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
