"""The command ``gainfield``; what is heavy is imported where a command needs it."""
