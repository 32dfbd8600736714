"""Worlds on a GPU: tasks as functions of JAX, and what they need."""
