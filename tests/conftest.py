"""On several processes the tests of one folder, which share what their conftest makes, run on the same one."""

from xdist.scheduler import LoadScopeScheduling


class ByFolder(LoadScopeScheduling):
    """Work is handed out in folders, those with most tests first."""

    def _split_scope(self, nodeid: str) -> str:
        return nodeid.split("/")[1]


def pytest_xdist_make_scheduler(config, log):
    return ByFolder(config, log)
