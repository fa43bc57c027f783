//! Parts are closed, and the geometry is as long and wide as the table says.

use glam::Vec3;
use yugen_noh::solid::{Solids, check_closed};
use yugen_noh::{
    DIMENSIONS, FIRE_CANDELA, Finish, FireLight, Hour, MeasuredAt, PRESETS, Part, Preset, Robe, Stage,
};

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

/// Maps of one texel, 10 mm wide.
fn robe() -> Robe {
    let texel = yugen_reflectance::btf::Texel {
        diffuse: Vec3::splat(0.3),
        specular: Vec3::splat(0.2),
        normal: Vec3::Z,
        tangent: Vec3::X,
        sigma: glam::Vec2::new(0.3, 0.2),
        confidence: 1.0,
    };
    let colour_space = yugen_optics::ColourSpace::default();
    let maps = yugen_reflectance::btf::Btf { width: 1, height: 1, colour_space, texels: vec![texel] };
    Robe::new(maps.into(), 0.01, "ward_gmd").unwrap()
}

/// Area of a triangle in space, and of its place on the cloth, negative where that is mirrored.
fn areas(part: &Part, t: &[u32; 3]) -> [f32; 2] {
    let [a, b, c] = t.map(|i| part.mesh.positions[i as usize]);
    let [u, v, w] = t.map(|i| part.mesh.uvs[i as usize]);
    [0.5 * (b - a).cross(c - a).length(), -0.5 * (v - u).perp_dot(w - u)]
}

#[test]
fn a_robe_is_as_long_and_wide_as_the_table_says() {
    for changes in [
        &[][..],
        &[("robe_length", 1.25), ("robe_half_span", 0.66), ("robe_sleeve", 0.45), ("rack_height", 1.5)],
    ] {
        let preset = Preset::find("national").unwrap();
        let mut d = preset.dimensions();
        for (key, value) in changes {
            d.set(key, *value).unwrap();
        }
        let stage = Stage::new(preset, d.clone()).unwrap().with_robe(robe());
        let near = |key: &str, found: f32| {
            assert!((found - d.get(key)).abs() < 0.01, "{key}: {found} instead of {}", d.get(key));
        };
        let at = |id: &str| bounds(part(&stage, id));
        // Along the sleeves' top the cloth is flat.
        near("robe_half_span", at("sode-migi")[1].x);
        near("robe_half_span", -at("sode-hidari")[0].x);
        // From the top over the quarter of a circle, 25 mm in radius, that the shoulder is.
        let shoulder = 0.025 * (std::f32::consts::FRAC_PI_2 - 1.0);
        for id in ["ushiro-migoro-migi", "ushiro-migoro-hidari", "mae-migoro-migi", "mae-migoro-hidari"] {
            near("robe_length", at(id)[1].y - at(id)[0].y + shoulder);
        }
        near("robe_sleeve", at("sode-migi")[1].y - at("sode-migi")[0].y + shoulder);
        // The floor below the rack is a centimetre higher than in the middle; the robe is 4 mm thick on the rail.
        let floor = stage.layout().floor(middle(part(&stage, "iko")).z);
        near("rack_height", at("sode-migi")[1].y - 0.004 - floor);
        let posts: Vec<f32> = part(&stage, "iko").mesh.positions.iter().map(|p| p.x.abs()).collect();
        let inner =
            posts.iter().filter(|x| **x > at("sode-migi")[1].x + 0.01).fold(f32::MAX, |m, x| m.min(*x));
        near("rack_width", 2.0 * inner + 0.008);
        // It is sewn on 4 mm below the shoulder and stands nearly upright.
        near("robe_collar", at("eri")[1].y - at("sode-migi")[1].y + 0.004);
        assert!(at("uraji")[0].y > floor + 0.05, "it lies on the floor");
    }
}

/// Warp runs down, weft across, in metres: a square metre of (u, v) is one of cloth, and no cloth is seen in a mirror. Each panel begins elsewhere on the bolt.
#[test]
fn the_cloth_of_a_robe_lies_straight_on_its_grain() {
    let stage = Stage::preset("national").unwrap().with_robe(robe());
    let mut offsets = Vec::new();
    for part in stage.parts().iter().filter(|p| p.finish == Finish::Cloth) {
        check_closed(&part.mesh).unwrap();
        let mesh = &part.mesh;
        let (mut on_cloth, mut in_space, mut worst) = (0.0, 0.0, 0.0f32);
        for t in &mesh.triangles {
            let [space, cloth] = areas(part, t);
            // The rim, 0.7 mm wide, has no grain, and the inner side is the cloth from behind.
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            if cloth <= 0.0 || 2.0 * space / longest < 1e-3 {
                continue;
            }
            let [u, v, w] = t.map(|i| mesh.uvs[i as usize]);
            // dp/du and dp/dv of the triangle.
            let m = glam::Mat2::from_cols(v - u, w - u).inverse();
            let du = (b - a) * m.x_axis.x + (c - a) * m.x_axis.y;
            let dv = (b - a) * m.y_axis.x + (c - a) * m.y_axis.y;
            if part.id != "eri" {
                // Weft across, warp up the front, over the shoulder and down the back.
                assert!(du.x > 0.5 && dv.x.abs() < 0.3, "{}: {du} {dv}", part.id);
                assert!(dv.y > 0.6 || dv.y < -0.6 || dv.z > 0.6, "{}: {dv}", part.id);
            }
            worst = worst.max((du.length() - 1.0).abs()).max((dv.length() - 1.0).abs());
            on_cloth += cloth;
            in_space += space;
        }
        // Areas differ by 0.3 % at most; single triangles beside seams and folds by 13 %. The collar turns around the neck.
        assert!((in_space / on_cloth - 1.0f32).abs() < 0.01, "{}: {in_space} m2 of {on_cloth}", part.id);
        assert!(part.id == "eri" || worst < 0.3, "{}: {worst}", part.id);
        offsets.push(mesh.uvs[0]);
    }
    assert_eq!(offsets.len(), 9);
    for (i, a) in offsets.iter().enumerate() {
        assert!(offsets[..i].iter().all(|b| a.distance(*b) > 0.01));
    }
}

/// Where a ray first meets a part of the stage.
fn first(stage: &Stage, from: Vec3, way: Vec3) -> Option<(f32, &Part)> {
    let mut best: Option<(f32, &Part)> = None;
    for part in stage.parts() {
        for t in &part.mesh.triangles {
            let [a, b, c] = t.map(|i| part.mesh.positions[i as usize]);
            let n = (b - a).cross(c - a);
            let far = (a - from).dot(n) / way.dot(n);
            let p = from + way * far;
            let inside = [(a, b), (b, c), (c, a)].iter().all(|(a, b)| (*b - *a).cross(p - *a).dot(n) >= 0.0);
            if inside && far > 0.0 && best.is_none_or(|b| far < b.0) {
                best = Some((far, part));
            }
        }
    }
    best
}

#[test]
fn near_views_of_the_robe_see_its_cloth_and_fires_do() {
    let stage = Stage::preset("national").unwrap();
    assert!(!stage.cameras().iter().any(|c| c.name.starts_with("robe")));
    let parts = stage.parts().len();
    let stage = stage.with_robe(robe());
    let cameras = stage.cameras();
    let mut widths = Vec::new();
    for name in ["robe", "robe_near", "thread"] {
        let camera = cameras.iter().find(|c| c.name == name).unwrap();
        let (from, way) = (camera.to_world.w_axis.truncate(), camera.to_world.z_axis.truncate());
        let (far, part) = first(&stage, from, way).unwrap();
        assert_eq!(part.finish, Finish::Cloth, "{name} sees {}", part.id);
        let yugen_scene::Projection::Perspective { fov_x, .. } = camera.projection else { panic!("{name}") };
        widths.push(2.0 * far * (0.5 * fov_x).tan());
    }
    // The whole rack; a forearm; a few centimetres.
    assert!(
        widths[0] > 2.0 && (0.3..0.6).contains(&widths[1]) && (0.02..0.06).contains(&widths[2]),
        "{widths:?}"
    );
    // No pillar stands between the back of the robe and the fires at the front corners.
    for fire in &stage.fires()[..2] {
        for x in [-0.3, 0.0, 0.3] {
            let from = fire.foot + Vec3::Y * 0.3;
            let to =
                Vec3::new(x, 1.0, cameras.iter().find(|c| c.name == "robe").unwrap().to_world.w_axis.z - 4.2);
            let (_, part) = first(&stage, from, (to - from).normalize()).unwrap();
            assert_eq!(part.finish, Finish::Cloth, "{} is in the way", part.id);
        }
    }
    // Another robe takes the place of the first.
    let hung = stage.parts().len();
    assert!(hung > parts && stage.with_robe(robe()).parts().len() == hung);
}

#[test]
fn a_cloth_that_makes_no_robe_is_refused_with_the_reason() {
    let maps = || yugen_reflectance::btf::Btf {
        width: 0,
        height: 0,
        colour_space: yugen_optics::ColourSpace::default(),
        texels: Vec::new(),
    };
    let say = |width: f32, form: &str| Robe::new(maps().into(), width, form).unwrap_err().to_string();
    assert!(say(0.03, "blin_phong").contains("did you mean 'blinn_phong'?"));
    assert!(say(0.03, "ashikhmin2000").contains("no form 'ashikhmin2000'"));
    for width in [0.0, -1.0, f32::NAN, f32::INFINITY, 100.0] {
        assert!(say(width, "ggx").contains("from 0.1 to 10000 mm"));
    }
}

/// Maps of many texels make other textures coarser, the floor's last: all must fit into what a WebGPU device binds.
#[test]
fn textures_make_room_for_the_maps_of_a_robe() {
    let bytes = |stage: Stage| -> (usize, usize) {
        let scene = stage.scene(Hour::Night, FireLight::Out).unwrap();
        let of = |t: &yugen_scene::Texture| match t {
            yugen_scene::Texture::Image { image, .. } => image.width * image.height * 16 * 4 / 3,
            yugen_scene::Texture::Cloth { maps, .. } => maps.texels.len() * 48 * 4 / 3,
            other => panic!("{other:?}"),
        };
        let largest = |t: &yugen_scene::Texture| match t {
            yugen_scene::Texture::Image { image, .. } => image.width * image.height,
            _ => 0,
        };
        (scene.textures.iter().map(of).sum(), scene.textures.iter().map(largest).max().unwrap())
    };
    let stage = || Stage::preset("national").unwrap();
    let mut maps = yugen_reflectance::btf::Btf {
        width: 600,
        height: 600,
        colour_space: yugen_optics::ColourSpace::default(),
        texels: Vec::new(),
    };
    let texel = yugen_reflectance::btf::Texel {
        diffuse: Vec3::ZERO,
        specular: Vec3::ZERO,
        normal: Vec3::Z,
        tangent: Vec3::X,
        sigma: glam::Vec2::splat(0.3),
        confidence: 1.0,
    };
    maps.texels = vec![texel; 600 * 600];
    let (bare, floor) = bytes(stage());
    let (hung, largest) = bytes(stage().with_robe(Robe::new(maps.into(), 0.03, "ggx").unwrap()));
    assert!(bare + 600 * 600 * 64 > 128 << 20, "it would fit anyway: {bare}");
    assert!(hung < 124 << 20 && largest == floor, "{} MiB, {largest}", hung >> 20);
}
