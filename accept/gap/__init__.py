"""The gap analysis of a unit folder: records in; gap.json, gap.pdf and the improved model out."""
