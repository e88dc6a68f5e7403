; Generated from editors/tree-sitter-impasto/queries/highlights.scm by
; `cargo run -p tree-sitter-impasto --example queries`. Change that file, not this one.

; Comments

[
  (line_comment)
  (block_comment)
] @comment

(doc_comment) @comment.doc

; Literals

(integer) @number

(float) @number

(unit) @type

(boolean) @boolean

(string) @string

; Types

(type_identifier) @type

; Names that are defined

(material_definition
  name: (name) @type)

(struct_definition
  name: (name) @type)

(closure_definition
  name: (name) @function)

(function_definition
  name: (name) @function)

(method_definition
  name: (name) @function.method)

(constant_definition
  name: (name) @constant)

(param_declaration
  name: (name) @variable.parameter)

(parameter
  name: (name) @variable.parameter)

(method_parameters
  (name) @variable.parameter)

(field_declaration
  name: (field_identifier) @property)

(metadata_entry
  key: (field_identifier) @property)

; Names that are used

(module_identifier) @namespace

(function_identifier) @function

(named_argument
  name: (field_identifier) @variable.parameter)

(field_expression
  field: (field_identifier) @property)

(whole_material) @variable.special

((identifier) @constant
  (#match? @constant "^_*[A-Z][A-Z0-9_]*$"))

; What a material can ask of its surface, and what it assigns.
((identifier) @variable.special
  (#any-of? @variable.special
    "position" "normal" "geometric_normal" "tangent" "uv" "exterior_ior" "view" "instance_id" "object_position"
    "object_scale" "uv1" "vertex_color" "facing" "object_normal" "time" "frame"
    "surface" "emission" "interior" "opacity"))

; Keywords

[
  "material"
  "struct"
] @keyword

(closure_kind
  [
    "bsdf"
    "delta"
    "edf"
  ] @keyword)

"fn" @keyword

(test_definition
  "test" @keyword)

[
  "const"
  "private"
] @keyword

[
  "use"
  "as"
] @keyword

[
  "param"
  "let"
  "var"
  "assert"
] @keyword

[
  "if"
  "else"
  "when"
] @keyword

[
  "for"
  "in"
  "while"
  "limit"
  "break"
  "continue"
] @keyword

; Marks

[
  "="
  "+="
  "-="
  "*="
  "/="
  "%="
  "&="
  "|="
  "^="
  "<<="
  ">>="
  "||"
  "&&"
  "=="
  "!="
  "<"
  "<="
  ">"
  ">="
  "|"
  "^"
  "&"
  "<<"
  ">>"
  "+"
  "-"
  "*"
  "/"
  "%"
  "!"
  ".."
  "->"
] @operator

[
  ","
  ";"
  ":"
  "::"
  "."
] @punctuation.delimiter

[
  "("
  ")"
  "["
  "]"
  "{"
  "}"
] @punctuation.bracket
