"""Functions behind `import accept` and the commands: responses of records, fitted models, misalignments."""
