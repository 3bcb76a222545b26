"""Devices behind one-method interfaces (`base`), and the virtual bench that stands in for all of them."""
