"""Coefficients of compositions, Gauss-Legendre collocation and explicit methods, which check themselves."""
