"""The assembly as an Exudyn system; only here is Exudyn imported."""
