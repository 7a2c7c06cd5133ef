"""Self-contained HTML pages, tables, figures and the replay."""
