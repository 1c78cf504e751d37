"""Asks SU on the port of the README's run command until it is answered; exit code 0 when it is.

    python3 .ci/probe.py PID COMMAND
"""

import os
import re
import socket
import sys
import time

LIMIT = 120.0
SU = b"\x02SU\r\x03"


def port_of(command):
    """IP0's port: 1000 as in the factory's ETHERNET.PAR, and the offset the command asks for."""
    offset = re.search(r"--port-offset[ =](\d+)", command)
    return 1000 + (int(offset.group(1)) if offset else 0)


def answer(port):
    """What comes back for SU, None while nobody listens."""
    try:
        with socket.create_connection(("127.0.0.1", port), timeout=2) as line:
            line.sendall(SU)
            data = b""
            while not data.endswith(b"\x03"):
                more = line.recv(512)
                if not more:
                    break
                data += more
            return data
    except OSError:
        return None


def main():
    process, port = int(sys.argv[1]), port_of(sys.argv[2])
    limit = time.monotonic() + LIMIT
    while time.monotonic() < limit:
        data = answer(port)
        if data is not None:
            print("port %d answers SU: %r" % (port, data))
            return 0 if data.startswith(b"\x02FL,MODE:") and data.endswith(b"\x1a\x03") else 1
        try:
            os.kill(process, 0)
        except OSError:
            print("the command has ended before it answered", file=sys.stderr)
            return 1
        time.sleep(0.2)
    print("nobody answers on port %d within %d s" % (port, LIMIT), file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
