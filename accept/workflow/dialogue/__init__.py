"""Dialogues with the technician as functions, without a screen, a file or a clock: an event and a state give the state
that follows, effects to execute and words to show. A screen renders the state and executes the effects."""
