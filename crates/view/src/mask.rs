//! Masks that are painted in the window with a brush, on the picture or on a surface that is seen in it.

use crate::ink::Ink;
use glam::Vec2;
use std::sync::Arc;
use yugen_ink::mask::brush::{MaskBrush, MaskStroke};
use yugen_ink::mask::map::MaskMap;
use yugen_ink::mask::{Grey, Ground, Mask};
use yugen_ink::steering::Changes;

/// Pixels down of a mask that is begun on the picture; as many across as the picture is wider.
const LINES: usize = 540;
/// Pixels across and down of one that is begun on a surface.
const SURFACE: usize = 1024;
/// Radius of the brush, pixels of a picture of 1080 lines: least and most.
pub const RADII: [f32; 2] = [4.0, 540.0];
/// Least strength of the brush; the most is one.
pub const WEAKEST: f32 = 0.05;
/// Most bytes of masks as they were: each stroke that can be undone keeps one.
const KEPT: usize = 128 << 20;

/// What becomes of masks.
#[derive(Clone, Debug, PartialEq)]
pub enum MaskChange {
    /// The one of this name is painted from now on; where there is none one is begun, on this or on the picture.
    Paint(String, Option<Ground>),
    /// One is begun, on the object or material that is looked at, else on the picture.
    New,
    /// The next one is painted.
    Next,
    /// None is.
    Off,
    /// The one that is painted is no more.
    Remove,
    /// Where it is white a control has this value, or what it has without the mask.
    Set(String, Option<f32>),
    /// The brush goes along a way.
    Draw(MaskWay),
    /// The radius of the brush, pixels of a picture of 1080 lines.
    Radius(f32),
    /// So many times as large.
    Larger(f32),
    /// How much of the way to white, or to black, a stroke goes: 0 to 1.
    Strength(f32),
    /// So much stronger.
    Stronger(f32),
    /// It erases; the other where absent.
    Erase(Option<bool>),
    /// As it was before the last stroke.
    Undo,
}

/// Where a brush goes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MaskWay {
    /// Places of the picture, in parts of it across and down.
    pub places: Vec<[f32; 2]>,
    /// It goes on from the way before.
    pub goes_on: bool,
    /// It erases where it would paint, and the other way round.
    pub inverted: bool,
}

/// What masks are painted with, and which.
#[derive(Clone, Debug)]
pub struct MaskTable {
    /// The name of the one that is painted.
    pub mask: Option<String>,
    /// The radius of the brush, pixels of a picture of 1080 lines.
    pub radius: f32,
    /// How much of the way to white, or to black, a stroke goes: 0 to 1.
    pub strength: f32,
    /// To black.
    pub erases: bool,
    /// Width of the picture over its height.
    pub aspect: f32,
    /// Where the mask that is painted is seen, if it lies on a surface; or why that is not known.
    pub map: Result<Arc<MaskMap>, String>,
    /// The way of the last stroke, and its radius: it is shown until it is painted.
    pub way: (Vec<[f32; 2]>, f32),
    /// Names of masks that were begun or painted here, so that their pictures are not those of files.
    pub own: Vec<String>,
    stroke: Option<MaskStroke>,
    before: Vec<(String, Arc<Grey>)>,
}

/// Why nothing can be painted on a surface that is not seen yet.
const UNSEEN: &str = "the surface is not painted yet from here: draw on it when it is";

impl Default for MaskTable {
    fn default() -> Self {
        Self {
            mask: None,
            radius: 90.0,
            strength: 1.0,
            erases: false,
            aspect: 16.0 / 9.0,
            map: Err(UNSEEN.into()),
            way: Default::default(),
            own: Vec::new(),
            stroke: None,
            before: Vec::new(),
        }
    }
}

impl MaskTable {
    /// Whether there is a stroke to be undone.
    pub fn can_undo(&self) -> bool {
        !self.before.is_empty()
    }

    /// No mask is painted.
    pub fn put_down(&mut self) {
        (self.mask, self.stroke, self.map) = (None, None, Err(UNSEEN.into()));
        self.way.0.clear();
    }

    /// Nothing is left of masks that were not begun or painted here.
    pub fn keep_own(&mut self) {
        if self.mask.as_ref().is_some_and(|name| !self.own.contains(name)) {
            self.put_down();
        }
        self.before.retain(|(name, _)| self.own.contains(name));
    }

    /// Nothing is left of another scene.
    pub fn clear(&mut self) {
        self.put_down();
        self.before.clear();
        self.own.clear();
    }

    /// What a surface that is painted is seen as.
    pub fn see(&mut self, map: Option<Result<Arc<MaskMap>, String>>) {
        self.map = map.unwrap_or_else(|| Err(UNSEEN.into()));
    }

    fn touch(&mut self, name: &str) {
        if !self.own.iter().any(|known| known == name) {
            self.own.push(name.into());
        }
    }
}

impl Ink {
    /// The mask that is painted.
    pub fn mask(&self) -> Option<&Mask> {
        let name = self.masks.mask.as_ref()?;
        self.style.steering.masks.iter().find(|m| m.name == *name)
    }

    /// On what a mask is begun: the object or material that is looked at, else the picture.
    pub fn ground(&self) -> Ground {
        match &self.subject {
            Some((subject, name)) => subject.ground(name),
            None => Ground::Picture,
        }
    }

    /// A name that no mask has.
    pub fn free_name(&self) -> String {
        let taken = |name: &str| self.style.steering.masks.iter().any(|m| m.name == name);
        (1..).map(|n| format!("mask-{n}")).find(|name| !taken(name)).unwrap_or_default()
    }

    /// Changes masks.
    pub fn change_mask(&mut self, change: &MaskChange) -> Result<(), String> {
        let table = &mut self.masks;
        match change {
            MaskChange::Paint(name, on) => self.paint_mask(name, on.clone())?,
            MaskChange::New => self.paint_mask(&self.free_name(), Some(self.ground()))?,
            MaskChange::Next => {
                let all = &self.style.steering.masks;
                let now = table.mask.as_ref().and_then(|name| all.iter().position(|m| m.name == *name));
                let next = all.get(now.map_or(0, |i| i + 1) % all.len().max(1)).map(|m| m.name.clone());
                match next {
                    Some(name) => self.paint_mask(&name, None)?,
                    None => self.paint_mask(&self.free_name(), Some(self.ground()))?,
                }
            }
            MaskChange::Off => table.put_down(),
            MaskChange::Radius(radius) => table.radius = radius.clamp(RADII[0], RADII[1]),
            MaskChange::Larger(factor) => table.radius = (table.radius * factor).clamp(RADII[0], RADII[1]),
            MaskChange::Strength(strength) => table.strength = strength.clamp(WEAKEST, 1.0),
            MaskChange::Stronger(by) => table.strength = (table.strength + by).clamp(WEAKEST, 1.0),
            MaskChange::Erase(on) => table.erases = on.unwrap_or(!table.erases),
            MaskChange::Undo => {
                let (name, picture) =
                    table.before.pop().ok_or("no stroke of a mask is left that could be undone")?;
                if let Some(mask) = self.style.steering.masks.iter_mut().find(|m| m.name == name) {
                    mask.picture = picture;
                }
                table.stroke = None;
                table.way.0.clear();
                self.changes += 1;
            }
            MaskChange::Remove | MaskChange::Set(..) | MaskChange::Draw(_) => {
                let name = table.mask.clone();
                let at = name.and_then(|name| self.style.steering.masks.iter().position(|m| m.name == name));
                let at = at.ok_or("no mask is painted: begin one by `mask new`")?;
                self.change_painted(at, change)?;
            }
        }
        Ok(())
    }

    /// Changes the mask of this index, which is the one that is painted.
    fn change_painted(&mut self, at: usize, change: &MaskChange) -> Result<(), String> {
        let (table, mask) = (&mut self.masks, &mut self.style.steering.masks[at]);
        match change {
            MaskChange::Remove => {
                table.before.retain(|(name, _)| *name != mask.name);
                table.own.retain(|name| *name != mask.name);
                table.put_down();
                self.style.steering.masks.remove(at);
            }
            MaskChange::Set(control, Some(value)) => {
                mask.changes.of_object(control, *value).map_err(|e| e.to_string())?;
            }
            MaskChange::Set(control, None) => mask.changes.remove(control),
            MaskChange::Draw(way) => table.draw(mask, way)?,
            _ => return Ok(()),
        }
        self.changes += 1;
        Ok(())
    }

    fn paint_mask(&mut self, name: &str, on: Option<Ground>) -> Result<(), String> {
        let masks = &mut self.style.steering.masks;
        match (masks.iter().find(|m| m.name == name), on) {
            (Some(known), Some(on)) if known.on != on => {
                return Err(format!("the mask '{name}' lies on {}, not on {on}: name another", known.on));
            }
            (Some(_), _) => {}
            (None, on) => {
                let on = on.unwrap_or_default();
                let size = match on {
                    Ground::Picture => [(LINES as f32 * self.masks.aspect).round() as usize, LINES],
                    _ => [SURFACE; 2],
                };
                // Where it is white nothing is painted, until something else is said.
                let mut changes = Changes::default();
                changes.of_object("ink", 0.0).map_err(|e| e.to_string())?;
                masks.push(Mask { name: name.into(), picture: Arc::new(Grey::black(size)), on, changes });
                self.masks.touch(name);
            }
        }
        if self.masks.mask.as_deref() != Some(name) {
            self.masks.put_down();
            self.masks.mask = Some(name.into());
        }
        self.changes += 1;
        Ok(())
    }
}

impl MaskTable {
    fn draw(&mut self, mask: &mut Mask, way: &MaskWay) -> Result<(), String> {
        let map = match mask.on {
            Ground::Picture => None,
            _ => Some(self.map.clone()?),
        };
        let fits = |map: &Arc<MaskMap>| *map.on() == mask.on && map.size() == mask.picture.size();
        if map.as_ref().is_some_and(|map| !fits(map)) {
            return Err(UNSEEN.into());
        }
        if !way.goes_on || self.stroke.is_none() {
            self.before.push((mask.name.clone(), mask.picture.clone()));
            // The oldest are forgotten, the last is not.
            let mut bytes = 0;
            let many = self.before.iter().rev().take_while(|(_, grey)| {
                bytes += grey.bytes();
                bytes <= KEPT
            });
            let old = self.before.len() - many.count().max(1);
            self.before.drain(..old);
            let brush = MaskBrush {
                radius: self.radius / 1080.0,
                strength: self.strength,
                erases: self.erases != way.inverted,
            };
            self.stroke = Some(MaskStroke::new(brush, &mask.picture));
            self.way = (Vec::new(), self.radius);
            self.touch(&mask.name);
        }
        let places: Vec<Vec2> = way.places.iter().map(|p| Vec2::from(*p)).collect();
        let ways: Vec<[Vec2; 2]> = match places[..] {
            [one] => vec![[one; 2]],
            _ => places.windows(2).map(|w| [w[0], w[1]]).collect(),
        };
        self.way.0.extend(&way.places);
        if let Some(stroke) = &mut self.stroke {
            let grey = Arc::make_mut(&mut mask.picture);
            ways.into_iter().for_each(|way| stroke.draw(grey, way, self.aspect, map.as_deref()));
        }
        Ok(())
    }
}

/// What the pictures of masks are called beside a preset whose file has this stem, each by its own name.
pub fn file_names(stem: &str, masks: &[String]) -> Vec<String> {
    let plain = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
    let mut all: Vec<String> = Vec::new();
    for mask in masks {
        let name = format!("{stem}-{}", mask.chars().map(plain).collect::<String>());
        let numbered = (1..).map(|n| if n == 1 { format!("{name}.png") } else { format!("{name}-{n}.png") });
        all.extend(numbered.into_iter().find(|name| !all.contains(name)));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ink::Subject;

    fn draw(x: f32) -> MaskChange {
        MaskChange::Draw(MaskWay { places: vec![[x, 0.5]], ..MaskWay::default() })
    }

    fn at(ink: &Ink, x: f32) -> f32 {
        ink.mask().expect("one is painted").picture.at(Vec2::new(x, 0.5), false)
    }

    #[test]
    fn a_mask_is_begun_painted_erased_and_undone() {
        let mut ink = Ink::default();
        ink.masks.aspect = 2.0;
        let said = |ink: &mut Ink, change: &MaskChange| ink.change_mask(change).unwrap_err();
        assert!(said(&mut ink, &draw(0.5)).contains("no mask is painted"));
        ink.change_mask(&MaskChange::New).unwrap();
        let mask = ink.mask().unwrap();
        assert_eq!(
            (mask.name.as_str(), &mask.on, mask.picture.size()),
            ("mask-1", &Ground::Picture, [1080, 540])
        );
        assert_eq!(mask.changes.iter().collect::<Vec<_>>(), [("ink", 0.0)]);
        ink.change_mask(&MaskChange::Radius(108.0)).unwrap();
        let changes = ink.changes;
        ink.change_mask(&draw(0.25)).unwrap();
        let on =
            MaskWay { places: vec![[0.25, 0.5], [0.3, 0.5], [0.32, 0.5]], goes_on: true, inverted: false };
        ink.change_mask(&MaskChange::Draw(on)).unwrap();
        assert_eq!([at(&ink, 0.25), at(&ink, 0.32), at(&ink, 0.75)], [1.0, 1.0, 0.0]);
        // The modifier erases once, a switch until it is another.
        let other = MaskWay { places: vec![[0.25, 0.5]], inverted: true, ..MaskWay::default() };
        ink.change_mask(&MaskChange::Draw(other)).unwrap();
        assert_eq!(at(&ink, 0.25), 0.0);
        ink.change_mask(&MaskChange::Undo).unwrap();
        ink.change_mask(&MaskChange::Erase(None)).unwrap();
        ink.change_mask(&MaskChange::Strength(0.4)).unwrap();
        ink.change_mask(&draw(0.25)).unwrap();
        assert!((at(&ink, 0.25) - 0.6).abs() < 0.003);
        ink.change_mask(&MaskChange::Undo).unwrap();
        assert_eq!([at(&ink, 0.25), at(&ink, 0.32)], [1.0, 1.0]);
        ink.change_mask(&MaskChange::Undo).unwrap();
        assert_eq!((at(&ink, 0.25), ink.changes - changes), (0.0, 7));
        assert!(said(&mut ink, &MaskChange::Undo).contains("no stroke of a mask"));
        // Controls of it, and the brush's own bounds.
        let set = |name: &str, value| MaskChange::Set(name.into(), value);
        assert!(said(&mut ink, &set("bleed", Some(0.0))).contains("of the whole sheet"));
        ink.change_mask(&set("wash", Some(0.2))).unwrap();
        ink.change_mask(&set("ink", None)).unwrap();
        assert_eq!(ink.mask().unwrap().changes.iter().collect::<Vec<_>>(), [("wash", 0.2)]);
        ink.change_mask(&MaskChange::Larger(100.0)).unwrap();
        ink.change_mask(&MaskChange::Stronger(-9.0)).unwrap();
        assert_eq!((ink.masks.radius, ink.masks.strength), (540.0, WEAKEST));
    }

    #[test]
    fn masks_have_their_own_strokes_and_outlive_presets() {
        let mut ink = Ink::default();
        ink.change_mask(&MaskChange::New).unwrap();
        ink.change_mask(&draw(0.5)).unwrap();
        ink.subject = Some((Subject::Material, "red clay".into()));
        ink.change_mask(&MaskChange::New).unwrap();
        let mask = ink.mask().unwrap();
        assert_eq!(
            (mask.name.as_str(), mask.on.to_string(), mask.picture.size()),
            ("mask-2", "material.red clay".into(), [1024; 2])
        );
        assert!(ink.change_mask(&draw(0.5)).unwrap_err().contains("not painted yet from here"));
        // A stroke of another mask is undone there.
        ink.change_mask(&MaskChange::Undo).unwrap();
        ink.change_mask(&MaskChange::Next).unwrap();
        assert_eq!((ink.mask().unwrap().name.as_str(), at(&ink, 0.5)), ("mask-1", 0.0));
        let other = MaskChange::Paint("mask-1".into(), Some(Ground::Object("a".into())));
        assert!(ink.change_mask(&other).unwrap_err().contains("lies on picture, not on object.a"));
        ink.change_mask(&draw(0.5)).unwrap();
        ink.choose(Some("dry")).unwrap();
        assert_eq!(ink.style.steering.masks.len(), 2, "what was painted stays with another preset");
        ink.change_mask(&MaskChange::Remove).unwrap();
        assert!(ink.mask().is_none() && ink.style.steering.masks.len() == 1 && ink.masks.own == ["mask-2"]);
        assert!(ink.change_mask(&MaskChange::Undo).is_err());
        ink.forget_scene();
        assert!(ink.style.steering.masks.is_empty() && ink.masks.own.is_empty());
        ink.change_mask(&MaskChange::Next).unwrap();
        assert_eq!(ink.mask().unwrap().on, Ground::Picture, "nothing is looked at in another scene");
    }

    #[test]
    fn old_strokes_are_forgotten_where_they_are_too_many() {
        let mut ink = Ink::default();
        ink.subject = None;
        ink.masks.aspect = 2.0;
        ink.change_mask(&MaskChange::New).unwrap();
        let bytes = ink.mask().unwrap().picture.bytes();
        for _ in 0..KEPT / bytes + 4 {
            ink.change_mask(&draw(0.5)).unwrap();
        }
        assert_eq!(ink.masks.before.len(), KEPT / bytes);
    }

    #[test]
    fn pictures_are_named_apart() {
        let names = ["a/b c", "a_b_c", "松", "x"].map(String::from);
        assert_eq!(
            file_names("own", &names),
            ["own-a_b_c.png", "own-a_b_c-2.png", "own-松.png", "own-x.png"]
        );
    }
}
