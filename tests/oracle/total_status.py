"""The body of SF, the words of IO and the record of SU, byte by byte.

- Our manual, 5.3.3 FL (3) status file and (5) system total status: 52 + 64 + 160 = 276 bytes; `sf-layout.tsv` has the offsets.
- The SCARA edition, pages 106 to 123 (S23): six floats a group, 52 + 64 + 134 = 250 bytes. IO: pages 132 to 151 (S27, S97).
- `decisions.md` D5 (SU), D6 (big-endian, no alarm is FFFF), T14 (the words of a field bus that is absent are 0)."""

import struct

MASTER_MODES = {"TEACHING": 0, "INTERNAL": 1, "SIG": 2, "RS-232C": 3, "ETHER": 3}
MOTION = {"reset": 0, "running": 1, "retry": 2, "continue": 3}
AXES = {"six-axis": 8, "scara": 6}
RESERVED = {"six-axis": 4, "scara": 2}
# The first line of each word: general, extension, system lines; words 13 to 16 are a system reservation.
BLOCKS = (1, 17, 33, 49, 101, 117, 133, 149, 201, 217, 233, 249)
FIELD_BUS = (301, 317, 333, 349, 401, 417, 433, 449)
# System output 4, the sixteen lines from 249 on.
EMG_ST, SV_RDY, TEACH, INT, EXTSIG, EXTHOST, AUTORUN, CYC_ST, BT_ALM, ALARM = 249, 250, 252, 253, 254, 255, 257, 260, 261, 262
# No source says when the controller sets these: ACK, SYS_RDY, CYC_END, LOW_ST.
UNDECIDED_OUTPUTS = (251, 256, 258, 259)

# SU, field dialect (D5), and the words that the six-axis manual prints.
MODE_WORDS = {"field": ("teaching", "internal", "external(sig)", "external(host)", "external(ethernet)"),
              "manual": ("teaching", "internal", "external (sig)", "external (rs232c)", "external (ethernet)")}
STATUS_WORDS = {"field": {"reset": "stop(reset)", "running": "running", "retry": "stop(retry)", "continue": "stop(continue)"},
                "manual": {"reset": "stop (reset)", "running": "running", "retry": "stop (retry)", "continue": "stop (continue)"}}
MODES = ("TEACHING", "INTERNAL", "SIG", "RS-232C", "ETHER")


def word(lines, first):
    """Sixteen lines as a word: bit 0 is the lowest line (SF-25)."""
    return sum(1 << bit for bit in range(16) if first + bit in lines)


def system_outputs(facts):
    """The lines of system output 4 that are on (SF-38, SF-39): exactly one of TEACH, INT, EXTSIG, EXTHOST."""
    mode = {"TEACHING": TEACH, "INTERNAL": INT, "SIG": EXTSIG}.get(facts["mode"], EXTHOST)
    shown = {EMG_ST: facts["emergency"], SV_RDY: facts["servo"], AUTORUN: facts["status"] == "running",
             CYC_ST: facts["run_mode"] == "cycle", BT_ALM: facts["battery"], ALARM: bool(facts["alarms"])}
    return {mode} | {line for line, on in shown.items() if on}


def words(lines, blocks):
    return b"".join(struct.pack(">H", word(lines, first)) for first in blocks)


def motion_status(facts):
    """I: 52 bytes. `facts["alarms"]` are the words of the alarms, the oldest first."""
    alarms = (facts["alarms"] + [0xFFFF] * 10)[:10]
    return (struct.pack(">4B", facts["servo"], facts["emergency"], MOTION[facts["status"]], facts["request"])
            + struct.pack(">10H", *alarms)
            + struct.pack(">4H", facts["line"], facts["line"], facts["task"], facts["task"])
            + struct.pack(">6H", facts["hold"], facts["coordinate"], facts["rate"], facts["guide"], MASTER_MODES[facts["mode"]], 0)
            + struct.pack(">2I", facts["power_minutes"], facts["run_minutes"]))


def io_information(facts):
    """II: 64 bytes: sixteen words in, sixteen out."""
    outputs = facts["outputs"] | system_outputs(facts)
    return words(facts["inputs"], BLOCKS) + bytes(8) + words(outputs, BLOCKS) + bytes(8)


def name(text):
    """20 bytes, left-justified, filled with 00 (SF-45)."""
    return text.encode("ascii").ljust(20, b"\0")


def current_values(facts, arm):
    """III: 160 bytes, 134 on a SCARA."""
    groups = b""
    for group in (facts["joints"], facts["world"], facts["work"]):
        groups += struct.pack(">%df" % AXES[arm], *(list(group) + [0.0] * AXES[arm])[:AXES[arm]])
    return groups + name(facts["work_name"]) + name(facts["tool_name"]) + name("") + bytes(RESERVED[arm])


def total_status(facts, arm):
    """The body of SF."""
    return motion_status(facts) + io_information(facts) + current_values(facts, arm)


def undecided(facts, arm, body):
    """The body with 0 wherever no source decides: the lines of a stopped program, four outputs, the SU request after a
    change that was undone."""
    body = bytearray(body)
    if facts["line"] is None or facts["selected"] and facts["status"] != "running":
        body[24:32] = bytes(8)
    else:
        # The line of analysis is the line of execution or a later one (SF-10).
        body[26:28] = bytes(2)
    if facts["request"] is None:
        body[3] = 0
    value, = struct.unpack(">H", body[106:108])
    body[106:108] = struct.pack(">H", value & ~hidden_outputs(facts))
    return bytes(body)


def hidden_outputs(facts):
    """The bits of system output 4 that no source decides. BT_ALM is the battery or its alarm, which are not the same until a
    reset."""
    hidden = UNDECIDED_OUTPUTS + ((BT_ALM,) if facts["alarms"] and not facts["battery"] else ())
    return sum(1 << line - 249 for line in hidden)


def io_body(facts):
    """The body of IO: twenty words in, twenty out."""
    outputs = facts["outputs"] | system_outputs(facts)
    return words(facts["inputs"], BLOCKS + FIELD_BUS) + words(outputs, BLOCKS + FIELD_BUS)


def status_items(facts, dialect):
    """The items of SU: mode, file, override, speed limit (None: not stated), machine, execution status."""
    mode = MODE_WORDS[dialect][MODES.index(facts["mode"])]
    return ["MODE:%s/%s" % (mode, facts["run_mode"]), "FILE:%s" % facts["selected"], "OVRD:%d%%" % facts["override"], None,
            "MACHINE:%s" % ("lock" if facts["lock"] else "free"), "STATUS:%s" % STATUS_WORDS[dialect][facts["status"]]]


def parts(arm):
    """Names of the pieces of the body and where they begin: so that a difference says where it is."""
    group = 4 * AXES[arm]
    begun = {"servo": 0, "emergency stop": 1, "motion status": 2, "SU request": 3, "alarms": 4, "lines and tasks": 24,
             "feed hold": 32, "guide": 34, "master mode": 40, "dummy": 42, "minutes": 44, "input words": 52, "output words": 84,
             "joints": 116, "world": 116 + group, "work": 116 + 2 * group, "work name": 116 + 3 * group,
             "tool name": 136 + 3 * group, "base name": 156 + 3 * group, "reserved": 176 + 3 * group}
    return begun, 176 + 3 * group + RESERVED[arm]


def difference(arm, expected, found):
    """The pieces that differ, as {piece: (expected, found)}."""
    begun, length = parts(arm)
    ends = list(begun.values())[1:] + [length]
    return {piece: (expected[at:end].hex(), found[at:end].hex()) for (piece, at), end in zip(begun.items(), ends)
            if expected[at:end] != found[at:end]}
