"""Audible sound: signals in pascals from lines and records, WAV files of stated scale, orders, background."""

from nvhchain.sound.background import Background, background_beside, background_sound, recorded_background
from nvhchain.sound.hearing import Hearing, hearing, loudness_at, loudness_level, loudness_limits, loudness_ratios
from nvhchain.sound.orders import OrderTrack, filter_orders, order_track
from nvhchain.sound.signals import Loop, Sound, run_up_sound, steady_loop, steady_sound
from nvhchain.sound.tonality import tone_prominence
from nvhchain.sound.wav import read_wav, write_wav

__all__ = ["Sound", "steady_sound", "write_wav"]
