"""The base of all packages: files that are whole or absent, exit codes, the home folder, the console, other processes
and machines."""
