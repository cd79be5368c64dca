"""Rolling bearings by themselves: rows of rolling elements, their contact, ratings and life, catalogue data."""
