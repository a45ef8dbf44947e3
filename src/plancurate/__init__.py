"""plancurate turns motion planners into imitation-learning data and shows which of it is worth training on."""

__version__ = "0.1.0"
