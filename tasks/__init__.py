"""The steps: ordinary typed functions that a test or a notebook can call."""
