"""What `import accept` and the commands share: responses of records, models fitted, misalignments estimated."""
