"""The widgets of the first screen: the units of the bench, what waits, the week, a choice of kinds."""
