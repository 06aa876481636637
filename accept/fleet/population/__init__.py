"""A batch of units: the model that is learned from them, and which of them belong to it."""
