"""The version, which every label of ours carries."""

VERSION = "0.2.0"
