"""Sample arrays as earlier versions encoded them."""

FIRST_FORMAT = (
    b'{"format": "kata-samples/1", "crc32": 3637212752, "columns": [{"name": "time_s", "unit": "s", "resol'
    b'ution": 1e-06, "shape": [5], "bytes": 17}, {"name": "path_s", "unit": "s", "resolution": 1e-06, "sha'
    b'pe": [5], "bytes": 32}, {"name": "angle_deg", "unit": "deg", "resolution": 0.0001, "shape": [5, 2], '
    b'"bytes": 24}]}\n'
    b"x\x9cc\x10\x00\x02\x06u `\xc0\x0b\x00\x1dV\x00\xddx\x9cc`\x10\xf8\xe0\xc0\xc0\xa0~"
    b"\xc3\x9b\x81\x81\xe1\xbf\x0f\x88`@#\x1a\x1a\x18\xea\x1b\x00\xb9\xb5\t\xd1x\x9c\xbb\xf0P\t\n"
    b"\xba6\xfaA\xc1\xff\xff\x0cP@:\x0b\x00e\x1f\x12a"
)
"""Return three columns of five samples as the first version encoded them."""
