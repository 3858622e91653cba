"""Logs in memory for tests of the log protocol."""

from protocol.dialect import mavlink
from protocol.engines.file_transfer import BytesFile, Log
from protocol.ranges import LOG_DATA_SIZE


class Store:
    """Logs in memory; counts how many are open."""

    def __init__(self, *data):
        self.data = list(data)
        self.opened = 0

    def logs(self):
        return [Log(str(n), 1_700_000_000 + n, len(data)) for n, data in enumerate(self.data)]

    def open(self, name):
        if int(name) >= len(self.data):
            raise FileNotFoundError(name)
        self.opened += 1
        return Opened(self, self.data[int(name)])


class Opened(BytesFile):
    def __init__(self, store, data):
        super().__init__(data)
        self.store = store

    def close(self):
        self.store.opened -= 1


def data(offset, content, number=0):
    return mavlink.MAVLink_log_data_message(number, offset, len(content), list(content.ljust(LOG_DATA_SIZE, b"\0")))
