"""`python -m accept` is `accept`: nothing but the program itself is imported from the working folder."""

import os
import sys

if not sys.flags.safe_path and sys.path and sys.path[0] in ("", os.getcwd()):
    del sys.path[0]

from accept.cli.main import main

main()
