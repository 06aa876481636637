"""The page of a certificate: its fixed parts, its body, and the whole document."""
