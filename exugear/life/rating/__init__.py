"""Rating of gears to ISO 6336 with all factors by name, together with finite element results."""
