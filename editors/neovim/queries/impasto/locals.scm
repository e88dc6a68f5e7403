; Generated from editors/tree-sitter-impasto/queries/locals.scm by
; `cargo run -p tree-sitter-impasto --example queries`. Change that file, not this one.

[
  (source_file)
  (material_body)
  (closure_definition)
  (method_definition)
  (function_definition)
  (test_definition)
  (block)
  (for_statement)
] @local.scope

(use_name
  !alias
  name: (identifier) @local.definition.import)

(use_name
  alias: (name) @local.definition.import)

(material_definition
  name: (name) @local.definition.type)

(struct_definition
  name: (name) @local.definition.type)

(constant_definition
  name: (name) @local.definition.constant)

(param_declaration
  name: (name) @local.definition.parameter)

(parameter
  name: (name) @local.definition.parameter)

(method_parameters
  (name) @local.definition.parameter)

(let_statement
  name: (name) @local.definition.var)

(var_statement
  name: (name) @local.definition.var)

(for_statement
  name: (name) @local.definition.var)

; Functions are defined in the scope around their own.
((function_definition
  name: (name) @local.definition.function)
  (#set! definition.function.scope "parent"))

((closure_definition
  name: (name) @local.definition.function)
  (#set! definition.function.scope "parent"))

(identifier) @local.reference

(function_identifier) @local.reference

(type_identifier) @local.reference
