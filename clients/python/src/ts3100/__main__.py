"""`python -m ts3100`: the program `ts3100`."""

from .binary import main

main()
