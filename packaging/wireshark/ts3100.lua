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
  MN = "maintenance information (extension)",
}

-- Fields of SF: offset, size, key, name, kind. Groups of equal fields follow by loops, as in the manual's table.
local SF_HEAD = {
  { 0, 1, "servo", "servo power", { [0] = "off", "on" } },
  { 1, 1, "emergency-stop", "EMERGENCY stop switch", { [0] = "off", "on" } },
  { 2, 1, "motion-status", "motion status", { [0] = "stop (reset)", "run", "stop (retry)", "stop (continue)" } },
  { 3, 1, "su-request", "SU command request", { [0] = "off", "on" } },
}
local SF_MIDDLE = {
  { 24, 2, "execution-line", "program execution line" },
  { 26, 2, "analysis-line", "program analysis line" },
  { 28, 2, "execution-task", "program execution task" },
  { 30, 2, "analysis-task", "program analysis task" },
  { 32, 2, "feed-hold", "feed hold", { [0] = "off", "on" } },
  { 34, 2, "guide-coordinate", "guidance coordinate system", { [0] = "joint", "tool", "work", "world" } },
  { 36, 2, "guide-rate", "guide rate", { [0] = "slow", "mid", "fast" } },
  { 38, 2, "guide-mode", "guide mode", { [0] = "jog", "inching", "free" } },
  { 40, 2, "master-mode", "master mode", { [0] = "TEACHING", "INTERNAL", "EXT (SIG)", "EXT (HOST)" } },
  { 42, 2, "dummy", "dummy" },
  { 44, 4, "power-on-time", "power ON time" },
  { 48, 4, "run-time", "program run time" },
}
-- Words of lines: key, name, number of the line in bit 0.
local SF_WORDS = {
  { "general.1", "general", 1 }, { "general.2", "general", 17 },
  { "general.3", "general", 33 }, { "general.4", "general", 49 },
  { "extension.1", "extension", 101 }, { "extension.2", "extension", 117 },
  { "extension.3", "extension", 133 }, { "extension.4", "extension", 149 },
  { "system.1", "system", 201 }, { "system.2", "system", 217 },
  { "system.3", "system", 233 }, { "system.4", "system", 249 },
}
local LETTERS = { "X", "Y", "Z", "A", "B", "C", "axis 7", "axis 8" }
-- A SCARA's record ends in two bytes of 0 where no EOF follows it (248 or 250 bytes).
local SF_EIGHT, SF_SIX, SF_SIX_FILLED = 276, 248, 250
local IO_WORDS = 80
-- Words of alarms: level, first word, how many, code of the first. The second ranges are those of the SCARA edition.
local ALARM_RANGES = {
  { 8, 0, 368, 1 }, { 4, 368, 144, 1 }, { 2, 512, 224, 1 }, { 1, 736, 224, 1 },
  { 8, 960, 512, 369 }, { 4, 1472, 256, 145 }, { 2, 1728, 256, 225 }, { 1, 1984, 256, 225 },
}

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

local function add_sf(key, name, size, kind)
  local abbreviation = "ts3100.sf." .. sf_name(key)
  local field
  if kind == "float" then field = ProtoField.float(abbreviation, name)
  elseif kind == "name" then field = ProtoField.string(abbreviation, name)
  elseif kind == "mask" then field = ProtoField.uint16(abbreviation, name, base.HEX)
  elseif size == 1 then field = ProtoField.uint8(abbreviation, name, base.DEC, kind)
  elseif size == 2 then field = ProtoField.uint16(abbreviation, name, base.DEC, kind)
  else field = ProtoField.uint32(abbreviation, name, base.DEC, kind) end
  sf_fields[key] = field
  list[#list + 1] = field
end

for _, row in ipairs(SF_HEAD) do add_sf(row[3], row[4], row[2], row[5]) end
for slot = 1, 10 do add_sf("alarm." .. slot, "current alarm " .. slot, 2) end
for _, row in ipairs(SF_MIDDLE) do add_sf(row[3], row[4], row[2], row[5]) end
for _, direction in ipairs({ { "input", "Din" }, { "output", "Dout" } }) do
  for _, row in ipairs(SF_WORDS) do
    local lines = direction[2] .. row[3] .. "-" .. (row[3] + 15)
    add_sf(direction[1] .. "." .. row[1], row[2] .. " " .. direction[1] .. " " .. lines, 2, "mask")
  end
end
for _, group in ipairs({ "joint", "world", "work" }) do
  for axis = 1, 8 do
    local letter = group == "joint" and tostring(axis) or LETTERS[axis]
    add_sf(group .. "." .. axis, group .. " coordinate " .. letter, 4, "float")
  end
end
for _, name in ipairs({ "work", "tool", "base" }) do
  add_sf("name." .. name, name .. " coordinate name", 20, "name")
end
proto.fields = list

local channel_text = ProtoField.string("ts3100_channel.text", "Bytes")
local channel_sender = ProtoField.string("ts3100_channel.sender", "Sender")
channel.fields = { channel_text, channel_sender }
local panel_words = ProtoField.string("ts3100_panel.words", "Action")
panel.fields = { panel_words }

local malformed = ProtoExpert.new("ts3100.not_a_text", "Bytes that are no text", expert.group.MALFORMED, expert.severity.WARN)
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
  local lengths = letters == "SF" and { SF_SIX, SF_SIX_FILLED, SF_EIGHT } or letters == "IO" and { IO_WORDS } or {}
  local available = tvb:len() - from
  local head = math.min(3, available - stx)
  if #lengths == 0 or head < 1 or tvb(from + stx, head):string() ~= ("FL,"):sub(1, head) then return first end
  for _, length in ipairs(lengths) do
    local behind = from + stx + 3 + length
    if length ~= SF_SIX_FILLED and byte_at(tvb, behind) == EOF then
      if byte_at(tvb, behind + 1) == ETX then return stx + 3 + length + 2 end
      if byte_at(tvb, behind + 1) == CR and byte_at(tvb, behind + 2) == ETX then return stx + 3 + length + 3 end
    end
    -- Without EOF: a text that is full, 253 bytes, and the words of IO.
    local filled = length == SF_SIX_FILLED or length == IO_WORDS
    if filled and byte_at(tvb, behind) == ETX then return stx + 3 + length + 1 end
  end
  if available < stx + 3 + lengths[#lengths] + 3 then return nil end
  return first
end

local function dissect_sf(tree, body)
  local six = body:len() < SF_EIGHT
  local axes = six and 6 or 8
  local whole = tree:add(fields.sf, body())
  whole:set_text("SF: " .. (six and "six" or "eight") .. " axes, " .. body:len() .. " bytes")
  local function put(key, offset, size)
    if offset + size <= body:len() then
      local field = sf_fields[key]
      if key:sub(1, 5) == "name." then
        whole:add(field, body(offset, size), (body(offset, size):raw():gsub("%z.*", "")))
      else
        local item = whole:add(field, body(offset, size))
        if key:sub(1, 6) == "alarm." then
          local word = body(offset, 2):uint()
          local shown = "none"
          for _, range in ipairs(ALARM_RANGES) do
            if word >= range[2] and word < range[2] + range[3] then
              shown = string.format("%d-%03d", range[1], word - range[2] + range[4])
            end
          end
          item:append_text(" (" .. shown .. ")")
        end
      end
    end
  end
  for _, row in ipairs(SF_HEAD) do put(row[3], row[1], row[2]) end
  for slot = 1, 10 do put("alarm." .. slot, 2 + 2 * slot, 2) end
  for _, row in ipairs(SF_MIDDLE) do put(row[3], row[1], row[2]) end
  for index, direction in ipairs({ "input", "output" }) do
    for place, row in ipairs(SF_WORDS) do
      put(direction .. "." .. row[1], 52 + 32 * (index - 1) + 2 * (place - 1), 2)
    end
  end
  for index, group in ipairs({ "joint", "world", "work" }) do
    for axis = 1, axes do put(group .. "." .. axis, 116 + 4 * axes * (index - 1) + 4 * (axis - 1), 4) end
  end
  for index, name in ipairs({ "work", "tool", "base" }) do
    put("name." .. name, 116 + 12 * axes + 20 * (index - 1), 20)
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
  -- Records that are told by their length alone have no EOF.
  local filled = letters == "SF" and length == 3 + SF_SIX_FILLED or letters == "IO" and length == 3 + IO_WORDS
  if filled then ending = length end
  local complete = not filled and ending > 3 and data(ending - 1, 1):uint() == EOF
  if complete then ending = ending - 1 end
  if ending > 3 then
    local body = data(3, ending - 3)
    if letters == "SF" then
      dissect_sf(tree, body:tvb())
    elseif letters == "SU" or letters == "SM" then
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
