"""Effects of the piezo stacks themselves."""
