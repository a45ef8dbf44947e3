"""Pictures: robots, scenes and motions drawn without a screen, as images, films and recordings."""
