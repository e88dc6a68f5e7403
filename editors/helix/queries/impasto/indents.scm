; Where Helix indents lines: within brackets, and below a line that goes on.

[
  (use_list)
  (material_body)
  (closure_body)
  (field_list)
  (metadata)
  (parameters)
  (method_parameters)
  (block)
  (arguments)
  (array_expression)
  (parenthesized_expression)
] @indent

[
  (let_statement)
  (var_statement)
  (assignment_statement)
  (param_declaration)
  (constant_definition)
  (binary_expression)
] @indent

[
  "}"
  ")"
  "]"
] @outdent
