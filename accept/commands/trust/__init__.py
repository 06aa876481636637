"""Commands about keys, signatures, verification and the event store."""
