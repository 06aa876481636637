"""What everything above stands on: files that are whole or absent, exit codes, the home folder, the console,
other processes and machines."""
