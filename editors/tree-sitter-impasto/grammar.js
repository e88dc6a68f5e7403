/**
 * The grammar of Impasto for editors. It agrees with the compiler's parser on every source that has no syntax error:
 * the tests of this crate compare the two trees. Where the compiler only complains (a chain of comparisons, a `use`
 * after a definition), this grammar may be wider, since an editor colors what is there.
 *
 * `src/scanner.c` reads what a regular expression cannot tell: `0..8` from `0.`, `12um` from `12u`, units from names,
 * and documentation from comments.
 *
 * After a change: `tree-sitter generate && tree-sitter test`, then `cargo test -p tree-sitter-impasto`.
 */

/// <reference types="tree-sitter-cli/dsl" />
// @ts-check

// Infix operators, loosest first.
const OPERATORS = [
  ["||"],
  ["&&"],
  ["==", "!=", "<", "<=", ">", ">="],
  ["|"],
  ["^"],
  ["&"],
  ["<<", ">>"],
  ["+", "-"],
  ["*", "/", "%"],
];

const PREFIX = OPERATORS.length + 1;
const POSTFIX = PREFIX + 1;

const ASSIGNMENTS = ["=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<=", ">>="];

// Reserved words: a half-typed statement does not swallow the one below it as a name.
const KEYWORDS = [
  "material", "bsdf", "delta", "edf", "fn", "struct",
  "const", "private", "use", "as", "param", "let", "var", "if", "else",
  "for", "in", "while", "limit", "break", "continue", "assert",
  "when", "true", "false",
];

/** `item, item, ...`, of which there may be none; a comma may follow the last. */
function list(item) {
  return optional(seq(item, repeat(seq(",", item)), optional(",")));
}

/** What may stand before the keyword of a definition. */
function start($) {
  return [optional(field("documentation", $.documentation)), optional("private")];
}

export default grammar({
  name: "impasto",

  word: $ => $.identifier,

  extras: $ => [/[ \t\r\n\f]/, $.line_comment, $.block_comment],

  externals: $ => [
    $.integer,
    $.float,
    $.unit,
    $._doc_marker,
    $._file_doc_marker,
    $.doc_text,
    $.unterminated,
    // Never in a rule: valid only while the parser recovers from an error.
    $._recovering,
  ],

  supertypes: $ => [$.item, $.statement, $.expression],

  reserved: {
    global: _ => KEYWORDS,
  },

  rules: {
    source_file: $ => seq(
      optional($.file_documentation),
      repeat(choice($.use_declaration, $.item)),
    ),

    // Documentation

    file_documentation: $ => repeat1(alias($._file_doc_line, $.doc_comment)),

    _file_doc_line: $ => seq($._file_doc_marker, optional(field("text", $.doc_text))),

    documentation: $ => repeat1($.doc_comment),

    doc_comment: $ => seq($._doc_marker, optional(field("text", $.doc_text))),

    line_comment: _ => token(/\/\/[^\n]*/),

    block_comment: _ => token(seq("/*", /[^*]*\*+([^/*][^*]*\*+)*/, "/")),

    // Imports

    use_declaration: $ => seq(
      "use",
      $._path,
      "::",
      choice($._use_name, $.use_list),
      ";",
    ),

    _path: $ => choice(
      field("path", $._module),
      seq($._path, "::", field("path", $._module)),
    ),

    _module: $ => choice(
      alias($.identifier, $.module_identifier),
      // Folders of the library are named like what they hold.
      alias("bsdf", $.module_identifier),
      alias("edf", $.module_identifier),
    ),

    _segment: $ => choice($.identifier, alias("bsdf", $.identifier), alias("edf", $.identifier)),

    use_list: $ => seq("{", list(alias($._plain_use_name, $.use_name)), "}"),

    _use_name: $ => alias($._any_use_name, $.use_name),

    _any_use_name: $ => seq(field("name", $._segment), optional($._alias)),

    _plain_use_name: $ => seq(field("name", $.identifier), optional($._alias)),

    _alias: $ => seq("as", field("alias", $._name)),

    // Definitions

    item: $ => choice(
      $.material_definition,
      $.closure_definition,
      $.function_definition,
      $.struct_definition,
      $.constant_definition,
      $.test_definition,
    ),

    material_definition: $ => seq(
      ...start($),
      "material",
      field("name", $._name),
      field("body", $.material_body),
    ),

    material_body: $ => seq("{", repeat(choice($.param_declaration, $.statement)), "}"),

    param_declaration: $ => seq(
      optional(field("documentation", $.documentation)),
      "param",
      field("name", $._name),
      ":",
      field("type", $.type),
      "=",
      field("default", $.expression),
      optional(field("range", $.range)),
      optional(field("metadata", $.metadata)),
      ";",
    ),

    range: $ => seq("in", field("low", $.expression), "..", field("high", $.expression)),

    metadata: $ => seq("{", list($.metadata_entry), "}"),

    metadata_entry: $ => seq(
      field("key", alias($.identifier, $.field_identifier)),
      ":",
      field("value", $.expression),
      optional(seq("..", field("high", $.expression))),
    ),

    closure_definition: $ => seq(
      ...start($),
      field("kind", $.closure_kind),
      field("name", $._name),
      field("parameters", $.parameters),
      field("body", $.closure_body),
    ),

    closure_kind: _ => choice("bsdf", seq("delta", "bsdf"), "edf"),

    closure_body: $ => seq("{", repeat(choice($.let_statement, $.method_definition)), "}"),

    method_definition: $ => seq(
      field("name", $._name),
      field("parameters", $.method_parameters),
      $._body,
    ),

    method_parameters: $ => seq("(", list($._name), ")"),

    function_definition: $ => seq(
      ...start($),
      "fn",
      field("name", $._name),
      field("parameters", $.parameters),
      "->",
      field("result", $.type),
      $._body,
    ),

    parameters: $ => seq("(", list($.parameter), ")"),

    parameter: $ => seq(
      field("name", $._name),
      ":",
      field("type", $.type),
      optional(seq("=", field("default", $.expression))),
    ),

    _body: $ => choice(
      seq("=", field("value", $.expression), optional(field("condition", $.when_clause)), ";"),
      field("body", $.block),
    ),

    when_clause: $ => seq("when", $.expression),

    struct_definition: $ => seq(
      ...start($),
      "struct",
      field("name", $._name),
      field("body", $.field_list),
    ),

    field_list: $ => seq("{", list($.field_declaration), "}"),

    field_declaration: $ => seq(
      optional(field("documentation", $.documentation)),
      field("name", alias($.identifier, $.field_identifier)),
      ":",
      field("type", $.type),
    ),

    constant_definition: $ => seq(
      ...start($),
      "const",
      field("name", $._name),
      ":",
      field("type", $.type),
      "=",
      field("value", $.expression),
      ";",
    ),

    // The word is not reserved: only a title behind it makes a test.
    test_definition: $ => seq(
      optional(field("documentation", $.documentation)),
      "test",
      field("title", $.string),
      field("body", $.block),
    ),

    type: $ => seq(
      field("name", choice(
        alias($.identifier, $.type_identifier),
        alias("bsdf", $.type_identifier),
        alias("edf", $.type_identifier),
      )),
      optional(field("array", $.array_length)),
    ),

    array_length: $ => seq("[", optional($.expression), "]"),

    // Statements

    block: $ => seq("{", repeat($.statement), optional(field("value", $.expression)), "}"),

    statement: $ => choice(
      $.let_statement,
      $.var_statement,
      $.assignment_statement,
      $.for_statement,
      $.while_statement,
      $.break_statement,
      $.continue_statement,
      $.assert_statement,
      // An `if` that starts a statement ends it, too: `if a { } -b` is two.
      prec(1, $.if_expression),
    ),

    let_statement: $ => seq("let", $._binding),

    var_statement: $ => seq("var", $._binding),

    _binding: $ => seq(
      field("name", $._name),
      optional(seq(":", field("type", $.type))),
      "=",
      field("value", $.expression),
      ";",
    ),

    assignment_statement: $ => seq(
      field("place", choice($.expression, alias("material", $.whole_material))),
      field("operator", choice(...ASSIGNMENTS)),
      field("value", $.expression),
      ";",
    ),

    for_statement: $ => seq(
      "for",
      field("name", $._name),
      "in",
      field("low", $.expression),
      "..",
      field("high", $.expression),
      field("body", $.block),
    ),

    while_statement: $ => seq(
      "while",
      field("condition", $.expression),
      optional(seq("limit", field("limit", $.expression))),
      field("body", $.block),
    ),

    break_statement: _ => seq("break", ";"),

    continue_statement: _ => seq("continue", ";"),

    assert_statement: $ => seq("assert", field("condition", $.expression), ";"),

    // Expressions

    expression: $ => choice(
      $.boolean,
      $.integer,
      $.float,
      $.quantity,
      $.string,
      $.identifier,
      $.call_expression,
      $.field_expression,
      $.index_expression,
      $.array_expression,
      $.unary_expression,
      $.binary_expression,
      $.parenthesized_expression,
      $.if_expression,
      $.block,
    ),

    boolean: _ => choice("true", "false"),

    quantity: $ => seq(field("number", choice($.integer, $.float)), field("unit", $.unit)),

    // A string ends on its line. One that does not is half typed: it ends there, with a node that says so.
    string: $ => seq('"', optional($.string_content), choice(token.immediate('"'), $.unterminated)),

    string_content: _ => token.immediate(prec(1, /[^"\r\n]+/)),

    call_expression: $ => prec(POSTFIX, seq(
      field("function", alias($.identifier, $.function_identifier)),
      field("arguments", $.arguments),
    )),

    arguments: $ => seq("(", list(choice($.expression, $.named_argument)), ")"),

    named_argument: $ => seq(field("name", alias($.identifier, $.field_identifier)), ":", field("value", $.expression)),

    field_expression: $ => prec(POSTFIX, seq(
      field("value", $.expression),
      ".",
      field("field", alias($.identifier, $.field_identifier)),
    )),

    index_expression: $ => prec(POSTFIX, seq(
      field("value", $.expression),
      "[",
      field("index", $.expression),
      "]",
    )),

    array_expression: $ => seq("[", list($.expression), "]"),

    parenthesized_expression: $ => seq("(", $.expression, ")"),

    unary_expression: $ => prec(PREFIX, seq(
      field("operator", choice("-", "!")),
      field("argument", $.expression),
    )),

    binary_expression: $ => choice(...OPERATORS.flatMap((level, i) => level.map(operator =>
      prec.left(i + 1, seq(
        field("left", $.expression),
        field("operator", operator),
        field("right", $.expression),
      ))
    ))),

    if_expression: $ => seq(
      "if",
      field("condition", $.expression),
      field("consequence", $.block),
      optional(field("alternative", $.else_clause)),
    ),

    else_clause: $ => seq("else", choice($.block, $.if_expression)),

    // Where a name is defined; elsewhere it is an `identifier`.
    _name: $ => alias($.identifier, $.name),

    identifier: _ => /[A-Za-z_][A-Za-z0-9_]*/,
  },
});
