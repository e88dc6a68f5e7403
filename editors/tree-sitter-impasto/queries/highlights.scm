; What to color, by the capture names of tree-sitter and Neovim. The queries for other editors are made from this one:
; `cargo run -p tree-sitter-impasto --example queries`.
;
; A node has one color at most, whichever pattern comes first (a test holds that). Plain variables have none.

; Comments

[
  (line_comment)
  (block_comment)
] @comment

(doc_comment) @comment.documentation

; Literals

(integer) @number

(float) @number.float

(unit) @type

(boolean) @boolean

(string) @string

; Types

(type_identifier) @type

; Names that are defined

(material_definition
  name: (name) @type.definition)

(struct_definition
  name: (name) @type.definition)

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
  name: (field_identifier) @variable.member)

(metadata_entry
  key: (field_identifier) @property)

; Names that are used

(module_identifier) @module

(function_identifier) @function.call

(named_argument
  name: (field_identifier) @variable.parameter)

(field_expression
  field: (field_identifier) @variable.member)

(whole_material) @variable.builtin

((identifier) @constant
  (#match? @constant "^_*[A-Z][A-Z0-9_]*$"))

; What a material can ask of its surface, and what it assigns.
((identifier) @variable.builtin
  (#any-of? @variable.builtin
    "position" "normal" "geometric_normal" "tangent" "uv" "exterior_ior" "view" "instance_id" "object_position"
    "object_scale" "uv1" "vertex_color" "facing" "object_normal" "time" "frame"
    "surface" "emission" "interior" "opacity"))

; Keywords

[
  "material"
  "struct"
] @keyword.type

(closure_kind
  [
    "bsdf"
    "delta"
    "edf"
  ] @keyword.type)

"fn" @keyword.function

(test_definition
  "test" @keyword.function)

[
  "const"
  "private"
] @keyword.modifier

[
  "use"
  "as"
] @keyword.import

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
] @keyword.conditional

[
  "for"
  "in"
  "while"
  "limit"
  "break"
  "continue"
] @keyword.repeat

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
