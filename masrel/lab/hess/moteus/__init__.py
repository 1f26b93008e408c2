"""The mjbots moteus, a motor controller on a CAN-FD bus: drive it, or emulate it."""
