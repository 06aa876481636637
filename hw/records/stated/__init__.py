"""What files state of their channels - structure, times, units - and the record that is made of it."""
