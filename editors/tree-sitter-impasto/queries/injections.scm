; Documentation is Markdown. The lines of a file's documentation are one text, and so are those of a definition.

((file_documentation
  (doc_comment
    text: (doc_text) @injection.content))
  (#set! injection.language "markdown")
  (#set! injection.combined))

((documentation
  (doc_comment
    text: (doc_text) @injection.content))
  (#set! injection.language "markdown")
  (#set! injection.combined))

([
  (line_comment)
  (block_comment)
] @injection.content
  (#set! injection.language "comment"))
