"""Sources of the documentation site: the repository's pages, and pages made from the code's own tables."""
