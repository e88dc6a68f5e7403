; Where lines are indented, by the capture names of nvim-treesitter. Helix and Zed have queries of their own.

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
] @indent.begin

; A value on the lines below its name.
[
  (let_statement)
  (var_statement)
  (assignment_statement)
  (param_declaration)
  (constant_definition)
] @indent.begin

[
  "}"
  ")"
  "]"
] @indent.branch @indent.end

[
  (line_comment)
  (block_comment)
  (string)
] @indent.ignore

(ERROR
  [
    "{"
    "("
    "["
  ]) @indent.begin
