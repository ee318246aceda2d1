"""Moving surfaces as binary glTF 2.0 (.glb), for slides, browsers and 3D programs.

The motion is two morph targets, whose weights follow the cosine and the sine of the phase (glTF 2.0, section 3.7.2.2).
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain.files.atomic_write import write_output
from nvhchain.handoff import ComplexArray, FloatArray, Surface

_STEPS, _SECONDS = 24, 2.0
_FLOAT, _UINT, _BYTE = 5126, 5125, 5121


def write_glb(surface: Surface, motion: ComplexArray, colours: FloatArray, path: str | Path) -> Path:
    """Write a surface that moves in a loop of one period.

    motion (n_vertex, 3) complex array: motion of the vertices as it is drawn (m); the shown position is vertices +
    Re(motion e^{jφ}).
    colours (n_vertex, 3): red, green and blue, 0 to 1.
    """
    phase = 2.0 * np.pi * np.arange(_STEPS + 1) / _STEPS
    weights = np.column_stack([np.cos(phase), np.sin(phase)])
    tint = np.column_stack([np.rint(255.0 * np.clip(colours, 0.0, 1.0)), np.full(len(colours), 255)])
    data: list[tuple[np.ndarray, int, str]] = [
        (np.asarray(surface.vertices, "<f4"), _FLOAT, "VEC3"),
        (np.asarray(motion.real, "<f4"), _FLOAT, "VEC3"),
        (np.asarray(-motion.imag, "<f4"), _FLOAT, "VEC3"),
        (np.asarray(tint, "u1"), _BYTE, "VEC4"),
        (np.asarray(surface.triangles, "<u4").ravel(), _UINT, "SCALAR"),
        (np.asarray(_SECONDS * phase / phase[-1], "<f4"), _FLOAT, "SCALAR"),
        (np.asarray(weights, "<f4").ravel(), _FLOAT, "SCALAR"),
    ]
    binary, views, accessors = b"", [], []
    for number, (values, kind, shape) in enumerate(data):
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": values.nbytes})
        accessor: dict[str, Any] = {
            "bufferView": number, "componentType": kind, "type": shape, "count": len(values),
            **({"normalized": True} if kind == _BYTE else {}),
        }  # fmt: skip
        if kind == _FLOAT and number != 6:
            rows = values.reshape(len(values), -1)
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        accessors.append(accessor)
        binary += values.tobytes() + b"\0" * (-values.nbytes % 4)
    mesh = {
        "primitives": [
            {
                "attributes": {"POSITION": 0, "COLOR_0": 3}, "indices": 4, "material": 0,
                "targets": [{"POSITION": 1}, {"POSITION": 2}],
            }
        ],
        "weights": [0.0, 0.0],
    }  # fmt: skip
    content = {
        "asset": {"version": "2.0", "generator": "nvhchain"},
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [mesh],
        "materials": [{"doubleSided": True, "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.8}}],
        "animations": [
            {
                "samplers": [{"input": 5, "output": 6, "interpolation": "LINEAR"}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
            }
        ],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(binary)}],
    }  # fmt: skip
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    head = np.array([0x46546C67, 2, 28 + len(text) + len(binary)], "<u4").tobytes()
    chunks = np.array([len(text), 0x4E4F534A], "<u4").tobytes() + text
    chunks += np.array([len(binary), 0x004E4942], "<u4").tobytes() + binary
    return write_output(Path(path), head + chunks)
