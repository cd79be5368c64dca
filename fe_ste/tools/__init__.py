"""General things: arrays, files, compilation, threads, workers, drawing, rendering."""
