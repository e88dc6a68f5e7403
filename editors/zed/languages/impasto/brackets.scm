; Pairs that Zed jumps between.

("(" @open
  ")" @close)

("[" @open
  "]" @close)

("{" @open
  "}" @close)

(string
  "\"" @open
  "\"" @close)
