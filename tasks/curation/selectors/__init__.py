"""Selectors: one file each, found by name."""
