"""Curated data for other trainers: a pool's episodes, with what selections keep of them, in formats that these read."""
