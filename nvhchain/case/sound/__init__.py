"""Sound beside the prediction: background and targets of a case."""

from nvhchain.case.sound.background import BackgroundLevels, RecordedBackground
from nvhchain.case.sound.target import Target, check_targets

__all__ = ["BackgroundLevels", "RecordedBackground", "Target", "check_targets"]
