"""The paper: its examples, figures, tables and claims, as runs and numbers."""
