"""Sizes and rates of the long transfers: files, logs and lists of parameters."""

__all__ = ["LOG_DATA_SIZE", "MESSAGES_PER_INTERVAL", "PARAMETERS_PER_INTERVAL", "SEND_INTERVAL"]

LOG_DATA_SIZE = 90  # bytes of a log in one LOG_DATA

# A server sends so many messages in every interval: slow enough for the receive buffers of its peers.
SEND_INTERVAL = 0.01  # [s]
MESSAGES_PER_INTERVAL = 10  # files and logs
PARAMETERS_PER_INTERVAL = 5  # of each parameter list
