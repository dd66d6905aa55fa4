"""Data sheets of gearboxes and motors, the catalogue of them, and the parts made of them."""
