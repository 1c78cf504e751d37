"""IW, HO, HI and RS,SIG: our manual, 5.3.3 (IW, RS); `clauses.tsv` CMD-IW-01 to CMD-IW-05, CMD-RS-07, CMD-RS-08; the SCARA edition
S14, S79; `decisions.md` T12 (1 to 32 lines, the first is the lowest bit), T14 (no field bus: its outputs get NG)."""

# CMD-IW-04: the outputs that a host may force.
OUTPUTS = {*range(1, 65), *range(101, 165), *range(201, 209)}
# S14: the inputs that HI reads.
INPUT_BLOCKS = ((1, 64), (101, 164), (201, 264), (301, 364), (401, 464))
MOST = 32
USER_OUTPUTS = range(1, 25)
OK, NG = "OK", "NG"


def force(outputs, pairs):
    """IW: up to 32 lines, all or none; the answer and the outputs that are on afterwards."""
    if not 1 <= len(pairs) <= MOST or any(line not in OUTPUTS or on not in (0, 1) for line, on in pairs):
        return NG, outputs
    switched = {line: on for line, on in pairs}
    return OK, {line for line in outputs if switched.get(line, 1)} | {line for line, on in switched.items() if on}


def force_value(outputs, first, length, value):
    """HO: a number below 2 to the power of the length, over so many lines."""
    if not 1 <= length <= MOST or not 0 <= value < 2 ** length:
        return NG, outputs
    return force(outputs, [(first + bit, value >> bit & 1) for bit in range(length)])


def read(inputs, first, length):
    """HI: so many lines as one decimal number; NG for a length or a line that does not exist."""
    if not 1 <= length <= MOST or not any(begin <= first <= end for begin, end in INPUT_BLOCKS):
        return NG
    return str(sum(1 << bit for bit in range(length) if first + bit in inputs))


def reset(outputs):
    """RS,SIG turns DO1 to DO24 off, and no others."""
    return outputs - set(USER_OUTPUTS)
