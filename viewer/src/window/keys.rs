//! Every key of the window, in one table: the help lists it, and pressing follows it.

use eframe::egui::{Context, Event, Key, Modifiers};

/// What a key, a button or a menu asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Command {
    /// Shows and hides the list of keys.
    Help,
    /// Leaves what is going on: help, dialog, tool, crop.
    Leave,
    /// The camera as it is written.
    Home,
    /// What was picked, or else everything, in the middle of the picture.
    Frame,
    /// The tool that turns and picks.
    ToolOrbit,
    /// The tool that focuses.
    ToolFocus,
    /// The tool that traces paths.
    ToolTrace,
    /// The tool that crops.
    ToolCrop,
    /// Rests, and goes on.
    Pause,
    /// Begins the picture again.
    Restart,
    /// Reads all files again.
    Reload,
    /// The next frame of what moves.
    NextFrame,
    /// The one before.
    LastFrame,
    /// Half a stop brighter.
    Brighter,
    /// Half a stop darker.
    Darker,
    /// No stops.
    Exposure0,
    /// The next tone curve.
    NextCurve,
    /// The next channel.
    NextChannel,
    /// The next layer.
    NextLayer,
    /// Light in false color.
    FalseColor,
    /// Marks pixels that are cut.
    MarkClipped,
    /// Marks pixels that are no numbers.
    MarkNonfinite,
    /// Takes a snapshot.
    Snapshot,
    /// The wipe, and back.
    Wipe,
    /// The snapshot alone, and back.
    Flip,
    /// The next difference, and back.
    Difference,
    /// All of the picture.
    Fit,
    /// A pixel of the picture on each of the screen.
    ActualPixels,
    /// Twice as large.
    Larger,
    /// Half as large.
    Smaller,
    /// Shows and hides the panels.
    Panels,
    /// Takes the last value back.
    Undo,
    /// Gives it again.
    Redo,
    /// Writes what was set into the scene.
    WriteBack,
    /// Saves the picture.
    Save,
}

/// A key.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The group of the help that it stands in.
    pub group: &'static str,
    /// The key.
    pub key: Key,
    /// Ctrl, or Cmd on a Mac?
    pub is_command: bool,
    /// Shift? Of letters and digits only: signs are typed with and without.
    pub is_shift: bool,
    /// What it does.
    pub command: Command,
    /// The same in words.
    pub about: &'static str,
}

const fn row(group: &'static str, key: Key, command: Command, about: &'static str) -> Row {
    Row {
        group,
        key,
        is_command: false,
        is_shift: false,
        command,
        about,
    }
}

impl Row {
    const fn command(mut self) -> Self {
        self.is_command = true;
        self
    }

    const fn shift(mut self) -> Self {
        self.is_shift = true;
        self
    }

    /// The key as keyboards have it.
    pub fn keys(&self) -> String {
        let command = match (self.is_command, cfg!(target_os = "macos")) {
            (false, _) => "",
            (true, true) => "Cmd+",
            (true, false) => "Ctrl+",
        };
        let shift = if self.is_shift { "Shift+" } else { "" };
        format!("{command}{shift}{}", self.key.symbol_or_name())
    }

    fn is_pressed(&self, key: Key, modifiers: Modifiers) -> bool {
        let has_shift = is_letter(key);
        key == self.key
            && modifiers.command == self.is_command
            && !modifiers.alt
            && (!has_shift || modifiers.shift == self.is_shift)
    }
}

/// Is it a key whose Shift is asked for? Others, such as `?`, are typed with it or without.
fn is_letter(key: Key) -> bool {
    let name = key.name();
    name.len() == 1 && name.bytes().all(|b| b.is_ascii_alphanumeric())
}

const CAMERA: &str = "Camera";
const RENDER: &str = "Render";
const DISPLAY: &str = "Display";
const COMPARE: &str = "Compare";
const VIEW: &str = "View";
const FILES: &str = "Values and files";

/// All keys.
pub const TABLE: &[Row] = &[
    row(CAMERA, Key::Home, Command::Home, "camera as written"),
    row(
        CAMERA,
        Key::F,
        Command::Frame,
        "frame what was picked, or everything",
    ),
    row(
        CAMERA,
        Key::Num1,
        Command::ToolOrbit,
        "tool: turn, and pick by a click",
    ),
    row(
        CAMERA,
        Key::Num2,
        Command::ToolFocus,
        "tool: focus by a click",
    ),
    row(
        CAMERA,
        Key::Num3,
        Command::ToolTrace,
        "tool: trace a path by a click",
    ),
    row(CAMERA, Key::Num4, Command::ToolCrop, "tool: crop by a drag"),
    row(RENDER, Key::Space, Command::Pause, "pause, and go on"),
    row(RENDER, Key::R, Command::Restart, "begin the picture again"),
    row(RENDER, Key::F5, Command::Reload, "read all files again"),
    row(RENDER, Key::Period, Command::NextFrame, "next frame"),
    row(RENDER, Key::Comma, Command::LastFrame, "previous frame"),
    row(DISPLAY, Key::E, Command::Brighter, "half a stop brighter"),
    row(DISPLAY, Key::E, Command::Darker, "half a stop darker").shift(),
    row(DISPLAY, Key::Num0, Command::Exposure0, "exposure 0"),
    row(DISPLAY, Key::T, Command::NextCurve, "next tone curve"),
    row(DISPLAY, Key::C, Command::NextChannel, "next channel"),
    row(DISPLAY, Key::L, Command::NextLayer, "next layer"),
    row(DISPLAY, Key::X, Command::FalseColor, "false color"),
    row(DISPLAY, Key::Z, Command::MarkClipped, "mark clipped pixels"),
    row(
        DISPLAY,
        Key::N,
        Command::MarkNonfinite,
        "mark pixels that are not finite",
    ),
    row(COMPARE, Key::S, Command::Snapshot, "take a snapshot"),
    row(COMPARE, Key::W, Command::Wipe, "wipe, and back"),
    row(COMPARE, Key::B, Command::Flip, "snapshot alone, and back"),
    row(
        COMPARE,
        Key::D,
        Command::Difference,
        "next difference, and back",
    ),
    row(VIEW, Key::Num0, Command::Fit, "whole picture").command(),
    row(VIEW, Key::Num1, Command::ActualPixels, "actual pixels").command(),
    row(VIEW, Key::Plus, Command::Larger, "larger"),
    row(VIEW, Key::Equals, Command::Larger, "larger"),
    row(VIEW, Key::Minus, Command::Smaller, "smaller"),
    row(VIEW, Key::H, Command::Panels, "hide and show the panels"),
    row(VIEW, Key::Questionmark, Command::Help, "this list"),
    row(
        VIEW,
        Key::Escape,
        Command::Leave,
        "leave this list, a dialog, a tool, the crop",
    ),
    row(FILES, Key::Z, Command::Undo, "take the last value back").command(),
    row(FILES, Key::Z, Command::Redo, "give it again")
        .command()
        .shift(),
    row(
        FILES,
        Key::W,
        Command::WriteBack,
        "write values into the scene file",
    )
    .command()
    .shift(),
    row(FILES, Key::S, Command::Save, "save the picture").command(),
];

/// What a hand does on the picture without keys, for the help.
pub const MOUSE: &[(&str, &str)] = &[
    ("drag", "turn the camera"),
    ("middle drag, Shift+drag", "move it sideways"),
    ("wheel, right drag", "move it nearer and away"),
    ("click", "pick: material, source, position, value"),
    ("Ctrl+click", "focus there"),
    ("Shift+click", "trace a path from there"),
    ("Ctrl+wheel", "magnify the picture"),
    ("Ctrl+drag", "move the magnified picture"),
    ("double click", "aim at what is there"),
];

/// The row of a key that is pressed.
pub fn find(key: Key, modifiers: Modifiers) -> Option<&'static Row> {
    TABLE.iter().find(|row| row.is_pressed(key, modifiers))
}

/// The key of a command, for tooltips.
pub fn of(command: Command) -> Option<String> {
    let row = TABLE.iter().find(|row| row.command == command);
    row.map(Row::keys)
}

/// Takes the keys of this frame, unless somebody types a text.
pub fn pressed(ctx: &Context) -> Vec<Command> {
    if ctx.text_edit_focused() {
        return Vec::new();
    }
    ctx.input_mut(|input| {
        let mut commands = Vec::new();
        input.events.retain(|event| match event {
            Event::Key {
                key,
                pressed: true,
                modifiers,
                ..
            } => match find(*key, *modifiers) {
                Some(row) => {
                    commands.push(row.command);
                    false
                }
                None => true,
            },
            _ => true,
        });
        commands
    })
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn each_key_has_one_meaning_and_each_command_a_key() {
        let mut keys = HashSet::new();
        for row in TABLE {
            assert!(keys.insert(row.keys()), "{} is there twice", row.keys());
            assert!(!row.about.is_empty() && !row.about.ends_with('.'));
            let modifiers = Modifiers {
                command: row.is_command,
                ctrl: row.is_command,
                shift: row.is_shift,
                ..Modifiers::NONE
            };
            let found = find(row.key, modifiers).expect("it is in the table");
            assert_eq!(found.command, row.command, "{}", row.keys());
        }
        let groups: Vec<&str> = TABLE.iter().map(|row| row.group).collect();
        let mut seen = HashSet::new();
        for pair in groups.windows(2) {
            seen.insert(pair[0]);
            assert!(
                pair[0] == pair[1] || !seen.contains(pair[1]),
                "{} is torn",
                pair[1]
            );
        }
    }

    #[test]
    fn shift_matters_for_letters_and_not_for_signs() {
        let command = |key, modifiers| find(key, modifiers).map(|row| row.command);
        assert_eq!(command(Key::E, Modifiers::NONE), Some(Command::Brighter));
        assert_eq!(command(Key::E, Modifiers::SHIFT), Some(Command::Darker));
        assert_eq!(
            command(Key::Questionmark, Modifiers::SHIFT),
            Some(Command::Help)
        );
        assert_eq!(
            command(Key::Questionmark, Modifiers::NONE),
            Some(Command::Help)
        );
        assert_eq!(command(Key::F, Modifiers::ALT), None);
        assert_eq!(command(Key::Q, Modifiers::NONE), None);
    }

    /// The manual lists what the table has.
    #[test]
    fn the_manual_has_every_key() {
        let manual = include_str!("../../../docs/view.md");
        for row in TABLE {
            let keys = row.keys().replace("Cmd+", "Ctrl+");
            let line = format!("| `{keys}` | {} |", row.about);
            assert!(manual.contains(&line), "docs/view.md lacks\n{line}");
        }
        for (hand, about) in MOUSE {
            let line = format!("| {hand} | {about} |");
            assert!(manual.contains(&line), "docs/view.md lacks\n{line}");
        }
    }
}
