"""`python -m conservative`: the command line."""

from conservative.reports.cli.launch import launch

if __name__ == "__main__":
    launch()
