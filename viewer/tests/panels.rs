//! The whole window without a display: hands and keys in, orders and what is shown out. The tree that screen readers have
//! says where things are.

#![cfg(feature = "window")]
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use eframe::egui::{
    Event, Key, Modifiers, MouseWheelUnit, OutputCommand, PointerButton, Pos2, Rect, Role, Ui,
    UiBuilder, vec2,
};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use impasto_compiler::ParameterValue;
use impasto_viewer::engine::{Order, ParamId, Picture, State};
use impasto_viewer::testing::{BallEngine, camera};
use impasto_viewer::window::compare::Mode;
use impasto_viewer::window::desk::{Desk, Tool};
use impasto_viewer::window::picture::Channel;
use impasto_viewer::window::tone::Curve;
use impasto_viewer::window::{Window, WindowOptions, keys};

struct Test {
    harness: Harness<'static, Option<Window>>,
    engine: BallEngine,
}

impl Test {
    fn new() -> Self {
        Self::sized(1280.0, 800.0, 1.0)
    }

    fn sized(width: f32, height: f32, scale: f32) -> Self {
        let engine = BallEngine::still();
        let given = engine.clone();
        let harness = Harness::builder()
            .with_size(vec2(width, height))
            .with_pixels_per_point(scale)
            .build_ui_state(
                move |ui, window: &mut Option<Window>| {
                    let make = || {
                        Window::new(ui.ctx(), Box::new(given.clone()), &WindowOptions::default())
                    };
                    window.get_or_insert_with(make).ui(&mut whole(ui));
                },
                None,
            );
        let mut test = Self { harness, engine };
        test.frames(4);
        test.engine.orders();
        test
    }

    fn frames(&mut self, count: usize) {
        self.harness.run_steps(count);
    }

    fn window(&mut self) -> &mut Window {
        self.harness
            .state_mut()
            .as_mut()
            .expect("it is made in the first frame")
    }

    fn desk(&mut self) -> &mut Desk {
        &mut self.window().desk
    }

    /// Where a widget is.
    fn rect(&self, role: Role, label: &str) -> Rect {
        self.harness.get_by_role_and_label(role, label).rect()
    }

    fn click(&mut self, label: &str) {
        self.harness.get_by_label(label).click();
        self.frames(3);
    }

    fn key(&mut self, key: Key, modifiers: Modifiers) {
        self.harness.key_press_modifiers(modifiers, key);
        self.frames(3);
    }

    /// A drag in steps, a frame each; orders of each frame.
    fn drag(&mut self, from: Pos2, steps: &[(f32, f32)]) -> Vec<Vec<Order>> {
        self.drag_by(from, steps, PointerButton::Primary, Modifiers::NONE)
    }

    fn drag_by(
        &mut self,
        from: Pos2,
        steps: &[(f32, f32)],
        button: PointerButton,
        modifiers: Modifiers,
    ) -> Vec<Vec<Order>> {
        self.harness.event(Event::ModifiersChanged(modifiers));
        self.harness.event(Event::PointerMoved(from));
        self.frames(1);
        let press = |pos, pressed| Event::PointerButton {
            pos,
            button,
            pressed,
            modifiers,
        };
        self.harness.event(press(from, true));
        self.frames(1);
        let mut at = from;
        let mut orders = Vec::new();
        self.engine.orders();
        for (x, y) in steps {
            at += vec2(*x, *y);
            self.harness.event(Event::PointerMoved(at));
            self.frames(1);
            orders.push(self.engine.orders());
        }
        self.harness.event(press(at, false));
        self.frames(1);
        orders.push(self.engine.orders());
        self.harness.event(Event::ModifiersChanged(Modifiers::NONE));
        self.frames(2);
        orders
    }

    fn click_at(&mut self, at: Pos2, modifiers: Modifiers) -> Vec<Order> {
        let mut orders = self.drag_by(at, &[], PointerButton::Primary, modifiers);
        // Far enough in time from the next click that the two are no double click.
        self.frames(40);
        orders.push(self.engine.orders());
        orders.into_iter().flatten().collect()
    }

    fn placed(&mut self) -> Rect {
        self.window().canvas.placed().expect("there is a picture")
    }

    fn shows(&self, text: &str) -> bool {
        self.harness
            .query_all_by_label_contains(text)
            .next()
            .is_some()
    }

    fn copied(&self) -> Option<String> {
        let commands = &self.harness.output().platform_output.commands;
        commands.iter().find_map(|command| match command {
            OutputCommand::CopyText(text) => Some(text.clone()),
            _ => None,
        })
    }
}

fn id(binding: &str, param: &str) -> ParamId {
    ParamId {
        binding: binding.to_owned(),
        param: param.to_owned(),
    }
}

#[test]
fn parameters_are_shown_as_their_metadata_has_them() {
    let test = Test::new();
    for text in [
        "pot",
        "floor",
        "Base",
        "Pattern",
        "Coat",
        "Base color",
        "Roughness",
        "glaze in glaze.impasto",
    ] {
        assert!(test.shows(text), "{text} is not shown");
    }
    let value = |label: &str| {
        test.harness
            .get_by_role_and_label(Role::SpinButton, label)
            .value()
    };
    assert_eq!(value("Speckle").as_deref(), Some("8.00 mm"));
    assert_eq!(value("Square").as_deref(), Some("5.00 cm"));
    assert_eq!(value("Octaves").as_deref(), Some("3"));
}

#[test]
fn a_dragged_slider_sends_a_value_a_frame_and_the_last_one_when_it_is_let_go() {
    let mut test = Test::new();
    let slider = test.rect(Role::Slider, "Roughness");
    let from = slider.left_center() + vec2(0.3 * slider.width(), 0.0);
    let orders = test.drag(from, &[(8.0, 0.0), (8.0, 0.0), (0.0, 0.0), (8.0, 0.0)]);
    let mut values = Vec::new();
    for (frame, orders) in orders.iter().enumerate() {
        assert!(orders.len() <= 1, "{frame}: {orders:?}");
        for order in orders {
            let Order::Set {
                param,
                value: ParameterValue::Float(x),
                dragged,
            } = order
            else {
                panic!("{order:?}");
            };
            assert_eq!(*param, id("pot", "roughness"));
            values.push((*x, *dragged));
        }
    }
    assert!(values.is_sorted_by(|a, b| a.0 <= b.0), "{values:?}");
    let (last, dragged) = values.pop().expect("some orders");
    assert!(
        !dragged && values.iter().all(|(_, dragged)| *dragged) && values.len() == 3,
        "{values:?}"
    );
    assert_eq!(Some(last), values.last().map(|v| v.0));
    assert!((0.4..0.8).contains(&last), "{last}");
}

#[test]
fn lengths_are_ordered_with_their_unit_and_sliders_end_at_soft_limits() {
    let mut test = Test::new();
    let slider = test.rect(Role::Slider, "Speckle");
    let orders = test.drag(slider.center(), &[(4.0, 0.0), (900.0, 0.0)]);
    let last = orders.into_iter().flatten().last().expect("some orders");
    let expected = Order::Set {
        param: id("pot", "speckle"),
        value: ParameterValue::Text("30 mm".to_owned()),
        dragged: false,
    };
    assert_eq!(last, expected);
}

#[test]
fn what_is_typed_is_held_by_the_hard_limits() {
    let mut test = Test::new();
    let field = test.rect(Role::SpinButton, "Speckle");
    test.click_at(field.center(), Modifiers::NONE);
    test.harness.key_press(Key::Num2);
    test.harness.event(Event::Text("12345".to_owned()));
    test.frames(2);
    assert_eq!(test.desk().tool, Tool::Orbit, "digits are digits");
    assert!(test.engine.orders().is_empty(), "nothing is entered yet");
    test.key(Key::Enter, Modifiers::NONE);
    let orders = test.engine.orders();
    let expected = Order::Set {
        param: id("pot", "speckle"),
        value: ParameterValue::Text("1000 mm".to_owned()),
        dragged: false,
    };
    assert_eq!(orders, [expected]);
}

#[test]
fn ticks_texts_and_components() {
    let mut test = Test::new();
    let tick = test.rect(Role::CheckBox, "Coated");
    let orders = test.click_at(tick.left_center() + vec2(6.0, 0.0), Modifiers::NONE);
    let set = |param: ParamId, value| Order::Set {
        param,
        value,
        dragged: false,
    };
    assert_eq!(
        orders,
        [set(id("pot", "coated"), ParameterValue::Bool(false))]
    );
    let path = test.rect(Role::TextInput, "Wood");
    test.click_at(path.center(), Modifiers::NONE);
    test.key(Key::A, Modifiers::COMMAND);
    test.harness.event(Event::Text("oak.png".to_owned()));
    test.frames(2);
    assert!(test.engine.orders().is_empty(), "nothing is entered yet");
    test.key(Key::Enter, Modifiers::NONE);
    let expected = set(
        id("floor", "wood"),
        ParameterValue::Texture("oak.png".to_owned()),
    );
    assert_eq!(test.engine.orders(), [expected]);
    let field = test.rect(Role::SpinButton, "Offset y");
    let orders = test.drag(field.center(), &[(10.0, 0.0), (10.0, 0.0)]);
    let last = orders.into_iter().flatten().last().expect("some orders");
    let Order::Set {
        value: ParameterValue::Floats(v),
        dragged: false,
        ..
    } = last
    else {
        panic!("{last:?}");
    };
    assert!(
        v.len() == 3 && v[0] == 0.0 && v[1] > 0.0 && v[2] == 0.0,
        "{v:?}"
    );
}

#[test]
fn colors_are_picked_in_srgb_and_ordered_as_linear_values() {
    let mut test = Test::new();
    let plate = test.rect(Role::ColorWell, "Base color color");
    let orders = test.click_at(plate.center(), Modifiers::NONE);
    assert!(orders.is_empty(), "looking changes nothing");
    let shade = test.rect(Role::ColorWell, "Base color shade");
    // The lower right corner of the square is black; its upper right one has all of the hue.
    let orders = test.drag(shade.center(), &[(20.0, 0.0), (500.0, -500.0)]);
    let orders: Vec<Order> = orders.into_iter().flatten().collect();
    let Some(Order::Set {
        param,
        value: ParameterValue::Floats(v),
        dragged: false,
    }) = orders.last()
    else {
        panic!("{orders:?}");
    };
    assert_eq!(*param, id("pot", "base_color"));
    assert!(
        (v[0] - 1.0).abs() < 1e-3 && v[1] > 0.0 && v[1] < 0.4 && v[2] < 1e-3,
        "{v:?}"
    );
    assert!(
        orders[..orders.len() - 1]
            .iter()
            .all(|o| matches!(o, Order::Set { dragged: true, .. }))
    );
    // The hue stays when a hand passes black.
    test.drag(shade.center(), &[(500.0, 500.0)]);
    let orders = test.drag(shade.center(), &[(500.0, -500.0)]);
    let Some(Order::Set {
        value: ParameterValue::Floats(back),
        ..
    }) = orders.last().and_then(|o| o.last())
    else {
        panic!("{orders:?}");
    };
    assert!(
        back.iter().zip(v).all(|(a, b)| (a - b).abs() < 1e-3),
        "{back:?} {v:?}"
    );
}

#[test]
fn values_are_reset_one_by_one_and_together() {
    let mut test = Test::new();
    assert!(
        test.harness.query_by_label("Reset Roughness").is_none(),
        "nothing is set"
    );
    let slider = test.rect(Role::Slider, "Roughness");
    test.drag(slider.center(), &[(5.0, 0.0)]);
    test.click("Reset Roughness");
    assert_eq!(test.engine.orders(), [Order::Reset(id("pot", "roughness"))]);
    test.drag(slider.center(), &[(5.0, 0.0)]);
    test.click("Write back");
    assert_eq!(test.engine.orders(), [Order::WriteBack]);
    assert!(test.shows("Wrote ball.toml"));
    test.drag(slider.center(), &[(15.0, 0.0)]);
    test.click("Reset all");
    assert_eq!(test.engine.orders(), [Order::ResetAll]);
}

#[test]
fn what_keys_of_the_scene_move_is_closed_and_says_why() {
    let mut test = Test::new();
    let glow = test.harness.get_by_role_and_label(Role::Slider, "Glow");
    assert!(glow.accesskit_node().is_disabled());
    let at = glow.rect().center();
    let orders = test.drag(at, &[(10.0, 0.0), (10.0, 0.0)]);
    assert!(orders.iter().all(Vec::is_empty), "{orders:?}");
    test.harness.hover_at(at);
    test.frames(60);
    assert!(test.shows("Keys of the scene move it"));
}

#[test]
fn names_tell_what_their_authors_said() {
    let mut test = Test::new();
    let slider = test.rect(Role::Slider, "Speckle");
    assert!(!test.shows("Size of the speckles."));
    // Beside the letters, but before the slider.
    test.harness
        .hover_at(slider.left_center() - vec2(20.0, 0.0));
    test.frames(60);
    for text in ["Size of the speckles.", "in 0.1 .. 1000 mm", "default 8 mm"] {
        assert!(test.shows(text), "{text} is not shown");
    }
}

#[test]
fn the_filter_hides_what_does_not_fit() {
    let mut test = Test::new();
    test.desk().filter = "rough".to_owned();
    test.frames(3);
    assert!(test.shows("Roughness") && !test.shows("Speckle") && !test.shows("Square"));
    test.desk().filter = "floor".to_owned();
    test.frames(3);
    assert!(!test.shows("Roughness") && test.shows("Square"));
}

#[test]
fn problems_stand_below_the_last_good_picture() {
    let mut test = Test::new();
    let before = test.window().canvas.images;
    test.engine.break_files(true);
    test.frames(4);
    assert!(test.shows("1 error") && test.shows("unknown name `roughnes`"));
    assert!(
        test.shows("did you mean `roughness`?"),
        "all of the text is there"
    );
    assert!(test.shows("Errors in the files"));
    assert_eq!(test.window().canvas.images, before, "the picture stays");
    test.harness.get_by_label("glaze.impasto:12:24").click();
    let mut copied = None;
    for _ in 0..4 {
        test.frames(1);
        copied = copied.or(test.copied());
    }
    assert_eq!(copied.as_deref(), Some("glaze.impasto:12"));
    test.engine.break_files(false);
    test.frames(4);
    assert!(!test.shows("1 error"));
}

#[test]
fn keys_do_what_their_table_says() {
    let mut test = Test::new();
    test.key(Key::Questionmark, Modifiers::SHIFT);
    for row in keys::TABLE {
        assert!(test.shows(row.about), "{} is not in the help", row.about);
    }
    test.key(Key::Escape, Modifiers::NONE);
    assert!(!test.desk().shows_help);
    let command = Modifiers::COMMAND;
    let both = Modifiers::COMMAND | Modifiers::SHIFT;
    let none = Modifiers::NONE;
    for (key, modifiers, expected) in [
        (Key::Home, none, Order::LookAsWritten),
        (Key::Space, none, Order::Pause(true)),
        (Key::Space, none, Order::Pause(false)),
        (Key::R, none, Order::Restart),
        (Key::F5, none, Order::Reload),
        (Key::Period, none, Order::Frame(2)),
        (Key::Comma, none, Order::Frame(1)),
        (Key::W, both, Order::WriteBack),
    ] {
        test.key(key, modifiers);
        assert_eq!(test.engine.orders(), [expected], "{key:?}");
    }
    for (key, tool) in [
        (Key::Num2, Tool::Focus),
        (Key::Num4, Tool::Crop),
        (Key::Num1, Tool::Orbit),
    ] {
        test.key(key, none);
        assert_eq!(test.desk().tool, tool);
    }
    test.key(Key::E, none);
    test.key(Key::E, none);
    test.key(Key::E, Modifiers::SHIFT);
    assert_eq!(test.desk().look.exposure, 0.5);
    test.key(Key::Num0, none);
    assert_eq!(test.desk().look.exposure, 0.0);
    test.key(Key::T, none);
    test.key(Key::C, none);
    assert_eq!(
        (test.desk().look.curve, test.desk().look.channel),
        (Curve::Filmic, Channel::Red)
    );
    let zoom = test.window().canvas.zoom().expect("a picture");
    test.key(Key::Plus, Modifiers::SHIFT);
    assert!(test.window().canvas.zoom().expect("a picture") > zoom);
    test.key(Key::Num0, command);
    assert_eq!(test.window().canvas.zoom(), Some(zoom));
    test.key(Key::S, command);
    assert!(test.desk().shows_save);
    assert!(test.engine.orders().is_empty());
}

#[test]
fn who_types_presses_no_keys() {
    let mut test = Test::new();
    let field = test.rect(Role::TextInput, "Filter parameters");
    test.click_at(field.center(), Modifiers::NONE);
    test.harness.key_press(Key::R);
    test.harness.event(Event::Text("r".to_owned()));
    test.frames(3);
    assert!(test.engine.orders().is_empty());
    assert_eq!(test.desk().filter, "r");
}

#[test]
fn a_drag_on_the_picture_turns_the_camera_and_a_hand_that_passes_does_not() {
    let mut test = Test::new();
    let centre = test.placed().center();
    for step in 0..10 {
        test.harness.hover_at(centre + vec2(5.0 * step as f32, 3.0));
        test.frames(1);
    }
    assert!(test.engine.orders().is_empty());
    let images = test.window().canvas.images;
    let orders = test.drag(centre, &[(20.0, 0.0), (20.0, 10.0), (20.0, 0.0)]);
    let looks: Vec<_> = orders
        .iter()
        .map(|orders| match orders[..] {
            [] => None,
            [Order::Look(camera)] => Some(camera),
            _ => panic!("{orders:?}"),
        })
        .collect();
    assert!(looks.iter().flatten().count() >= 2, "{looks:?}");
    let last = looks.into_iter().flatten().last().expect("some");
    assert!(last.position.x < camera().position.x && last.position.y > camera().position.y);
    assert_eq!(last.aperture, camera().aperture);
    assert!(test.window().canvas.images > images);
}

#[test]
fn other_hands_move_it_sideways_and_nearer() {
    let mut test = Test::new();
    let centre = test.placed().center();
    let look = |orders: Vec<Vec<Order>>| match orders.into_iter().flatten().last() {
        Some(Order::Look(camera)) => camera,
        other => panic!("{other:?}"),
    };
    let steps = [(20.0, 0.0), (20.0, 0.0)];
    let none = Modifiers::NONE;
    let moved = look(test.drag_by(centre, &steps, PointerButton::Middle, none));
    assert!((moved.basis()[2] - camera().basis()[2]).length() < 1e-5 && moved.position.x < -0.01);
    let moved = look(test.drag_by(centre, &steps, PointerButton::Primary, Modifiers::SHIFT));
    assert!((moved.basis()[2] - camera().basis()[2]).length() < 1e-5 && moved.position.x < -0.02);
    let before = moved;
    let moved = look(test.drag_by(centre, &steps, PointerButton::Secondary, none));
    let step = moved.position - before.position;
    assert!(step.dot(camera().basis()[2]) > 0.01, "nearer");
    test.key(Key::Home, none);
    test.engine.orders();
    test.harness.hover_at(centre);
    test.frames(1);
    test.harness.event(Event::MouseWheel {
        unit: MouseWheelUnit::Line,
        delta: vec2(0.0, 2.0),
        phase: eframe::egui::TouchPhase::Move,
        source: eframe::egui::MouseWheelSource::Unknown,
        modifiers: none,
    });
    test.frames(20);
    let orders = test.engine.orders();
    let Some(Order::Look(nearer)) = orders.last() else {
        panic!("{orders:?}");
    };
    let distance = |c: &impasto_runtime::scene::Camera| (c.position - c.look_at).length();
    let share = distance(nearer) / distance(&camera());
    assert!((0.5..0.95).contains(&share), "{share}");
}

#[test]
fn clicks_pick_focus_and_trace() {
    let mut test = Test::new();
    let centre = test.placed().center();
    let orders = test.click_at(centre, Modifiers::NONE);
    assert_eq!(orders, [Order::Pick([32, 20])]);
    assert!(test.desk().picked.is_some());
    for text in ["set/ball", "glaze.impasto:12", "Position", "Depth"] {
        assert!(test.shows(text), "{text} is not shown");
    }
    test.click_at(centre, Modifiers::COMMAND);
    let camera = test.desk().camera().expect("a camera");
    assert!((camera.focus - 0.52).abs() < 0.05, "{}", camera.focus);
    test.click_at(centre + vec2(0.0, 30.0), Modifiers::SHIFT);
    assert!(test.desk().traced.is_some() && test.shows("Path of"));
    assert!(test.shows("it left the scene"), "the text is there");
    test.click("Next sample");
    assert_eq!(test.desk().traced.as_ref().map(|t| t.sample), Some(1));
    test.click("Close");
    assert!(!test.shows("Path of"));
}

#[test]
fn a_drag_crops() {
    let mut test = Test::new();
    test.key(Key::Num4, Modifiers::NONE);
    let placed = test.placed();
    let pixel = placed.width() / 64.0;
    let from = placed.min + vec2(10.5 * pixel, 5.5 * pixel);
    let orders = test.drag(
        from,
        &[(5.0 * pixel, 5.0 * pixel), (15.0 * pixel, 5.0 * pixel)],
    );
    let orders: Vec<Order> = orders.into_iter().flatten().collect();
    assert_eq!(orders, [Order::Crop(Some([[10, 5], [31, 16]]))]);
    assert_eq!(test.desk().tool, Tool::Orbit);
    assert!(test.shows("21 x 11"));
    test.click("All");
    assert_eq!(test.engine.orders(), [Order::Crop(None)]);
}

#[test]
fn pictures_are_compared() {
    let mut test = Test::new();
    test.click("Snapshot");
    assert!(test.shows("1: 64 spp"));
    let slider = test.rect(Role::Slider, "Roughness");
    test.drag(slider.center(), &[(30.0, 0.0)]);
    test.key(Key::W, Modifiers::NONE);
    assert_eq!(test.desk().compare, Mode::Wipe);
    let line = test.rect(Role::Splitter, "Wipe line");
    let centre = test.placed().center();
    assert!((line.center().x - centre.x).abs() < 2.0);
    let orders = test.drag(line.center(), &[(-30.0, 0.0), (-30.0, 0.0)]);
    assert!(
        orders.iter().all(Vec::is_empty),
        "the camera stays: {orders:?}"
    );
    assert!(test.desk().wipe < 0.45, "{}", test.desk().wipe);
    test.key(Key::D, Modifiers::NONE);
    assert_eq!(test.desk().compare, Mode::Absolute);
    let difference = test
        .window()
        .canvas
        .difference
        .clone()
        .expect("of one size");
    assert!(difference.absolute > 1e-5 && test.shows("RMSE"));
    // Another size has no difference, and says so.
    test.engine.order_size([32, 20]);
    test.frames(3);
    assert!(test.window().canvas.difference.is_none());
}

trait OrderSize {
    fn order_size(&self, size: [u32; 2]);
}

impl OrderSize for BallEngine {
    fn order_size(&self, size: [u32; 2]) {
        use impasto_viewer::engine::Engine;
        self.order(Order::Size(size));
    }
}

#[test]
fn menus_ask_for_layers_goals_sizes_and_strategies() {
    let mut test = Test::new();
    let choose = |test: &mut Test, menu: &str, item: &str| {
        test.harness
            .get_by_role_and_label(Role::ComboBox, menu)
            .click();
        test.frames(3);
        test.harness
            .get_by_role_and_label(Role::Button, item)
            .click();
        test.frames(3);
    };
    choose(&mut test, "Layer", "albedo");
    assert_eq!(
        test.engine.orders(),
        [Order::Outputs(vec!["albedo".to_owned()])]
    );
    assert_eq!(test.desk().layer.as_deref(), Some("albedo"));
    choose(&mut test, "Overlay", "cost");
    assert_eq!(test.desk().overlay.as_deref(), Some("cost"));
    let survey = Order::Survey(true);
    assert_eq!(test.engine.orders(), [survey]);
    for (goal, expected) in [
        ("relMSE", Some("relmse=1e-3")),
        ("Time", Some("relmse=1e-3,time=60s")),
        ("relMSE", Some("time=60s")),
        ("Time", None),
    ] {
        let tick = test.rect(Role::CheckBox, goal);
        test.harness
            .get_by_role_and_label(Role::CheckBox, goal)
            .click();
        test.frames(3);
        let expected = expected.map(str::to_owned);
        assert_eq!(test.engine.orders(), [Order::Until(expected)], "{tick:?}");
    }
    choose(&mut test, "Strategy", "threshold=");
    assert_eq!(
        test.engine.orders(),
        [Order::Strategy("threshold=1000".to_owned())]
    );
    let number = test.rect(Role::SpinButton, "threshold");
    let orders = test.drag(number.center(), &[(10.0, 0.0), (10.0, 0.0)]);
    let orders: Vec<Order> = orders.into_iter().flatten().collect();
    assert!(
        matches!(&orders[..], [Order::Strategy(s)] if s != "threshold=1000"),
        "{orders:?}"
    );
    choose(&mut test, "Curve", "Filmic");
    assert_eq!(test.desk().look.curve, Curve::Filmic);
    choose(&mut test, "Size", "320 x 200  (50 %)");
    assert_eq!(test.engine.orders(), [Order::Size([320, 200])]);
}

#[test]
fn kernels_and_their_times_are_listed() {
    let mut test = Test::sized(1280.0, 1400.0, 1.0);
    for text in ["closed form", "ray cast", "46.0 %", "Why so"] {
        assert!(test.shows(text), "{text} is not shown");
    }
    let menu = test
        .harness
        .get_by_role_and_label(Role::ComboBox, "Strategy");
    assert_eq!(menu.value().as_deref(), Some("auto"));
    test.click("Why so");
    assert!(test.shows("sharing one would cost"));
    assert!(test.shows("No error is known yet"));
}

#[test]
fn pictures_are_saved_from_a_dialog() {
    let mut test = Test::new();
    test.click("Save");
    test.desk().save_as = "out/ball.exr".to_owned();
    test.click("PNG");
    let expected = Order::Save {
        path: "out/ball.png".into(),
        exposure: 0.0,
    };
    assert_eq!(test.engine.orders(), [expected]);
    assert!(!test.desk().shows_save && test.shows("Wrote out/ball.png"));
    // By keys alone.
    test.key(Key::S, Modifiers::COMMAND);
    test.key(Key::A, Modifiers::COMMAND);
    test.harness.event(Event::Text("other.film".to_owned()));
    test.frames(2);
    test.key(Key::Enter, Modifiers::NONE);
    let expected = Order::Save {
        path: "other.film".into(),
        exposure: 0.0,
    };
    assert_eq!(test.engine.orders(), [expected]);
    test.key(Key::S, Modifiers::COMMAND);
    test.key(Key::Escape, Modifiers::NONE);
    assert!(!test.desk().shows_save && test.engine.orders().is_empty());
}

#[test]
fn frames_lie_on_a_line() {
    let mut test = Test::new();
    let slider = test.rect(Role::Slider, "Frame");
    let orders = test.drag(slider.center(), &[(4.0, 0.0), (900.0, 0.0)]);
    assert_eq!(orders.into_iter().flatten().last(), Some(Order::Frame(48)));
    test.click("Previous frame");
    assert_eq!(test.engine.orders(), [Order::Frame(47)]);
}

#[test]
fn the_picture_is_made_again_only_when_it_changes() {
    let mut test = Test::new();
    let images = test.window().canvas.images;
    test.frames(10);
    assert_eq!(test.window().canvas.images, images);
    test.key(Key::E, Modifiers::NONE);
    assert_eq!(test.window().canvas.images, images + 1);
    let repaint = test.harness.run_ok();
    assert!(
        repaint.is_some(),
        "a window at rest asks for no more frames"
    );
}

#[test]
fn windows_of_every_size_and_pictures_of_every_kind() {
    for (width, height, scale) in [
        (0.0, 0.0, 1.0),
        (1.0, 1.0, 1.0),
        (60.0, 30.0, 2.0),
        (520.0, 90.0, 1.0),
        (200.0, 900.0, 1.0),
        (1280.0, 800.0, 2.0),
        (3000.0, 1600.0, 1.0),
    ] {
        let mut test = Test::sized(width, height, scale);
        test.desk().layer = Some("cost".to_owned());
        test.desk().compare_by(Mode::Wipe);
        test.desk().shows_help = true;
        test.engine.break_files(true);
        test.frames(4);
        test.harness.set_size(vec2(700.0, 500.0));
        test.frames(2);
        test.harness.set_size(vec2(0.0, 0.0));
        test.frames(2);
        test.harness.set_size(vec2(640.0, 480.0));
        test.desk().shows_help = false;
        test.frames(2);
        let centre = test.placed().center();
        test.drag(centre, &[(10.0, 10.0)]);
    }
    let mut test = Test::new();
    let nan = Picture {
        width: 3,
        height: 1,
        number: 77,
        pixels: Arc::new(vec![[f32::NAN; 3], [f32::INFINITY; 3], [-1.0; 3]]),
        counts: Arc::new(vec![1; 3]),
        ..Picture::default()
    };
    let torn = Picture {
        width: 9,
        height: 9,
        number: 78,
        ..Picture::default()
    };
    for picture in [nan, torn, Picture::default()] {
        test.engine
            .change(|news| news.picture = Some(Arc::new(picture)));
        for _ in 0..6 {
            test.key(Key::X, Modifiers::NONE);
            test.key(Key::D, Modifiers::NONE);
            test.key(Key::L, Modifiers::NONE);
            test.key(Key::Plus, Modifiers::NONE);
        }
        test.key(Key::Num0, Modifiers::COMMAND);
    }
    test.engine.change(|news| {
        news.picture = None;
        news.state = State::Failed("no device\nhint: try another".to_owned());
    });
    test.frames(3);
    assert!(test.shows("Failed: no device"));
}

/// Clicks, drags, wheels, keys and texts anywhere, in a window that changes its size.
#[test]
fn a_monkey_breaks_nothing() {
    for seed in 1..=3u32 {
        let mut state = seed.wrapping_mul(0x9E37_79B9);
        let mut random = move |n: u32| {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state % n
        };
        let mut test = Test::new();
        let mut at = Pos2::ZERO;
        for _ in 0..250 {
            let modifiers = [
                Modifiers::NONE,
                Modifiers::NONE,
                Modifiers::SHIFT,
                Modifiers::COMMAND,
            ][random(4) as usize];
            let buttons = [
                PointerButton::Primary,
                PointerButton::Primary,
                PointerButton::Middle,
                PointerButton::Secondary,
            ];
            let button = buttons[random(4) as usize];
            let press = |pos, pressed| Event::PointerButton {
                pos,
                button,
                pressed,
                modifiers,
            };
            test.harness.event(Event::ModifiersChanged(modifiers));
            match random(10) {
                0 => {
                    let row = &keys::TABLE[random(keys::TABLE.len() as u32) as usize];
                    test.harness.key_press_modifiers(modifiers, row.key);
                }
                1 => {
                    let text = ["7", "-1e9", "nan", "a/b.png", "0xffffff", ""][random(6) as usize];
                    test.harness.event(Event::Text(text.to_owned()));
                    test.harness.key_press(Key::Enter);
                }
                2 => test.harness.event(Event::MouseWheel {
                    unit: MouseWheelUnit::Line,
                    delta: vec2(0.0, random(9) as f32 - 4.0),
                    phase: eframe::egui::TouchPhase::Move,
                    source: eframe::egui::MouseWheelSource::Unknown,
                    modifiers,
                }),
                3 if random(8) == 0 => {
                    let size = vec2(random(1600) as f32, random(1000) as f32);
                    test.harness.set_size(size);
                }
                4 => test.engine.break_files(random(4) == 0),
                5 => {
                    test.harness.event(press(at, true));
                    test.frames(1);
                    at += vec2(random(200) as f32 - 100.0, random(200) as f32 - 100.0);
                    test.harness.event(Event::PointerMoved(at));
                    test.frames(1);
                    test.harness.event(press(at, false));
                }
                _ => {
                    at = Pos2::new(random(1280) as f32, random(800) as f32);
                    test.harness.event(Event::PointerMoved(at));
                    test.harness.event(press(at, true));
                    test.harness.event(press(at, false));
                }
            }
            test.frames(1);
            for order in test.engine.orders() {
                if let Order::Look(camera) = order {
                    let [right, up, forward] = camera.basis();
                    assert!(
                        camera.position.is_finite() && right.length() > 0.9,
                        "{camera:?}"
                    );
                    assert!(up.dot(camera.up) > 0.0 && forward.is_finite(), "{camera:?}");
                }
            }
        }
    }
}

#[test]
fn a_window_that_closes_ends_its_engine() {
    let test = Test::new();
    let engine = test.engine.clone();
    assert!(!engine.has_quit());
    drop(test);
    assert!(engine.has_quit());
}

/// All of the window, without the margin that the harness leaves.
fn whole(ui: &mut Ui) -> Ui {
    let rect = ui.ctx().content_rect();
    let mut whole = ui.new_child(UiBuilder::new().max_rect(rect));
    whole.set_clip_rect(rect);
    whole
}
