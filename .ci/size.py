"""Checks the size of the binary that people install: python3 .ci/size.py target/release/ts3100"""

import os
import sys

LIMIT = 7_000_000

size = os.path.getsize(sys.argv[1])
print("%s has %d bytes, at most %d" % (sys.argv[1], size, LIMIT))
sys.exit(size > LIMIT)
