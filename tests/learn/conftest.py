"""Scripts under tools/ are tested here too."""

import sys
from pathlib import Path

TOOLS = Path(__file__).parents[2] / "tools"
for folder in (TOOLS, Path(__file__).parent):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
