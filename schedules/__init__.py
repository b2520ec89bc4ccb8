"""The envelope: from a study to designed controllers, gain schedules and their files."""
