//! Layers of a picture: channels whose names share what stands before the last dot.

use yugen_optics::Image;

/// The layers that hold a colour (`NAME.R`, `NAME.G`, `NAME.B`), in their order.
pub fn colour_layers(image: &Image) -> Vec<&str> {
    let has = |layer: &str, c: &str| image.channel(&format!("{layer}.{c}")).is_some();
    let named = image.channels.iter().filter_map(|c| c.strip_suffix(".R"));
    named.filter(|layer| has(layer, "G") && has(layer, "B")).collect()
}

/// The layer that is meant where none is named and the picture has no colour of its own: what Blender calls the finished
/// picture, or the only one that is a colour.
pub fn default_layer(image: &Image) -> Option<&str> {
    if ["R", "Y", "X"].iter().any(|c| image.channel(c).is_some()) {
        return None;
    }
    let layers = colour_layers(image);
    let called = |end: &str| layers.iter().find(|l| l.ends_with(end)).copied();
    called("Composite.Combined").or_else(|| called(".Combined")).or(match layers[..] {
        [only] => Some(only),
        _ => None,
    })
}

/// One layer as a picture of its own, its channels called as in the layer; `None` where there is no such layer.
pub fn layer(image: &Image, name: &str) -> Option<Image> {
    let channels: Vec<&str> = image
        .channels
        .iter()
        .filter(|c| c.rsplit_once('.').is_some_and(|(layer, _)| layer == name))
        .map(String::as_str)
        .collect();
    if channels.is_empty() {
        return None;
    }
    let mut out = image.select(&channels)?;
    for c in &mut out.channels {
        c.drain(..=name.len());
    }
    Some(out)
}

/// The names of all layers, in the order of their first channels.
pub fn layers(image: &Image) -> Vec<&str> {
    let mut names: Vec<&str> = image.channels.iter().filter_map(|c| Some(c.rsplit_once('.')?.0)).collect();
    names.dedup();
    names
}
