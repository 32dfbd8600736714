"""Views of creatures, and the drawing of them, for the pictures of README and docs."""
