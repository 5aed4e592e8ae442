"""Controllers, which compute the torque of an actuator from its signals."""
