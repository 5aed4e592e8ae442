"""From a mechanism to tables: the room that knows both what a user describes and what the kernels read."""
