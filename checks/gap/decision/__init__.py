"""The decision: gates, verdict, detection limits."""
