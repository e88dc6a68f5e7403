; What may be selected and jumped to, by the capture names of nvim-treesitter-textobjects. A material, closure or
; struct counts as a class.

(material_definition
  body: (material_body) @class.inner) @class.outer

(closure_definition
  body: (closure_body) @class.inner) @class.outer

(struct_definition
  body: (field_list) @class.inner) @class.outer

(function_definition
  body: (block) @function.inner) @function.outer

(function_definition
  value: (_) @function.inner) @function.outer

(method_definition
  body: (block) @function.inner) @function.outer

(method_definition
  value: (_) @function.inner) @function.outer

(parameters
  (parameter) @parameter.inner @parameter.outer)

(method_parameters
  (name) @parameter.inner @parameter.outer)

(arguments
  (_) @parameter.inner @parameter.outer)

(param_declaration) @parameter.outer

(param_declaration
  default: (_) @parameter.inner)

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
] @comment.outer
