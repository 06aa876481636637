"""Responses of one unit under other conditions: what each changes in a model, and what it says about explanations."""
