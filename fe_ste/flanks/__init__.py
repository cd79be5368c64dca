"""What departs from the ideal flank: modifications, measured topography, errors of wheels."""
