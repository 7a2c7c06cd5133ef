"""A page in which a visitor drives the vehicle of a scenario: its closed loop as C, compiled to WebAssembly."""
