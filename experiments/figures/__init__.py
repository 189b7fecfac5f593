"""The figures of a finished sweep, drawn again."""
