#!/usr/bin/env python3
"""Neovim with the recipe of docs/how-to/write-scol.md, as it is written there: a file is opened, and the keys of a person have
to show diagnostics, fix them, explain, find, rename and format.

    python3 tests/system/packages/editors.py --serve target/dist/ts3100 [--nvim NVIM]

Needs Neovim 0.7 or newer (apt-get install neovim). The recipes of its version and of older ones that it still reads are tried."""

import json
import os
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
import pages  # noqa: E402
from emulator import ROOT, surroundings  # noqa: E402
from steps import Failed, equal, program, serving, true  # noqa: E402

PAGE = os.path.join(ROOT, "docs", "how-to", "write-scol.md")
LIMIT = 60
# The recipes, each with the first version that reads it, and the one from which on it is not for.
RECIPES = {"init-0.7.lua": ((0, 7), (0, 8)), "init-0.8.lua": ((0, 8), (1, 0)), "init-0.11.lua": ((0, 11), (1, 0))}
# Keys of each recipe, for what they do.
OWN_KEYS = {"explain": "K", "define": "gd", "uses": "gr", "rename": "<F2>", "fix": "\\a", "format": "\\f"}
KEYS = {"init-0.7.lua": OWN_KEYS, "init-0.8.lua": OWN_KEYS,
        "init-0.11.lua": {"explain": "K", "define": "<C-]>", "uses": "grr", "rename": "grn", "fix": "gra", "format": ":lua vim.lsp.buf.format()<CR>"}}
PICK = """PROGRAM PICK
  COUNT = 0
AGAIN:
      MOVEL HOME
  COUNT = COUNT+1
  WAIT DIN(1)
  IF COUNT < 3 THEN GOTO AGAIN
  STOP
END
DATA
  POINT HOME = 400,0,200,0,0,0,0,0/11111
END
"""
# Works the editor by its keys and writes down what is there after each of them. Runs in every version from 0.7 on.
DRIVER = r"""
local keys, found = vim.json.decode(os.getenv("KEYS")), {}
local function lines() return table.concat(vim.api.nvim_buf_get_lines(0, 0, -1, true), "\n") .. "\n" end
local function press(action)
  vim.api.nvim_feedkeys(vim.api.nvim_replace_termcodes(keys[action], true, false, true), "mx", false)
end
local function until_(condition) return vim.wait(10000, condition, 20) end
local function at(pattern)
  vim.api.nvim_win_set_cursor(0, { 1, 0 })
  vim.fn.search(pattern, "c")
end
local function diagnostics()
  return vim.tbl_map(function(one) return { one.lnum + 1, one.code or "", one.message } end, vim.diagnostic.get(0))
end
local function step(name, action)
  local fine, value = pcall(action)
  found[name] = fine and value or { error = tostring(value) }
end

-- Where a person would be asked, the answer is given.
vim.ui.input = function(_, take) take("PLACE") end
vim.ui.select = function(choices, options, take)
  found.offered = vim.tbl_map(function(one) return (options.format_item or tostring)(one) end, choices)
  take(choices[1], 1)
end

step("filetype", function() return vim.bo.filetype end)
step("diagnostics", function()
  until_(function() return #vim.diagnostic.get(0) > 0 end)
  return diagnostics()
end)
step("fixed", function()
  at("MOVEL")
  press("fix")
  until_(function() return not lines():find("MOVEL") end)
  return lines()
end)
step("clean", function()
  until_(function() return #vim.diagnostic.get(0, { severity = vim.diagnostic.severity.ERROR }) == 0 end)
  return diagnostics()
end)
step("explained", function()
  at("DIN")
  press("explain")
  local function floating()
    for _, window in ipairs(vim.api.nvim_list_wins()) do
      if vim.api.nvim_win_get_config(window).relative ~= "" then return window end
    end
  end
  until_(floating)
  local window = floating()
  local text = table.concat(vim.api.nvim_buf_get_lines(vim.api.nvim_win_get_buf(window), 0, -1, true), "\n")
  vim.api.nvim_win_close(window, true)
  return text
end)
step("defined", function()
  at("GOTO AGAIN")
  vim.fn.search("AGAIN")
  press("define")
  until_(function() return vim.api.nvim_win_get_cursor(0)[1] == 3 end)
  return vim.api.nvim_win_get_cursor(0)[1]
end)
step("uses", function()
  at("COUNT")
  press("uses")
  until_(function() return #vim.fn.getqflist() > 0 end)
  local rows = vim.tbl_map(function(one) return one.lnum end, vim.fn.getqflist())
  vim.cmd("cclose")
  return rows
end)
step("renamed", function()
  at("HOME")
  press("rename")
  until_(function() return lines():find("POINT PLACE") end)
  return lines()
end)
step("formatted", function()
  local before = lines()
  press("format")
  until_(function() return lines() ~= before end)
  return lines()
end)
step("completed", function()
  local at_end = { textDocument = vim.lsp.util.make_text_document_params(0), position = { line = 3, character = 4 } }
  local answers = vim.lsp.buf_request_sync(0, "textDocument/completion", at_end, 10000)
  local _, answer = next(answers)
  return vim.tbl_map(function(one) return one.label end, answer.result.items or answer.result)
end)
step("coloured", function()
  local tokens = vim.lsp.semantic_tokens
  if not tokens or not tokens.get_at_pos then return "" end
  at("PLACE")
  local function kind()
    local row, column = unpack(vim.api.nvim_win_get_cursor(0))
    return (tokens.get_at_pos(0, row - 1, column) or {})[1]
  end
  until_(kind)
  return kind().type
end)
vim.cmd("silent write")
-- A file as on the controller.
vim.cmd("silent edit robot/MAIN")
step("main", function()
  until_(function() return #vim.diagnostic.get(0) > 0 end)
  return { vim.bo.filetype, #vim.diagnostic.get(0) }
end)
step("messages", function() return vim.fn.execute("messages") end)
local file = io.open(os.getenv("FOUND"), "w")
file:write(vim.json.encode(found))
file:close()
vim.cmd("qall!")
"""


def version(nvim):
    said = subprocess.run([nvim, "--version"], stdout=subprocess.PIPE, text=True, check=True).stdout
    numbers = re.match(r"NVIM v(\d+)\.(\d+)", said)
    if not numbers:
        raise Failed("no version of Neovim: %s" % said.split("\n")[0])
    return int(numbers[1]), int(numbers[2])


def session(nvim, recipe, folder, ts3100):
    """What the driver found with this recipe."""
    work = os.path.join(folder, recipe + ".work")
    os.makedirs(os.path.join(work, "robot"))
    for name, text in (("pick.scol", PICK), ("robot/MAIN", "PROGRAM MAIN\n  MOVEE HERE\nEND\n"), ("driver.lua", DRIVER)):
        with open(os.path.join(work, name), "w", encoding="utf-8") as file:
            file.write(text)
    result = os.path.join(work, "found.json")
    environment = surroundings(PATH=folder + os.pathsep + os.environ["PATH"], KEYS=json.dumps(KEYS[recipe]), FOUND=result, HOME=work,
                               **{"XDG_%s_HOME" % name: os.path.join(work, name) for name in ("CONFIG", "DATA", "STATE", "CACHE")})
    command = [nvim, "--headless", "-i", "NONE", "-n", "-u", os.path.join(folder, recipe), "pick.scol", "-c", "luafile driver.lua"]
    ended = subprocess.run(command, cwd=work, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                           text=True, timeout=LIMIT, check=False)
    if not os.path.exists(result):
        raise Failed("%s ended with %d\n%s" % (" ".join(command), ended.returncode, ended.stdout))
    with open(result, encoding="utf-8") as file:
        found = json.load(file)
    with open(os.path.join(work, "pick.scol"), encoding="utf-8") as file:
        found["written"] = file.read()
    found["as fmt"] = subprocess.run([ts3100, "fmt", "--check", "pick.scol"], cwd=work, stdout=subprocess.DEVNULL, check=False).returncode
    return found


def proves(recipe, found):
    def step(name, condition):
        true("%s: %s" % (recipe, name), condition, found)

    step("the file is SCOL", found["filetype"] == "scol")
    step("MOVEL is an error of line 4, with its remedy", any(row == 4 and "MOVES" in message for row, _, message in found["diagnostics"]))
    step("a key fixes it", "MOVES HOME" in found["fixed"])
    step("and the error is gone", not [row for row, code, _ in found["clean"] if code.startswith("E")])
    step("a key explains DIN", "DIN" in found["explained"])
    step("a key goes to a label", found["defined"] == 3)
    step("a key lists the uses of a variable", sorted(found["uses"]) == [2, 5, 5, 7])
    step("a key renames a point in the program and in DATA", found["renamed"].count("PLACE") == 2 and "HOME" not in found["renamed"])
    step("a key formats as ts3100 fmt does", "\n  MOVES PLACE\n" in found["formatted"] and found["as fmt"] == 0 and found["written"] == found["formatted"])
    step("words are completed", {"MOVES", "COUNT"} <= set(found["completed"]))
    step("a file of the folder robot is SCOL too", found["main"] == ["scol", 1])
    step("no message complains", "error" not in found["messages"].lower())


def main():
    parser = serving(__doc__)
    parser.add_argument("--nvim", default="nvim", help="the program of Neovim")
    options = parser.parse_args()
    runs = version(options.nvim)
    with tempfile.TemporaryDirectory(prefix="ts3100-editors-") as folder:
        os.symlink(options.serve, os.path.join(folder, "ts3100"))
        pages.run("packages/editors", options.serve, [PAGE], directory=folder)
        chosen = [name for name, (first, end) in RECIPES.items() if first <= runs < end]
        equal("the page has these recipes", sorted(RECIPES), sorted(name for name in os.listdir(folder) if name.startswith("init-")))
        true("Neovim %d.%d has a recipe" % runs, chosen)
        for recipe in chosen:
            proves(recipe, session(options.nvim, recipe, folder, options.serve))


if __name__ == "__main__":
    sys.exit(program(main))
