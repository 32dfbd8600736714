"""Surveys: random bodies walk by their demonstrators, and each walk is assessed."""
