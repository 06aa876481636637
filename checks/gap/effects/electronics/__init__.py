"""Effects of converters, amplifiers, wires and scales."""
