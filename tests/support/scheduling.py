"""Which process takes which tests, where several share the suite."""

from xdist.scheduler import LoadFileScheduling

# Folders whose files share what is dear: one process takes all of them.
TOGETHER = ("tests/sitl/system_identification/",)
# What waits for other processes half of its time: while one process waits, the others compute.
WAITING = ("tests/e2e/",)


class FolderScheduling(LoadFileScheduling):
    """A file, or a whole folder of ``TOGETHER``, to each process in turn; the first begins with what is ``WAITING``."""

    def _split_scope(self, nodeid):
        return next((folder for folder in TOGETHER if nodeid.startswith(folder)), super()._split_scope(nodeid))

    def _assign_work_unit(self, node):
        waits = node is self.nodes[0]
        wanted = next((scope for scope in self.workqueue if scope.startswith(WAITING) == waits), None)
        if wanted is not None:
            self.workqueue.move_to_end(wanted, last=False)
        super()._assign_work_unit(node)

    def mark_test_complete(self, node, item_index, duration=0):
        """Forget a file that is done: xdist counts the tests of all that it keeps, after each test anew."""
        super().mark_test_complete(node, item_index, duration)
        files = self.assigned_work[node]
        scope = self._split_scope(self.registered_collections[node][item_index])
        if all(files[scope].values()):
            del files[scope]
