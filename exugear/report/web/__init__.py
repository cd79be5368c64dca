"""Self-contained web pages: HTML, arrays, scripts, vendored libraries and 3-D views of bodies."""
