"""Checks the size of the binary that people install, and of its page over the wire: python3 .ci/size.py target/release/ts3100"""

import gzip
import os
import pathlib
import sys

BINARY = 7_000_000
PAGE = 150_000

ui = pathlib.Path(__file__).parent.parent / "crates/control/assets/ui"
sizes = {
    sys.argv[1]: (os.path.getsize(sys.argv[1]), BINARY),
    "the page, compressed,": (sum(len(gzip.compress(file.read_bytes())) for file in ui.iterdir()), PAGE),
}
for name, (size, limit) in sizes.items():
    print("%s has %d bytes, at most %d" % (name, size, limit))
sys.exit(any(size > limit for size, limit in sizes.values()))
