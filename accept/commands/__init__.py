"""The commands, in folders by subject."""
