" Indentation of Impasto: a level for a bracket that is open at the end of a line, and one for lines that go on.
if exists("b:did_indent")
  finish
endif
let b:did_indent = 1

setlocal indentexpr=ImpastoIndent(v:lnum)
setlocal indentkeys=0{,0},0),0],!^F,o,O
setlocal nosmartindent
let b:undo_indent = "setlocal indentexpr< indentkeys< smartindent<"

if exists("*ImpastoIndent")
  finish
endif

" The line without its strings and comments.
function! s:Bare(number) abort
  let line = substitute(getline(a:number), '"[^"]*"\?', '', 'g')
  return substitute(substitute(line, '/\*.\{-}\*/', '', 'g'), '//.*$', '', '')
endfunction

" The last line of code above, or 0.
function! s:Above(number) abort
  let above = prevnonblank(a:number - 1)
  while above > 0 && getline(above) =~# '^\s*//'
    let above = prevnonblank(above - 1)
  endwhile
  return above
endfunction

function! ImpastoIndent(number) abort
  let previous = s:Above(a:number)
  if previous == 0
    return 0
  endif
  " Where the statement or list entry that the previous line belongs to starts.
  let start = previous
  let above = s:Above(start)
  while above > 0 && s:Bare(start) !~# '^\s*[)}\]]' && s:Bare(above) !~# '[;,{}(\[]\s*$'
    let start = above
    let above = s:Above(start)
  endwhile
  let bare = s:Bare(previous)
  let closes = getline(a:number) =~# '^\s*[)}\]]'
  if bare =~# '[({[]\s*$'
    return indent(previous) + (closes ? 0 : shiftwidth())
  endif
  if closes
    return max([indent(start) - shiftwidth(), 0])
  endif
  return indent(start) + (bare =~# '[;,}]\s*$' ? 0 : shiftwidth())
endfunction
