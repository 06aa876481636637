"""Responses of one unit under other conditions: what each changes in a model, and how explanations are tested by it."""
