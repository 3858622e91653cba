"""One module per command of ``darko-sitl``; none imports the simulation before it runs."""
