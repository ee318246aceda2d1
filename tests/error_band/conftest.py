import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # ball_with_modes.py, made_laws.py
