"""Model against data: where they disagree, what is missing, and how sure that is."""
