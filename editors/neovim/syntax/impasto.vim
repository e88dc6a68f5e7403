" Colors of Impasto where there is no tree-sitter parser: in Vim, and in Neovim before 0.11. A test of the crate
" tree-sitter-impasto holds the words to the compiler's tables.
if exists("b:current_syntax")
  finish
endif

syntax keyword impastoKeyword material bsdf delta edf fn struct const private use as param let var
syntax keyword impastoConditional if else when
syntax keyword impastoRepeat for in while limit break continue
syntax keyword impastoStatement assert
syntax match impastoKeyword /^\s*\zstest\ze\s*"/
syntax keyword impastoBoolean true false
syntax keyword impastoType bool int uint float length angle vec2 vec3 vec4 color point vector normal mat2 mat3 texture medium contained
syntax keyword impastoSurface position normal geometric_normal tangent uv exterior_ior view instance_id
syntax keyword impastoSurface object_position object_scale uv1 vertex_color facing object_normal time frame
syntax keyword impastoSurface surface emission interior opacity

syntax match impastoConstant /\<_*[A-Z][A-Z0-9_]*\>/
syntax match impastoFunction /\<\h\w*\ze\s*(/
syntax match impastoField /\.\@<!\.\h\w*/
syntax match impastoModule /\<\h\w*\ze\s*::/
syntax match impastoArgument /\<\h\w*\ze\s*::\@!/
" A type stands behind a colon of a declaration, or an arrow.
syntax match impastoAnnotation /\%(->\|\%(\<\%(param\|let\|var\|const\)\s\+\h\w*\s*\)\@<=:\)\s*\h\w*/ contains=impastoType,impastoKeyword
syntax region impastoSignature matchgroup=impastoFunction start=/\%(\<\%(fn\|bsdf\|edf\)\s\+\)\@<=\h\w*\s*(/ end=/)/ contains=TOP,impastoArgument,impastoSurface,impastoType
syntax match impastoParameter /\<\h\w*\s*:\s*\h\w*/ contained containedin=impastoSignature contains=impastoType,impastoKeyword

syntax match impastoNumber /\<\d\+u\?\>/
syntax match impastoNumber /\<0x[0-9A-Za-z_]*/
syntax match impastoNumber /\<\d\+\.\%(\d\+\|[.A-Za-z_]\@!\)\%([eE][+-]\?\d\+\)\?\|\<\d\+[eE][+-]\?\d\+/
syntax match impastoNumber /\%(\w\|[)\]]\)\@<!\.\d\+\%([eE][+-]\?\d\+\)\?/
syntax match impastoUnit /\%(\%(\w\|\.\)\@<!\%(\d\+\.\?\d*\|\.\d\+\)\%([eE][+-]\?\d\+\)\?\s*\)\@<=\%(nm\|um\|mm\|cm\|m\|km\|deg\|rad\)\>/

syntax region impastoString start=/"/ end=/"\|$/ oneline
syntax keyword impastoTodo contained TODO FIXME XXX
syntax match impastoLabel contained /\%(^\s*\/\/[\/!]\s*\)\@<=\u\l*:/
syntax match impastoCode contained /`[^`]*`/
syntax match impastoComment /\/\/.*/ contains=impastoTodo,@Spell
syntax region impastoComment start=/\/\*/ end=/\*\// contains=impastoTodo,@Spell
syntax match impastoDoc /\/\/!.*\|\/\/\/\/\@!.*/ contains=impastoTodo,impastoLabel,impastoCode,@Spell

highlight default link impastoKeyword Keyword
highlight default link impastoConditional Conditional
highlight default link impastoRepeat Repeat
highlight default link impastoStatement Statement
highlight default link impastoBoolean Boolean
highlight default link impastoType Type
highlight default link impastoSurface Special
highlight default link impastoConstant Constant
highlight default link impastoFunction Function
highlight default link impastoModule Include
highlight default link impastoArgument Identifier
highlight default link impastoNumber Number
highlight default link impastoUnit Type
highlight default link impastoString String
highlight default link impastoTodo Todo
highlight default link impastoLabel SpecialComment
highlight default link impastoCode Special
highlight default link impastoComment Comment
highlight default link impastoDoc SpecialComment

let b:current_syntax = "impasto"
