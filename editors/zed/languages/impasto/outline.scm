; What Zed's outline shows.

(material_definition
  "material" @context
  name: (name) @name) @item

(closure_definition
  kind: (closure_kind) @context
  name: (name) @name) @item

(function_definition
  "fn" @context
  name: (name) @name) @item

(struct_definition
  "struct" @context
  name: (name) @name) @item

(constant_definition
  "const" @context
  name: (name) @name) @item

(param_declaration
  "param" @context
  name: (name) @name) @item

(method_definition
  name: (name) @name) @item

[
  (documentation)
  (line_comment)
] @annotation
