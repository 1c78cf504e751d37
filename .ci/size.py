"""Checks the binary that people install, how it is linked and its size, and the size of its page over the wire:

    python3 .ci/size.py target/dist/ts3100
"""

import gzip
import os
import pathlib
import sys

root = pathlib.Path(__file__).parent.parent
sys.path.insert(0, str(root / "packaging"))
from verify import mislinked  # noqa: E402

BINARY = 9_000_000
PAGE = 150_000

binary = pathlib.Path(sys.argv[1])
ui = root / "crates/control/assets/ui"
sizes = {
    binary: (os.path.getsize(binary), BINARY),
    "the page, compressed,": (sum(len(gzip.compress(file.read_bytes())) for file in ui.iterdir()), PAGE),
}
for name, (size, limit) in sizes.items():
    print("%s has %d bytes, at most %d" % (name, size, limit))
problems = mislinked(binary.read_bytes())
for problem in problems:
    print("%s %s" % (binary, problem))
sys.exit(bool(problems) or any(size > limit for size, limit in sizes.values()))
