"""Programs of learning."""
