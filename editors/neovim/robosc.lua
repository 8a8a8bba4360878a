-- RoboSC in Neovim (0.7 and later): `dofile` this file in init.lua. The language server is `robosc-lsp`.
local group = vim.api.nvim_create_augroup("robosc", { clear = true })
local here = vim.fn.fnamemodify(debug.getinfo(1, "S").source:sub(2), ":p:h")

-- Here is syntax/robosc.vim.
vim.opt.runtimepath:append(here)

-- Neovim 0.7 does not use `vim.filetype` by default.
vim.api.nvim_create_autocmd({ "BufNewFile", "BufRead" }, {
  group = group,
  pattern = "*.rscd",
  command = "setfiletype robosc",
})

-- The nearest folder with `.git`, or the file's own one.
local function root_of(file)
  local own = vim.fn.fnamemodify(file, ":p:h")
  local folder, above = nil, own
  while folder ~= above do
    folder, above = above, vim.fn.fnamemodify(above, ":h")
    if vim.fn.getftype(folder .. "/.git") ~= "" then
      return folder
    end
  end
  return own
end

-- One server serves all files, so that an unsaved library counts wherever it is imported. It is notified of new folders.
local roots = {}

local function add_folder(client, root)
  local folder = { uri = vim.uri_from_fname(root), name = root }
  local change = { event = { added = { folder }, removed = {} } }
  local method = "workspace/didChangeWorkspaceFolders"
  if vim.fn.has("nvim-0.11") == 1 then
    client:notify(method, change)
  else
    client.notify(method, change)
  end
end

local first
local function start(config)
  if vim.lsp.start then
    local function is_same(client)
      return client.name == config.name
    end
    return vim.lsp.start(config, { reuse_client = is_same })
  end
  -- Neovim 0.7 shares no server among files by itself.
  if not (first and vim.lsp.get_client_by_id(first)) then
    first = vim.lsp.start_client(config)
  end
  if first then
    vim.lsp.buf_attach_client(0, first)
  end
  return first
end

local function attach(file)
  local root = root_of(file)
  local is_new = not vim.tbl_contains(roots, root)
  if is_new then
    table.insert(roots, root)
  end
  local number = start({
    name = "robosc",
    cmd = { "robosc-lsp" },
    root_dir = root,
    on_init = function(client)
      for _, other in ipairs(roots) do
        if other ~= root then
          add_folder(client, other)
        end
      end
    end,
  })
  local client = number and vim.lsp.get_client_by_id(number)
  -- A client that is not initialized yet sends the folder in on_init.
  if is_new and client and client.initialized and client.config.root_dir ~= root then
    add_folder(client, root)
  end
end

-- The style is one of whole files: `gq` formats all of it, wherever it stands.
function _G.robosc_formatexpr()
  if vim.fn.mode():find("[iR]") then
    return 1 -- A line that is typed has become too long: that is Neovim's own work.
  end
  if vim.lsp.buf.format then
    vim.lsp.buf.format({ timeout_ms = 30000 })
  else
    vim.lsp.buf.formatting_sync(nil, 30000)
  end
  return 0
end

-- The keys that Neovim 0.11 has by itself.
local keys = { K = "hover", grn = "rename", grr = "references", gra = "code_action" }

vim.api.nvim_create_autocmd("FileType", {
  group = group,
  pattern = "robosc",
  callback = function()
    vim.bo.commentstring = "// %s"
    vim.bo.expandtab = true
    vim.bo.shiftwidth = 4
    vim.bo.smartindent = true
    vim.bo.omnifunc = "v:lua.vim.lsp.omnifunc"
    vim.bo.tagfunc = "v:lua.vim.lsp.tagfunc"
    vim.bo.formatexpr = "v:lua.robosc_formatexpr()"
    for key, work in pairs(keys) do
      if vim.fn.maparg(key, "n") == "" then
        vim.keymap.set("n", key, vim.lsp.buf[work], { buffer = true })
      end
    end
    local file = vim.api.nvim_buf_get_name(0)
    if vim.bo.buftype == "" and file ~= "" then
      attach(file)
    end
  end,
})
