"""The motion room: verify motions whoever made them, and predict them with a trained policy."""
