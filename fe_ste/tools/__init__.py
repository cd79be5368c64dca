"""General things: arrays, files, compilation, sparse factors, threads, workers, drawing, rendering."""
