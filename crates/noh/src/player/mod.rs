//! The player (shite): a mask, wig, band, fan, white socks, and white clothes under the robe; each part at the joint
//! of [`yugen_motion::dance::player`] that carries it.

mod body;
mod hannya;
mod ko_omote;
mod mask;

pub use mask::{MASKS, Mask};

pub(crate) fn omote() -> crate::pattern::Surface {
    ko_omote::painting()
}

pub(crate) fn hannya() -> crate::pattern::Surface {
    hannya::painting()
}

use crate::dimension::Basis;
use crate::part::{Finish, Part};
use crate::solid::Solids;
use glam::{Mat4, Vec3};
use std::sync::Arc;
use yugen_motion::dance;
use yugen_motion::garment::Body;
use yugen_scene::Mesh;

/// A part and the joint that carries it.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Name of the joint.
    pub joint: String,
    /// In the joint's coordinates.
    pub part: Part,
}

const SIDES: [(&str, &str, &str, &str); 2] =
    [("left", "hidari", "左", "left"), ("right", "migi", "右", "right")];

/// All parts, with a mask.
pub fn pieces(mask: &Mask) -> Vec<Piece> {
    let mut all = Vec::new();
    let mut add = |joint: &str, names: [&str; 4], finish: Finish, mesh: Mesh| {
        let [id, ja, romaji, en] = names.map(String::from);
        let part = Part {
            id,
            ja,
            romaji,
            en,
            finish,
            mesh: Arc::new(mesh),
            basis: Basis::Assumed,
            dimensions: Vec::new(),
        };
        all.push(Piece { joint: joint.into(), part });
    };
    // High on the face, so that the chin stays free.
    let worn = Mat4::from_translation(Vec3::new(0.0, 0.088, 0.062));
    let put_on = |mut mesh: Mesh| {
        mesh.positions.iter_mut().for_each(|p| *p = worn.transform_point3(*p));
        mesh
    };
    let [ja, romaji, en] = mask.names;
    add("head", ["omote", ja, romaji, en], mask.finish, put_on(mask.solids().mesh("omote")));
    if let Some(horns) = mask.horns {
        add("head", ["tsuno", "角", "tsuno", "horns of the mask"], Finish::Gilt, put_on(horns()));
    }
    add("head", ["katsura", "鬘", "katsura", "wig"], Finish::Hair, body::wig());
    add(
        "head",
        ["kazura-obi", "鬘帯", "kazura-obi", "band over the wig"],
        Finish::Band,
        solid("band", body::band()),
    );
    add("head", ["atama", "頭", "atama", "head"], Finish::Skin, body::head());
    add("neck", ["kubi", "首", "kubi", "neck"], Finish::Skin, body::neck());
    let right = "right_hand";
    add(right, ["ogi", "扇", "ōgi", "fan"], Finish::Fan, solid("fan", body::paper()));
    add(
        right,
        ["ogi-hone", "扇の骨", "ōgi no hone", "ribs of the fan"],
        Finish::Lacquer,
        solid("ribs", body::ribs()),
    );
    for (side, romaji, kanji, english) in SIDES {
        let left = side == "left";
        let names = |id: &str, ja: &str, en: &str| {
            [
                format!("{id}-{romaji}"),
                format!("{ja}（{kanji}）"),
                format!("{id} {romaji}"),
                format!("{english} {en}"),
            ]
        };
        let hand = names("te", "手", "hand");
        add(&format!("{side}_hand"), hand.each_ref().map(String::as_str), Finish::Skin, body::hand(left));
        let foot = names("tabi", "白足袋", "white sock");
        add(&format!("{side}_foot"), foot.each_ref().map(String::as_str), Finish::Under, body::tabi(left));
    }
    // Under the robe: what lies at one joint is one part, as round as what the robe lies on.
    let body = Body::player();
    for (index, joint) in dance::player().into_iter().enumerate() {
        let own: Vec<_> =
            body.capsules.iter().filter(|c| c.joint == index).map(|c| (c.ends, c.radii)).collect();
        let name = joint.name;
        let bare = ["neck", "head"].contains(&&*name) || ["hand", "foot"].iter().any(|e| name.ends_with(e));
        if bare || own.is_empty() {
            continue;
        }
        let id = format!("shitagi-{}", name.replace('_', "-"));
        let en = format!("under-robe, {}", name.replace('_', " "));
        add(&name, [&id, "白練下着", "shitagi", &en], Finish::Under, body::under(&name, &own));
    }
    all
}

fn solid(name: &str, solids: Solids) -> Mesh {
    solids.mesh(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::check_closed;

    #[test]
    fn parts_are_closed_and_at_joints_that_are() {
        let joints = dance::player();
        let pieces: Vec<Piece> = pieces(&MASKS[0]);
        for Piece { joint, part } in &pieces {
            assert!(joints.iter().any(|j| j.name == *joint), "{joint}");
            check_closed(&part.mesh).unwrap_or_else(|e| panic!("{}: {e:?}", part.id));
            assert!(pieces.iter().filter(|p| p.part.id == part.id).count() == 1, "{}", part.id);
            let m = &part.mesh;
            assert!(m.normals.len() == m.positions.len() && m.uvs.len() == m.positions.len(), "{}", part.id);
        }
    }
}
