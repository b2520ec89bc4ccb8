"""The smallest table: lines added where a schedule needs them, and taken away where it does not."""
