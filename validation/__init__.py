"""Units from a simulation that shares no code with the model, to test the program blind."""
