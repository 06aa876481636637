"""The screens of the guided workflow: they show and ask, `accept.workflow` and `accept.judging` decide."""
