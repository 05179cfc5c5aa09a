"""Tables of the report, made from measurements."""
