"""What a command found, in plain words and people's units: the answer before all tables, one module a command."""
