//! The queries of each editor, made from those of the grammar: editors differ in the names of colors and of what is selected.

use std::path::PathBuf;

/// An editor's folder below `editors/`, the queries that are made for it, and its names of captures.
pub(crate) struct Editor {
    folder: &'static str,
    queries: &'static [&'static str],
    /// The grammar's name and the editor's. The first that is a prefix up to a dot counts.
    names: &'static [(&'static str, &'static str)],
}

/// Adding an editor is adding a row.
pub(crate) const EDITORS: [Editor; 3] = [
    Editor {
        folder: "neovim/queries/impasto",
        queries: &[
            "highlights",
            "locals",
            "folds",
            "indents",
            "injections",
            "textobjects",
        ],
        names: &[],
    },
    Editor {
        folder: "helix/queries/impasto",
        queries: &["highlights", "injections", "textobjects"],
        names: &[
            ("boolean", "constant.builtin.boolean"),
            ("comment.documentation", "comment.block.documentation"),
            ("function.call", "function"),
            ("keyword.conditional", "keyword.control.conditional"),
            ("keyword.import", "keyword.control.import"),
            ("keyword.modifier", "keyword.storage.modifier"),
            ("keyword.repeat", "keyword.control.repeat"),
            ("keyword.type", "keyword.storage.type"),
            ("module", "namespace"),
            ("number.float", "constant.numeric.float"),
            ("number", "constant.numeric.integer"),
            ("property", "variable.other.member"),
            ("type.definition", "type"),
            ("variable.member", "variable.other.member"),
            ("class.outer", "class.around"),
            ("class.inner", "class.inside"),
            ("function.outer", "function.around"),
            ("function.inner", "function.inside"),
            ("parameter.outer", "parameter.around"),
            ("parameter.inner", "parameter.inside"),
            ("comment.outer", "comment.around"),
        ],
    },
    Editor {
        folder: "zed/languages/impasto",
        queries: &["highlights", "injections", "textobjects"],
        names: &[
            ("comment.documentation", "comment.doc"),
            ("function.call", "function"),
            ("keyword.conditional", "keyword"),
            ("keyword.function", "keyword"),
            ("keyword.import", "keyword"),
            ("keyword.modifier", "keyword"),
            ("keyword.repeat", "keyword"),
            ("keyword.type", "keyword"),
            ("module", "namespace"),
            ("number.float", "number"),
            ("type.definition", "type"),
            ("variable.builtin", "variable.special"),
            ("variable.member", "property"),
            ("class.outer", "class.around"),
            ("class.inner", "class.inside"),
            ("function.outer", "function.around"),
            ("function.inner", "function.inside"),
            ("comment.outer", "comment.around"),
        ],
    },
];

/// The file of each query of an editor, below the folder `editors`, with its text.
pub(crate) fn files(editor: &Editor) -> Vec<(PathBuf, String)> {
    let queries = editor.queries.iter().map(|name| {
        let text = match *name {
            "highlights" => tree_sitter_impasto::HIGHLIGHTS_QUERY,
            "locals" => tree_sitter_impasto::LOCALS_QUERY,
            "folds" => tree_sitter_impasto::FOLDS_QUERY,
            "indents" => tree_sitter_impasto::INDENTS_QUERY,
            "injections" => tree_sitter_impasto::INJECTIONS_QUERY,
            _ => tree_sitter_impasto::TEXTOBJECTS_QUERY,
        };
        let file = PathBuf::from(editor.folder).join(format!("{name}.scm"));
        (file, translated(editor, name, text))
    });
    queries.collect()
}

/// The text with the editor's names of captures, and a first line that says where it is from.
fn translated(editor: &Editor, name: &str, text: &str) -> String {
    // What the comment at the top says of names is not true of the copy.
    let body = text.split_once("\n\n").map_or(text, |(_, body)| body);
    let head = format!(
        "; Generated from editors/tree-sitter-impasto/queries/{name}.scm by\n\
         ; `cargo run -p tree-sitter-impasto --example queries`. Change that file, not this one.\n\n"
    );
    let mut out = head;
    let mut rest = body;
    while let Some(at) = rest.find('@') {
        let (before, after) = rest.split_at(at + 1);
        let end =
            after.find(|c: char| !(c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-')));
        let (capture, behind) = after.split_at(end.unwrap_or(after.len()));
        let own = editor.names.iter().find(|(from, _)| *from == capture);
        out += before;
        out += own.map_or(capture, |(_, to)| *to);
        rest = behind;
    }
    out + rest
}
