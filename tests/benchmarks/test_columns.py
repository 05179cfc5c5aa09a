from conservative.benchmarks.gate.accuracy_columns import lines


def flat(name, fastest, **extra):
    return {"name": name, "param": None, "group": None, "min": fastest, "median": 2 * fastest, "extra_info": extra}


def test_numbers_become_columns_and_texts_do_not():
    header, first, second = lines([flat("slow", 1e-3, label="x", drift=2e-16), flat("fast", 1e-6, order=2)])
    assert header.split("  ")[-1].strip() == "order"
    assert "label" not in header
    assert first.split() == ["fast", "1e-06", "2e-06", "2"]
    assert second.split() == ["slow", "0.001", "0.002", "2e-16"]


def test_columns_are_aligned():
    found = lines([flat("a", 1e-3, drift=1.0), flat("a long name", 1e-3, drift=1.23e-10)])
    assert len({len(line) for line in found}) == 1
