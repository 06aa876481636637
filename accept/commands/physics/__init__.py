"""Commands about signals, responses and the model."""
