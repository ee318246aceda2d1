"""Free memory is that of the machine or of the container, whichever is less."""

from types import SimpleNamespace

import pytest

from nvhchain.runtime.memory import free_memory

GIB = 2**30


@pytest.fixture(autouse=True)
def machine(monkeypatch):
    monkeypatch.setattr("psutil.virtual_memory", lambda: SimpleNamespace(available=64 * GIB))


def group(root, folder, files, stat, membership):
    place = root / "sys/fs/cgroup" / folder
    place.mkdir(parents=True, exist_ok=True)
    for name, value in files.items():
        (place / name).write_text(f"{value}\n")
    (place / "memory.stat").write_text(stat)
    (root / "proc/self").mkdir(parents=True, exist_ok=True)
    (root / "proc/self/cgroup").write_text(membership)


def test_without_control_groups_it_is_that_of_the_machine(tmp_path):
    assert free_memory(tmp_path) == 64 * GIB


@pytest.mark.parametrize(
    ("folder", "limit", "use", "stat", "membership"),
    [
        ("job/task", "memory.max", "memory.current", "anon 1\ninactive_file {}\n", "0::/job/task\n"),
        ("job", "memory.max", "memory.current", "inactive_file {}\n", "0::/job/task\n"),
        ("", "memory.max", "memory.current", "inactive_file {}\n", "0::/of/the/host\n"),
        ("memory/job", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file {}\n",
         "9:cpu:/x\n4:memory:/job\n0::/\n"),
    ],
    ids=["version 2", "parent", "container", "version 1"],
)  # fmt: skip
def test_a_limit_counts_with_what_is_used_of_it_less_what_is_given_back(tmp_path, folder, limit, use, stat, membership):
    group(tmp_path, folder, {limit: 8 * GIB, use: 6 * GIB}, stat.format(GIB), membership)
    assert free_memory(tmp_path) == 3 * GIB
    group(tmp_path, folder, {limit: 8 * GIB, use: 10 * GIB}, stat.format(GIB), membership)
    assert free_memory(tmp_path) == 0
    group(tmp_path, folder, {limit: 800 * GIB, use: 6 * GIB}, stat.format(0), membership)
    assert free_memory(tmp_path) == 64 * GIB


def test_a_group_without_a_limit_leaves_the_machine_s(tmp_path):
    group(tmp_path, "", {"memory.max": "max", "memory.current": GIB}, "inactive_file 0\n", "0::/\n")
    assert free_memory(tmp_path) == 64 * GIB
