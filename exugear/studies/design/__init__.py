"""What a study is asked for: the study file, parameters by their paths in the case, and the points they make."""
