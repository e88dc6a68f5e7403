" How lines of Impasto are commented, joined and indented.
if exists("b:did_ftplugin")
  finish
endif
let b:did_ftplugin = 1

setlocal comments=:///,://!,://,s1:/*,mb:*,ex:*/
setlocal commentstring=//\ %s
setlocal formatoptions-=t formatoptions+=croqlj
setlocal expandtab shiftwidth=4 softtabstop=4 tabstop=4
setlocal suffixesadd=.impasto
setlocal matchpairs=(:),{:},[:]
let b:undo_ftplugin = "setlocal comments< commentstring< formatoptions< expandtab< shiftwidth< softtabstop< tabstop<"
      \ . " suffixesadd< matchpairs<"

" Neovim from 0.11 on colors by tree-sitter where the parser is installed; else syntax/impasto.vim does.
if has("nvim-0.11")
  lua pcall(vim.treesitter.start)
endif
