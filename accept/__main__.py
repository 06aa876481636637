"""`python -m accept` is `accept`: nothing but the program itself is imported from the working folder."""

import os
import sys

if not sys.flags.safe_path and sys.path and sys.path[0] in ("", os.getcwd()):
    del sys.path[0]

from accept import _strangers

if problem := _strangers():  # of another package in the same environment: the working folder is left out above
    sys.stderr.write(f"accept: {problem}\n")
    sys.exit(6)  # bad input: `Exit.BAD_INPUT` cannot be imported yet

from accept.cli.main import main

main()
