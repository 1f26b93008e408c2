"""Printed agreement, held against every table."""
