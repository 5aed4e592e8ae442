"""Build the recipe from the sdist in dist/ and run its tests: ``python packaging/conda/check.py [CHANNEL]``.

Needs py-rattler-build from PyPI. The channel is conda-forge, or the address of another one that has what the recipe needs.
"""

from __future__ import annotations

import hashlib
import re
import sys
import tempfile
from pathlib import Path

from rattler_build import RenderConfig, Stage0Recipe, VariantConfig
from rattler_build.package import Package

ROOT = Path(__file__).parents[2]


def main(channel: str) -> None:
    """Stop with an error if the build or a test fails."""
    [sdist] = (ROOT / "dist").glob("*.tar.gz")
    text = (ROOT / "packaging" / "conda" / "recipe.yaml").read_text(encoding="utf-8")
    text = re.sub(r"(?m)^  url: .*$", f"  url: {sdist.as_uri()}", text)
    text = re.sub(r'(?m)^  sha256: "0+"', f'  sha256: "{hashlib.sha256(sdist.read_bytes()).hexdigest()}"', text)
    with tempfile.TemporaryDirectory() as folder:
        recipe = Path(folder, "recipe", "recipe.yaml")
        recipe.parent.mkdir()
        recipe.write_text(text, encoding="utf-8")
        [variant] = Stage0Recipe.from_file(str(recipe)).render(VariantConfig(), RenderConfig())
        built = variant.run_build(channels=[channel], output_dir=str(Path(folder, "out")))
        for path in built.packages:
            package = Package.from_file(str(path))
            results = package.run_tests(channel=[channel])
            print(f"{path.name}: {len(package.files)} files, {sum(one.success for one in results)} of {len(results)} tests")
            if not results or not all(one.success for one in results):
                raise SystemExit(1)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "conda-forge")
