"""What may be said: gates, verdict, detection limits."""
