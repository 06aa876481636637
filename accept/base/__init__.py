"""The base of all packages: whole files, exit codes, the home folder, the console, other processes and machines."""
