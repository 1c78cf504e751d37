"""Which command is accepted in which mode and state, read from the manuals.

- Our manual (six axes), 5.3.2: Table 5.3 for HOST, Table 5.4 for IP0, with "Valid, Invalid, Valid when the robot is stopped".
- The SCARA edition (STE 80722), pages 46 to 49, as `ste80722.md` S86 and S87 have them.
- `decisions.md` T2 (which table counts for which arm), T5 (which commands a dialect serves), T4 and T27 (MP, EM).

Conditions that the tables leave to the page of a command (RS needs a stopped robot, DO needs servo power) are in `accepted`."""

O, X, S = "valid", "invalid", "valid when stopped"
MODES = ("TEACHING", "INTERNAL", "SIG", "RS-232C", "ETHER")
PORTS = ("HOST", "IP0")

# The port that has the control right, and no other: X X X O X on HOST, X X X X O on IP0.
RIGHT = {"HOST": (X, X, X, O, X), "IP0": (X, X, X, X, O)}
ALWAYS = {port: (O,) * 5 for port in PORTS}
STOPPED = {port: (S,) * 5 for port in PORTS}

# Tables 5.3 and 5.4, in their order. RN is printed with a circle under ETHER on HOST.
SIX_AXES = {
    "RN": {"HOST": (X, X, X, S, O), "IP0": (X, X, X, X, S)},
    "SP": ALWAYS, "BR": ALWAYS, "SO": RIGHT, "RS": RIGHT, "SL": RIGHT, "UL": STOPPED, "DL": STOPPED, "CA": ALWAYS, "SU": ALWAYS,
    "ER": STOPPED, "EU": ALWAYS, "EC": RIGHT, "MW": ALWAYS, "FD": ALWAYS, "SF": ALWAYS, "MR": ALWAYS, "IW": RIGHT, "VR": ALWAYS,
    "DO": RIGHT,
}

# S86, read as its last columns say. RN has X under ETHER on HOST here, SL is valid in every mode.
SCARA = {
    "RN": {"HOST": (X, X, X, S, X), "IP0": (X, X, X, X, S)},
    "SP": ALWAYS, "BR": ALWAYS, "SO": RIGHT, "RS": RIGHT, "SL": STOPPED, "UL": STOPPED, "DL": STOPPED, "ER": STOPPED,
    "CA": ALWAYS, "SU": ALWAYS, "EU": ALWAYS, "EC": RIGHT, "MW": ALWAYS, "FD": ALWAYS, "SF": ALWAYS, "MR": ALWAYS, "VR": ALWAYS,
    "IW": RIGHT, "DO": RIGHT, "AC": ALWAYS, "MD": RIGHT, "RT": RIGHT, "SC": RIGHT, "JG": RIGHT, "ZS": RIGHT, "MP": RIGHT,
    "PS": ALWAYS, "PR": ALWAYS, "MN": ALWAYS, "RM": ALWAYS, "IO": ALWAYS, "WD": ALWAYS, "AH": ALWAYS, "HO": RIGHT,
    "VL": ALWAYS, "SM": ALWAYS, "HI": RIGHT, "ZC": ALWAYS, "EM": RIGHT,
}


def table(arm, dialect):
    """The rows that count for an arm (`six-axis`, `scara`) in a dialect. T2.1: six axes take the other commands from S86."""
    if arm == "scara":
        return SCARA
    if dialect == "manual":
        return SIX_AXES
    extensions = {command: row for command, row in SCARA.items() if command != "ZC"}
    return {**extensions, **SIX_AXES, "RN": SCARA["RN"]}


def served(text, arm, dialect):
    """Whether a dialect knows a command with its operand at all (T5). The form of an operand is not looked at."""
    command = text[:2]
    if command not in table(arm, dialect):
        return False
    if text == "RS,ERR":
        return arm == "scara" or dialect == "field"
    if text == "MD,2":
        return dialect == "field"
    return True


# S87 and the pages of the commands: what they need besides the table. MP acts and is refused as DO (T4), JG is like DO (T2.2).
NEEDS_STOP = ("RS", "SL", "DO", "MP", "JG", "EM", "RN")
NEEDS_POWER = ("RN", "DO", "MP", "JG")
NOT_IN_FEED_HOLD = ("RN", "DO", "MP", "JG", "EM")


def accepted(text, port, mode, state, arm, dialect):
    """Whether a well-formed command is accepted: True, False, or None where no source decides.

    `state`: one of `stopped`, `running` (a program runs), `direct` (a DO is under way), `hold` (stopped, feed hold on),
    `unpowered` (stopped, servo power off), `emergency` (the emergency stop is pressed)."""
    command = text[:2]
    if not served(text, arm, dialect):
        return False
    cell = table(arm, dialect)[command][port][MODES.index(mode)]
    stopped = state not in ("running", "direct")
    if cell == X or cell == S and not stopped:
        return False
    if command == "RN" and not stopped:
        # The printed circle under ETHER: valid, though a program that runs cannot be started.
        return None
    if not stopped and (command in NEEDS_STOP or text.startswith("EC,MODE")):
        return False
    if state in ("unpowered", "emergency") and command in NEEDS_POWER or state == "emergency" and command == "SO":
        return False
    return not (state == "hold" and command in NOT_IN_FEED_HOLD)


def sentence(text, port, mode, state, arm, dialect):
    """What the expectation rests on."""
    command = text[:2]
    if not served(text, arm, dialect):
        return "T5: on six axes the manual dialect serves the 20 commands of our manual; an unknown command gets NG (CMD-LST-04)"
    cell = table(arm, dialect)[command][port][MODES.index(mode)]
    source = "S86" if arm == "scara" or command not in SIX_AXES else "Table 5.3" if port == "HOST" else "Table 5.4"
    more = {"running": "; RS, SL, DO, EC,MODE, EM need a stopped robot (CMD-RS-02, CMD-SL-02, CMD-DO-04, CMD-EC-03, T4)",
            "direct": "; SF shows RUN while a DO is under way (D7), and stopped is motion status 0, 2 or 3 (PRM-LEG-06)",
            "hold": "; DO is answered NG in the feed hold state (CMD-DO-03), RN and EM too (CMD-RN-05, T27.8)",
            "unpowered": "; DO is answered NG with servo power off (CMD-DO-03), RN too (CMD-RN-05)",
            "emergency": "; SO is refused while the emergency stop is on (CMD-SO-02), RN too (CMD-RN-05)"}.get(state, "")
    return "%s: %s on %s, %s: %s%s" % (source, command, port, mode, cell, more)
