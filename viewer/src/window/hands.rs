//! What hands do while a frame is drawn, given to the window in pieces that it understands.
//!
//! egui sees where the pointer is at the end of a frame's events. Where frames are slow, a press and the drag that follows
//! fall into one, and the press seems to be where the drag has come to; a slider that is let go follows the hand as it
//! leaves. A frame therefore has nothing of the pointer behind a button that goes down or up: that is for the next one.

use eframe::egui::Event;

/// Cuts the events behind the first button if more of the pointer follows it. What is cut off comes in the next frame.
pub fn cut(events: &mut Vec<Event>) -> Vec<Event> {
    let is_button = |event: &Event| matches!(event, Event::PointerButton { .. });
    let is_pointer = |event: &Event| {
        is_button(event) || matches!(event, Event::PointerMoved(_) | Event::PointerGone)
    };
    match events.iter().position(is_button) {
        Some(button) if events[button + 1..].iter().any(is_pointer) => events.split_off(button + 1),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use eframe::egui::{Modifiers, PointerButton, Pos2, pos2};

    use super::*;

    fn to(x: f32) -> Event {
        Event::PointerMoved(pos2(x, 0.0))
    }

    fn button(pressed: bool) -> Event {
        Event::PointerButton {
            pos: Pos2::ZERO,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        }
    }

    #[test]
    fn a_press_a_drag_and_a_release_are_frames_of_their_own() {
        let text = Event::Text("a".to_owned());
        let all = vec![
            to(1.0),
            button(true),
            to(2.0),
            text,
            to(3.0),
            button(false),
            to(9.0),
        ];
        let mut rest = all.clone();
        let mut frames = Vec::new();
        while !rest.is_empty() {
            let mut now = rest;
            rest = cut(&mut now);
            frames.push(now.len());
        }
        assert_eq!(frames, [2, 4, 1]);
        let mut whole = vec![to(1.0), button(true)];
        assert!(cut(&mut whole).is_empty() && whole.len() == 2);
        let mut moves = vec![to(1.0), to(2.0), Event::PointerGone];
        assert!(cut(&mut moves).is_empty() && moves.len() == 3);
        assert!(cut(&mut Vec::new()).is_empty());
    }
}
