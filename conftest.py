"""What all tests share, those of docstrings too: they read and write no flanks in the user's cache folder."""

import os

os.environ["EXUGEAR_FLANKS"] = "off"
