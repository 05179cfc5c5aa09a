"""The version, part of the label of every method here."""

VERSION = "0.3.0"
