; Parameters have the color of parameters where they are used, too.

[
  (material_body)
  (closure_definition)
  (method_definition)
  (function_definition)
  (block)
] @local.scope

(param_declaration
  name: (name) @local.definition.variable.parameter)

(parameter
  name: (name) @local.definition.variable.parameter)

(method_parameters
  (name) @local.definition.variable.parameter)

(let_statement
  name: (name) @local.definition.variable)

(var_statement
  name: (name) @local.definition.variable)

(identifier) @local.reference
