"""Distribution of the tests over the processes that share the suite."""

from xdist.scheduler import LoadFileScheduling

# Folders whose files share what is dear: one process takes all of them.
TOGETHER = ("tests/sitl/simulation/", "tests/sitl/lab/identification/")
# What waits half of its time, for other processes or for a screen: the first process begins with the first of these,
# the second with the second, and any further one computes meanwhile.
WAITING = ("tests/e2e/", "tests/darko_gcs/tui/")


class FolderScheduling(LoadFileScheduling):
    """A file, or a whole folder of ``TOGETHER``, to each process in turn, so that few wait at a time."""

    def _split_scope(self, nodeid):
        return next((folder for folder in TOGETHER if nodeid.startswith(folder)), super()._split_scope(nodeid))

    def _assign_work_unit(self, node):
        place = self.nodes.index(node)
        own = [scope for scope in self.workqueue if scope.startswith(WAITING[place : place + 1])]
        others = [scope for scope in self.workqueue if not scope.startswith(WAITING)]
        for scope in (own or others)[:1]:
            self.workqueue.move_to_end(scope, last=False)
        super()._assign_work_unit(node)

    def mark_test_complete(self, node, item_index, duration=0):
        """Forget a file that is done: xdist counts the tests of all that it keeps, after each test anew."""
        super().mark_test_complete(node, item_index, duration)
        files = self.assigned_work[node]
        scope = self._split_scope(self.registered_collections[node][item_index])
        if all(files[scope].values()):
            del files[scope]
