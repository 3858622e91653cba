"""One module per command of ``darko-gcs``; none imports the screens or the wire before it runs."""
