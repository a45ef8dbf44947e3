"""Learning: demonstrations of a selection, policies, their training, and rollouts on test targets."""
