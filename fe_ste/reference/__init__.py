"""The reference analysis: full non-linear contact of finite-element models."""
