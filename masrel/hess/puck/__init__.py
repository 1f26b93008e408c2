"""The Barrett Puck, a motor amplifier on a CAN bus: codec, device, emulator."""
