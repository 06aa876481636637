"""The guided workflow without its screens: steps from a spec, state as a fold over stored events, and the session."""
