"""The version, part of the label of every method here."""

VERSION = "0.2.0"
