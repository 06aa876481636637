"""`python -m accept` is `accept`."""

from accept.cli.main import main

main()
