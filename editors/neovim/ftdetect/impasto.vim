" Sources of Impasto. This also works in Vim.
autocmd BufRead,BufNewFile *.impasto setfiletype impasto
