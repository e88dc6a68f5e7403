//! Hands and news in, orders out.

use super::*;
use crate::engine::Engine;
use crate::testing::{BallEngine, camera};

fn desk() -> (Desk, BallEngine) {
    let engine = BallEngine::still();
    let mut desk = Desk::default();
    desk.take(engine.news(), engine.answers(), 0.0);
    (desk, engine)
}

/// A frame: what the desk asks for goes to the engine, and what that says to the desk.
fn frame(desk: &mut Desk, engine: &BallEngine, is_down: bool, now: f64) -> Vec<Order> {
    let orders = desk.settle(is_down, now);
    orders.iter().for_each(|order| engine.order(order.clone()));
    desk.take(engine.news(), engine.answers(), now);
    orders
}

fn roughness() -> ParamId {
    ParamId {
        binding: "pot".to_owned(),
        param: "roughness".to_owned(),
    }
}

fn shown(desk: &Desk, id: &ParamId) -> Value {
    let project = Arc::clone(&desk.news.project);
    desk.value(id, param_of(&project, id).expect("it is there"))
        .clone()
}

#[test]
fn a_drag_is_one_order_a_frame_and_one_more_at_its_end() {
    let (mut desk, engine) = desk();
    let id = roughness();
    let mut orders = Vec::new();
    for (i, x) in [0.4, 0.5, 0.6].into_iter().enumerate() {
        // Two moves in a frame: the last counts.
        desk.set(&id, Value::Number(x - 0.05));
        desk.set(&id, Value::Number(x));
        orders.push(frame(&mut desk, &engine, true, i as f64));
    }
    assert!(
        frame(&mut desk, &engine, true, 3.0).is_empty(),
        "a hand that rests asks for nothing"
    );
    orders.push(frame(&mut desk, &engine, false, 4.0));
    let expected = |x: f64, dragged| {
        vec![Order::Set {
            param: roughness(),
            value: impasto_compiler::ParameterValue::Float(x),
            dragged,
        }]
    };
    let expected = [
        expected(0.4, true),
        expected(0.5, true),
        expected(0.6, true),
        expected(0.6, false),
    ];
    assert_eq!(orders, expected);
    assert!(frame(&mut desk, &engine, false, 5.0).is_empty());
    // What was typed is sent once, and nobody holds it.
    desk.set(&id, Value::Number(0.9));
    let typed = frame(&mut desk, &engine, false, 6.0);
    assert!(
        matches!(typed[..], [Order::Set { dragged: false, .. }]),
        "{typed:?}"
    );
}

#[test]
fn what_a_hand_gave_is_shown_until_the_engine_has_it() {
    let (mut desk, engine) = desk();
    let id = roughness();
    desk.set(&id, Value::Number(0.7));
    assert_eq!(shown(&desk, &id), Value::Number(0.7));
    let orders = desk.settle(false, 0.0);
    // The engine reads something else first.
    engine.change(|news| news.project = Arc::new((*news.project).clone()));
    desk.take(engine.news(), Vec::new(), 0.1);
    assert_eq!(shown(&desk, &id), Value::Number(0.7));
    orders.into_iter().for_each(|order| engine.order(order));
    desk.take(engine.news(), Vec::new(), 0.2);
    assert_eq!(shown(&desk, &id), Value::Number(0.7));
    assert!(desk.waits().is_none(), "the engine's own now");
    // One that it does not take over goes after a while.
    desk.set(&id, Value::Number(0.2));
    desk.settle(false, 1.0);
    engine.change(|news| news.project = Arc::new((*news.project).clone()));
    desk.take(engine.news(), Vec::new(), 9.0);
    assert_eq!(shown(&desk, &id), Value::Number(0.7));
}

#[test]
fn limits_hold_and_closed_parameters_stay() {
    let (mut desk, engine) = desk();
    desk.set(&roughness(), Value::Number(7.0));
    assert_eq!(shown(&desk, &roughness()), Value::Number(1.0));
    frame(&mut desk, &engine, false, 0.0);
    for (binding, param) in [
        ("floor", "glow"),
        ("pot", "bent"),
        ("pot", "none"),
        ("none", "x"),
    ] {
        let id = ParamId {
            binding: binding.to_owned(),
            param: param.to_owned(),
        };
        desk.set(&id, Value::Number(0.3));
        assert!(desk.settle(false, 1.0).is_empty(), "{binding}.{param}");
    }
}

#[test]
fn values_are_taken_back_and_given_again() {
    let (mut desk, engine) = desk();
    let id = roughness();
    for x in [0.4, 0.5] {
        // A drag is one step.
        desk.set(&id, Value::Number(x - 0.01));
        frame(&mut desk, &engine, true, 0.0);
        desk.set(&id, Value::Number(x));
        frame(&mut desk, &engine, true, 0.0);
        frame(&mut desk, &engine, false, 0.0);
    }
    desk.command(Command::Undo);
    frame(&mut desk, &engine, false, 0.0);
    assert_eq!(shown(&desk, &id), Value::Number(0.4));
    desk.command(Command::Undo);
    frame(&mut desk, &engine, false, 0.0);
    assert_eq!(shown(&desk, &id), Value::Number(0.3));
    desk.command(Command::Undo);
    assert!(frame(&mut desk, &engine, false, 0.0).is_empty());
    desk.command(Command::Redo);
    desk.command(Command::Redo);
    frame(&mut desk, &engine, false, 0.0);
    assert_eq!(shown(&desk, &id), Value::Number(0.5));
}

#[test]
fn resets_forget_what_hands_gave() {
    let (mut desk, engine) = desk();
    desk.set(&roughness(), Value::Number(0.9));
    frame(&mut desk, &engine, false, 0.0);
    assert_eq!(desk.count_set(), 1);
    desk.reset(&roughness());
    let orders = frame(&mut desk, &engine, false, 1.0);
    assert_eq!(orders, [Order::Reset(roughness())]);
    assert_eq!(
        (desk.count_set(), shown(&desk, &roughness())),
        (0, Value::Number(0.3))
    );
    desk.set(&roughness(), Value::Number(0.9));
    desk.reset_all();
    assert_eq!(frame(&mut desk, &engine, false, 2.0), [Order::ResetAll]);
}

#[test]
fn the_camera_moves_once_a_frame_and_comes_home() {
    let (mut desk, engine) = desk();
    desk.drag_orbit(0.1, 0.0);
    desk.drag_orbit(0.1, 0.05);
    desk.dolly(1.0);
    let orders = frame(&mut desk, &engine, true, 0.0);
    let [Order::Look(moved)] = orders[..] else {
        panic!("{orders:?}");
    };
    assert!(moved.position.x < -0.1 && moved.position.y > camera().position.y);
    assert!(desk.has_moved());
    // A hand that rests sends nothing, and an engine that reads the scene again moves nothing.
    assert!(frame(&mut desk, &engine, true, 1.0).is_empty());
    engine.change(|news| news.project = Arc::new((*news.project).clone()));
    desk.take(engine.news(), Vec::new(), 2.0);
    assert_eq!(desk.camera(), Some(moved));
    desk.drag_orbit(0.1, 0.0);
    desk.command(Command::Home);
    assert_eq!(
        frame(&mut desk, &engine, false, 3.0),
        [Order::LookAsWritten]
    );
    assert_eq!(desk.camera(), Some(camera()));
}

#[test]
fn clicks_pick_focus_aim_and_trace() {
    let (mut desk, engine) = desk();
    desk.click([32, 20], Tool::Orbit);
    assert_eq!(
        frame(&mut desk, &engine, false, 0.0),
        [Order::Pick([32, 20])]
    );
    let picked = desk.picked.clone().expect("the ball is in the middle");
    assert_eq!((picked.binding, desk.reveal), (Some(0), Some(0)));
    assert_eq!(desk.picked_pixel(), Some([32, 20]));
    assert_eq!(
        desk.pivot(),
        Vec3::from(picked.position),
        "the camera turns about it"
    );
    // Two questions at once have answers in their order.
    desk.click([32, 20], Tool::Focus);
    desk.click([32, 39], Tool::Orbit);
    frame(&mut desk, &engine, false, 0.0);
    let orders = frame(&mut desk, &engine, false, 0.0);
    let [Order::Look(focused)] = orders[..] else {
        panic!("{orders:?}");
    };
    assert_eq!(focused.focus, picked.depth);
    assert_eq!(desk.picked.as_ref().and_then(|p| p.binding), Some(1));
    desk.aim([32, 20]);
    frame(&mut desk, &engine, false, 0.0);
    let orders = frame(&mut desk, &engine, false, 0.0);
    assert!(
        matches!(orders[..], [Order::Look(c)] if (c.look_at - Vec3::from(picked.position)).length() < 1e-5)
    );
    desk.click([2, 1], Tool::Orbit);
    frame(&mut desk, &engine, false, 0.0);
    assert_eq!(desk.picked, None);
    desk.sample = 3;
    desk.click([30, 22], Tool::Trace);
    let orders = frame(&mut desk, &engine, false, 0.0);
    let asked = Order::Trace {
        pixel: [30, 22],
        sample: 3,
    };
    assert_eq!(orders, [asked]);
    let traced = desk.traced.as_ref().expect("a path");
    assert!(traced.vertices.len() > 2 && desk.shows_trace);
}

#[test]
fn what_was_picked_is_followed_when_the_camera_moves() {
    let (mut desk, engine) = desk();
    desk.click([32, 20], Tool::Orbit);
    frame(&mut desk, &engine, false, 0.0);
    desk.drag_pan(0.2, 0.0);
    frame(&mut desk, &engine, false, 0.0);
    let [column, row] = desk.picked_pixel().expect("it is still there");
    assert!(
        (39..=41).contains(&column) && (19..=21).contains(&row),
        "{column},{row}"
    );
    desk.drag_pan(5.0, 0.0);
    frame(&mut desk, &engine, false, 0.0);
    assert_eq!(desk.picked_pixel(), None);
}

#[test]
fn frame_shows_what_was_picked_or_everything() {
    let (mut desk, engine) = desk();
    desk.command(Command::Frame);
    let orders = frame(&mut desk, &engine, false, 0.0);
    let [Order::Look(all)] = orders[..] else {
        panic!("{orders:?}");
    };
    assert!((all.look_at - Vec3::new(0.0, 0.1, 0.0)).length() < 1e-5);
    // The floor has no bounds: it is aimed at.
    desk.click([32, 39], Tool::Orbit);
    frame(&mut desk, &engine, false, 0.0);
    let floor = desk.picked.clone().expect("the floor");
    assert_eq!(floor.bounds, None);
    desk.command(Command::Frame);
    frame(&mut desk, &engine, false, 0.0);
    let aimed = desk.camera().expect("a camera");
    assert!((aimed.look_at - Vec3::from(floor.position)).length() < 1e-5);
}

#[test]
fn crops_are_within_the_picture() {
    let (mut desk, engine) = desk();
    desk.crop_to(Some([[10, 5], [20, 900]]));
    assert_eq!(
        frame(&mut desk, &engine, false, 0.0),
        [Order::Crop(Some([[10, 5], [20, 40]]))]
    );
    desk.crop_to(Some([[10, 5], [20, 40]]));
    assert!(
        frame(&mut desk, &engine, false, 0.0).is_empty(),
        "it is so already"
    );
    desk.command(Command::Leave);
    assert_eq!(frame(&mut desk, &engine, false, 0.0), [Order::Crop(None)]);
    for nothing in [[[5, 5], [5, 9]], [[0, 0], [64, 40]], [[90, 0], [99, 9]]] {
        desk.crop_to(Some(nothing));
        assert!(
            frame(&mut desk, &engine, false, 0.0).is_empty(),
            "{nothing:?}"
        );
    }
}

#[test]
fn snapshots_come_and_go() {
    let mut none = Desk::default();
    none.compare_by(Mode::Wipe);
    assert_eq!(
        (none.compare, none.snapshots.len()),
        (Mode::Off, 0),
        "there is no picture yet"
    );
    let (mut desk, engine) = desk();
    desk.command(Command::Wipe);
    assert_eq!(
        (desk.compare, desk.snapshots.len()),
        (Mode::Wipe, 1),
        "the first is taken by itself"
    );
    desk.command(Command::Wipe);
    assert!(desk.compare == Mode::Off && desk.reference().is_none());
    for expected in [Mode::Absolute, Mode::Relative, Mode::Squared, Mode::Off] {
        desk.command(Command::Difference);
        assert_eq!(desk.compare, expected);
    }
    for _ in 0..SNAPSHOTS + 3 {
        desk.command(Command::Snapshot);
    }
    assert_eq!(
        (desk.snapshots.len(), desk.chosen),
        (SNAPSHOTS, SNAPSHOTS - 1)
    );
    desk.compare_by(Mode::Flip);
    desk.forget(0);
    assert_eq!(desk.chosen, SNAPSHOTS - 2);
    for _ in 0..SNAPSHOTS {
        desk.forget(0);
    }
    assert_eq!((desk.snapshots.len(), desk.compare), (0, Mode::Off));
    desk.forget(7);
    desk.read_from = " some/good.exr ".to_owned();
    desk.read();
    frame(&mut desk, &engine, false, 0.0);
    assert_eq!(desk.snapshots.len(), 1);
    desk.read_from = "bad.exr".to_owned();
    desk.read();
    frame(&mut desk, &engine, false, 0.0);
    assert!(desk.note.as_ref().is_some_and(|note| note.is_bad));
}

#[test]
fn layers_are_recorded_when_they_are_wanted() {
    let (mut desk, engine) = desk();
    let names: Vec<String> = desk.layers().into_iter().map(|(name, _)| name).collect();
    let expected = [
        "error", "cost", "kernel", "samples", "albedo", "normal", "depth",
    ];
    assert!(!desk.has_layer("cost"), "nobody looks at it");
    assert_eq!(names, expected);
    desk.show(Some("albedo".to_owned()));
    let orders = frame(&mut desk, &engine, false, 0.0);
    assert_eq!(orders, [Order::Outputs(vec!["albedo".to_owned()])]);
    assert!(desk.has_layer("albedo"));
    desk.show(Some("error".to_owned()));
    desk.lay_over(Some("samples".to_owned()));
    assert!(
        frame(&mut desk, &engine, false, 0.0).is_empty(),
        "they are there already"
    );
    desk.lay_over(Some("kernel".to_owned()));
    let orders = frame(&mut desk, &engine, false, 0.0);
    assert_eq!(orders, [Order::Survey(true)]);
    assert!(desk.has_layer("cost") && desk.has_layer("kernel"));
    desk.lay_over(None);
    let orders = frame(&mut desk, &engine, false, 0.0);
    assert_eq!(orders, [Order::Survey(false)]);
    desk.record("albedo", false);
    assert_eq!(
        frame(&mut desk, &engine, false, 0.0),
        [Order::Outputs(Vec::new())]
    );
    // Those that the engine began with stay.
    engine.order(Order::Outputs(vec!["depth".to_owned()]));
    let mut later = Desk::default();
    later.take(engine.news(), Vec::new(), 0.0);
    later.record("albedo", true);
    let expected = Order::Outputs(vec!["depth".to_owned(), "albedo".to_owned()]);
    assert_eq!(later.settle(false, 0.0), [expected]);
    engine.order(Order::Outputs(Vec::new()));
    desk.take(engine.news(), Vec::new(), 0.0);
    desk.layer = None;
    let mut seen = Vec::new();
    for _ in 0..5 {
        desk.command(Command::NextLayer);
        seen.push(desk.layer.clone().unwrap_or_default());
    }
    assert_eq!(seen, ["error", "cost", "kernel", "samples", ""]);
}

#[test]
fn renders_end_as_they_are_asked_to() {
    let (mut desk, engine) = desk();
    assert_eq!(desk.samples, 64, "as the engine has it");
    desk.take_samples(64);
    desk.take_samples(0);
    assert!(frame(&mut desk, &engine, false, 0.0).is_empty());
    desk.take_samples(128);
    desk.goals = Goals::of("relmse=1e-3,time=5min");
    desk.order_goals();
    desk.goals = Goals::default();
    desk.order_goals();
    let expected = [
        Order::Samples(128),
        Order::Until(Some("relmse=1e-3,time=5min".to_owned())),
        Order::Until(None),
    ];
    assert_eq!(frame(&mut desk, &engine, false, 0.0), expected);
    desk.plan_by("auto");
    desk.plan_by("mega");
    desk.plan_by("threshold=");
    desk.go_to(900);
    desk.command(Command::NextFrame);
    desk.resize([0, 99_999]);
    let expected = [
        Order::Strategy("mega".to_owned()),
        Order::Strategy("threshold=1000".to_owned()),
        Order::Frame(48),
        Order::Size([1, 16_384]),
    ];
    assert_eq!(desk.settle(false, 0.0), expected);
}

#[test]
fn pictures_are_saved_by_name() {
    let (mut desk, engine) = desk();
    assert_eq!(desk.save_as, "ball.exr");
    desk.command(Command::Brighter);
    desk.save(Some("png"));
    let expected = Order::Save {
        path: PathBuf::from("ball.png"),
        exposure: 0.5,
    };
    assert_eq!(frame(&mut desk, &engine, false, 0.0), [expected]);
    assert_eq!(
        desk.note.as_ref().map(|n| n.text.as_str()),
        Some("Wrote ball.png")
    );
    desk.save_as = "  ".to_owned();
    desk.save(None);
    assert!(frame(&mut desk, &engine, false, 0.0).is_empty());
    assert!(desk.note.as_ref().is_some_and(|note| note.is_bad));
    desk.command(Command::WriteBack);
    assert_eq!(frame(&mut desk, &engine, false, 0.0), [Order::WriteBack]);
    engine.change(|news| {
        news.project = Arc::new(Project {
            is_scene: false,
            ..(*news.project).clone()
        });
    });
    desk.take(engine.news(), Vec::new(), 0.0);
    desk.command(Command::WriteBack);
    assert!(desk.settle(false, 0.0).is_empty());
}

#[test]
fn leaving_goes_from_the_inside_out() {
    let (mut desk, _) = desk();
    desk.shows_help = true;
    desk.tool = Tool::Crop;
    desk.crop = Some([[1, 1], [5, 5]]);
    desk.command(Command::Leave);
    assert!(!desk.shows_help && desk.tool == Tool::Crop);
    desk.command(Command::Leave);
    assert!(desk.tool == Tool::Orbit && desk.crop.is_some());
    desk.command(Command::Leave);
    assert_eq!(desk.crop, None);
    desk.command(Command::Leave);
}

#[test]
fn a_desk_without_anything_survives_every_command() {
    let commands = crate::window::keys::TABLE.iter().map(|row| row.command);
    let mut desk = Desk::default();
    for command in commands {
        desk.command(command);
        desk.command(command);
    }
    desk.click([0, 0], Tool::Orbit);
    desk.drag_orbit(1.0, f32::NAN);
    desk.settle(false, 0.0);
    desk.take(News::default(), vec![Answer::Picked(None)], 0.0);
}

#[test]
fn new_problems_come_to_the_front() {
    let (mut desk, engine) = desk();
    desk.drawer = Drawer::Trace;
    engine.break_files(true);
    desk.take(engine.news(), Vec::new(), 0.0);
    assert_eq!(desk.drawer, Drawer::Problems);
    desk.drawer = Drawer::Trace;
    desk.take(engine.news(), Vec::new(), 0.0);
    assert_eq!(desk.drawer, Drawer::Trace, "a hand has seen them");
}
