; Generated from editors/tree-sitter-impasto/queries/folds.scm by
; `cargo run -p tree-sitter-impasto --example queries`. Change that file, not this one.

[
  (file_documentation)
  (documentation)
  (block_comment)
  (use_list)
  (material_body)
  (closure_body)
  (field_list)
  (metadata)
  (parameters)
  (block)
  (arguments)
  (array_expression)
] @fold
