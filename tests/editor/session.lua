-- A session of Neovim 0.7 with the language server, step by step. What a step finds wrong is printed, and the others go on.

local impasto, folder = vim.env.IMPASTO, vim.env.FOLDER
local PATIENCE = 20000
local client_id

local function say(text)
  io.stdout:write(text .. "\n")
  io.stdout:flush()
end

local failed = 0
local function step(name, body)
  local ok, why = pcall(body)
  if ok then
    say("ok: " .. name)
  else
    failed = failed + 1
    say("FAILED: " .. name .. ": " .. tostring(why))
  end
end

local function check(condition, what)
  if not condition then
    error(what, 2)
  end
end

local function wait(what, condition)
  check(vim.wait(PATIENCE, condition, 20), "waited in vain for " .. what)
end

-- Diagnostics count as there when they have come, also when they are none.
local published = {}
local publish = vim.lsp.handlers["textDocument/publishDiagnostics"]
vim.lsp.handlers["textDocument/publishDiagnostics"] = function(err, result, ctx, config)
  published[vim.uri_to_fname(result.uri)] = true
  return publish(err, result, ctx, config)
end

vim.api.nvim_create_autocmd({ "BufRead", "BufNewFile" }, {
  pattern = { "*.impasto", "*.toml" },
  callback = function(event)
    if event.match:match("%.impasto$") then
      vim.bo[event.buf].filetype = "impasto"
    end
    client_id = client_id
      or vim.lsp.start_client({
        name = "impasto",
        cmd = { impasto, "lsp" },
        root_dir = folder,
        flags = { debounce_text_changes = 0 },
      })
    vim.lsp.buf_attach_client(event.buf, client_id)
  end,
})

local function client()
  return vim.lsp.get_client_by_id(client_id)
end

local function text(buffer)
  return table.concat(vim.api.nvim_buf_get_lines(buffer or 0, 0, -1, true), "\n") .. "\n"
end

local function set_text(new)
  vim.api.nvim_buf_set_lines(0, 0, -1, true, vim.split((new:gsub("\n$", "")), "\n"))
end

-- Puts the cursor on the start of a string, `into` bytes further, and gives what requests take.
local function at(what, into)
  for row, line in ipairs(vim.api.nvim_buf_get_lines(0, 0, -1, true)) do
    local column = line:find(what, 1, true)
    if column then
      vim.api.nvim_win_set_cursor(0, { row, column - 1 + (into or 0) })
      return vim.lsp.util.make_position_params(0, client().offset_encoding)
    end
  end
  error("no `" .. what .. "` in the text", 2)
end

local function ask(method, params)
  local answer, why = client().request_sync(method, params, PATIENCE, 0)
  check(answer, method .. ": " .. tostring(why))
  check(not answer.err, method .. ": " .. vim.inspect(answer.err))
  return answer.result
end

local function of_file()
  return { textDocument = vim.lsp.util.make_text_document_params() }
end

local function diagnostics()
  return vim.diagnostic.get(0)
end

vim.cmd("edit " .. folder .. "/car_paint.impasto")
local source = vim.api.nvim_get_current_buf()
local original = text()

step("a real material opens without diagnostics", function()
  wait("the server", function()
    return client() and client().initialized
  end)
  wait("diagnostics", function()
    return published[folder .. "/car_paint.impasto"]
  end)
  check(#diagnostics() == 0, vim.inspect(diagnostics()))
end)

-- Without a server all else would wait in vain.
if failed > 0 then
  vim.cmd("cquit 1")
end

step("an edit brings a diagnostic, and its quick fix takes it away", function()
  set_text((original:gsub("size: flake_size,", "size: flake_sice,")))
  wait("the diagnostic", function()
    return #diagnostics() == 1
  end)
  local found = diagnostics()[1]
  check(found.code == "E0201", vim.inspect(found))
  at("flake_sice")
  local params = vim.lsp.util.make_range_params(0, client().offset_encoding)
  params.context = { diagnostics = {} }
  local actions = ask("textDocument/codeAction", params)
  check(actions[1] and actions[1].title == "write `flake_size`", vim.inspect(actions))
  vim.lsp.util.apply_workspace_edit(actions[1].edit, client().offset_encoding)
  check(text() == original, text())
  wait("the diagnostic to go", function()
    return #diagnostics() == 0
  end)
end)

step("a text is formatted", function()
  set_text((original:gsub("    let fine", "  let   fine")))
  vim.lsp.buf.formatting_sync(nil, PATIENCE)
  check(text() == original, text())
end)

step("a parameter is explained", function()
  local hover = ask("textDocument/hover", at("flake_amount * fine", 3))
  check(hover.contents.value:find("How much of the base the flakes hide", 1, true), vim.inspect(hover))
end)

step("a name of the library leads to its definition, and is understood there", function()
  local found = ask("textDocument/definition", at("fresnel_diffuse(base", 3))
  vim.lsp.util.jump_to_location(found, client().offset_encoding)
  check(text():find("bsdf fresnel_diffuse", 1, true), text())
  check(vim.api.nvim_get_current_line():find("bsdf fresnel_diffuse", 1, true), vim.api.nvim_get_current_line())
  wait("the library's diagnostics", function()
    return published[vim.api.nvim_buf_get_name(0)]
  end)
  check(#diagnostics() == 0, vim.inspect(diagnostics()))
  local hover = ask("textDocument/hover", at("cosine_hemisphere", 3))
  check(hover.contents.value:find("fn cosine_hemisphere", 1, true), vim.inspect(hover))
  vim.api.nvim_set_current_buf(source)
end)

step("a name of the library is completed in broken code, with its import", function()
  set_text((original:gsub("(    let coarse)", "    let speck = clamp(per\n%1", 1)))
  local list = ask("textDocument/completion", at("clamp(per", 9))
  local item
  for _, candidate in ipairs(list.items) do
    item = candidate.label == "perlin" and candidate or item
  end
  check(item, "no `perlin`")
  local edits = { item.textEdit }
  vim.list_extend(edits, item.additionalTextEdits or {})
  vim.lsp.util.apply_text_edits(edits, source, client().offset_encoding)
  check(text():find("let speck = clamp(perlin(", 1, true), text())
  check(text():find("use std::noise::{flakes, perlin};", 1, true), text())
  set_text(original)
end)

step("the parameters of a call are shown while it is typed", function()
  set_text((original:gsub("(    let coarse)", "    let speck = smoothstep(0.1, \n%1", 1)))
  local help = ask("textDocument/signatureHelp", at("smoothstep(0.1, ", 16))
  check(help.signatures[1].label == "smoothstep(low, high, x)", vim.inspect(help))
  check(help.activeParameter == 1, vim.inspect(help))
  set_text(original)
end)

step("a name is renamed wherever it is", function()
  at("fine =")
  vim.lsp.buf.rename("small")
  wait("the new name", function()
    return text():find("small.normal", 1, true)
  end)
  local expected = original:gsub("fine =", "small ="):gsub("fine%.", "small.")
  check(text() == expected, text())
  set_text(original)
end)

step("references are found", function()
  local params = at("coarse.weight")
  params.context = { includeDeclaration = true }
  local found = ask("textDocument/references", params)
  check(#found == 3, vim.inspect(found))
  check(#ask("textDocument/documentHighlight", at("coarse.weight")) == 3, "highlights")
end)

step("the outline has what is defined", function()
  local symbols = ask("textDocument/documentSymbol", of_file())
  check(#symbols == 1 and symbols[1].name == "car_paint", vim.inspect(symbols))
  check(#symbols[1].children == 8, vim.inspect(symbols[1].children))
end)

step("what it costs stands above the material and behind its lines", function()
  local title
  wait("a lens", function()
    for _, lens in ipairs(ask("textDocument/codeLens", of_file())) do
      title = lens.command.title:find("operations", 1, true) and lens.command.title or title
    end
    return title
  end)
  check(title:find("lobes", 1, true), title)
  local params = of_file()
  params.range = {
    start = { line = 0, character = 0 },
    ["end"] = { line = vim.api.nvim_buf_line_count(0), character = 0 },
  }
  local hints = ask("textDocument/inlayHint", params)
  check(#hints > 0 and hints[1].label:find(" ops", 1, true), vim.inspect(hints))
end)

step("tokens, colors, folds and selections are answered", function()
  local tokens = ask("textDocument/semanticTokens/full", of_file())
  check(#tokens.data > 0 and #tokens.data % 5 == 0, vim.inspect(tokens))
  local colors = ask("textDocument/documentColor", of_file())
  check(#colors == 2, vim.inspect(colors))
  local params = of_file()
  params.range, params.color = colors[1].range, { red = 1, green = 0, blue = 0, alpha = 1 }
  local forms = ask("textDocument/colorPresentation", params)
  check(forms[1].label == "srgb(0xff0000)", vim.inspect(forms))
  check(#ask("textDocument/foldingRange", of_file()) > 0, "no folds")
  params = of_file()
  params.positions = { at("flake_amount * fine", 3).position }
  local ranges = ask("textDocument/selectionRange", params)
  check(ranges[1].parent.parent, vim.inspect(ranges))
end)

step("a scene is checked against the material as it is in the editor", function()
  set_text((original:gsub("flake_amount", "flake_share")))
  vim.cmd("edit " .. folder .. "/scene.toml")
  wait("the diagnostic", function()
    return #diagnostics() > 0
  end)
  local message = diagnostics()[1].message
  check(message:find("no parameter `flake_amount`", 1, true), message)
  vim.api.nvim_set_current_buf(source)
  set_text(original)
  vim.api.nvim_set_current_buf(vim.fn.bufnr("scene.toml"))
  wait("the diagnostic to go", function()
    return #diagnostics() == 0
  end)
end)

step("the server ends with the editor", function()
  local gone = client()
  gone.stop()
  wait("its end", function()
    return gone.is_stopped()
  end)
end)

say(failed == 0 and "DONE" or "FAILED: " .. failed .. " steps")
