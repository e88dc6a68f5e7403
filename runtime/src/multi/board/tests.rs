//! The board with devices that are numbers: every sample is taken once, whatever happens, and all end together.

use super::*;
use crate::film::ranges;

/// A device that takes samples at a rate, and has some in flight.
#[derive(Clone)]
struct Device {
    rate: f64,
    in_flight: f64,
    /// When it is lost, if it is.
    lost_at: f64,
    pass: Option<Pass>,
    is_done: bool,
}

#[derive(Clone)]
struct Pass {
    range: Range,
    all: u64,
    finished: f64,
}

impl Device {
    fn of(rate: f64) -> Self {
        Self {
            rate,
            in_flight: 2.0,
            lost_at: f64::INFINITY,
            pass: None,
            is_done: false,
        }
    }
}

/// What came of it.
struct Outcome {
    seconds: f64,
    /// Samples that are in the common film, each time that they were put there.
    put: Vec<Range>,
    passes: usize,
    calls: usize,
}

/// Events of a render.
#[derive(Clone, Copy, Default)]
struct Events {
    stop_at: Option<f64>,
    call_every: Option<f64>,
}

const STEP: f64 = 0.01;

fn run(ranges: &[Range], devices: &mut [Device], worthwhile: f64, events: Events) -> Outcome {
    let mut board = Board::new(ranges, &vec![false; devices.len()], worthwhile);
    let mut outcome = Outcome {
        seconds: 0.0,
        put: Vec::new(),
        passes: 0,
        calls: 0,
    };
    let (mut now, mut called) = (0.0, 0.0);
    while !board.is_left() {
        assert!(now < 1e4, "it does not end: {board:?}");
        for (index, device) in devices.iter_mut().enumerate() {
            if !device.is_done {
                advance(&mut board, index, device, now, &mut outcome);
            }
        }
        if events.stop_at.is_some_and(|at| now >= at) {
            board.stop();
        }
        if events.call_every.is_some_and(|every| now - called >= every) && board.is_answered() {
            board.call();
            (called, outcome.calls) = (now, outcome.calls + 1);
        }
        now += STEP;
    }
    outcome.seconds = now;
    outcome
}

/// Lets a device work for a step.
fn advance(board: &mut Board, index: usize, device: &mut Device, now: f64, outcome: &mut Outcome) {
    if now >= device.lost_at {
        board.lost(index);
        board.leave(index);
        device.is_done = true;
        return;
    }
    if let Some(pass) = &mut device.pass {
        pass.finished = (pass.finished + device.rate * STEP).min(pass.all as f64);
        if board.look(index, pass.finished) == Order::Halt {
            let begun = (pass.finished + device.in_flight).ceil() as u64;
            let begun = begun.min(pass.all);
            let keep = board.keep(index, begun, now);
            assert!((begun..=pass.all).contains(&keep), "{begun} {keep}");
            pass.all = keep;
        }
        if pass.finished < pass.all as f64 {
            return;
        }
        board.passed(index, pass.all, now);
        device.pass = None;
    }
    loop {
        match board.next(index, now) {
            Step::Take(range) => {
                outcome.passes += 1;
                device.pass = Some(Pass {
                    all: range.count,
                    range,
                    finished: 0.0,
                });
                assert!(device.pass.as_ref().is_some_and(|p| p.range.count > 0));
                return;
            }
            Step::Put => outcome.put.extend(board.put(index)),
            Step::Wait => return,
            Step::Done => {
                board.leave(index);
                device.is_done = true;
                return;
            }
        }
    }
}

fn range(first: u64, count: u64) -> Range {
    Range { first, count }
}

/// All samples that were put, if none was put twice.
fn once(put: &[Range]) -> Vec<Range> {
    let mut all = Vec::new();
    for range in put {
        assert_eq!(ranges::shared(&all, &[*range]), None, "{put:?}");
        all = ranges::joined(&all, &[*range]);
    }
    all
}

#[test]
fn equal_devices_take_a_pass_each() {
    let mut devices = vec![Device::of(100.0); 4];
    let outcome = run(&[range(0, 4000)], &mut devices, 0.05, Events::default());
    assert_eq!(once(&outcome.put), [range(0, 4000)]);
    assert_eq!(outcome.passes, 4);
    assert!(outcome.seconds < 10.1, "{}", outcome.seconds);
}

#[test]
fn unequal_devices_end_together() {
    for rates in [
        &[100.0, 50.0][..],
        &[100.0, 7.0],
        &[10.0, 300.0, 20.0],
        &[100.0, 100.0, 100.0, 50.0],
    ] {
        let mut devices: Vec<Device> = rates.iter().map(|rate| Device::of(*rate)).collect();
        let all = 20_000;
        let outcome = run(&[range(5, all)], &mut devices, 0.05, Events::default());
        assert_eq!(once(&outcome.put), [range(5, all)]);
        let ideal = all as f64 / rates.iter().sum::<f64>();
        let ratio = outcome.seconds / ideal;
        assert!(ratio < 1.02, "{rates:?}: {ratio}");
        assert!(outcome.passes <= 5 * rates.len(), "{}", outcome.passes);
    }
}

/// A device whose rate says nothing of how it goes on.
#[test]
fn a_device_that_becomes_slow_does_not_hold_up_the_others() {
    let mut board = Board::new(&[range(0, 200)], &[false; 2], 0.05);
    assert_eq!(board.next(0, 0.0), Step::Take(range(0, 100)));
    assert_eq!(board.next(1, 0.0), Step::Take(range(100, 100)));
    // It takes 10 samples at once, and then none.
    assert_eq!(board.look(1, 10.0), Order::GoOn);
    assert_eq!(board.look(0, 99.0), Order::GoOn);
    board.passed(0, 100, 10.0);
    // What it holds is safe before it waits.
    assert_eq!(board.next(0, 10.0), Step::Put);
    assert_eq!(board.put(0), [range(0, 100)]);
    assert_eq!(board.next(0, 10.0), Step::Wait);
    assert_eq!(board.look(1, 10.0), Order::Halt);
    let kept = board.keep(1, 12, 10.0);
    assert!((12..30).contains(&kept), "{kept}");
    let Step::Take(given) = board.next(0, 10.0) else {
        panic!("{board:?}");
    };
    assert_eq!((given.first, given.end()), (100 + kept, 200));
}

#[test]
fn samples_of_a_lost_device_are_taken_by_others() {
    let mut devices = vec![Device::of(50.0), Device::of(50.0), Device::of(25.0)];
    devices[1].lost_at = 7.0;
    let events = Events {
        call_every: Some(2.0),
        stop_at: None,
    };
    let outcome = run(&[range(0, 3000)], &mut devices, 0.05, events);
    assert_eq!(once(&outcome.put), [range(0, 3000)]);
    assert!(outcome.calls > 3);
    // The last of all, while the others have nothing to do.
    let mut devices = vec![Device::of(100.0), Device::of(1.0)];
    devices[1].lost_at = 11.0;
    let outcome = run(&[range(0, 20)], &mut devices, 1e9, Events::default());
    assert_eq!(once(&outcome.put), [range(0, 20)]);
    // All of them.
    let mut devices = vec![Device::of(50.0); 2];
    devices.iter_mut().for_each(|device| device.lost_at = 5.0);
    let outcome = run(&[range(0, 3000)], &mut devices, 0.05, events);
    assert!(count(&once(&outcome.put)) < 3000);
}

#[test]
fn after_a_stop_only_what_is_begun_is_taken() {
    let mut devices = vec![Device::of(50.0), Device::of(200.0)];
    let events = Events {
        stop_at: Some(3.0),
        call_every: None,
    };
    let outcome = run(&[range(0, 3000)], &mut devices, 0.05, events);
    let taken = count(&once(&outcome.put));
    assert!((700..800).contains(&taken), "{taken}");
    assert!(outcome.seconds < 3.2, "{}", outcome.seconds);
}

#[test]
fn fewer_samples_than_devices_and_ranges_with_gaps_are_taken() {
    let mut devices = vec![Device::of(1.0); 4];
    let outcome = run(&[range(3, 2)], &mut devices, 0.05, Events::default());
    assert_eq!(once(&outcome.put), [range(3, 2)]);
    let gaps = [range(0, 3), range(5, 1), range(9, 100)];
    let outcome = run(
        &gaps,
        &mut vec![Device::of(9.0); 3],
        0.05,
        Events::default(),
    );
    assert_eq!(once(&outcome.put), gaps);
    let outcome = run(&[], &mut vec![Device::of(9.0); 3], 0.05, Events::default());
    assert_eq!(outcome.put, []);
}

/// Whatever the rates, losses and calls are.
#[test]
fn every_sample_is_taken_once() {
    let mut state = 1u64;
    let mut random = |below: u64| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 33) % below
    };
    for _ in 0..300 {
        let count = 1 + random(5) as usize;
        let mut devices: Vec<Device> = (0..count)
            .map(|_| Device {
                rate: 1.0 + random(200) as f64,
                in_flight: random(30) as f64,
                lost_at: match random(3) {
                    0 => random(900) as f64 * 0.01,
                    _ => f64::INFINITY,
                },
                pass: None,
                is_done: false,
            })
            .collect();
        devices[0].lost_at = f64::INFINITY;
        let all = [
            range(random(9), 1 + random(900)),
            range(1000, 1 + random(900)),
        ];
        let events = Events {
            call_every: (random(2) == 0).then_some(0.3),
            stop_at: None,
        };
        let worthwhile = [0.0, 0.05, 1.0][random(3) as usize];
        let outcome = run(&all, &mut devices, worthwhile, events);
        assert_eq!(once(&outcome.put), ranges::joined(&all, &[]));
    }
}
