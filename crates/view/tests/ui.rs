//! Panels and overlays through their accessibility tree, without a window.

use egui::accesskit::Toggled;
use egui::{Key, Modifiers, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use glam::{Mat4, Vec3};
use std::path::Path;
use std::sync::Arc;
use yugen_ink::control::CONTROLS;
use yugen_ink::depth::DepthMap;
use yugen_ink::mask::Ground;
use yugen_ink::mask::map::MaskMap;
use yugen_ink::projection::Projection;
use yugen_ink::steering::Names;
use yugen_optics::tonemap::Curve;
use yugen_reflectance::Kind;
use yugen_scene::prepared::Rows;
use yugen_scene::{Geometry, Light, Material, ModelBuilder, Scene, Shape, Value};
use yugen_view::action::ACTIONS;
use yugen_view::command::{Command, LightChange};
use yugen_view::ink::Subject;
use yugen_view::language::Language;
use yugen_view::live::{ClothSettings, Live};
use yugen_view::mask::{MaskChange, MaskWay};
use yugen_view::state::State;
use yugen_view::ui::{Asked, Seen, set_look, show};

struct World {
    state: State,
    seen: Seen,
    done: Vec<Command>,
}

fn harness(language: Language) -> Harness<'static, World> {
    let mut scene = Scene {
        materials: vec![
            Material::lambert(Value::Number(0.5)),
            ModelBuilder::new(Kind::RoughPlastic).build().expect("its defaults"),
        ],
        shapes: vec![
            Shape::new("desk", Geometry::Rectangle, Mat4::IDENTITY, 0),
            Shape::new("ball", Geometry::Sphere, Mat4::IDENTITY, 1),
        ],
        ..Scene::default()
    };
    scene.add_light("lamp", Light::Point { position: Vec3::ONE, intensity: Vec3::ONE });
    scene.add_light("", Light::Constant { radiance: Vec3::ONE });
    let world = World {
        state: State::new(scene, Path::new("ball.toml"), language),
        seen: Seen { adapter: "a GPU".into(), japanese: language == Language::Japanese, ..Seen::default() },
        done: Vec::new(),
    };
    let builder =
        Harness::builder().with_size(Vec2::new(1100.0, 900.0)).with_context_setup(|ctx| set_look(ctx, None));
    // The tests bring no font with Japanese characters.
    let builder = if language == Language::English { builder } else { builder.allow_missing_glyphs() };
    builder.build_ui_state(
        |ui, world: &mut World| {
            let Asked { commands, .. } = show(ui, &world.state, &world.seen);
            for command in commands {
                world.state.apply(&command).unwrap_or_else(|e| panic!("{command:?}: {e}"));
                world.done.push(command);
            }
        },
        world,
    )
}

/// Cloth that is where it is.
struct Still;

impl Live for Still {
    fn clip(&self) -> Option<String> {
        None
    }

    fn rate(&self) -> f64 {
        10.0
    }

    fn settings(&self) -> ClothSettings {
        ClothSettings { fabric: "silk".into(), wind: Vec3::ZERO }
    }

    fn fabrics(&self) -> Vec<&'static str> {
        vec!["silk", "hemp"]
    }

    fn most_wind(&self) -> f32 {
        100.0
    }

    fn play(
        &mut self,
        _: &mut Scene,
        seconds: f32,
        _: &ClothSettings,
        _: std::time::Duration,
    ) -> Result<f32, String> {
        Ok(seconds)
    }
}

#[test]
fn simulated_cloth_has_a_fabric_and_a_wind() {
    let mut h = harness(Language::English);
    assert!(h.query_by_label("fabric").is_none(), "nothing is cloth");
    let state = &mut h.state_mut().state;
    state.clips = vec![("cache".into(), [0.0, 0.0])];
    state.set_live(Some(Box::new(Still)));
    assert_eq!(state.moment(), Some(("cache".into(), 0.0)));
    state.go_on(1.26);
    assert_eq!(state.moment(), Some(("cache".into(), 1.3)), "a frame that is computed");
    state.go_on(60.0);
    assert_eq!(state.moment(), Some(("cache".into(), 1.3)), "a minute, again and again");
    h.run();
    h.get_by_role_and_label(egui::Role::ComboBox, "fabric").click();
    h.run();
    h.get_by_label("hemp").click();
    h.run();
    h.get_by_label("wind, m/s z").focus();
    h.key_press(Key::ArrowUp);
    h.run();
    let settings = h.state().state.live.as_ref().map(|live| live.settings.clone()).expect("cloth");
    assert!(settings.fabric == "hemp" && settings.wind.z > 0.0 && settings.wind.x == 0.0, "{settings:?}");
}

#[test]
fn lights_and_materials_are_changed_by_hand() {
    let mut h = harness(Language::English);
    let lamp = h.get_by_role_and_label(egui::Role::CheckBox, "lamp");
    assert_eq!(lamp.accesskit_node().toggled(), Some(Toggled::True));
    lamp.click();
    h.run();
    assert_eq!(h.state().done, [Command::Light("lamp".into(), LightChange::Switch(Some(false)))]);
    assert!(!h.state().state.edits.lights[0].on);
    // The slider of a parameter has the parameter's own range.
    h.state_mut().state.selected = h.state().state.material("ball").ok();
    h.run();
    let slider = h.get_by_role_and_label(egui::Role::Slider, "alpha");
    let range = slider.accesskit_node().min_numeric_value().zip(slider.accesskit_node().max_numeric_value());
    let (_, alpha) = Kind::RoughPlastic.param("alpha").expect("it has one");
    assert_eq!(range.map(|(a, b)| (a as f32, b as f32)), Some((alpha.min, alpha.max)));
    slider.focus();
    h.run();
    h.key_press(Key::ArrowRight);
    h.run();
    let Some(Command::Material(_, name, values)) = h.state().done.last() else {
        panic!("{:?}", h.state().done)
    };
    assert!(name == "alpha" && values[0].parse::<f32>().is_ok_and(|v| v > alpha.default[0]), "{values:?}");
    h.get_by_role_and_label(egui::Role::ComboBox, "model").click();
    h.run();
    h.get_by_label("ward").click();
    h.run();
    assert!(matches!(h.state().done.last(), Some(Command::Model(_, model)) if model == "ward"));
    assert_eq!(h.state().state.materials[h.state().state.selected.expect("the ball's")].kind, Kind::Ward);
    let sliders = |name: &str| h.query_all_by_role_and_label(egui::Role::Slider, name).count();
    assert_eq!(["alpha_y", "alpha"].map(sliders), [1, 0]);
    h.get_by_label("As the file has them").click();
    h.run();
    assert!(h.state().state.edits.is_empty(), "{:?}", h.state().done);
}

#[test]
fn keys_do_what_the_overlay_says() {
    let mut h = harness(Language::English);
    for action in ACTIONS {
        assert!(h.query_by_label(action.does[0]).is_none(), "{} before it was asked for", action.name);
    }
    h.key_press_modifiers(Modifiers::SHIFT, Key::Questionmark);
    h.run();
    assert!(h.state().state.help);
    for action in ACTIONS {
        assert!(h.query_by_label(action.does[0]).is_some(), "{} is not listed", action.name);
    }
    h.key_press(Key::Escape);
    h.run();
    assert!(!h.state().state.help);
    let before = h.state().state.eye.position();
    h.key_press(Key::V);
    h.key_press(Key::ArrowLeft);
    h.key_press(Key::Num1);
    h.key_press(Key::I);
    h.key_press_modifiers(Modifiers::SHIFT, Key::I);
    h.key_press(Key::H);
    h.run();
    let state = &h.state().state;
    assert!(state.ink.on && state.ink.name == state.ink.presets[1].name, "{}", state.ink.name);
    assert!(
        state.curve == Curve::ALL[1]
            && state.eye.position() != before
            && !state.edits.lights[0].on
            && !state.panel
    );
    // Without the panel its controls are gone.
    assert!(h.query_by_label("lamp").is_none());
}

#[test]
fn the_picture_is_turned_by_dragging_and_picked_by_a_click() {
    let mut h = harness(Language::English);
    let at = egui::pos2(300.0, 300.0);
    h.hover_at(at);
    h.drag_at(at);
    h.step();
    for i in 1..5 {
        h.hover_at(at + Vec2::new(10.0 * i as f32, 0.0));
        h.step();
    }
    h.drop_at(at + Vec2::new(40.0, 0.0));
    h.run();
    let turned = |c: &Command| matches!(c, Command::Orbit([right, up]) if *right < 0.0 && *up == 0.0);
    assert!(!h.state().done.is_empty() && h.state().done.iter().all(turned), "{:?}", h.state().done);
    h.state_mut().done.clear();
    h.drag_at(at);
    h.step();
    h.drop_at(at);
    h.run();
    let [Command::Pick([x, y])] = h.state().done[..] else { panic!("{:?}", h.state().done) };
    assert!((0.2..0.6).contains(&x) && (0.2..0.6).contains(&y), "{x} {y}");
}

#[test]
fn a_painting_is_steered_by_the_controls_of_its_table() {
    let mut h = harness(Language::English);
    assert!(h.query_by_role_and_label(egui::Role::Slider, "dryness").is_none());
    h.get_by_role_and_label(egui::Role::CheckBox, "painted in ink").click();
    h.run();
    assert_eq!(h.state().done, [Command::Ink(Some(true))]);
    for control in CONTROLS {
        let slider = h.get_by_role_and_label(egui::Role::Slider, control.name);
        let node = slider.accesskit_node();
        let range = node.min_numeric_value().zip(node.max_numeric_value());
        assert_eq!(range.map(|(a, b)| (a as f32, b as f32)), Some((control.min, control.max)));
        let before = h.state().state.ink.style.controls.get(control.name).expect("there is one");
        let key = if before < control.max { Key::ArrowRight } else { Key::ArrowLeft };
        slider.focus();
        h.run();
        h.key_press(key);
        h.run();
        let after = h.state().state.ink.style.controls.get(control.name).expect("there is one");
        assert!(after != before && (control.min..=control.max).contains(&after), "{}: {after}", control.name);
    }
    assert_eq!(h.state().done.len(), 1 + CONTROLS.len());
    assert!(h.state().done[1..].iter().all(|c| matches!(c, Command::Set(..))));
    // A preset from the list; the next one by key.
    for label in ["preset", "paper", "pigment", "wash", "wrinkles"] {
        assert!(h.query_by_role_and_label(egui::Role::ComboBox, label).is_some(), "{label}");
    }
    h.get_by_role_and_label(egui::Role::ComboBox, "preset").click();
    h.run();
    h.get_by_label("boneless").click();
    h.run();
    assert_eq!(h.state().state.ink.name, "boneless");
    assert_eq!(h.state().state.ink.style.controls.contour, 0.0);
    // A stroke has controls once it is selected.
    assert!(h.query_by_role_and_label(egui::Role::Slider, "stroke ink").is_none());
    h.state_mut().state.ink.stroke = Some(0x0f3a_9c12);
    h.run();
    h.get_by_role_and_label(egui::Role::Slider, "stroke ink").focus();
    h.run();
    h.key_press(Key::ArrowRight);
    h.run();
    h.get_by_role_and_label(egui::Role::CheckBox, "hidden").click_accesskit();
    h.run();
    h.get_by_role_and_label(egui::Role::CheckBox, "pinned").click_accesskit();
    h.run();
    let edit = h.state().state.ink.style.steering.strokes.get(&0x0f3a_9c12).cloned().expect("it has a table");
    assert!(edit.hide && edit.pin && edit.changes.iter().count() == 1, "{edit:?}");
    h.get_by_label("As the others").click_accesskit();
    h.run();
    assert!(h.state().state.ink.style.steering.is_empty());
    // So has an object, and what it is made of.
    h.state_mut().state.ink.stroke = None;
    h.state_mut().state.ink.offered =
        vec![(Subject::Object, "ball".into()), (Subject::Material, "red clay".into())];
    h.run();
    h.get_by_label("material red clay").click_accesskit();
    h.run();
    assert_eq!(h.state().state.ink.subject, Some((Subject::Material, "red clay".into())));
    h.get_by_role_and_label(egui::Role::Slider, "material wash").focus();
    h.run();
    h.key_press(Key::ArrowRight);
    h.run();
    assert_eq!(h.state().state.ink.steered().collect::<Vec<_>>(), [(Subject::Material, "red clay")]);
    h.get_by_label("As the others").click_accesskit();
    h.run();
    assert!(h.state().state.ink.style.steering.is_empty());
    h.get_by_label("Save the preset").click_accesskit();
    h.get_by_label("Save .svg").click_accesskit();
    h.run();
    let saved = h.state().done.iter().filter(|c| matches!(c, Command::Save(_))).count();
    assert_eq!(saved, 2, "{:?}", h.state().done);
}

/// Where a mask on an object is seen: what the window learns of its painter.
fn see(h: &mut Harness<'static, World>, object: &str) {
    let state = &mut h.state_mut().state;
    let size = state.ink.mask().expect("one is painted").picture.size();
    let camera = state.eye.camera();
    let (rows, projection) = (Rows::new(&state.scene).unwrap(), Projection::new(camera).unwrap());
    let depth = DepthMap::of(&rows, &projection, &|_| None, 1).expect("nothing is seen through");
    let (on, names) = (Ground::Object(object.into()), Names::of(&state.scene));
    let map = MaskMap::new(&on, size, &rows, &names, &projection, &depth).unwrap();
    state.ink.masks.see(Some(Ok(Arc::new(map))));
}

/// Drags over the picture with the left button, in steps.
fn drag(h: &mut Harness<'static, World>, from: egui::Pos2, to: egui::Pos2, modifiers: Modifiers) {
    h.event(egui::Event::PointerMoved(from));
    let button = |pos, pressed| egui::Event::PointerButton {
        pos,
        button: egui::PointerButton::Primary,
        pressed,
        modifiers,
    };
    h.event_modifiers(button(from, true), modifiers);
    h.step();
    for i in 1..=4 {
        h.event_modifiers(egui::Event::PointerMoved(from.lerp(to, i as f32 / 4.0)), modifiers);
        h.step();
    }
    h.event_modifiers(button(to, false), modifiers);
    h.run();
}

/// The mean of the mask that is painted.
fn painted(h: &Harness<'static, World>) -> f32 {
    let picture = h.state().state.ink.mask().expect("one is painted").picture.picture();
    picture.data.iter().sum::<f32>() / picture.data.len() as f32
}

#[test]
fn masks_are_begun_and_painted_with_the_mouse_and_by_keys() {
    let mut h = harness(Language::English);
    // All of the panel is to be seen.
    h.set_size(Vec2::new(1100.0, 2000.0));
    h.key_press(Key::I);
    h.run();
    // One on the picture, with a control and its value.
    h.get_by_label("New mask on the picture").click_accesskit();
    h.run();
    assert_eq!(h.state().state.ink.mask().map(|m| m.name.as_str()), Some("mask-1"));
    h.get_by_role_and_label(egui::Role::Slider, "mask ink").focus();
    h.run();
    h.key_press(Key::ArrowRight);
    h.run();
    h.get_by_role_and_label(egui::Role::ComboBox, "also of it").click();
    h.run();
    h.get_by_role_and_label(egui::Role::Button, "dryness").click();
    h.run();
    let changes = h.state().state.ink.mask().unwrap().changes.clone();
    let names: Vec<&str> = changes.iter().map(|c| c.0).collect();
    assert!(names == ["ink", "dryness"] && changes.iter().next().unwrap().1 > 0.0, "{changes:?}");
    h.get_by_label("mask dryness As the others").click_accesskit();
    h.run();
    assert_eq!(h.state().state.ink.mask().unwrap().changes.iter().count(), 1);
    // The mouse draws instead of turning the view; with Ctrl it erases, with Shift it moves the view.
    let [a, b] = [egui::pos2(300.0, 300.0), egui::pos2(380.0, 310.0)];
    let (before, view) = (h.state().done.len(), h.state().state.eye.position());
    drag(&mut h, a, b, Modifiers::NONE);
    let drawn = &h.state().done[before..];
    let ways: Vec<&MaskWay> = drawn
        .iter()
        .map(|c| match c {
            Command::Mask(MaskChange::Draw(way)) => way,
            other => panic!("{other:?}"),
        })
        .collect();
    assert!(ways.len() > 2 && !ways[0].goes_on && ways[1..].iter().all(|w| w.goes_on), "{ways:?}");
    assert!(ways.windows(2).all(|w| w[0].places.last() == w[1].places.first()), "{ways:?}");
    assert_eq!(h.state().state.eye.position(), view);
    let once = painted(&h);
    assert!(once > 0.001, "{once}");
    drag(&mut h, a, b, Modifiers::COMMAND | Modifiers::CTRL);
    let erased = painted(&h);
    assert!(erased < 0.05 * once, "{erased} of {once}");
    h.key_press_modifiers(Modifiers::COMMAND | Modifiers::CTRL, Key::Z);
    h.run();
    assert_eq!(painted(&h), once, "the last stroke is undone");
    drag(&mut h, a, b, Modifiers::SHIFT);
    assert!(h.state().state.eye.position() != view && painted(&h) == once);
    // A click is a dab of the brush.
    let far = egui::pos2(500.0, 600.0);
    drag(&mut h, far, far, Modifiers::NONE);
    assert!(painted(&h) > once && h.state().state.ink.stroke.is_none());
    h.get_by_label("Undo the stroke").click_accesskit();
    h.run();
    assert_eq!(painted(&h), once);
    // The brush, by keys and by sliders.
    let (radius, strength) = (h.state().state.ink.masks.radius, h.state().state.ink.masks.strength);
    h.key_press(Key::N);
    h.key_press(Key::U);
    h.key_press(Key::J);
    h.run();
    let brush = &h.state().state.ink.masks;
    assert!(brush.radius < radius && brush.strength < strength && brush.erases);
    h.get_by_role_and_label(egui::Role::CheckBox, "erase").click_accesskit();
    for slider in ["brush radius", "brush strength"] {
        h.get_by_role_and_label(egui::Role::Slider, slider).focus();
        h.run();
        h.key_press(Key::ArrowRight);
        h.run();
    }
    let after = h.state().state.ink.masks.clone();
    assert!(!after.erases && after.radius > 0.8 * radius && after.strength > strength - 0.1, "{after:?}");
    // Escape leaves the slider, then it lays the brush down.
    h.key_press(Key::Escape);
    h.run();
    h.key_press(Key::Escape);
    h.run();
    assert!(h.state().state.ink.mask().is_none() && h.state().state.ink.style.steering.masks.len() == 1);
    h.key_press(Key::K);
    h.run();
    h.get_by_label("Remove the mask").click_accesskit();
    h.run();
    assert!(h.state().state.ink.style.steering.masks.is_empty());
}

#[test]
fn a_mask_is_painted_on_the_surface_of_what_is_selected() {
    let mut h = harness(Language::English);
    h.key_press(Key::I);
    h.run();
    h.state_mut().state.ink.subject = Some((Subject::Object, "ball".into()));
    h.run();
    assert!(h.query_by_label("New mask on the object ball").is_some());
    h.key_press_modifiers(Modifiers::SHIFT, Key::K);
    h.run();
    assert_eq!(h.state().state.ink.mask().map(|m| &m.on), Some(&Ground::Object("ball".into())));
    see(&mut h, "ball");
    // Over all of the picture: what is seen of the ball is painted, and what is behind is not.
    for y in [150.0, 250.0, 350.0, 450.0, 550.0, 650.0, 750.0] {
        drag(&mut h, egui::pos2(10.0, y), egui::pos2(780.0, y), Modifiers::NONE);
    }
    let all = painted(&h);
    assert!((0.1..0.7).contains(&all), "{all}");
    h.key_press_modifiers(Modifiers::COMMAND | Modifiers::CTRL, Key::Z);
    h.run();
    assert!(painted(&h) <= all);
}

#[test]
fn it_speaks_japanese() {
    let mut h = harness(Language::Japanese);
    for words in ["光源", "材質", "全体を収める", "経路追跡による画像と比べる", "水墨で描く"]
    {
        assert!(h.query_all_by_label(words).next().is_some(), "{words}");
    }
    h.key_press(Key::F1);
    h.run();
    for action in ACTIONS {
        assert!(h.query_by_label(action.does[1]).is_some(), "{} is not listed", action.name);
    }
    h.key_press(Key::F1);
    h.run();
    h.get_by_label("English").click();
    h.run();
    assert!(h.query_by_label("Lights").is_some() && h.query_all_by_label("光源").next().is_none());
}
