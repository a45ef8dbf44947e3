"""Curation: the pool of verified candidates and the selectors that keep part of it."""
