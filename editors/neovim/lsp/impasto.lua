-- The language server, for `vim.lsp.enable("impasto")` of Neovim 0.11 and newer.
return require("impasto").config()
