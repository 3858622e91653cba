"""A tree of files in memory for tests of MAVLink FTP."""

import random

from protocol.engines.file_transfer import BytesFile, Entry

BIG = random.Random(5).randbytes(40_000)


class Tree:
    """Two folders; counts how many of its files are open."""

    def __init__(self, **files):
        self.files = {"a.txt": b"hello", "big.bin": BIG, "empty": b"", **files}
        self.opened = 0

    def entries(self, path):
        if path.strip("/") == "many":
            return [Entry(f"log{n:04}.tlog", n) for n in range(100)]
        if path.strip("/"):
            raise FileNotFoundError(path)
        return [*(Entry(name, len(data)) for name, data in self.files.items()), Entry("many", None)]

    def open(self, path):
        name = path.strip("/")
        if name == "many":
            raise IsADirectoryError(path)
        if name == "broken":
            return Broken(self)
        if name not in self.files:
            raise FileNotFoundError(path)
        return Opened(self, self.files[name])


class Opened(BytesFile):
    def __init__(self, tree, data=b"x" * 500):
        super().__init__(data)
        self.tree = tree
        tree.opened += 1

    def close(self):
        self.tree.opened -= 1


class Broken(Opened):
    def read(self, *_):
        raise OSError(5, "disk")
