"""Self-contained HTML pages of documents and of answers."""
