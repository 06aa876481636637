"""Execution of the effects of a dialogue, on the open unit and the bench."""
