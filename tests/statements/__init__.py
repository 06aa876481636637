"""What a file says of itself is used, or the file is refused with the reason: a test for each statement of each format.

The files are made by other programs' libraries or by bytes from the public descriptions, and asked through the public
doors alone. `python -m tests.statements` prints the page docs/reference/statements.md.
"""
