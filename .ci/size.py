"""Checks how the optimised program is linked, and the size of its page over the wire; docker_image.py has that of the program:

    python3 .ci/size.py target/dist/ts3100
"""

import gzip
import os
import pathlib
import sys

root = pathlib.Path(__file__).parent.parent
sys.path.insert(0, str(root / "packaging"))
from verify import mislinked  # noqa: E402

PAGE = 150_000

binary = pathlib.Path(sys.argv[1])
ui = root / "crates/control/assets/ui"
size = sum(len(gzip.compress(file.read_bytes())) for file in ui.iterdir())
print("%s has %d bytes; the page, compressed, %d, at most %d" % (binary, os.path.getsize(binary), size, PAGE))
problems = mislinked(binary.read_bytes())
for problem in problems:
    print("%s %s" % (binary, problem))
sys.exit(bool(problems) or size > PAGE)
