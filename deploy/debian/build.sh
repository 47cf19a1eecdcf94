#!/bin/sh
# Builds the Debian package: deploy/debian/build.sh VERSION WHEELS OUT
#   WHEELS: folder with the wheel of Kata and those of all packages that it needs, for this computer's Python
#   OUT:    folder for the package
# Two builds of the same wheels with the same SOURCE_DATE_EPOCH are equal.
set -e
version=$1 wheels=$2 out=$3
here=$(dirname "$0")
made=$(mktemp --directory)
trap 'rm -rf "$made"' EXIT

put() { install -D --mode "$1" "$2" "$made/$3"; }
put 0644 "$here/../systemd/kata.service" usr/lib/systemd/system/kata.service
put 0644 "$here/60-kata.rules" usr/lib/udev/rules.d/60-kata.rules
put 0644 "$here/environment" etc/kata/environment
put 0644 "$here/limits.conf" etc/security/limits.d/kata.conf
install -d "$made/usr/bin"
ln -s /opt/kata/current/bin/kata "$made/usr/bin/kata"
for wheel in "$wheels"/*.whl; do
    put 0644 "$wheel" "usr/share/kata/wheels/$(basename "$wheel")"
done

filled() {
    python3 - "$1" "$version" "$(dpkg --print-architecture)" "$(du --summarize --block-size=1K "$made" | cut -f1)" <<'PYTHON'
import sys
from pathlib import Path

minor = sys.version_info.minor
values = dict(zip(("VERSION", "ARCHITECTURE", "INSTALLED_KB"), sys.argv[2:]), PYTHON=f"3.{minor}", NEXT_PYTHON=f"3.{minor + 1}")
text = Path(sys.argv[1]).read_text()
for name, value in values.items():
    text = text.replace(f"@{name}@", value)
sys.stdout.write(text)
PYTHON
}
mkdir "$made/DEBIAN"
for name in control postinst; do
    filled "$here/$name" >"$made/DEBIAN/$name"
done
cp "$here/conffiles" "$here/prerm" "$here/postrm" "$made/DEBIAN"
find "$made" -type d -exec chmod 0755 {} +
chmod 0644 "$made/DEBIAN/control" "$made/DEBIAN/conffiles"
chmod 0755 "$made/DEBIAN/postinst" "$made/DEBIAN/prerm" "$made/DEBIAN/postrm"
mkdir -p "$out"
# Wheels are compressed already.
dpkg-deb --root-owner-group -Znone --build "$made" "$out" >/dev/null
