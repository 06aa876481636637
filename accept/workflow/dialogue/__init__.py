"""Dialogues with the technician as functions, without a screen, a file or a clock:
`handle(state, event)` returns the state that follows, the effects to execute and the words to show.

A screen renders the state, passes on keys and executes effects; it decides nothing.
"""
