//! Parts are closed, and the geometry is as long and wide as the table says.

use glam::Vec3;
use yugen_noh::solid::{Solids, check_closed};
use yugen_noh::{DIMENSIONS, FIRE_CANDELA, FireLight, Hour, MeasuredAt, PRESETS, Part, Preset, Stage};

fn part<'a>(stage: &'a Stage, id: &str) -> &'a Part {
    stage.parts().iter().find(|p| p.id == id).unwrap_or_else(|| panic!("no part {id}"))
}

fn bounds(part: &Part) -> [Vec3; 2] {
    let all = part.mesh.positions.iter();
    all.fold([Vec3::MAX, Vec3::MIN], |[low, high], p| [low.min(*p), high.max(*p)])
}

#[test]
fn every_part_of_every_stage_is_closed() {
    for preset in PRESETS {
        let stage = Stage::preset(preset.name).unwrap();
        let mut ids = std::collections::BTreeSet::new();
        for part in stage.parts() {
            if let Err(e) = check_closed(&part.mesh) {
                panic!("{}: {}: {e}", preset.name, part.id);
            }
            assert!(ids.insert(part.id.clone()), "{} twice", part.id);
            let mesh = &part.mesh;
            assert!(mesh.uvs.len() == mesh.positions.len() && mesh.normals.len() == mesh.positions.len());
            assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4), "{}", part.id);
            // Shading normals look to the side that the triangle does.
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
                let face = (b - a).cross(c - a);
                let sum: Vec3 = t.iter().map(|i| mesh.normals[*i as usize]).sum();
                assert!(face.dot(sum) > 0.0, "{}: {}: {a} {b} {c}", preset.name, part.id);
            }
        }
    }
}

#[test]
fn what_is_not_closed_is_found() {
    let stage = Stage::preset("textbook").unwrap();
    let good = &part(&stage, "shite-bashira").mesh;
    check_closed(good).unwrap();
    let mut open = (**good).clone();
    open.triangles.pop();
    assert!(check_closed(&open).is_err());
    let mut turned = (**good).clone();
    turned.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    assert!(check_closed(&turned).is_err());
    let mut torn = (**good).clone();
    torn.positions[0] += Vec3::X * 1e-3;
    assert!(check_closed(&torn).is_err());
    assert!(check_closed(&Solids::new().mesh("")).is_err());
}

fn middle(part: &Part) -> Vec3 {
    let [low, high] = bounds(part);
    0.5 * (low + high)
}

/// Each number of the table that shows in the geometry, read off the meshes, within a centimetre (or a tenth of a degree).
#[test]
fn presets_are_as_long_and_wide_as_the_table_says() {
    for preset in PRESETS {
        let stage = Stage::preset(preset.name).unwrap();
        let d = preset.dimensions();
        let near = |key: &str, found: f32| {
            let unit = DIMENSIONS.iter().find(|d| d.key == key).unwrap().unit;
            let slack = if unit == "degrees" { 0.1 } else { 0.01 };
            assert!(
                (found - d.get(key)).abs() < slack,
                "{}: {key}: {found} instead of {}",
                preset.name,
                d.get(key)
            );
        };
        let at = |id: &str| bounds(part(&stage, id));
        let (shite, metsuke, fue) = (at("shite-bashira"), at("metsuke-bashira"), at("fue-bashira"));
        let (x, z) = match preset.measured_at {
            MeasuredAt::Inside => (fue[0].x - shite[1].x, metsuke[0].z - shite[1].z),
            MeasuredAt::Centre => (fue[0].x - shite[0].x, metsuke[0].z - shite[0].z),
            MeasuredAt::Outside => (fue[1].x - shite[0].x, metsuke[1].z - shite[0].z),
        };
        near("width", x);
        near("depth", z);
        near("pillar", shite[1].x - shite[0].x);
        let corners = &part(&stage, "shite-bashira").mesh.positions;
        let flat = corners.iter().map(|p| p.x).filter(|x| *x < shite[1].x - 1e-4).fold(f32::MIN, f32::max);
        near("pillar_chamfer", shite[1].x - flat);
        near("pillar_height", at("kashira-nuki")[0].y);

        // The main floor: two heights of its surface give the rake and, between them, the height.
        let floor = &part(&stage, "honbutai").mesh.positions;
        let [low, high] = at("honbutai");
        let top =
            |z: f32| floor.iter().filter(|p| (p.z - z).abs() < 1e-3).map(|p| p.y).fold(f32::MIN, f32::max);
        let bottom =
            floor.iter().filter(|p| (p.z - high.z).abs() < 1e-3).map(|p| p.y).fold(f32::MAX, f32::min);
        let (front, rear) = (top(high.z), top(low.z));
        let fall = (rear - front) / (high.z - low.z);
        near("floor_rake", fall.atan().to_degrees());
        let ground = at("niwa")[1].y;
        near("floor_height", rear + fall * low.z - ground);
        near("board_thickness", front - bottom);
        let boards = part(&stage, "honbutai").mesh.triangles.len() / 12;
        assert_eq!(boards as f32, (d.get("width") / d.get("board_width")).round(), "{}", preset.name);
        assert!((0.30..=0.45).contains(&(d.get("width") / boards as f32)));
        near(
            "atoza_depth",
            middle(part(&stage, "shite-bashira")).z - middle(part(&stage, "koken-bashira")).z,
        );
        near("jiutai_width", at("jiutai-za")[1].x - at("jiutai-za")[0].x);

        // The bridge by its last pair of pillars; it begins between the pillars of shite and attendants.
        let last = d.get("bridge_bays") as u32;
        let [a, b] =
            ["front", "rear"].map(|s| middle(part(&stage, &format!("hashigakari-bashira-{last}-{s}"))));
        let root = 0.5 * (middle(part(&stage, "shite-bashira")) + middle(part(&stage, "koken-bashira")));
        let way = 0.5 * (a + b) - root;
        near("bridge_width", a.with_y(0.0).distance(b.with_y(0.0)));
        near("bridge_length", way.with_y(0.0).length());
        near("bridge_angle", (-way.z).atan2(-way.x).to_degrees());
        let head = at(&format!("hashigakari-bashira-{last}-front"))[1].y;
        let end = head - d.get("bridge_pillar_height");
        let fall = ((at("atoza")[1].y - end) / d.get("bridge_length")).atan();
        near("bridge_rake", fall.to_degrees());
        let pairs = stage.parts().iter().filter(|p| p.id.starts_with("hashigakari-bashira-")).count();
        assert_eq!(pairs as f32, 2.0 * d.get("bridge_bays"));
        near("curtain_height", at("agemaku")[1].y - at("agemaku")[0].y);

        let roof = part(&stage, "yane");
        let [low, high] = bounds(roof);
        near("eaves", high.x - middle(part(&stage, "fue-bashira")).x);
        let between = 0.5 * (low.z + high.z);
        let edge = roof.mesh.positions.iter().filter(|p| (p.x - high.x).abs() < 1e-3);
        let nearest = edge.clone().map(|p| (p.z - between).abs()).fold(f32::MAX, f32::min);
        let edge = edge.filter(|p| (p.z - between).abs() < nearest + 1e-4).map(|p| p.y);
        near("bark_thickness", edge.clone().fold(f32::MIN, f32::max) - edge.fold(f32::MAX, f32::min));

        near("steps_width", at("kizahashi")[1].x - at("kizahashi")[0].x - 0.048);
        assert_eq!(part(&stage, "kizahashi").mesh.triangles.len() as f32 / 12.0 - 2.0, d.get("steps"));
        near("gravel_width", at("shirasu")[1].z - at("honbutai")[1].z);
        for (key, id) in
            [("pine_ichi", "ichi-no-matsu"), ("pine_ni", "ni-no-matsu"), ("pine_san", "san-no-matsu")]
        {
            near(key, at(id)[1].y - ground);
        }
        for (i, fire) in stage.fires().iter().enumerate() {
            // Inside of the ring at the rim, 8.5 mm thick.
            let rim = ground + d.get("fire_rim");
            let ring = &part(&stage, &format!("kagaribi-{}", i + 1)).mesh.positions;
            let inner = ring
                .iter()
                .filter(|p| (p.y - rim).abs() < 1e-3)
                .map(|p| p.with_y(0.0).distance(fire.foot.with_y(0.0)))
                .fold(f32::MAX, f32::min);
            near("fire_basket", 2.0 * (inner + 0.0085));
            assert!(fire.diameter == d.get("fire_basket") && (rim - fire.foot.y).abs() < 0.05);
        }
    }
}

#[test]
fn what_cannot_be_is_refused_with_the_reason() {
    let tried = |changes: &[(&str, f32)]| {
        let preset = Preset::find("national").unwrap();
        let mut d = preset.dimensions();
        for (key, value) in changes {
            d.set(key, *value).map_err(|e| e.to_string())?;
        }
        Stage::new(preset, d).map(|_| ()).map_err(|e| e.to_string())
    };
    tried(&[("side", 5.7), ("roof_pitch", 38.0)]).unwrap();
    for (changes, words) in [
        (&[("sid", 5.7)][..], "'sid'; did you mean 'side'?"),
        (&[("side", 9.0)], "width = 9 is out of range"),
        (&[("side", f32::NAN)], "out of range"),
        (&[("bridge_width", 2.8), ("atoza_depth", 2.1)], "needs 2.52 m of the rear seat's side"),
        (&[("curtain_height", 3.2)], "does not hang under beams"),
        (&[("roof_pitch", 45.0), ("roof_curve", 1.0), ("eaves", 1.8)], "the roof would come down to"),
        (&[("jiutai_width", 1.1), ("eaves", 0.9)], "do not cover a chorus seat"),
        (&[("bridge_length", 5.5), ("bridge_bays", 11.0)], "lets a robe pass"),
        (&[("bridge_bays", 2.5)], "a whole number"),
        (&[("steps", 2.0), ("floor_height", 1.0)], "can be climbed"),
        (&[("pine_san", 1.8)], "must not grow"),
    ] {
        match tried(changes) {
            Ok(()) => panic!("{changes:?} was taken"),
            Err(said) => assert!(said.contains(words), "{changes:?}: {said}"),
        }
    }
    let said = Stage::preset("nationel").unwrap_err().to_string();
    assert!(said.contains("did you mean 'national'?"), "{said}");
}

#[test]
fn every_value_lies_in_its_range_and_has_a_source() {
    for preset in PRESETS {
        for (key, ..) in preset.values {
            assert!(DIMENSIONS.iter().any(|d| d.key == *key), "{}: {key}", preset.name);
        }
        for (d, e) in preset.dimensions().iter() {
            assert!((d.min..=d.max).contains(&e.value) && !e.source.is_empty(), "{}: {}", preset.name, d.key);
        }
    }
}

#[test]
fn the_scene_has_seats_and_fires_of_the_stated_strength() {
    let stage = Stage::preset("honganji").unwrap();
    let scene = stage.scene(Hour::Night, FireLight::Balls).unwrap();
    for seat in ["shomen", "waki-shomen", "naka-shomen"] {
        assert!(scene.cameras.iter().any(|c| c.name == seat));
    }
    let fires: Vec<_> = scene.shapes.iter().filter_map(|s| Some((s, s.emission.as_ref()?))).collect();
    assert_eq!(fires.len(), 4);
    for (shape, emission) in fires {
        let yugen_scene::Value::Rgb(radiance) = emission else { panic!("a colour") };
        let radius = shape.to_world.x_axis.truncate().length();
        let candela = scene.working_space.luminance(*radiance) * std::f32::consts::PI * radius * radius;
        assert!((candela / FIRE_CANDELA - 1.0).abs() < 1e-4, "{candela}");
    }
    assert_eq!(scene.materials.len(), 2 * stage.finishes().len());
    // All textures with their pyramids, 16 bytes a texel, fit into what every WebGPU device binds at once.
    let bytes: usize = scene
        .textures
        .iter()
        .map(|t| match t {
            yugen_scene::Texture::Image { image, .. } => image.width * image.height * 16 * 4 / 3,
            other => panic!("{other:?}"),
        })
        .sum();
    assert!(bytes < 124 << 20, "{} MiB", bytes >> 20);
    // The same bits every time.
    let again = Stage::preset("honganji").unwrap();
    for (a, b) in stage.parts().iter().zip(again.parts()) {
        assert!(a.mesh.positions == b.mesh.positions && a.mesh.uvs == b.mesh.uvs, "{}", a.id);
    }
}
