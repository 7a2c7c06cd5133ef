"""Packages of parts, by kind; they come in this order in lists."""

PACKAGE_OF = {
    "vehicles": "undertow.physics.vehicles",
    "thrusters": "undertow.physics.thrusters",
    "power": "undertow.physics.power",
    "plants": "undertow.physics.plants",
    "controllers": "undertow.control.controllers",
    "disturbances": "undertow.physics.disturbances",
    "references": "undertow.control.references",
    "sensors": "undertow.physics.sensors",
    "navigation": "undertow.control.navigation",
    "supervision": "undertow.control.supervision",
    "faults": "undertow.physics.faults",
}
