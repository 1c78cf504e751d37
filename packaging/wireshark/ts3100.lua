-- Wireshark dissector for the simple communication protocol of the Toshiba Machine TS3100 / TSL3100.
-- Shows texts, commands, answers, the items of SU, the records of EU and CA and the fields of SF by name; for captures
-- of the wire (TCP ports 1000-1003) and for those of `ts3100 serve --transcript x.pcapng` and `ts3100 tap`, whose serial
-- ports and panel actions come as USER0 and USER1. Texts without STX are read too.
--
-- Install: copy it to a folder of Help > About Wireshark > Folders > Personal Lua Plugins, or
--   tshark -X lua_script:ts3100.lua -r x.pcapng
-- Filters: ts3100.command == "SL", ts3100.reply == "NG", ts3100.sf, ts3100.sf.motion_status == 1, ts3100.unknown

local STX, ETX, CR, EOF = 0x02, 0x03, 0x0D, 0x1A
local MAX_DATA = 253
local MAX_WAITING = 65536

local proto = Proto("ts3100", "Toshiba TS3100 robot controller")
local channel = Proto("ts3100_channel", "Toshiba TS3100 PRINT/INPUT channel")
local panel = Proto("ts3100_panel", "Toshiba TS3100 panel action")

proto.prefs.ports = Pref.range("TCP ports of texts", "1000", "Ports of the channel IP0, port offset included", 65535)
proto.prefs.channels = Pref.range("TCP ports of PRINT and INPUT", "1001-1003", "Ports of the channels IP1 to IP3", 65535)

local COMMANDS = {
  RN = "start of automatic operation", SP = "stop", BR = "servo power off", SO = "servo power on", RS = "reset",
  SL = "program selection", UL = "RAM file upload", DL = "RAM file download", CA = "directory request",
  SU = "status request", EU = "error history upload", ER = "RAM file erase", FL = "file",
  OK = "affirmative answer", NG = "negative answer", EC = "internal command", MW = "write global variables",
  FD = "feed hold", SF = "system total status", VR = "version", MR = "read global variables",
  IW = "write output lines", DO = "direct statement",
  SM = "quick status (extension)", WD = "watchdog (extension)", AC = "current alarms (extension)",
  AH = "alarm history (extension)", IO = "input and output words (extension)", HI = "read lines (extension)",
  HO = "write lines (extension)", PR = "position (extension)", VL = "speeds (extension)",
  ZS = "frames (extension)", MD = "mode (extension)", RT = "extension", SC = "extension", JG = "guide (extension)",
  MN = "maintenance information (extension)", RM = "reset of maintenance information (extension)",
  MP = "move to a position (extension)", PS = "current position file (extension)",
  ZC = "origin change of the third axis (extension)", EM = "control right (extension)",
}

-- generated from the tables of crates/proto: cargo test -p ts3100-tests -- --ignored bless_wireshark
-- Fields of SF: key, name, size, offset among eight axes and among six, kind or words of the values.
local SF = {
  { "servo", "servo power", 1, 0, 0, { [0] = "off", "on" } },
  { "emergency-stop", "EMERGENCY stop switch", 1, 1, 1, { [0] = "off", "on" } },
  { "motion-status", "motion status", 1, 2, 2, { [0] = "stop (reset)", "run", "stop (retry)", "stop (continue)" } },
  { "su-request", "SU command request", 1, 3, 3, { [0] = "off", "on" } },
  { "alarm.1", "current alarm 1", 2, 4, 4, "alarm" },
  { "alarm.2", "current alarm 2", 2, 6, 6, "alarm" },
  { "alarm.3", "current alarm 3", 2, 8, 8, "alarm" },
  { "alarm.4", "current alarm 4", 2, 10, 10, "alarm" },
  { "alarm.5", "current alarm 5", 2, 12, 12, "alarm" },
  { "alarm.6", "current alarm 6", 2, 14, 14, "alarm" },
  { "alarm.7", "current alarm 7", 2, 16, 16, "alarm" },
  { "alarm.8", "current alarm 8", 2, 18, 18, "alarm" },
  { "alarm.9", "current alarm 9", 2, 20, 20, "alarm" },
  { "alarm.10", "current alarm 10", 2, 22, 22, "alarm" },
  { "execution-line", "program execution line", 2, 24, 24, "number" },
  { "analysis-line", "program analysis line", 2, 26, 26, "number" },
  { "execution-task", "program execution task", 2, 28, 28, "number" },
  { "analysis-task", "program analysis task", 2, 30, 30, "number" },
  { "feed-hold", "feed hold", 2, 32, 32, { [0] = "off", "on" } },
  { "guide-coordinate", "guidance coordinate system", 2, 34, 34, { [0] = "joint", "tool", "work", "world" } },
  { "guide-rate", "guide rate", 2, 36, 36, { [0] = "slow", "mid", "fast" } },
  { "guide-mode", "guide mode", 2, 38, 38, { [0] = "jog", "inching", "free" } },
  { "master-mode", "master mode", 2, 40, 40, { [0] = "TEACHING", "INTERNAL", "EXT (SIG)", "EXT (HOST)" } },
  { "dummy", "dummy", 2, 42, 42, "number" },
  { "power-on-time", "power ON time", 4, 44, 44, "number" },
  { "run-time", "program run time", 4, 48, 48, "number" },
  { "input.general.1", "general input Din1-16", 2, 52, 52, "lines" },
  { "input.general.2", "general input Din17-32", 2, 54, 54, "lines" },
  { "input.general.3", "general input Din33-48", 2, 56, 56, "lines" },
  { "input.general.4", "general input Din49-64", 2, 58, 58, "lines" },
  { "input.extension.1", "extension input Din101-116", 2, 60, 60, "lines" },
  { "input.extension.2", "extension input Din117-132", 2, 62, 62, "lines" },
  { "input.extension.3", "extension input Din133-148", 2, 64, 64, "lines" },
  { "input.extension.4", "extension input Din149-164", 2, 66, 66, "lines" },
  { "input.system.1", "system input Din201-216", 2, 68, 68, "lines" },
  { "input.system.2", "system input Din217-232", 2, 70, 70, "lines" },
  { "input.system.3", "system input Din233-248", 2, 72, 72, "lines" },
  { "input.system.4", "system input Din249-264", 2, 74, 74, "lines" },
  { "output.general.1", "general output Dout1-16", 2, 84, 84, "lines" },
  { "output.general.2", "general output Dout17-32", 2, 86, 86, "lines" },
  { "output.general.3", "general output Dout33-48", 2, 88, 88, "lines" },
  { "output.general.4", "general output Dout49-64", 2, 90, 90, "lines" },
  { "output.extension.1", "extension output Dout101-116", 2, 92, 92, "lines" },
  { "output.extension.2", "extension output Dout117-132", 2, 94, 94, "lines" },
  { "output.extension.3", "extension output Dout133-148", 2, 96, 96, "lines" },
  { "output.extension.4", "extension output Dout149-164", 2, 98, 98, "lines" },
  { "output.system.1", "system output Dout201-216", 2, 100, 100, "lines" },
  { "output.system.2", "system output Dout217-232", 2, 102, 102, "lines" },
  { "output.system.3", "system output Dout233-248", 2, 104, 104, "lines" },
  { "output.system.4", "system output Dout249-264", 2, 106, 106, "lines" },
  { "joint.1", "joint coordinate 1", 4, 116, 116, "float" },
  { "joint.2", "joint coordinate 2", 4, 120, 120, "float" },
  { "joint.3", "joint coordinate 3", 4, 124, 124, "float" },
  { "joint.4", "joint coordinate 4", 4, 128, 128, "float" },
  { "joint.5", "joint coordinate 5", 4, 132, 132, "float" },
  { "joint.6", "joint coordinate 6", 4, 136, 136, "float" },
  { "joint.7", "joint coordinate 7", 4, 140, false, "float" },
  { "joint.8", "joint coordinate 8", 4, 144, false, "float" },
  { "world.1", "world coordinate X", 4, 148, 140, "float" },
  { "world.2", "world coordinate Y", 4, 152, 144, "float" },
  { "world.3", "world coordinate Z", 4, 156, 148, "float" },
  { "world.4", "world coordinate A", 4, 160, 152, "float" },
  { "world.5", "world coordinate B", 4, 164, 156, "float" },
  { "world.6", "world coordinate C", 4, 168, 160, "float" },
  { "world.7", "world coordinate axis 7", 4, 172, false, "float" },
  { "world.8", "world coordinate axis 8", 4, 176, false, "float" },
  { "work.1", "work coordinate X", 4, 180, 164, "float" },
  { "work.2", "work coordinate Y", 4, 184, 168, "float" },
  { "work.3", "work coordinate Z", 4, 188, 172, "float" },
  { "work.4", "work coordinate A", 4, 192, 176, "float" },
  { "work.5", "work coordinate B", 4, 196, 180, "float" },
  { "work.6", "work coordinate C", 4, 200, 184, "float" },
  { "work.7", "work coordinate axis 7", 4, 204, false, "float" },
  { "work.8", "work coordinate axis 8", 4, 208, false, "float" },
  { "name.work", "work coordinate name", 20, 212, 188, "name" },
  { "name.tool", "tool coordinate name", 20, 232, 208, "name" },
  { "name.base", "base coordinate name", 20, 252, 228, "name" },
  { "input.further.1", "input Din301-316", 2, false, 76, "lines" },
  { "input.further.2", "input Din317-332", 2, false, 78, "lines" },
  { "input.further.3", "input Din333-348", 2, false, 80, "lines" },
  { "input.further.4", "input Din349-364", 2, false, 82, "lines" },
  { "output.further.1", "output Dout301-316", 2, false, 108, "lines" },
  { "output.further.2", "output Dout317-332", 2, false, 110, "lines" },
  { "output.further.3", "output Dout333-348", 2, false, 112, "lines" },
  { "output.further.4", "output Dout349-364", 2, false, 114, "lines" },
}
local SF_SIX = 250
-- Words of alarms: level, first word, how many, code of the first.
local ALARM_RANGES = {
  { 8, 0, 368, 1 },
  { 4, 368, 144, 1 },
  { 2, 512, 224, 1 },
  { 1, 736, 224, 1 },
  { 8, 960, 512, 369 },
  { 4, 1472, 256, 145 },
  { 2, 1728, 256, 225 },
  { 1, 1984, 256, 225 },
}
-- Binary contents: length, and what may follow.
local FORMS = {
  IO = { { 80, "\3" }, { 80, "\26\3" }, { 80, "\26\13\3" } },
  SF = { { 276, "\26\3" }, { 276, "\26\13\3" }, { 250, "\3" }, { 248, "\26\3" } },
}
-- Contents that are items.
local ITEMS = { SM = true, SU = true, }
-- end of the generated part

local fields = {
  sender = ProtoField.string("ts3100.sender", "Sender"),
  framing = ProtoField.string("ts3100.framing", "Framing"),
  command = ProtoField.string("ts3100.command", "Command"),
  meaning = ProtoField.string("ts3100.meaning", "Meaning"),
  operand = ProtoField.string("ts3100.operand", "Operand"),
  unknown = ProtoField.bool("ts3100.unknown", "No command has these letters"),
  reply = ProtoField.string("ts3100.reply", "Answer"),
  to = ProtoField.string("ts3100.answer_to", "Answer to"),
  content = ProtoField.string("ts3100.file", "File"),
  record = ProtoField.string("ts3100.file.record", "Record"),
  su = ProtoField.string("ts3100.su", "SU item"),
  sf = ProtoField.bytes("ts3100.sf", "SF record"),
  eof = ProtoField.bool("ts3100.eof", "EOF, the file is complete"),
  bytes = ProtoField.bytes("ts3100.data", "Data"),
  no_cr = ProtoField.bool("ts3100.no_cr", "No CR in front of ETX"),
}
local sf_fields = {}
local list = {}
for _, field in pairs(fields) do list[#list + 1] = field end

local function sf_name(key) return (key:gsub("[-]", "_")) end

for _, row in ipairs(SF) do
  local key, name, size, kind = row[1], row[2], row[3], row[6]
  local abbreviation = "ts3100.sf." .. sf_name(key)
  local words = type(kind) == "table" and kind or nil
  local field
  if kind == "float" then field = ProtoField.float(abbreviation, name)
  elseif kind == "name" then field = ProtoField.string(abbreviation, name)
  elseif kind == "lines" then field = ProtoField.uint16(abbreviation, name, base.HEX)
  elseif size == 1 then field = ProtoField.uint8(abbreviation, name, base.DEC, words)
  elseif size == 2 then field = ProtoField.uint16(abbreviation, name, base.DEC, words)
  else field = ProtoField.uint32(abbreviation, name, base.DEC, words) end
  sf_fields[key] = field
  list[#list + 1] = field
end
proto.fields = list

local channel_text = ProtoField.string("ts3100_channel.text", "Bytes")
local channel_sender = ProtoField.string("ts3100_channel.sender", "Sender")
channel.fields = { channel_text, channel_sender }
local panel_words = ProtoField.string("ts3100_panel.words", "Action")
panel.fields = { panel_words }

local malformed = ProtoExpert.new("ts3100.not_a_text", "Bytes that are not a text", expert.group.MALFORMED, expert.severity.WARN)
local refused = ProtoExpert.new("ts3100.refused", "Refused: NG", expert.group.RESPONSE_CODE, expert.severity.NOTE)
proto.experts = { malformed, refused }

local tcp_stream = Field.new("tcp.stream")
local interface_name = Field.new("frame.interface_name")
local packet_direction = Field.new("frame.packet_flags_direction")

-- For each connection its host's commands in order, so that a frame looked at again finds what it answered.
local conversations = {}
-- For each connection the port of its host, where that was found by the form of a text.
local hosts = {}
-- For each connection whether a download is open, while the packets are looked at for the first time; and what each
-- text of a host was then taken for.
local downloads, kinds = {}, {}
-- The beginning of texts of a serial line that go on in a later packet.
local waiting = {}
local cut = {}

function proto.init()
  conversations, hosts, downloads, kinds, waiting, cut = {}, {}, {}, {}, {}, {}
end

local function remember(key, number, letters)
  local all = conversations[key]
  if not all then all = {}; conversations[key] = all end
  local last = all[#all]
  if not last or last.number < number or last.letters ~= letters then
    all[#all + 1] = { number = number, letters = letters, open = letters == "DL" or nil }
  end
end

local function asked(key, number)
  local all = conversations[key] or {}
  for index = #all, 1, -1 do
    if all[index].number <= number then return all[index].letters end
  end
  return ""
end

local function printable(bytes)
  return (bytes:raw():gsub("[%c\128-\255]", function(char)
    local byte = char:byte()
    local names = { [STX] = "<STX>", [ETX] = "<ETX>", [0x0A] = "<LF>", [CR] = "<CR>", [EOF] = "<EOF>" }
    return names[byte] or string.format("<%02X>", byte)
  end))
end

local function byte_at(tvb, at) return at < tvb:len() and tvb(at, 1):uint() or nil end

-- Length of the text at `from`, or nil when more bytes are needed. SF and IO hold any byte, ETX too, so the lengths
-- they can have are tried first.
local function text_length(tvb, from, letters)
  local stx = byte_at(tvb, from) == STX and 1 or 0
  local first
  for at = from, tvb:len() - 1 do
    if tvb(at, 1):uint() == ETX then first = at - from + 1; break end
  end
  local start, forms = from + stx, FORMS[letters]
  local available = tvb:len() - start
  local head = math.min(3, available)
  if not forms or head < 1 or tvb(start, head):string() ~= ("FL,"):sub(1, head) then return first end
  local longest = 0
  for _, form in ipairs(forms) do
    local length, ending = 3 + form[1], form[2]
    local whole = length + #ending
    if available >= whole and tvb(start + length, #ending):raw() == ending then return stx + whole end
    longest = math.max(longest, whole)
  end
  if available < longest then return nil end
  return first
end

-- Whether this many bytes are a record that its length alone tells: no EOF follows it.
local function is_told_by_length(letters, length)
  for _, form in ipairs(FORMS[letters] or {}) do
    if form[1] == length and form[2] == "\3" then return true end
  end
  return false
end

local function alarm(word)
  for _, range in ipairs(ALARM_RANGES) do
    local place = word - range[2]
    if place >= 0 and place < range[3] then return string.format("%d-%03d", range[1], place + range[4]) end
  end
  return "none"
end

local function dissect_sf(tree, body)
  local six = body:len() <= SF_SIX
  local whole = tree:add(fields.sf, body())
  whole:set_text("SF: " .. (six and "six" or "eight") .. " axes, " .. body:len() .. " bytes")
  for _, row in ipairs(SF) do
    local key, size, kind, offset = row[1], row[3], row[6], row[six and 5 or 4]
    if offset and offset + size <= body:len() then
      local bytes = body(offset, size)
      if kind == "name" then
        whole:add(sf_fields[key], bytes, (bytes:raw():gsub("%z.*", "")))
      else
        local item = whole:add(sf_fields[key], bytes)
        if kind == "alarm" then item:append_text(" (" .. alarm(bytes:uint()) .. ")") end
      end
    end
  end
end

local function dissect_records(tree, body, field, pattern)
  local from, length = 0, body:len()
  for at = 0, length do
    local byte = at < length and body(at, 1):uint() or nil
    if not byte or pattern[byte] then
      if at > from then tree:add(field, body(from, at - from), printable(body(from, at - from):bytes())) end
      from = at + 1
    end
  end
end

local function dissect_file(tree, data, letters)
  local length = data:len()
  local ending = length
  if ending > 3 and data(ending - 1, 1):uint() == CR and data(ending - 2, 1):uint() == EOF then ending = ending - 1 end
  local filled = is_told_by_length(letters, length - 3)
  if filled then ending = length end
  local complete = not filled and ending > 3 and data(ending - 1, 1):uint() == EOF
  if complete then ending = ending - 1 end
  if ending > 3 then
    local body = data(3, ending - 3)
    if letters == "SF" then
      dissect_sf(tree, body:tvb())
    elseif ITEMS[letters] then
      local has_cr = body:bytes():raw():find("\r", 1, true)
      dissect_records(tree, body:tvb(), fields.su, has_cr and { [CR] = true } or { [0x20] = true })
    elseif letters == "IO" then
      tree:add(fields.bytes, body)
    else
      local content = tree:add(fields.content, body, printable(body:bytes()))
      dissect_records(content, body:tvb(), fields.record, { [CR] = true, [0x0A] = true })
    end
  end
  if not filled then tree:add(fields.eof, data(math.min(ending, length - 1), 1), complete) end
end

-- What a text of the host is: the letters of a command, known or not, or "" for a further text of a file.
local function host_letters(raw, key)
  local letters = raw:sub(1, 2):upper()
  if letters == "FL" and raw:sub(3, 3) == "," then return "FL" end
  local message, ended = raw:gsub("\r$", "")
  local lines = message:find("[\r\n\26]") ~= nil
  local formed = COMMANDS[letters] and (message:match("^.. *$") or message:sub(3, 3) == ",")
  if downloads[key] then return formed and ended == 1 and not lines and letters or "" end
  -- A capture may begin in the middle of a download.
  return lines and "" or letters
end

-- The same for a packet that is looked at again: by then it is another download that is open, or none.
local function kind_of(raw, pinfo, key, place)
  local seen = key .. "/" .. pinfo.number .. "/" .. place
  if not pinfo.visited or kinds[seen] == nil then
    local letters = host_letters(raw, key)
    kinds[seen] = letters
    local goes_on = (letters == "" or letters == "FL") and not raw:find("\26\r?$")
    if not goes_on then downloads[key] = nil end
  end
  return kinds[seen]
end

local function dissect_text(tvb, pinfo, tree, key, from_robot, place)
  local stx = tvb(0, 1):uint() == STX and 1 or 0
  local length = tvb:len() - stx - 1
  local item = tree:add(proto, tvb(), "TS3100 text from the " .. (from_robot and "controller" or "host"))
  item:add(fields.sender, tvb(0, 0), from_robot and "controller" or "host"):set_generated()
  item:add(fields.framing, tvb(0, stx), stx == 1 and "STX" or "without STX")
  if length < 1 then return "empty" end
  local data = tvb(stx, length)
  local raw = data:bytes():raw()
  local message = raw:gsub("\r$", "")
  if from_robot then
    local question = asked(key, pinfo.number)
    local answers = raw:sub(1, 3) == "FL," or message == "OK" or message == "NG" or message == "SP"
    if not answers then
      -- A further text of a file.
      item:add(fields.content, data, printable(data:bytes()))
      return "file, continued"
    end
    local reply = raw:sub(1, 2)
    if not pinfo.visited then
      if reply == "OK" and question == "DL" then
        -- The OK to the last text ends it; that text has said so.
        if downloads[key] == nil then downloads[key] = conversations[key][#conversations[key]].open end
        conversations[key][#conversations[key]].open = nil
      elseif reply == "NG" then
        downloads[key] = nil
      end
    end
    item:add(fields.reply, data(0, 2), reply)
    if question ~= "" and reply ~= "SP" then item:add(fields.to, tvb(0, 0), question):set_generated() end
    if reply == "NG" then item:add_proto_expert_info(refused) end
    if reply == "FL" then
      dissect_file(item, data, question)
      return question ~= "" and ("FL (" .. question .. ")") or "FL"
    end
    return reply
  end
  local in_download = downloads[key]
  local letters = kind_of(raw, pinfo, key, place)
  if letters == "" then
    item:add(fields.content, data, printable(data:bytes()))
    return "file, continued"
  end
  item:add(fields.command, data(0, math.min(2, length)), printable(data(0, math.min(2, length)):bytes()):upper())
  local meaning = COMMANDS[letters]
  item:add(fields.meaning, data(0, math.min(2, length)), meaning or "unknown command"):set_generated()
  if not meaning then item:add(fields.unknown, data(0, math.min(2, length)), true):set_generated() end
  -- A file belongs to its DL; without one the answer is the file's.
  local stray = letters == "FL" and not in_download
  if letters ~= "OK" and letters ~= "NG" and (letters ~= "FL" or stray) and not pinfo.visited then
    remember(key, pinfo.number, letters)
  end
  if letters == "FL" then
    dissect_file(item, data, "")
    return "FL"
  end
  if raw:sub(-1) ~= "\r" then item:add(fields.no_cr, data(length - 1, 1), true) end
  if #message > 3 then
    item:add(fields.operand, data(3, #message - 3), printable(data(3, #message - 3):bytes()))
  end
  return printable(data(0, math.min(#message, 40)):bytes())
end

-- Cuts what is there into texts; returns how many bytes were used and what the texts are.
local function dissect_texts(tvb, pinfo, tree, key, from_robot)
  local from, shown = 0, {}
  while from < tvb:len() do
    local length = text_length(tvb, from, from_robot and asked(key, pinfo.number) or "")
    if not length then break end
    shown[#shown + 1] = dissect_text(tvb(from, length):tvb(), pinfo, tree, key, from_robot, #shown + 1)
    from = from + length
  end
  return from, shown
end

local function in_range(range, port)
  for part in tostring(range):gmatch("[^,]+") do
    local first, last = part:match("^(%d+)%-(%d+)$")
    first = first or part:match("^%d+$")
    if first and port >= tonumber(first) and port <= tonumber(last or first) then return true end
  end
  return false
end

local function describe(pinfo, from_robot, shown)
  if #shown > 0 then
    pinfo.cols.protocol = "TS3100"
    pinfo.cols.info = (from_robot and "< " or "> ") .. table.concat(shown, " | ")
  end
end

local function dissect_tcp(tvb, pinfo, tree, from_robot)
  local stream = tcp_stream()
  local key = "tcp" .. tostring(stream and stream.value or 0)
  local used, shown = dissect_texts(tvb, pinfo, tree, key, from_robot)
  describe(pinfo, from_robot, shown)
  if used < tvb:len() then
    if tvb:len() - used > MAX_WAITING then
      tree:add(proto, tvb(used)):add_proto_expert_info(malformed)
      return tvb:len()
    end
    pinfo.desegment_offset = used
    pinfo.desegment_len = DESEGMENT_ONE_MORE_SEGMENT
  end
  return tvb:len()
end

-- A serial line: no TCP puts its pieces together, so the unfinished end of a packet goes in front of the next.
local function dissect_serial(tvb, pinfo, tree, from_robot)
  local key = "HOST"
  local side = key .. tostring(from_robot)
  if not pinfo.visited then
    cut[pinfo.number] = waiting[side] or ""
  end
  local whole = tvb
  local before = cut[pinfo.number] or ""
  if #before > 0 then
    local both = ByteArray.new()
    both:append(ByteArray.new(before, true))
    both:append(tvb():bytes())
    whole = both:tvb("Text of several packets")
  end
  local used, shown = dissect_texts(whole, pinfo, tree, key, from_robot)
  describe(pinfo, from_robot, shown)
  if not pinfo.visited then
    local rest = used < whole:len() and whole(used):bytes():raw() or ""
    waiting[side] = #rest <= MAX_WAITING and rest or ""
  end
  return tvb:len()
end

function proto.dissector(tvb, pinfo, tree)
  local name = interface_name()
  if name and name.value == "HOST" then
    local direction = packet_direction()
    return dissect_serial(tvb, pinfo, tree, direction and direction.value == 2)
  end
  local stream = tcp_stream()
  local host = hosts["tcp" .. tostring(stream and stream.value or 0)]
  local from_robot = in_range(proto.prefs.ports, pinfo.src_port)
  if host then from_robot = host ~= pinfo.src_port end
  return dissect_tcp(tvb, pinfo, tree, from_robot)
end

function channel.dissector(tvb, pinfo, tree)
  local direction = packet_direction()
  local from_robot
  if pinfo.port_type == 2 or pinfo.src_port > 0 then
    from_robot = in_range(proto.prefs.channels, pinfo.src_port)
  else
    from_robot = direction and direction.value == 2
  end
  local text = printable(tvb():bytes())
  local item = tree:add(channel, tvb(), "TS3100 channel, from the " .. (from_robot and "program" or "host"))
  item:add(channel_sender, tvb(0, 0), from_robot and "controller" or "host"):set_generated()
  item:add(channel_text, tvb(), text)
  pinfo.cols.protocol = "TS3100-CH"
  pinfo.cols.info = (from_robot and "< " or "> ") .. text:sub(1, 80)
  return tvb:len()
end

local user = Proto("ts3100_serial", "Toshiba TS3100 serial port")
function user.dissector(tvb, pinfo, tree)
  local name = interface_name()
  if name and name.value == "COM1" then return channel.dissector(tvb, pinfo, tree) end
  return proto.dissector(tvb, pinfo, tree)
end

function panel.dissector(tvb, pinfo, tree)
  tree:add(panel, tvb()):add(panel_words, tvb(), tvb():string())
  pinfo.cols.protocol = "TS3100-PANEL"
  pinfo.cols.info = "! " .. tvb():string()
  return tvb:len()
end

local tcp_ports = DissectorTable.get("tcp.port")
local registered = {}
local function register()
  for _, entry in ipairs(registered) do tcp_ports:remove(entry[1], entry[2]) end
  registered = {}
  for range, dissector in pairs({ [tostring(proto.prefs.ports)] = proto, [tostring(proto.prefs.channels)] = channel }) do
    if range ~= "" then
      tcp_ports:add(range, dissector)
      registered[#registered + 1] = { range, dissector }
    end
  end
end
function proto.prefs_changed() register() end
register()

-- Texts at other ports (a port offset, free ports): what begins with a command or an answer and ends a text.
proto:register_heuristic("tcp", function(tvb, pinfo, tree)
  local length = tvb:len()
  if length < 3 or length > 300 or tvb(length - 1, 1):uint() ~= ETX then return false end
  local stx = tvb(0, 1):uint() == STX and 1 or 0
  local letters = tvb(stx, 2):string()
  if not COMMANDS[letters] then return false end
  local behind = tvb(stx + 2, 1):uint()
  if behind ~= CR and behind ~= 0x2C then return false end
  if stx == 0 and tvb(length - 2, 1):uint() ~= CR and tvb(length - 2, 1):uint() ~= EOF then return false end
  -- Only the controller answers; whoever sends a command is the host.
  local answer = letters == "FL" or letters == "OK" or letters == "NG" or letters == "SP"
  local stream = tcp_stream()
  local key = "tcp" .. tostring(stream and stream.value or 0)
  if answer then return false end
  -- From here on the connection is known, whatever its texts begin with.
  hosts[key] = pinfo.src_port
  pinfo.conversation = proto
  dissect_tcp(tvb, pinfo, tree, false)
  return true
end)

local encapsulation = DissectorTable.get("wtap_encap")
encapsulation:add(wtap.USER0, user)
encapsulation:add(wtap.USER1, panel)
