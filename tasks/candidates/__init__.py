"""Candidates: targets, paths to them, and what becomes of each: timed, measured, played back, a row of the lake."""
