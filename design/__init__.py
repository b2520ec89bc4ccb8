"""The control: gains over the whole grid at once, and everything that judges them."""
