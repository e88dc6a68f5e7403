-- The language server of Impasto in Neovim from 0.7 on: `require("impasto").setup()`.

local M = {}

-- Settings of the server, with their defaults. docs/editors.md says what they do.
local settings = {
  path = "impasto",
  scene = "",
  cost = { inlayHints = true, lens = true },
}

--- Is a buffer of TOML a scene? Those have cameras and materials.
local function is_scene(buffer)
  for _, line in ipairs(vim.api.nvim_buf_get_lines(buffer, 0, -1, false)) do
    if line:match("^%s*%[%s*camera%s*%]") or line:match("^%s*%[%s*materials%s*[%.%]]") then
      return true
    end
  end
  return vim.fn.fnamemodify(vim.api.nvim_buf_get_name(buffer), ":t") == "scene.toml"
end

--- Has the server anything to say of a buffer?
local function is_ours(buffer)
  local kind = vim.bo[buffer].filetype
  return kind == "impasto" or (kind == "toml" and is_scene(buffer))
end

--- A server that runs, or nil.
local function running()
  local all = vim.lsp.get_clients and vim.lsp.get_clients() or vim.lsp.get_active_clients()
  for _, client in pairs(all) do
    if client.name == "impasto" then
      return client
    end
  end
end

--- The folder that a file belongs to: that of its repository, that of a server that runs (a file of the library has no
--- repository), or its own.
local function root_of(buffer)
  local folder = vim.fn.fnamemodify(vim.api.nvim_buf_get_name(buffer), ":p:h")
  local above = vim.fn.finddir(".git", folder .. ";")
  if above ~= "" then
    return vim.fn.fnamemodify(above, ":p:h:h")
  end
  -- In a worktree it is a file.
  above = vim.fn.findfile(".git", folder .. ";")
  if above ~= "" then
    return vim.fn.fnamemodify(above, ":p:h")
  end
  local server = running()
  return server and server.config.root_dir or folder
end

--- What `vim.lsp.config` and `vim.lsp.start_client` take.
function M.config()
  return {
    name = "impasto",
    cmd = { settings.path, "lsp" },
    filetypes = { "impasto", "toml" },
    -- Neovim 0.11 asks for each buffer; one that is not ours has no folder, and no server.
    root_dir = function(buffer, give)
      if is_ours(buffer) then
        give(root_of(buffer))
      end
    end,
    settings = { impasto = settings },
    init_options = {
      -- Definitions of the library are files of a cache: Neovim takes `impasto-std:/...` for a relative path.
      virtualDocuments = false,
      -- Lenses may name the commands of `client_commands`.
      commands = true,
      scene = settings.scene,
      cost = settings.cost,
    },
  }
end

--- The server of a buffer before Neovim 0.11: one for each folder.
local started = {}
local function start(buffer)
  local root = root_of(buffer)
  local config = M.config()
  config.root_dir = root
  config.workspace_folders = { { uri = vim.uri_from_fname(root), name = root } }
  config.on_exit = function()
    started[root] = nil
  end
  local id = started[root] or vim.lsp.start_client(config)
  started[root] = id
  if id then
    vim.lsp.buf_attach_client(buffer, id)
  end
end

--- Runs the command on the buffer's file. Its output is a buffer beside it.
local function printed(arguments, kind)
  local file = vim.api.nvim_buf_get_name(0)
  local command = vim.list_extend({ settings.path }, arguments(file))
  local text = vim.fn.systemlist(command)
  vim.cmd("vnew")
  vim.api.nvim_buf_set_lines(0, 0, -1, false, text)
  vim.bo.buftype, vim.bo.bufhidden, vim.bo.swapfile = "nofile", "wipe", false
  vim.bo.filetype = kind
end

--- Commands of buffers of Impasto.
local function commands()
  vim.api.nvim_create_user_command("ImpastoPreview", function()
    vim.fn.jobstart({ settings.path, "view", vim.api.nvim_buf_get_name(0) })
  end, { desc = "Open the preview of the file, which follows each save" })
  vim.api.nvim_create_user_command("ImpastoWgsl", function()
    printed(function(file)
      return { "emit", file, "--what", "wgsl" }
    end, "wgsl")
  end, { desc = "Show the generated shader" })
  vim.api.nvim_create_user_command("ImpastoCost", function()
    printed(function(file)
      return { "cost", file }
    end, "")
  end, { desc = "Show what the file's materials cost" })
end

--- Lenses name these commands, which the client runs.
local function client_commands()
  vim.lsp.commands["impasto.explain"] = function(command)
    vim.notify(command.arguments and command.arguments[1] or "")
  end
  vim.lsp.commands["impasto.showPreview"] = function(command)
    local uri = command.arguments and command.arguments[1]
    if uri then
      vim.fn.jobstart({ settings.path, "view", vim.uri_to_fname(uri) })
    end
  end
end

--- Starts the server for sources and scenes. `options` are settings: `path`, `scene`, `cost.inlayHints`, `cost.lens`.
function M.setup(options)
  settings = vim.tbl_deep_extend("force", settings, options or {})
  commands()
  client_commands()
  if vim.lsp.config then
    vim.lsp.config("impasto", M.config())
    vim.lsp.enable("impasto")
    return
  end
  vim.api.nvim_create_autocmd("FileType", {
    group = vim.api.nvim_create_augroup("impasto", { clear = true }),
    pattern = { "impasto", "toml" },
    callback = function(event)
      if is_ours(event.buf) and vim.fn.executable(settings.path) == 1 then
        start(event.buf)
      end
    end,
  })
end

return M
