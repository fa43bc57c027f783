//! The one image type inside Yugen: linear `f32`, any number of named channels, top row first.

/// A linear image. `data` holds `height` rows of `width` pixels of `channels.len()` interleaved values.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Image {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Channel names in order, for example `R`, `G`, `B`, `A` or `albedo.R`.
    pub channels: Vec<String>,
    /// Row-major, interleaved, first row at the top.
    pub data: Vec<f32>,
}

impl Image {
    /// A black image.
    pub fn new(width: usize, height: usize, channels: &[&str]) -> Self {
        Self {
            width,
            height,
            channels: channels.iter().map(|c| c.to_string()).collect(),
            data: vec![0.0; width * height * channels.len()],
        }
    }

    /// A black image with channels R, G, B.
    pub fn rgb(width: usize, height: usize) -> Self {
        Self::new(width, height, &["R", "G", "B"])
    }

    /// Index of the first value of pixel (x, y).
    pub fn offset(&self, x: usize, y: usize) -> usize {
        (y * self.width + x) * self.channels.len()
    }

    /// All channels of pixel (x, y).
    pub fn pixel(&self, x: usize, y: usize) -> &[f32] {
        let o = self.offset(x, y);
        &self.data[o..o + self.channels.len()]
    }

    /// All channels of pixel (x, y).
    pub fn pixel_mut(&mut self, x: usize, y: usize) -> &mut [f32] {
        let (o, n) = (self.offset(x, y), self.channels.len());
        &mut self.data[o..o + n]
    }

    /// Position of a channel by its name.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|c| c == name)
    }

    /// The image made of the named channels only, in that order; `None` where one is missing.
    pub fn select(&self, names: &[&str]) -> Option<Self> {
        let at: Vec<usize> = names.iter().map(|n| self.channel(n)).collect::<Option<_>>()?;
        let data = self
            .data
            .chunks_exact(self.channels.len().max(1))
            .flat_map(|p| at.iter().map(|&c| p[c]))
            .collect();
        Some(Self {
            width: self.width,
            height: self.height,
            channels: names.iter().map(|n| n.to_string()).collect(),
            data,
        })
    }
}
