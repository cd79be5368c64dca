"""Sections of the report page: each makes its HTML, and the data that its figures are drawn from."""
