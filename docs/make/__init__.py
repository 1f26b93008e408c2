"""Programs that measure, and write the pages and figures of measurements."""
