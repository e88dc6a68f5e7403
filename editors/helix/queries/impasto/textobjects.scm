; Generated from editors/tree-sitter-impasto/queries/textobjects.scm by
; `cargo run -p tree-sitter-impasto --example queries`. Change that file, not this one.

(material_definition
  body: (material_body) @class.inside) @class.around

(closure_definition
  body: (closure_body) @class.inside) @class.around

(struct_definition
  body: (field_list) @class.inside) @class.around

(function_definition
  body: (block) @function.inside) @function.around

(function_definition
  value: (_) @function.inside) @function.around

(method_definition
  body: (block) @function.inside) @function.around

(method_definition
  value: (_) @function.inside) @function.around

(parameters
  (parameter) @parameter.inside @parameter.around)

(method_parameters
  (name) @parameter.inside @parameter.around)

(arguments
  (_) @parameter.inside @parameter.around)

(param_declaration) @parameter.around

(param_declaration
  default: (_) @parameter.inside)

(call_expression) @call.outer

(call_expression
  arguments: (arguments) @call.inner)

(if_expression
  consequence: (block) @conditional.inner) @conditional.outer

(for_statement
  body: (block) @loop.inner) @loop.outer

(while_statement
  body: (block) @loop.inner) @loop.outer

[
  (line_comment)
  (block_comment)
  (documentation)
  (file_documentation)
] @comment.around
