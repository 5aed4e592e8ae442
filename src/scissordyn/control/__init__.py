"""The catalogue of controllers: from what an actuator senses to the torque that it gives."""
