//! The editors' tree in the compiler's notation (`impasto emit --what ast`), so that the two can be compared.

use tree_sitter::Node;

use impasto_compiler::lexer::doc_text;

/// The tree of `text` as the compiler prints its own, but for line breaks.
pub(crate) fn printed(text: &str, file: Node<'_>) -> String {
    let printer = Printer { text };
    let (mut out, mut tests) = (Vec::new(), Vec::new());
    for node in printer.children(file) {
        match node.kind() {
            "file_documentation" => out.push(printer.documentation(node)),
            "use_declaration" => out.push(printer.import(node)),
            "test_definition" => tests.push(printer.test(node)),
            _ => out.push(printer.item(node)),
        }
    }
    out.extend(tests);
    out.join(" ")
}

struct Printer<'t> {
    text: &'t str,
}

fn list(entries: impl IntoIterator<Item = String>) -> String {
    let entries: Vec<String> = entries.into_iter().collect();
    format!("({})", entries.join(" "))
}

fn field<'t>(node: Node<'t>, name: &str) -> Node<'t> {
    node.child_by_field_name(name)
        .unwrap_or_else(|| panic!("a {} has a {name}: {}", node.kind(), node.to_sexp()))
}

impl<'t> Printer<'t> {
    fn text(&self, node: Node<'_>) -> &'t str {
        &self.text[node.byte_range()]
    }

    fn word(&self, node: Node<'_>) -> String {
        self.text(node).to_owned()
    }

    /// What stands below a node and means something.
    fn children<'n>(&self, node: Node<'n>) -> Vec<Node<'n>> {
        let mut cursor = node.walk();
        let named = node.named_children(&mut cursor);
        named
            .filter(|n| !matches!(n.kind(), "line_comment" | "block_comment"))
            .collect()
    }

    fn has_word(&self, node: Node<'_>, word: &str) -> bool {
        let mut cursor = node.walk();
        node.children(&mut cursor).any(|n| n.kind() == word)
    }

    fn documentation(&self, node: Node<'_>) -> String {
        let lines = self.children(node).into_iter().map(|line| {
            let line = self.text(line);
            format!("{:?}", doc_text(line.strip_suffix('\n').unwrap_or(line)))
        });
        list(["doc".to_owned()].into_iter().chain(lines))
    }

    fn optional_documentation(&self, node: Node<'_>) -> Option<String> {
        let docs = node.child_by_field_name("documentation");
        docs.map(|docs| self.documentation(docs))
    }

    fn import(&self, node: Node<'_>) -> String {
        let mut cursor = node.walk();
        let path = node.children_by_field_name("path", &mut cursor);
        let path: Vec<&str> = path.map(|n| self.text(n)).collect();
        let names = self
            .children(node)
            .into_iter()
            .flat_map(|n| match n.kind() {
                "use_list" => self.children(n),
                "use_name" => vec![n],
                _ => Vec::new(),
            });
        let names = names.map(|n| {
            let name = self.word(field(n, "name"));
            match n.child_by_field_name("alias") {
                Some(alias) => list(["as".to_owned(), name, self.word(alias)]),
                None => name,
            }
        });
        let head = ["use".to_owned(), path.join("::")];
        list(head.into_iter().chain(names))
    }

    fn item(&self, node: Node<'_>) -> String {
        let kind = match node.kind() {
            "material_definition" => "material".to_owned(),
            "function_definition" => "fn".to_owned(),
            "struct_definition" => "struct".to_owned(),
            "constant_definition" => "const".to_owned(),
            "closure_definition" => {
                let words = self.text(field(node, "kind")).split_whitespace();
                words.collect::<Vec<_>>().join("-")
            }
            other => panic!("no item: {other}"),
        };
        let mut entries = vec![kind, self.word(field(node, "name"))];
        if self.has_word(node, "private") {
            entries.push("private".to_owned());
        }
        entries.extend(self.optional_documentation(node));
        match node.kind() {
            "material_definition" => {
                let inner = self.children(field(node, "body"));
                let is_param = |n: &Node<'_>| n.kind() == "param_declaration";
                let params = inner.iter().filter(|n| is_param(n));
                entries.extend(params.map(|n| self.material_param(*n)));
                let rest = inner.iter().filter(|n| !is_param(n));
                entries.extend(rest.map(|n| self.statement(*n)));
            }
            "closure_definition" => {
                entries.extend(self.parameters(field(node, "parameters")));
                let inner = self.children(field(node, "body"));
                entries.extend(inner.iter().map(|n| match n.kind() {
                    "let_statement" => self.statement(*n),
                    _ => self.method(*n),
                }));
            }
            "function_definition" => {
                entries.extend(self.parameters(field(node, "parameters")));
                let result = self.type_name(field(node, "result"));
                entries.push(list(["->".to_owned(), result]));
                entries.extend(self.body(node));
            }
            "struct_definition" => {
                let fields = self.children(field(node, "body"));
                entries.extend(fields.into_iter().map(|n| {
                    let name = self.word(field(n, "name"));
                    let ty = self.type_name(field(n, "type"));
                    let head = ["field".to_owned(), name, ty];
                    list(head.into_iter().chain(self.optional_documentation(n)))
                }));
            }
            _ => {
                entries.push(self.type_name(field(node, "type")));
                entries.push(self.expression(field(node, "value")));
            }
        }
        list(entries)
    }

    fn test(&self, node: Node<'_>) -> String {
        let head = ["test".to_owned(), self.word(field(node, "title"))];
        list(head.into_iter().chain(self.contents(field(node, "body"))))
    }

    fn material_param(&self, node: Node<'_>) -> String {
        let mut entries = vec![
            "param".to_owned(),
            self.word(field(node, "name")),
            self.type_name(field(node, "type")),
            self.expression(field(node, "default")),
        ];
        if let Some(range) = node.child_by_field_name("range") {
            let low = self.expression(field(range, "low"));
            let high = self.expression(field(range, "high"));
            entries.push(list(["in".to_owned(), low, high]));
        }
        let metadata = node.child_by_field_name("metadata");
        let metadata = metadata.map(|m| self.children(m)).unwrap_or_default();
        entries.extend(metadata.into_iter().map(|entry| {
            let key = format!("{}:", self.text(field(entry, "key")));
            let value = self.expression(field(entry, "value"));
            let high = entry.child_by_field_name("high");
            let high = high.map(|high| self.expression(high));
            list([key, value].into_iter().chain(high))
        }));
        entries.extend(self.optional_documentation(node));
        list(entries)
    }

    fn parameters(&self, node: Node<'_>) -> Vec<String> {
        let all = self.children(node).into_iter().map(|n| {
            let name = self.word(field(n, "name"));
            let ty = self.type_name(field(n, "type"));
            let default = n.child_by_field_name("default");
            let default = default.map(|value| self.expression(value));
            list(["param".to_owned(), name, ty].into_iter().chain(default))
        });
        all.collect()
    }

    fn method(&self, node: Node<'_>) -> String {
        let arguments = self.children(field(node, "parameters"));
        let arguments = list(arguments.into_iter().map(|n| self.word(n)));
        let head = [
            "method".to_owned(),
            self.word(field(node, "name")),
            arguments,
        ];
        list(head.into_iter().chain(self.body(node)))
    }

    fn body(&self, node: Node<'_>) -> Vec<String> {
        if let Some(block) = node.child_by_field_name("body") {
            return self.contents(block);
        }
        let value = self.expression(field(node, "value"));
        match node.child_by_field_name("condition") {
            Some(when) => {
                let condition = self.expression(self.children(when)[0]);
                vec![list(["when".to_owned(), condition, value])]
            }
            None => vec![value],
        }
    }

    fn type_name(&self, node: Node<'_>) -> String {
        let name = self.word(field(node, "name"));
        match node.child_by_field_name("array") {
            None => name,
            Some(array) => {
                let count = self.children(array).into_iter().map(|n| self.expression(n));
                list(["[]".to_owned(), name].into_iter().chain(count))
            }
        }
    }

    /// The statements of a block, and its value. An `if` at its end is the value if it has one.
    fn contents(&self, block: Node<'_>) -> Vec<String> {
        let inner = self.children(block);
        let value = self.value(block).map(|n| n.id());
        let entries = inner.into_iter().map(|n| {
            if Some(n.id()) == value {
                list(["value".to_owned(), self.expression(n)])
            } else {
                self.statement(n)
            }
        });
        entries.collect()
    }

    fn value<'n>(&self, block: Node<'n>) -> Option<Node<'n>> {
        if let Some(value) = block.child_by_field_name("value") {
            return Some(value);
        }
        let last = self.children(block).pop()?;
        (last.kind() == "if_expression" && self.has_value(last)).then_some(last)
    }

    fn has_value(&self, chosen: Node<'_>) -> bool {
        let then = self.value(field(chosen, "consequence")).is_some();
        let other = chosen.child_by_field_name("alternative");
        let other = other.map(|other| self.children(other)[0]);
        then || other.is_some_and(|other| match other.kind() {
            "if_expression" => self.has_value(other),
            _ => self.value(other).is_some(),
        })
    }

    fn block(&self, keyword: &str, node: Node<'_>) -> String {
        list([keyword.to_owned()].into_iter().chain(self.contents(node)))
    }

    fn statement(&self, node: Node<'_>) -> String {
        let child = |name| self.expression(field(node, name));
        match node.kind() {
            "let_statement" | "var_statement" => {
                let keyword = node.kind().replace("_statement", "");
                let ty = node.child_by_field_name("type");
                let ty = ty.map(|ty| list([":".to_owned(), self.type_name(ty)]));
                let head = [keyword, self.word(field(node, "name"))];
                list(head.into_iter().chain(ty).chain([child("value")]))
            }
            "assignment_statement" => {
                let operator = self.word(field(node, "operator"));
                list([operator, child("place"), child("value")])
            }
            "for_statement" => {
                let name = self.word(field(node, "name"));
                let head = ["for".to_owned(), name, child("low"), child("high")];
                list(head.into_iter().chain(self.contents(field(node, "body"))))
            }
            "while_statement" => {
                let limit = node.child_by_field_name("limit");
                let limit = limit.map(|n| list(["limit".to_owned(), self.expression(n)]));
                let head = ["while".to_owned(), child("condition")];
                let head = head.into_iter().chain(limit);
                list(head.chain(self.contents(field(node, "body"))))
            }
            "assert_statement" => list(["assert".to_owned(), child("condition")]),
            "break_statement" | "continue_statement" => {
                list([node.kind().replace("_statement", "")])
            }
            _ => self.expression(node),
        }
    }

    fn expression(&self, node: Node<'_>) -> String {
        let child = |name| self.expression(field(node, name));
        match node.kind() {
            "integer" => match self.integer(node) {
                (value, true) => format!("{value}u"),
                (value, false) => value.to_string(),
            },
            "float" => format!("{:?}", self.number(node)),
            "quantity" => {
                let number = self.number(field(node, "number"));
                format!("{number:?}{}", self.text(field(node, "unit")))
            }
            "string" => {
                let content = self.children(node);
                format!("{:?}", content.first().map_or("", |n| self.text(*n)))
            }
            "call_expression" => {
                let arguments = self.children(field(node, "arguments"));
                let arguments = arguments.into_iter().map(|n| match n.kind() {
                    "named_argument" => {
                        let name = format!("{}:", self.text(field(n, "name")));
                        list([name, self.expression(field(n, "value"))])
                    }
                    _ => self.expression(n),
                });
                let head = ["call".to_owned(), self.word(field(node, "function"))];
                list(head.into_iter().chain(arguments))
            }
            "field_expression" => {
                let name = self.word(field(node, "field"));
                list([".".to_owned(), child("value"), name])
            }
            "index_expression" => list(["at".to_owned(), child("value"), child("index")]),
            "array_expression" => {
                let elements = self.children(node);
                let elements = elements.into_iter().map(|n| self.expression(n));
                list(["array".to_owned()].into_iter().chain(elements))
            }
            "unary_expression" => list([self.word(field(node, "operator")), child("argument")]),
            "binary_expression" => {
                let operator = self.word(field(node, "operator"));
                list([operator, child("left"), child("right")])
            }
            "parenthesized_expression" => self.expression(self.children(node)[0]),
            "block" => self.block("block", node),
            "if_expression" => {
                let then = self.block("then", field(node, "consequence"));
                let other = node.child_by_field_name("alternative");
                let other = other.map(|other| self.otherwise(self.children(other)[0]));
                let head = ["if".to_owned(), child("condition"), then];
                list(head.into_iter().chain(other))
            }
            "identifier" | "boolean" | "whole_material" => self.word(node),
            other => panic!("no expression: {other}"),
        }
    }

    fn otherwise(&self, node: Node<'_>) -> String {
        if node.kind() == "block" {
            return self.block("else", node);
        }
        let inner = if self.has_value(node) {
            list(["value".to_owned(), self.expression(node)])
        } else {
            self.expression(node)
        };
        list(["else".to_owned(), inner])
    }

    /// The value of an integer, and whether it is marked unsigned.
    fn integer(&self, node: Node<'_>) -> (u64, bool) {
        let text = self.text(node);
        let digits = text.strip_suffix('u').unwrap_or(text);
        let value = match digits.strip_prefix("0x") {
            Some(digits) => u64::from_str_radix(digits, 16),
            None => digits.parse(),
        };
        (value.unwrap_or(0), digits.len() < text.len())
    }

    fn number(&self, node: Node<'_>) -> f64 {
        match node.kind() {
            "integer" => self.integer(node).0 as f64,
            _ => self.text(node).parse().expect("a float"),
        }
    }
}
