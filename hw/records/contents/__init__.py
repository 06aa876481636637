"""Contents of files: variables before their data are read, and units in other programs' spelling."""
