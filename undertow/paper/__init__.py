"""Reproduction of the paper: its examples, figures, tables and claims."""
