"""Pictures: one style for all of them. Needs matplotlib, which is imported only when drawing."""
