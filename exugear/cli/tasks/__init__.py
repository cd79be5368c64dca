"""What the commands do: imported when a command starts, so that the help responds immediately."""
