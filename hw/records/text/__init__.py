"""Tables in text files: numbers, units and times as other programs write them."""
