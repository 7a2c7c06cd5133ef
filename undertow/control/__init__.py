"""What the computer on board does: references, control laws, navigation, supervision."""
