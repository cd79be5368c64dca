"""Parts of web pages that stand alone: HTML, arrays, scripts, vendored libraries, bodies in three dimensions."""
