"""What files hold: variables before their data are read, and units as other programs write them."""
