"""Programs of animation."""
