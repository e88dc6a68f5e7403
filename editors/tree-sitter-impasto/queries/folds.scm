; What to fold.

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
