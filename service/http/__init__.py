"""What HTTP asks of every answer and every connection, whatever the route."""
