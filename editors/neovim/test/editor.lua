-- What Neovim makes of a source, in any version from 0.7 on:
--   nvim --headless -u NONE -c "set runtimepath^=editors/neovim" -c "luafile editors/neovim/test/editor.lua"
-- in the folder of the repository. It prints `fine` and exits with 0, or says what is wrong and exits with 1.

local function check(what, found, expected)
  if not vim.deep_equal(found, expected) then
    error(what .. ": found " .. vim.inspect(found) .. ", not " .. vim.inspect(expected), 0)
  end
end

--- The color of the character at a line and column, both from 1: what the group finally is.
local function color(line, column)
  local id = vim.fn.synID(line, column, 1)
  return vim.fn.synIDattr(id, "name")
end

local function place(text)
  local at = vim.fn.searchpos("\\V" .. text, "cnw")
  assert(at[1] > 0, "no " .. text)
  return at[1], at[2]
end

local ok, problem = pcall(function()
  vim.o.swapfile = false
  vim.cmd("filetype plugin indent on | syntax on")
  local file = vim.fn.tempname() .. ".impasto"
  vim.fn.writefile({
    "//! A file.",
    "",
    "use std::bsdf::diffuse;",
    "",
    "/// Source: nobody.",
    "material clay {",
    "    param size: length = 0.6 mm in 0.05 mm .. 10 mm;",
    "    let a = position / size; // a comment",
    "    surface = diffuse(reflectance: TWO_PI * 0.5);",
    "}",
    "",
    "fn f(x: float, n: normal) -> float = select(x > 1.0, 12u, 0xff);",
  }, file)
  vim.cmd("edit " .. file)
  check("file type", vim.bo.filetype, "impasto")
  check("comments", vim.bo.commentstring, "// %s")
  check("width", vim.bo.shiftwidth, 4)
  vim.cmd("silent! lua vim.treesitter.stop()")
  vim.cmd("syntax enable | set syntax=impasto")
  for text, expected in pairs({
    ["//! A file"] = "impastoDoc",
    ["Source:"] = "impastoLabel",
    ["use std"] = "impastoKeyword",
    ["std::"] = "impastoModule",
    ["material"] = "impastoKeyword",
    ["length"] = "impastoType",
    ["0.6"] = "impastoNumber",
    ["mm in"] = "impastoUnit",
    ["in 0.05"] = "impastoRepeat",
    ["position"] = "impastoSurface",
    ["// a comment"] = "impastoComment",
    ["diffuse(r"] = "impastoFunction",
    ["reflectance"] = "impastoArgument",
    ["TWO_PI"] = "impastoConstant",
    ["12u"] = "impastoNumber",
    ["0xff"] = "impastoNumber",
    ["normal)"] = "impastoType",
    ["float = select"] = "impastoType",
  }) do
    local line, column = place(text)
    check(text, color(line, column), expected)
  end

  -- Documentation goes on at the next line, and brackets indent.
  vim.api.nvim_win_set_cursor(0, { 5, 0 })
  vim.cmd("normal! oMore.")
  check("documentation goes on", vim.api.nvim_get_current_line(), "/// More.")
  local before = vim.api.nvim_buf_get_lines(0, 0, -1, false)
  vim.cmd("silent %substitute/^ *//e | silent normal! gg=G")
  check("indentation", vim.api.nvim_buf_get_lines(0, 0, -1, false), before)

  -- Sources of the repository are laid out already: few lines may move.
  local moved, total = 0, 0
  local sources = vim.fn.globpath("stdlib,materials", "**/*.impasto", false, true)
  for _, source in ipairs(sources) do
    vim.cmd("edit! " .. source)
    local laid_out = vim.api.nvim_buf_get_lines(0, 0, -1, false)
    vim.cmd("silent normal! gg=G")
    for i, line in ipairs(vim.api.nvim_buf_get_lines(0, 0, -1, false)) do
      total = total + 1
      moved = moved + (line == laid_out[i] and 0 or 1)
    end
    vim.cmd("bdelete!")
  end
  assert(total > 5000, "the sources have moved: " .. total)
  assert(moved * 200 < total, moved .. " of " .. total .. " lines of the library are indented differently")
  vim.cmd("edit! " .. file)

  -- The server is started with its settings, for sources and scenes and nothing else.
  local started = {}
  local function note(config)
    table.insert(started, config)
    return 7
  end
  local impasto = require("impasto")
  local program = vim.fn.exepath("true")
  if vim.lsp.config then
    impasto.setup({ path = program, scene = "scene.toml" })
    local config = vim.lsp.config.impasto
    check("command", config.cmd, { program, "lsp" })
    check("settings", config.settings.impasto.scene, "scene.toml")
    check("options", config.init_options.scene, "scene.toml")
    check("it is on", vim.lsp.is_enabled("impasto"), true)
    local function roots(lines, name, kind)
      local buffer = vim.api.nvim_create_buf(true, false)
      vim.api.nvim_buf_set_name(buffer, vim.fn.fnamemodify(file, ":h") .. "/" .. name)
      vim.api.nvim_buf_set_lines(buffer, 0, -1, false, lines)
      vim.bo[buffer].filetype = kind
      local given = 0
      config.root_dir(buffer, function()
        given = given + 1
      end)
      return given
    end
    check("a source", roots({}, "a.impasto", "impasto"), 1)
    check("a scene", roots({ "[materials.wall]" }, "lamp.toml", "toml"), 1)
    check("no scene", roots({ "[package]" }, "Cargo.toml", "toml"), 0)
  else
    vim.lsp.start_client = note
    vim.lsp.buf_attach_client = function() end
    impasto.setup({ path = program, scene = "scene.toml" })
    vim.cmd("edit!")
    check("one server", #started, 1)
    check("command", started[1].cmd, { program, "lsp" })
    check("settings", started[1].settings.impasto.scene, "scene.toml")
    local scene = vim.fn.fnamemodify(file, ":h") .. "/lamp.toml"
    vim.fn.writefile({ "[materials.wall]", 'file = "a.impasto"' }, scene)
    vim.cmd("edit " .. scene)
    vim.bo.filetype = "toml"
    check("one server for a folder", #started, 1)
  end
  check("commands", vim.fn.exists(":ImpastoPreview"), 2)
end)

io.stdout:write((ok and "fine" or tostring(problem)) .. "\n")
vim.cmd(ok and "qall!" or "cquit 1")
