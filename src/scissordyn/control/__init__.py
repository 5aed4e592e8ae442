"""The catalogue of controllers: from the signals of an actuator to its torque."""
