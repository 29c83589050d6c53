"""The boxes of the control loop: observer, controller, command generator."""
