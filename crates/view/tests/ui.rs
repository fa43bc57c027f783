//! Panels and overlays through their accessibility tree, without a window.

use egui::accesskit::Toggled;
use egui::{Key, Modifiers, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use glam::{Mat4, Vec3};
use std::path::Path;
use yugen_ink::control::CONTROLS;
use yugen_optics::tonemap::Curve;
use yugen_reflectance::Kind;
use yugen_scene::{Geometry, Light, Material, ModelBuilder, Scene, Shape, Value};
use yugen_view::action::ACTIONS;
use yugen_view::command::{Command, LightChange};
use yugen_view::ink::Subject;
use yugen_view::language::Language;
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
