; Generated from editors/tree-sitter-impasto/queries/injections.scm by
; `cargo run -p tree-sitter-impasto --example queries`. Change that file, not this one.

((file_documentation
  (doc_comment
    text: (doc_text) @injection.content))
  (#set! injection.language "markdown")
  (#set! injection.combined))

((documentation
  (doc_comment
    text: (doc_text) @injection.content))
  (#set! injection.language "markdown")
  (#set! injection.combined))

([
  (line_comment)
  (block_comment)
] @injection.content
  (#set! injection.language "comment"))
