"""Parts that every PDF of this program is made of."""
