"""Before any search: what the records are, and the faults in them that are found first."""
