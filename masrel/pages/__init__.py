"""Pages that need nothing beside themselves: of a document, and of answers."""
