; Where Zed indents lines: within brackets, and below a line that goes on.

(_
  "{"
  "}" @end) @indent

(_
  "["
  "]" @end) @indent

(_
  "("
  ")" @end) @indent

[
  (let_statement)
  (var_statement)
  (assignment_statement)
  (param_declaration)
  (constant_definition)
] @indent
